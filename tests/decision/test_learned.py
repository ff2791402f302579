"""What one healthy flight says about each test."""

import numpy as np
import pytest

from fdi.decision.bounds import learn
from fdi.decision.learned import reached
from fdi.decision.recipes import PredictedSpread
from fdi.model.parts import Kind

from .build import flown, residuals

RECIPE = PredictedSpread(sigmas=4.0, persistence_s=1.5, mean_s=1000.0)
N = 400


def of_flight(values, end=N, **more):
    given = residuals(values, flights=flown(0.0, end / 4.0), **more)
    return reached(given, learn(given, RECIPE), np.arange(N) < end, RECIPE)


def noise(rows=1, seed=0):
    return np.random.default_rng(seed).normal(size=(rows, N))


def test_what_was_not_known_for_as_long_as_an_alarm_takes_says_nothing():
    """At 4 Hz the 1.5 s of an alarm are six samples."""
    values = noise(3)
    values[1, 205:] = values[1, :200] = np.nan
    values[2, 206:] = values[2, :200] = np.nan
    assert list(of_flight(values)) == ["e0: ", "e2: "]


def test_a_test_that_does_not_hold_from_the_beginning_on_says_nothing():
    values = noise(2)
    values[1] += 50.0
    assert list(of_flight(values)) == ["e0: "]


def test_what_happens_on_the_ground_says_nothing():
    values = noise()
    shaken = values.copy()
    shaken[0, 300:] += 500.0
    assert of_flight(shaken, 300) == of_flight(values, 300)


def test_nothing_that_was_reached_is_below_zero():
    (quiet,) = of_flight(np.zeros(N), tolerance=1.0).values()
    assert quiet.scale == 0.0


def test_the_constant_is_the_median_of_the_reference_where_the_model_allows_one():
    values = noise()
    (free,) = of_flight(values).values()
    (held,) = of_flight(values + 7.0, allowance=10.0).values()
    assert free.centre is None
    assert held.centre == pytest.approx(7.0, abs=0.6)  # of 80 samples: four of its deviations


@pytest.mark.parametrize(("samples", "size"), [(1, 0.0), (2, 2.0), (3, 4.0), (5, 4.0), (6, 8.0)])
def test_of_a_stated_bound_a_short_excess_counts_as_judging_would_let_it_alarm(samples, size):
    """Six samples make an alarm, three twice as far beyond, and two four times as far."""
    values = np.zeros(N)
    values[200 : 200 + samples] = 8.0
    (found,) = of_flight(values, kind=Kind.LIMIT).values()
    assert (found.scale, found.size) == (None, size)


def test_the_largest_scale_at_which_noise_would_have_alarmed_is_told():
    """Of a spread of 1 a fifth is believed, so that the threshold is four fifths of it."""
    values = np.zeros(N)
    values[200:206] = 8.0
    (found,) = of_flight(values).values()
    assert (found.scale, found.size) == (pytest.approx(10.0), 0.0)
    values[300:303] = 30.0  # as good as 15 for twice as long
    (found,) = of_flight(values).values()
    assert found.scale == pytest.approx(18.75)


@pytest.mark.parametrize(("allowance", "centre"), [(np.nan, None), (0.0, None), (5.0, 2.0)])
def test_a_test_without_an_allowance_has_no_constant(allowance, centre):
    given = residuals(np.full(N, 2.0), allowance=allowance, flights=flown(0.0, N / 4.0))
    (found,) = reached(given, learn(given, RECIPE), np.ones(N, bool), RECIPE).values()
    assert found.centre == centre
