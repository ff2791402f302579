"""The band of healthy flights: what it holds, what leaves it, by known answers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.comparison.band import HOLD_S, band_of, distance, quantiles, reach
from fdi.comparison.differ import Bands, differences
from fdi.comparison.values import Compared, Course

RATE = 10.0


def course(values, floor=0.0, rate=RATE, way=0):
    values = np.atleast_2d(np.asarray(values, float))
    t = np.arange(values.shape[1]) / rate
    ways = np.full(len(values), way, np.int8)
    return Course(t, values, np.full(values.shape, float(floor)), np.zeros(len(values)), ways)


def noise(seed, n=600, rows=1):
    return np.random.default_rng(seed).normal(0, 1, (rows, n))


def flight(number, healthy):
    return Compared(f"f{number}", number, 0, 0.0, True, 60.0, (), healthy)


def test_the_band_holds_nine_tenths_of_gaussian_noise():
    band = band_of([course(noise(i, 6000)) for i in range(4)])
    assert np.median(band.half) == pytest.approx(1.645, rel=0.05)  # normal, 5 % beyond each edge
    assert np.median(band.middle) == pytest.approx(0.0, abs=0.1)


def test_a_step_is_told_by_its_size_and_onset():
    """A residual that is 0 +- 1 in health and steps to 10 at 40 s is ten half widths off."""
    healthy = [course(np.zeros(600), floor=1.0) for _ in range(3)]
    step = course(10.0 * (np.arange(600) >= 400), floor=1.0)
    courses = [*healthy, step]
    flights = [flight(i, i < 3) for i in range(4)]
    found = differences(flights, courses, Bands(courses))
    assert found[0].flight == 3
    assert found[0].bands == pytest.approx(10.0)
    assert found[0].since == pytest.approx(40.0)
    assert (found[0].value, found[0].middle, found[0].half) == pytest.approx((10.0, 0.0, 1.0))
    assert all(one.bands == 0.0 for one in found[1:])


@pytest.mark.parametrize(("way", "bands"), [(0, 10.0), (1, 10.0), (-1, 0.0)])
def test_a_statement_of_one_side_differs_on_that_side_alone(way, bands):
    """A motor that is given less than its share was listed as one that is given more."""
    healthy = [course(np.zeros(600), floor=1.0, way=way) for _ in range(3)]
    courses = [*healthy, course(np.full(600, 10.0), floor=1.0, way=way)]
    found = differences([flight(i, i < 3) for i in range(4)], courses, Bands(courses))
    assert [one.bands for one in found if one.flight == 3] == [pytest.approx(bands)]
    assert reach(band_of(healthy), courses[3])[0] == pytest.approx(bands)


def test_a_spike_shorter_than_a_second_is_no_difference():
    spiked = np.zeros(600)
    spiked[300 : 300 + int(HOLD_S * RATE)] = 50.0
    _, held = distance(band_of([course(np.zeros(600), 1.0)]), course(spiked, 1.0))
    assert held.max() == 0.0


def test_unknown_is_no_difference_and_breaks_one():
    values = np.full(600, 9.0)
    values[::5] = np.nan
    far, held = distance(band_of([course(np.zeros(600), 1.0)]), course(values, 1.0))
    assert np.isnan(far[0, ::5]).all()
    assert held.max() == 0.0


def test_a_healthy_flight_off_the_others_widens_the_band():
    """One healthy flight at 5, others at 0: an odd one at 6 is hardly outside, not six bands."""
    courses = [course(np.full(600, x), 1.0) for x in (0.0, 0.0, 5.0, 6.0)]
    flights = [flight(i, i < 3) for i in range(4)]
    odd = next(one for one in differences(flights, courses, Bands(courses)) if one.flight == 3)
    assert odd.bands < 1.0


def test_after_the_longest_healthy_flight_its_whole_time_counts():
    long = course(np.r_[np.zeros(600), np.full(600, 7.0)], 1.0)
    _, held = distance(band_of([course(np.zeros(600), 1.0)]), long)
    assert held.max() == pytest.approx(7.0)


def test_without_any_width_nothing_is_counted():
    """A difference that has no measure is not infinite."""
    far, held = distance(band_of([course(np.zeros(600))]), course(np.full(600, 3.0)))
    assert np.isnan(far).all()
    assert held.max() == 0.0


def test_reach_is_in_the_unit_of_the_residual():
    band = band_of([course(np.zeros(600), 2.0)])
    assert reach(band, course(np.full(600, 5.0), 2.0))[0] == pytest.approx(5.0)
    assert reach(band, course(np.full(600, 1.0), 2.0))[0] == 0.0


@given(st.lists(st.floats(-100, 100), min_size=5, max_size=60))
def test_quantiles_are_numpys(values):
    low, high = quantiles(np.array([[*values, np.nan]]))
    assert (low[0], high[0]) == pytest.approx(np.quantile(values, (0.05, 0.95)), abs=1e-9)


@given(st.integers(0, 1000), st.floats(0.1, 50.0))
def test_units_do_not_matter(seed, scale):
    some = [noise(seed + i, 300) for i in range(3)]
    flights = [flight(i, i < 2) for i in range(3)]
    first = [course(one) for one in some]
    second = [course(one * scale) for one in some]
    one, other = (differences(flights, each, Bands(each)) for each in (first, second))
    assert [d.bands for d in one] == pytest.approx([d.bands for d in other])
