"""The scale below which a residual alarms, against the judge itself at that scale."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.decision.alarms import Use
from fdi.decision.bounds import learn
from fdi.decision.critical import critical_scales
from fdi.decision.judging import judge

from .build import DEFAULT, RATE, residuals

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
