"""A slope that jumps, between vectors that turn: by its known size, at its known moment."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi import analyze
from fdi.residuals.jump import Jump, jump

FLIGHT = (
    Path(__file__).resolve().parents[2].parent
    / "shared/flights/sitl/plane/p12_airspeed_ratio_low.tlog"
)
STEP = 0.25
T = np.arange(0.0, 240.0, STEP)
AT = 120.0
TURNS = 2 * np.pi * T / 60.0
"""A circle a minute."""


def flown(
    factor: float,
    *,
    heading: np.ndarray = TURNS,
    speed: np.ndarray | float = 20.0,
    wind: tuple[np.ndarray | float, np.ndarray | float] = (5.0, -3.0),
    noise: float = 0.3,
    gust: float = 0.2,
    seed: int = 0,
) -> Jump:
    """What is found where a speed is shown too large by a factor from `AT` on."""
    rng = np.random.default_rng(seed)
    air = speed * np.array([np.cos(heading), np.sin(heading)])
    wanders = np.cumsum(rng.normal(0.0, gust * np.sqrt(STEP), (2, T.size)), axis=1) * 0.2
    ground = air + np.array([wind[0] + 0 * T, wind[1] + 0 * T]) + wanders
    ground += rng.normal(0.0, noise, ground.shape)
    shown = air * np.where(T < AT, 1.0, factor)
    return jump([*ground], [*shown], STEP, 120.0, 0.03)


@pytest.mark.parametrize("factor", [0.8, 1.1, 1.3])
def test_the_change_is_told_by_its_size_and_its_moment(factor: float) -> None:
    found = flown(factor)
    sample = int(np.searchsorted(T, AT + 50.0))
    # the ground passes by 1 / factor for each metre shown
    off = found.size[sample] - (1 / factor - 1)
    assert abs(off) < 5 * found.error[sample] + 0.02
    assert abs(found.size[sample]) > 5 * found.error[sample] + 0.03
    assert T[sample] - found.ago[sample] == pytest.approx(AT, abs=6.0)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), wind=st.floats(-10, 10), noise=st.floats(0.05, 1.0))
def test_a_factor_that_stays_does_not_jump(seed: int, wind: float, noise: float) -> None:
    found = flown(1.0, seed=seed, wind=(wind, 3.0), noise=noise)
    beyond = np.abs(found.size) - 5 * found.error
    assert not (np.nan_to_num(beyond, nan=-1.0) > 0.03).any()


def test_a_straight_flight_tells_nothing() -> None:
    """There an airspeed that reads too much is a wind ahead."""
    assert np.isnan(flown(1.3, heading=0 * T + 0.4).size).all()


def test_a_gust_that_stays_is_a_wind_and_no_factor() -> None:
    for ahead in (4.0, -6.0):
        found = flown(1.0, wind=(np.where(T < AT, 5.0, 5.0 + ahead), 0.0))
        assert not (np.nan_to_num(np.abs(found.size) - 5 * found.error) > 0.03).any()


@pytest.mark.parametrize("per_second", [0.05, -0.02, 0.01])
def test_a_heading_that_drifts_off_is_no_factor(per_second: float) -> None:
    """A gyroscope's drift turns what is shown, and makes it follow less: cos of the angle."""
    heading, drift = TURNS, np.maximum(T - AT, 0.0) * per_second
    air = 20.0 * np.array([np.cos(heading), np.sin(heading)])
    shown = 20.0 * np.array([np.cos(heading + drift), np.sin(heading + drift)])
    ground = air + np.array([[5.0], [-3.0]]) + np.random.default_rng(5).normal(0.0, 0.3, air.shape)
    found = jump([*ground], [*shown], STEP, 120.0, 0.03)
    assert (np.abs(drift) > 0.5).any()
    assert not (np.nan_to_num(np.abs(found.size) - 5 * found.error) > 0.03).any()


@pytest.mark.parametrize("period", [10.0, 20.0])
def test_a_wind_that_begins_to_swing_is_no_factor(period: float) -> None:
    """A jump of the vector alone explains it as well as one of the factor, at another moment."""
    off = np.where(T > AT, 4.0 * np.sin((T - AT) / period), 0.0)
    found = flown(1.0, wind=(5.0 + off, -3.0 - off / 2), gust=0.0)
    assert not (np.nan_to_num(np.abs(found.size) - 5 * found.error) > 0.03).any()


def test_what_changes_with_the_speed_alone_is_no_factor() -> None:
    """A launch, a dive: shown too large by 5 m/s while it is fast, and only in straight flight."""
    straight = np.where(T < 60.0, 0.4, 0.4 + TURNS - TURNS[T >= 60.0][0])
    shown = np.where((T > 20.0) & (T < 40.0), 25.0, 20.0)
    air = 20.0 * np.array([np.cos(straight), np.sin(straight)])
    rng = np.random.default_rng(3)
    ground = air + rng.normal(0.0, 0.3, air.shape)
    found = jump([*ground], [*(air * shown / 20.0)], STEP, 120.0, 0.03)
    assert not (np.nan_to_num(np.abs(found.size) - 5 * found.error) > 0.03).any()


def test_what_is_unknown_is_left_out_and_nothing_is_told_of_nothing() -> None:
    nothing = np.full(T.size, np.nan)
    assert np.isnan(jump([nothing, nothing], [nothing, nothing], STEP, 120.0, 0.03).size).all()
    still = np.zeros(T.size)
    assert np.isnan(jump([still, still], [still, still], STEP, 120.0, 0.03).size).all()
    rng = np.random.default_rng(0)
    air = 20.0 * np.array([np.cos(TURNS), np.sin(TURNS)])
    ground = air + rng.normal(0.0, 0.3, air.shape)
    air[:, (T > 90.0) & (T < 150.0)] = np.nan  # and the factor changes unseen
    found = jump([*ground], [*(air * np.where(T < AT, 1.0, 1.3))], STEP, 120.0, 0.03)
    last = int(np.searchsorted(T, 200.0))
    assert found.size[last] == pytest.approx(1 / 1.3 - 1, abs=0.05)
    assert 50.0 - 6.0 < found.ago[last] < 110.0 + 6.0


@pytest.mark.skipif(not FLIGHT.exists(), reason="needs the labelled flights")
def test_an_accused_airspeed_is_dated_by_the_likeliest_moment_of_its_change() -> None:
    """Simulated: its pressure is multiplied by 0.64 at 35.06 s, and the next turn shows it."""
    (first, *_) = analyze(FLIGHT).findings
    assert first.component == "airspeed"
    assert first.onset == pytest.approx(35.06, abs=5.0)
    assert first.alarm > first.onset + 5.0
