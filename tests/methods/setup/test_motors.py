"""Motors that are arranged otherwise: a rigid body that flies or flips, and what is said of it."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav
from scipy.optimize import nnls

from fdi.methods.setup import Check
from fdi.methods.setup.arrangements import ALIKE, arrangements, cosines, directions_of
from fdi.methods.setup.moments import Intervals, explain
from fdi.methods.setup.motors import check_motors
from fdi.telemetry import read
from fdi.telemetry.motors import motors_of

from .build import Quad, write

QUARTER = ((0, -1, 0), (1, 0, 0), (0, 0, 1))


def told(tmp_path: Path, **how: object) -> Check:
    (check,) = check_motors(read(write(tmp_path / "flight.tlog", Quad(**how))))
    return check


@pytest.mark.parametrize("seed", range(3))
def test_a_healthy_flight_is_in_order(tmp_path: Path, seed: int) -> None:
    assert told(tmp_path, seed=seed).verdict == "in order"


def test_a_calm_hover_decides_nothing(tmp_path: Path) -> None:
    assert told(tmp_path, calm=True, hover=15.0).verdict == "not known"


@pytest.mark.parametrize("rate", [10, 25, 50])
@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"places": (1, 0, 2, 3)}, "motors 1 and 2 are swapped"),
        ({"places": (0, 1, 3, 2)}, "motors 3 and 4 are swapped"),
        ({"board": QUARTER}, "the autopilot's board is turned by 270 degrees to the right"),
        ({"turns": -1.0}, "all propellers turn the other way"),
        ({"places": (3, 0, 1, 2)}, "FRAME_TYPE fits 12 (Betaflight X), not 1"),
    ],
)
def test_a_failed_take_off_names_what_fits(
    tmp_path: Path, rate: float, how: dict[str, object], words: str
) -> None:
    """The truth is among what is named, as far as one way to fall can tell."""
    check = told(tmp_path, rate=rate, **how)
    assert check.verdict == "wrong"
    assert words in check.text
    assert check.numbers["misfit_best"] < check.numbers["misfit_as_set"]


def test_a_dead_motor_is_no_swap(tmp_path: Path) -> None:
    check = told(tmp_path, rate=25, effect=(1, 0, 1, 1))
    assert check.verdict == "wrong"
    assert "motor 2 has no effect" in check.text
    assert "swapped" not in check.text


def test_two_ways_that_move_alike_are_both_told(tmp_path: Path) -> None:
    """Reversed propellers on an X turn it as an H would."""
    check = told(tmp_path, turns=-1.0, rate=25)
    assert "all propellers turn the other way" in check.text
    assert "FRAME_TYPE fits 3 (H), not 1" in check.text
    assert check.settings == ()  # the propellers may be what is wrong


def test_a_frame_that_alone_fits_is_suggested(tmp_path: Path) -> None:
    (setting,) = told(tmp_path, places=(3, 0, 1, 2), rate=25).settings
    assert (setting.name, setting.now, setting.suggested) == ("FRAME_TYPE", 1.0, 12.0)


def test_a_frame_that_is_not_told_is_not_guessed(tmp_path: Path) -> None:
    check = told(tmp_path, tells_frame=False, hover=10.0)
    assert check.verdict == "not known"
    assert "frame" in check.text


def test_records_a_second_apart_say_nothing_of_moments(tmp_path: Path) -> None:
    check = told(tmp_path, rate=1.0)
    assert check.verdict == "not known"
    assert "1.0 s apart" in check.text


def test_a_flip_at_four_hertz_tells_that_and_not_which_motors_are_swapped(tmp_path: Path) -> None:
    check = told(tmp_path, rate=4, places=(0, 1, 3, 2))
    assert check.verdict == "wrong"
    assert "turns against them" in check.text
    assert "swapped" not in check.text


def test_a_flip_at_two_hertz_tells_nothing(tmp_path: Path) -> None:
    assert told(tmp_path, rate=2, places=(0, 1, 3, 2)).verdict == "not known"


def test_a_hexacopter_s_log_has_no_motors_of_a_quad(tmp_path: Path) -> None:
    """FRAME_CLASS 1 in the log of a hexacopter is none of its frames; nothing is assumed."""
    assert told(tmp_path, kind=mav.MAV_TYPE_HEXAROTOR, hover=10.0).verdict != "wrong"


def test_arrangements_are_told_apart_and_each_is_there_once(tmp_path: Path) -> None:
    log = read(write(tmp_path / "flight.tlog", Quad(hover=2.0)))
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    ways = arrangements(log, motors)
    own = directions_of(motors)
    assert ways[0].words == ()
    assert np.array_equal(ways[0].directions, own)
    for i, way in enumerate(ways[1:], 1):
        assert way.words
        assert way.prior < 0
        assert np.any(cosines(way.directions, own) < ALIKE)
        assert not any(np.allclose(way.directions, other.directions) for other in ways[:i])


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), trim=st.booleans())
def test_explained_is_what_least_squares_without_negative_coefficients_leave(
    seed: int, trim: bool
) -> None:
    """scipy's nnls is the oracle; a free trim is two columns of opposite sign."""
    rng = np.random.default_rng(seed)
    change, rate = rng.normal(0, 1, (3, 30)) + 0.5, rng.normal(0, 1, (3, 30))
    inputs, ways = rng.normal(0, 1, (4, 30)), rng.normal(0, 1, (5, 3, 4))
    left, _ = explain(Intervals(np.arange(30.0), change, inputs, rate, trim), ways)
    for way, axis in np.ndindex(5, 3):
        columns = [ways[way, axis] @ inputs, -rate[axis]]
        y = change[axis]
        spread = y @ y
        if trim:
            columns += [np.ones(30), -np.ones(30)]
            spread = ((y - y.mean()) ** 2).sum()
        _, rest = nnls(np.array(columns).T, y)
        assert left[way, axis] == pytest.approx(rest**2 / spread, rel=1e-6)
