"""Levels, means and the combined ratio: known answers and what always holds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fdi.methods.estimator.ratios import (
    LEAST_LEVEL,
    MEAN_S,
    combined_ratio,
    own_level,
    ratios_of,
    trailing_mean,
)
from fdi.methods.estimator.records import Core

NAN = np.nan
T = np.arange(0.0, 60.0, 0.2)
RATIO = st.one_of(st.floats(0.001, 3.0), st.just(0.0), st.just(NAN))


def core(**ratios: np.ndarray) -> Core:
    named = {name.replace("_", " "): value for name, value in ratios.items()}
    return Core(0, "X", T, named, {name: f"X.{name}" for name in named})


@pytest.mark.parametrize(
    ("ratios", "px4", "ardupilot"),
    [
        ((0.2, 0.4, 0.1), 0.3, 0.1),
        ((0.2, 0.4, 0.9), 0.9, 0.81),
        ((0.0, 0.4, 0.1), 0.7, 0.08),  # a ratio that is not above 0 counts as 1 in PX4
        ((NAN, 0.4, 0.1), 0.7, NAN),
        ((0.2, 0.4, NAN), 1.0, NAN),
    ],
)
def test_combined_ratio_is_the_selectors(
    ratios: tuple[float, float, float], px4: float, ardupilot: float
) -> None:
    columns = [np.array([value]) for value in ratios]
    assert combined_ratio(*columns, squared=False) == pytest.approx([px4], abs=1e-12)
    found = combined_ratio(*columns, squared=True)
    assert found == pytest.approx([ardupilot], abs=1e-12, nan_ok=True)


@given(arrays(np.float64, (3, 5), elements=RATIO))
def test_px4s_combined_ratio_is_always_known_and_above_zero(ratios: np.ndarray) -> None:
    found = combined_ratio(*ratios, squared=False)
    assert np.isfinite(found).all()
    assert (found > 0).all()


@given(arrays(np.float64, 40, elements=RATIO), st.floats(0.05, 5.0))
def test_trailing_mean_equals_the_slow_one(values: np.ndarray, step: float) -> None:
    t = np.cumsum(np.full(40, step))
    slow = []
    for at in t:
        seen = values[(t > at - MEAN_S + 1e-6) & (t <= at)]
        known = seen[np.isfinite(seen)]
        slow.append(known.mean() if known.size else NAN)
    assert trailing_mean(t, values) == pytest.approx(slow, abs=1e-9, nan_ok=True)


def test_level_is_the_median_of_the_first_20_s_in_the_air() -> None:
    value = np.where(T < 10, 0.9, np.where(T < 30, 0.2, 0.7))
    assert own_level(T, value, (10.0, 60.0)) == pytest.approx(0.2)


def test_level_is_not_below_quantisation() -> None:
    assert own_level(T, np.full(T.size, 0.003), (0.0, 60.0)) == LEAST_LEVEL


def test_level_of_what_is_not_known_is_not_known() -> None:
    assert own_level(T, np.full(T.size, NAN), (0.0, 60.0)) is None


def test_a_rise_lasts_while_the_mean_is_beyond_its_limit() -> None:
    value = np.where((T >= 30) & (T < 45), 0.5, 0.1)
    (ratio,) = ratios_of(core(height=value), (0.0, 60.0), (0.0, 60.0))
    ((low, high),) = ratio.rises
    assert 30 < low < 34
    assert 45 < high < 49
    assert ratio.rejected == ()


def test_one_rejected_sample_is_no_rise() -> None:
    value = np.full(T.size, 0.2)
    value[200] = 1.5
    (ratio,) = ratios_of(core(compass=value), (0.0, 60.0), (0.0, 60.0))
    assert ratio.rises == ()
    assert ratio.rejected == ((pytest.approx(40.0), pytest.approx(40.2)),)


def test_the_ground_shows_no_rise() -> None:
    value = np.where(T < 50, 0.1, 1.0)
    (ratio,) = ratios_of(core(velocity=value), (0.0, 48.0), (0.0, 60.0))
    assert ratio.rises == ()


def test_the_largest_is_that_of_the_flight_and_not_of_another_one() -> None:
    value = np.full(T.size, 0.1)
    value[T < 5.0] = 3.0  # an earlier flight
    value[(T >= 30.0) & (T < 34.2)] = 0.6
    (found,) = ratios_of(core(velocity=value), (10.0, 50.0), (8.0, 55.0))
    assert found.peak == 0.6
    assert found.peak_excess == pytest.approx(6.0)
    assert np.nanmax(found.excess) == pytest.approx(30.0)


def test_the_largest_growth_is_that_which_makes_a_rise() -> None:
    value = np.full(T.size, 0.1)
    value[T < 9.9] = 3.0  # the mean of 4 s holds it until 4 s after take-off
    (found,) = ratios_of(core(velocity=value), (10.0, 50.0), (8.0, 55.0))
    assert not found.rises
    assert np.nanmax(found.excess[found.t >= 10.0]) > 4.0
    assert found.peak_excess == pytest.approx(1.0)
