"""The wind that a receiver and an airspeed sensor show before one of them fails."""

import numpy as np
import pytest

from fdi.methods.heading.reckoning import _wind_at

T = np.arange(0.0, 300.0, 0.2)


def walking(growth: float, seed: int) -> np.ndarray:
    """A wind north and east of which each second adds ``growth`` m^2/s^2 to the variance."""
    draw = np.random.default_rng(seed)
    return np.cumsum(draw.normal(0, np.sqrt(0.2 * growth), (2, T.size)), axis=1)


def test_a_steady_wind_is_the_mean_of_what_is_seen():
    seen = np.array([[6.0], [-3.0]]) + np.random.default_rng(1).normal(0, 1.0, (2, T.size))
    wind = _wind_at(T, seen)
    assert wind.mean == pytest.approx([6.0, -3.0], abs=0.3)
    assert wind.walks == pytest.approx(0.5**2 / 30)  # the calmest wind
    assert np.sqrt(wind.variance) < 0.5


def test_a_wind_that_walks_is_told_by_how_much():
    found = [_wind_at(T, walking(0.3, seed)).walks for seed in range(20)]
    assert np.mean(found) == pytest.approx(0.3, rel=0.25)


def test_errors_that_come_and_go_are_no_walk():
    """An airspeed that reads wrong in turns looks like another wind on every other heading."""
    seen = 2.0 * np.array([np.sign(np.sin(0.6 * T)), np.sign(np.cos(0.6 * T))])
    assert _wind_at(T, seen).walks < 0.05


def test_after_a_gust_the_new_wind_counts():
    seen = np.where(T < 250.0, 4.0, 12.0) + np.zeros((2, 1))
    seen += np.random.default_rng(2).normal(0, 0.5, seen.shape)
    wind = _wind_at(T, seen)
    assert abs(wind.mean - 12.0).max() < 1.0
    reach = np.sqrt(wind.variance * 30**2 + wind.walks * 30**3 / 3)
    assert reach > 50.0  # m in half a minute: it may do so again


def test_too_few_records_tell_the_calmest_wind_and_its_doubt():
    wind = _wind_at(T[:10], np.full((2, 10), 5.0))
    assert wind.mean == pytest.approx([5.0, 5.0])
    assert wind.walks == pytest.approx(0.5**2 / 30)
