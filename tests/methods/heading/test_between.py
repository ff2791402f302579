"""What records of a rate miss, where the attitude beside them shows it and where it does not."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fdi.methods.heading.increments import _between, _body_steps, _steps

PERIOD = 0.5
T = np.arange(21) * PERIOD
RATE = np.where(T >= 5.0, 1.0, 0.0)
"""rad/s: it begins to turn between two records."""


def ride(begins: float, coarse: float = 0.0) -> SimpleNamespace:
    """A ride whose attitude shows when exactly the turn began."""
    angles = np.array([0 * T, 0 * T, np.maximum(T - begins, 0.0)])
    return SimpleNamespace(t=T, angles=angles, period=PERIOD, coarse=coarse)


def missed(own: SimpleNamespace) -> float:
    steps = _steps(own, own.angles[2])
    return float(_between(own, RATE, steps, np.array([8.0]), np.array([3.0]))[0])


def test_a_turn_that_began_half_way_was_not_missed() -> None:
    assert missed(ride(4.75)) == pytest.approx(0.0, abs=1e-9)


def test_what_was_missed_is_what_the_attitude_turned_beyond() -> None:
    assert missed(ride(4.65)) == pytest.approx(0.1)


def test_without_attitudes_as_often_the_records_count_as_independent() -> None:
    independent = 1.0 * PERIOD / np.sqrt(2)
    assert missed(ride(4.75, coarse=0.2)) == pytest.approx(independent)
    own = ride(4.75)
    own.angles[2, 9] = np.nan
    assert missed(own) == pytest.approx(independent)


def test_an_attitude_that_jumps_makes_no_doubt_larger() -> None:
    own = ride(4.75)
    own.angles[2, 12:] += 2.0
    assert missed(own) == pytest.approx(PERIOD / np.sqrt(2))


def test_steps_about_the_bodys_axes_are_rotation_vectors() -> None:
    angles = np.array([[0.1, 0.3, -0.8, 0.2], [0.2, -0.4, 0.5, 0.5], [3.0, 3.3, 4.0, 6.0]])
    own = SimpleNamespace(t=np.arange(4.0), angles=angles, period=1.0, coarse=0.0)
    places = Rotation.from_euler("ZYX", angles[::-1].T)
    np.testing.assert_allclose(
        _body_steps(own).T, (places[:-1].inv() * places[1:]).as_rotvec(), atol=1e-12
    )
