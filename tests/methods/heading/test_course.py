"""On wings the course is a third heading: an aeroplane in the wind, one sensor of which drifts."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.methods.heading.course import COURSE_S, course_pairs
from fdi.methods.heading.increments import heading_pairs, sensor_pairs
from fdi.methods.heading.motion import Fixes, Ride
from fdi.methods.heading.tilt import G
from fdi.methods.setup.rotations import to_earth

T = np.arange(0.0, 120.0, 0.1)
GRID = np.arange(30.0, 115.0, 1.0)
SPEED, WIND = 18.0, (4.0, -3.0)
HALF_TURN_AT = 60.0


def heading(t: np.ndarray) -> np.ndarray:
    """Straight on, half a turn in 15 s, and straight back."""
    return 0.5 + np.pi * np.clip((t - HALF_TURN_AT) / 15.0, 0.0, 1.0)


def plane(
    *, gyro: float = 0.0, compass: float = 0.0, course: float = 0.0, knows_wind: bool = True
) -> Ride:
    """Return a level flight, sensors of which turn by so many rad/s too much, as angles."""
    yaw = heading(T)
    rate = np.gradient(yaw, T) + gyro
    level, nose = np.zeros(T.size), yaw + compass * T
    field = np.array([2e-5 * np.cos(nose), -2e-5 * np.sin(nose), np.full(T.size, 4e-5)])
    at = T[::2]
    ways = heading(at)
    north, east = SPEED * np.cos(ways) + WIND[0], SPEED * np.sin(ways) + WIND[1]
    if course:
        turned = (north + 1j * east - complex(*WIND)) * np.exp(1j * course * at) + complex(*WIND)
        north, east = turned.real, turned.imag
    fixes = Fixes(at, at, 0 * at, 0 * at, north, east, 0 * at)
    return Ride(
        t=T,
        rates=np.array([level, level, rate]),
        force=np.array([level, level, np.full(T.size, -9.81)]),
        field=field,
        angles=np.array([level, level, yaw]),
        fixes=fixes,
        wind=np.tile(np.array(WIND)[:, None], T.size) if knows_wind else None,
        air=(0.0, 120.0),
        flight=0,
        cycle=0.2,
        coarse=0.0,
        declination=0.0,
        dip=1.1,
        strength=np.nan,
        has_wings=True,
        absent={},
        lost={},
        climbed=0 * T,
    )


def off(ride: Ride) -> dict[str, np.ndarray]:
    pairs = course_pairs(ride, GRID)
    assert pairs is not None
    return {pair.name: pair.off for pair in pairs}


def beyond(ride: Ride) -> dict[str, float]:
    pairs = course_pairs(ride, GRID)
    assert pairs is not None
    return {pair.name: float(np.nanmax(np.abs(pair.off) / pair.sigma)) for pair in pairs}


def test_nose_and_course_through_the_air_turn_alike_in_a_wind() -> None:
    assert max(beyond(plane()).values()) < 0.2


def test_a_wind_that_nobody_tells_stays_within_the_deviation_in_a_turn() -> None:
    assert 0.1 < beyond(plane(knows_wind=False))["gyroscope-course"] < 2.0


@pytest.mark.parametrize(
    ("drifts", "apart", "alike"),
    [
        ("gyro", ("compass-gyroscope", "gyroscope-course"), "compass-course"),
        ("compass", ("compass-gyroscope", "compass-course"), "gyroscope-course"),
        ("course", ("compass-course", "gyroscope-course"), "compass-gyroscope"),
    ],
)
def test_who_drifts_is_off_both_others_by_its_drift_over_the_window(
    drifts: str, apart: tuple[str, str], alike: str
) -> None:
    found = off(plane(**{drifts: 0.02}))
    straight = HALF_TURN_AT - 5 > GRID  # a late compass and receiver are off while it turns
    for name in apart:
        assert np.abs(found[name][straight]) == pytest.approx(0.02 * COURSE_S, abs=0.02)
    assert np.abs(found[alike][straight]) == pytest.approx(0.0, abs=0.01)


def test_a_course_that_is_too_slow_to_tell_a_heading_is_unknown() -> None:
    ride = plane()
    assert ride.fixes is not None
    slow = replace(ride.fixes, north=0.05 * ride.fixes.north, east=0.05 * ride.fixes.east)
    still = replace(ride, fixes=slow, wind=np.zeros((2, T.size)))
    assert np.isnan(off(still)["gyroscope-course"]).all()
    assert np.isfinite(off(still)["compass-gyroscope"]).all()


def test_rotors_go_where_they_like() -> None:
    assert course_pairs(replace(plane(), has_wings=False), GRID) is None
    assert course_pairs(replace(plane(), fixes=None), GRID) is None


LOOP = (40.0, 40.0 + np.pi * SPEED / G)
"""At twice gravity, so that at the top it feels what a vehicle feels that stands: upside down."""


def looping() -> Ride:
    """Return a flight that pitches up through a whole turn, and goes on as before."""
    ride = plane()
    assert ride.angles is not None
    assert ride.fixes is not None
    turned = 2 * np.pi * np.clip((T - LOOP[0]) / (LOOP[1] - LOOP[0]), 0.0, 1.0)
    on_back = np.cos(turned) < 0  # as 3-2-1 angles: roll and heading turn round at the vertical
    level, _, yaw = ride.angles
    angles = np.array([level + np.pi * on_back, np.arcsin(np.sin(turned)), yaw + np.pi * on_back])
    rates = ride.rates.copy()
    rates[1] += np.gradient(turned, T)
    force = np.array([G * np.sin(turned), level, -G * np.cos(turned) - SPEED * rates[1]])
    field = np.einsum("nji,j->in", to_earth(*angles), np.array([2e-5, 0.0, 4e-5]))
    at = ride.fixes.t
    ahead = np.cos(np.interp(at, T, turned))
    north, east = (
        (way - wind) * ahead + wind
        for way, wind in zip((ride.fixes.north, ride.fixes.east), WIND, strict=True)
    )
    fixes = replace(ride.fixes, north=north, east=east)
    return replace(ride, angles=angles, rates=rates, force=force, field=field, fixes=fixes)


def test_no_heading_is_told_over_a_loop_and_another_one_is():
    """Straight on until 60 s: a loop from 40 to 46 s turns no heading, whatever angles say."""
    pairs = heading_pairs(looping(), GRID)
    assert {pair.name for pair in pairs} >= {"compass-gyroscope", "gyroscope-estimator"}
    for pair in pairs:
        over = (GRID > 42.0) & (GRID < 49.0)  # the windows that hold the nose beyond 60 degrees
        assert np.isnan(pair.off[over]).all()
        assert np.isfinite(pair.off[(GRID > 52.0) | (GRID < 40.0)]).all()
        assert np.nanmax(np.abs(pair.off) / pair.sigma) < 5


def test_who_feels_his_weight_on_his_back_does_not_lean_as_he_feels():
    for pair in sensor_pairs(looping(), GRID):
        assert np.nanmax(np.abs(pair.off) / pair.sigma) < 5, pair.name
