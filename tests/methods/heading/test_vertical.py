"""Heights of receiver, barometer and specific force: by how much each bends, and who is odd."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.methods.heading.check import _by_heights
from fdi.methods.heading.motion import Fixes, Ride
from fdi.methods.heading.tilt import G
from fdi.methods.heading.vertical import height_pairs

T = np.arange(0.0, 60.0, 0.1)
GRID = np.arange(10.0, 59.0, 0.2)
FAILS = 40.0


def climbing(pull: float = 0.5) -> Ride:
    """Return a level vehicle that is pulled upwards, m/s2, whose three witnesses agree."""
    height = pull * T**2 / 2
    still = np.zeros((3, T.size))
    force = np.array([0 * T, 0 * T, np.full(T.size, -G - pull)])
    at = T[::2]
    fixes = Fixes(at, at, 0 * at, 0 * at, 0 * at, 0 * at, height[::2])
    air = (0.0, float(T[-1]))
    return Ride(
        T,
        still,
        force,
        None,
        still,
        fixes,
        None,
        air,
        0,
        0.2,
        0.0,
        0.0,
        1.1,
        np.nan,
        False,
        {},
        {},
        height,
    )


def received(ride: Ride, off: np.ndarray) -> Ride:
    assert ride.fixes is not None
    return replace(ride, fixes=replace(ride.fixes, height=ride.fixes.height + off))


def named(ride: Ride) -> set[str]:
    found = _by_heights(height_pairs(ride, GRID), GRID.size)
    return set().union(*found) - {"none", "undecided"}


@pytest.mark.parametrize("pull", [0.0, 0.5, -2.0])
def test_witnesses_of_one_climb_agree(pull: float) -> None:
    for pair in height_pairs(climbing(pull), GRID):
        assert np.abs(pair.off).max() < 0.05  # heights between records are on a line
        assert (pair.sigma > 0).all()


def test_a_constant_and_a_constant_drift_do_not_bend() -> None:
    ride = climbing()
    off = 300.0 + 2.0 * T[::2]
    for one, other in zip(
        height_pairs(ride, GRID), height_pairs(received(ride, off), GRID), strict=True
    ):
        assert np.allclose(one.off, other.off, atol=1e-9)


def test_a_receiver_whose_height_jumps_is_the_odd_one() -> None:
    ride = received(climbing(), np.where(T[::2] >= FAILS, 25.0, 0.0))
    barometer, force, others = height_pairs(ride, GRID)
    after = (GRID > FAILS + 0.3) & (GRID < FAILS + 2.3)
    for pair in (barometer, force):
        assert pair.off[after] == pytest.approx(25.0, abs=0.05)
    assert np.abs(others.off).max() < 0.05
    assert named(ride) == {"satellite"}


def test_a_barometer_that_jumps_accuses_no_receiver() -> None:
    ride = climbing()
    assert named(replace(ride, climbed=ride.climbed + np.where(T >= FAILS, 25.0, 0.0))) == set()


def test_without_barometer_or_attitude_nothing_is_said() -> None:
    ride = climbing()
    off = received(ride, np.where(T[::2] >= FAILS, 25.0, 0.0))
    assert "satellite" not in named(replace(ride, climbed=np.full(T.size, np.nan)))
    assert {"satellite"} not in _by_heights(
        height_pairs(replace(off, climbed=np.full(T.size, np.nan)), GRID), GRID.size
    )
    assert height_pairs(replace(off, angles=None), GRID) == ()
