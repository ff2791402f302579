"""The scale below which a residual alarms, against the judge itself at that scale."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given as drawn
from hypothesis import strategies as st

from fdi.decision.alarms import Use
from fdi.decision.bounds import learn
from fdi.decision.critical import critical_scales, least_of
from fdi.decision.judging import judge

from .build import DEFAULT, RATE, bounds_by_hand, residuals, told_by_hand

RECIPE = replace(DEFAULT.decision, budget_per_hour=None)
SUDDEN = replace(RECIPE, mean_least=1e9, mean_most=1e9)
USE = Use("majority", True, 0.0)
SIZE = 1200


def rough(seed):
    """Slow noise with bursts and gaps, half of it with a tolerance."""
    rng = np.random.default_rng(seed)
    kernel = np.exp(-np.arange(12) / 4)
    column = np.convolve(rng.standard_t(4, SIZE + 11), kernel, "valid")
    column[rng.random(SIZE) < 0.1] = np.nan
    spread = np.exp(rng.normal(0, 0.3, SIZE))
    return residuals(column * spread, spread=spread, tolerance=rng.choice([0.0, 0.7]))


def scales_of(given, recipe):
    bounds = learn(given, recipe)
    off = bounds.told.strayed(given.values)[0]
    known = np.isfinite(off[0])
    found = critical_scales(off, 0, bounds, known, recipe, RATE)
    return bounds, known, found


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scale", [0.2, 0.5, 0.8, 1.3])
def test_sudden_alarm_is_certain_exactly_where_the_scale_is_below_the_critical_one(seed, scale):
    given = rough(seed)
    bounds, known, critical = scales_of(given, SUDDEN)
    alarms = judge(given, bounds, SUDDEN, USE, scale)
    assert np.array_equal(critical[0, known] > scale, alarms.certain[0, known])


@pytest.mark.parametrize("seed", range(6))
def test_there_is_an_alarm_exactly_below_the_largest_critical_scale(seed):
    given = rough(seed)
    bounds, _, critical = scales_of(given, RECIPE)
    highest = critical.max()
    assert judge(given, bounds, RECIPE, USE, 0.99 * highest).alarm.any()
    assert not judge(given, bounds, RECIPE, USE, 1.01 * highest).alarm.any()


def test_scale_moves_thresholds_of_noise_and_not_the_models_statements():
    given = rough(0)
    bounds = learn(given, RECIPE)
    stated = replace(bounds, told=replace(bounds.told, stated=np.array([True])))
    half, whole = (judge(given, bounds, RECIPE, USE, scale).threshold for scale in (0.5, 1.0))
    assert half - bounds.tolerance == pytest.approx(0.5 * (whole - bounds.tolerance))
    assert np.array_equal(judge(given, stated, RECIPE, USE, 0.5).threshold, whole)


@pytest.mark.parametrize(
    ("samples", "scale", "certain"), [(2, 0.125, 2), (3, 0.75, 3), (5, 0.75, 3), (9, 2.0, 6)]
)
def test_a_run_is_an_alarm_up_to_the_scale_of_its_length_and_its_strength(samples, scale, certain):
    """5 beyond a tolerance of 1 and noise of 2: six samples at a scale of 2, three half as far."""
    off = np.zeros((1, 40))
    off[0, 10 : 10 + samples] = -5.0
    bounds = bounds_by_hand(told_by_hand(), 40, tolerance=1.0, noise=2.0)
    found = critical_scales(off, 0, bounds, np.ones(40, bool), RECIPE, RATE)[0]
    assert found.max() == scale
    assert np.flatnonzero(found == scale).tolist() == [*range(9 + certain, 10 + samples)]


def test_what_is_not_judged_at_a_moment_has_no_scale_there_and_ends_no_run():
    off = np.full((2, 40), 5.0)
    off[1] = 3.0
    known = np.ones(40, bool)
    known[20:30] = False
    bounds = bounds_by_hand(told_by_hand(), 40, tolerance=1.0, noise=2.0)
    found = critical_scales(off, 0, bounds, known, RECIPE, RATE)
    assert np.isneginf(found[:, 20:30]).all()
    assert (found[:, 30:] == [[2.0], [1.0]]).all()


def test_a_mean_alarms_below_the_scale_of_its_threshold():
    """Means of 40 samples: 2 over a spread of 4, against a bound of a tenth of that spread."""
    bounds = bounds_by_hand(told_by_hand(), 80, noise=1e9, spread=4.0, mean=0.4)
    found = critical_scales(np.full((1, 80), 2.0), 0, bounds, np.ones(80, bool), RECIPE, RATE)[0]
    assert found[39:] == pytest.approx(np.full(41, 5.0))
    assert (found[6:39] < 1e-6).all()


def test_where_noise_has_no_threshold_no_scale_alarms():
    bounds = bounds_by_hand(told_by_hand(), 40, tolerance=1.0, noise=0.0, spread=0.0)
    found = critical_scales(np.full((1, 40), 5.0), 0, bounds, np.ones(40, bool), RECIPE, RATE)
    assert np.isneginf(found).all()


@drawn(st.lists(st.integers(-9, 9), min_size=1, max_size=30), st.integers(1, 30))
def test_the_least_of_successive_columns_is_that_of_each_window(values, count):
    count = min(count, len(values))
    expected = [min(values[i : i + count]) for i in range(len(values) - count + 1)]
    assert least_of(np.array([values], float), count)[0].tolist() == expected
