"""The shift between two logs of one flight is found; two flights of one plan do not agree."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from flights import SHARED
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.telemetry import Clock, Log, read
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.together.agreement import ALIKE, agreement, best_agreement, shared
from fdi.telemetry.together.placing import place
from fdi.units import Conversion

from ..build import Flight

PAIRS = (
    "copter/c01_ref_slow_line",
    "copter/c03_ref_square_wind",
    "copter/c07_ref_aggressive",
    "copter/c10_motor1_x0.7_20s",
    "copter/c20_gps_glitch_11m",
    "copter/c30_accel_bias_y_both",
    "copter/c62_gps_loss_30s_wind",
    "copter/c90_crash_motor1_x0.2",
    "plane/p01_rect_calm",
    "plane/p20_engine_stop",
    "plane/p34_elevator_stuck",
    "plane/p78_no_airspeed_stall_5kg",
)
WITHIN_S = 0.05
AXES = ("roll", "pitch", "yaw", "rollspeed")

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")


def pair(name: str) -> tuple[Log, Log]:
    return read(SHARED / "sitl" / f"{name}.tlog"), read(SHARED / "sitl" / f"{name}.BIN")


def without_clocks(log: Log) -> Log:
    """Return the log as one that knows neither boot time nor UTC."""
    unknown = np.array([np.nan])
    return replace(
        log, clock=Clock(np.array([-np.inf]), unknown, unknown, np.nan, np.nan, "none"), _cache={}
    )


@needs_shared
@pytest.mark.parametrize("name", PAIRS)
def test_signals_alone_find_the_shift_that_boot_time_tells(name: str) -> None:
    first, second = pair(name)
    expected = float(second.clock.boot_offset[0] - first.clock.boot_offset[0])
    by_boot = place(first, second)
    assert (by_boot.clue, by_boot.offset) == ("boot", expected)
    assert by_boot.agreement is not None
    assert by_boot.agreement.r > 0.95
    found = place(without_clocks(first), without_clocks(second))
    assert found.clue == "signals"
    assert found.offset == pytest.approx(expected, abs=WITHIN_S)
    assert found.uncertainty <= WITHIN_S


@needs_shared
@pytest.mark.parametrize(("one", "other"), [(0, 3), (4, 5), (6, 7), (9, 8)])
def test_two_flights_of_one_plan_are_refused(one: int, other: int) -> None:
    """Also at the shift at which both were booted at one simulated moment."""
    first, second = pair(PAIRS[one])[0], pair(PAIRS[other])[1]
    with pytest.raises(UsageError, match="another flight than"):
        place(first, second)


def attitude(t: Floats, signals: tuple[Floats, ...], at: Floats) -> Log:
    """Return a log whose attitude is given by signals on a fine grid ``at``."""
    columns = {
        axis: Column(partial(np.interp, t, at, signal), Conversion("rad/s"))
        for axis, signal in zip(AXES, signals, strict=True)
    }
    message = Message("ATTITUDE", None, t, t, np.arange(t.size), columns)
    return replace(EMPTY, messages={"ATTITUDE": message}, span=(float(t[0]), float(t[-1])))


def moves(seed: int, at: Floats) -> tuple[Floats, ...]:
    """Return four signals with parts up to 1 Hz, as attitude has in flight."""
    noise = np.random.default_rng(seed).normal(size=(4, at.size))
    kernel = np.ones(50) / 50
    return tuple(np.convolve(row, kernel, "same") for row in noise)


AT = np.arange(-10.0, 200.0, 0.01)
EMPTY: Log


@pytest.fixture(autouse=True, scope="module")
def _empty(tmp_path_factory: pytest.TempPathFactory) -> None:
    global EMPTY
    path: Path = tmp_path_factory.mktemp("log") / "x.tlog"
    path.write_bytes(Flight().bytes())
    EMPTY = without_clocks(read(path))


@given(
    seed=st.integers(0, 1000),
    shift=st.floats(-120, 120),
    rates=st.sampled_from([(4.0, 10.0), (10.0, 4.0), (2.0, 50.0), (5.0, 5.0)]),
)
@settings(max_examples=25, deadline=None)
def test_a_known_shift_is_found(seed: int, shift: float, rates: tuple[float, float]) -> None:
    signals = moves(seed, AT)
    t = np.arange(20.0, 180.0, 1 / rates[0])
    first = attitude(t, signals, AT)
    other = np.arange(25.03, 170.0, 1 / rates[1])
    second = attitude(other, signals, AT)
    moved = replace(
        second,
        messages={"ATTITUDE": replace(second["ATTITUDE"], t=other - shift, _cache={})},
    )
    found = best_agreement(shared(first, moved))
    assert found is not None
    assert found.r > ALIKE
    assert found.offset == pytest.approx(shift, abs=WITHIN_S)


@given(seed=st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_signals_of_two_flights_agree_nowhere(seed: int) -> None:
    t = np.arange(20.0, 180.0, 0.2)
    pairs = shared(attitude(t, moves(seed, AT), AT), attitude(t, moves(seed + 5000, AT), AT))
    found = best_agreement(pairs)
    assert found is None or found.r < ALIKE
    near = agreement(pairs, 0.0)
    assert near is not None
    assert near.r < ALIKE


def test_what_nothing_moves_in_says_nothing() -> None:
    t = np.arange(0.0, 100.0, 0.2)
    still = tuple(np.zeros(AT.size) for _ in AXES)
    assert best_agreement(shared(attitude(t, still, AT), attitude(t, still, AT))) is None


def test_logs_without_a_shared_signal_are_refused() -> None:
    t = np.arange(0.0, 100.0, 0.2)
    log = attitude(t, moves(1, AT), AT)
    with pytest.raises(UsageError, match="share no signals"):
        place(log, replace(log, messages={}, _cache={}))
