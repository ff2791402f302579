"""What is held against bounds: from when to when an alarm lasts, and how strong it is."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.decision.alarms import Use
from fdi.decision.bounds import learn
from fdi.decision.judging import enough, judge, states

from .build import DEFAULT, RATE, bounds_by_hand, flown, residuals, told_by_hand

USE = Use("majority", True, 10.0)
RECIPE = replace(DEFAULT.decision, budget_per_hour=None, scatter_most=None)
LEAST = RECIPE.alarm_samples(RATE)
SIZE = 800


def judged(values, bounds=None, *, scale=1.0, recipe=RECIPE, **more):
    given = residuals(values, flights=flown(0.0, 200.0), **more)
    return judge(given, bounds or learn(given, recipe), recipe, USE, scale)


def test_an_alarm_takes_a_second_and_a_half_or_so_many_samples():
    assert LEAST == 6
    assert RECIPE.alarm_samples(1.0) == 5
    assert RECIPE.mean_samples(RATE) == 40
    assert RECIPE.mean_samples(0.01) == 2


def test_twice_as_strong_takes_half_and_four_times_a_quarter_and_two_at_the_least():
    assert enough(20) == [(1.0, 20), (2.0, 10), (4.0, 5)]
    assert enough(3) == [(1.0, 3), (2.0, 2), (4.0, 2)]


def test_a_size_at_its_threshold_is_quiet_and_without_one_unknown():
    size = np.array([1.0, 1.1, np.nan, 1.1, 1.1])
    assert states(size, np.array([1.0, 1.0, 1.0, np.nan, np.inf])).tolist() == [0, 1, -1, -1, -1]


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("start", [250, 300])
def test_what_is_small_but_lasts_is_an_alarm_from_its_beginning_to_its_end(start, sign):
    """0.9 for 30 s, against a threshold of 0.45 of the means of 40 samples.

    The mean is beyond it with the 21st sample; 6 samples show more than half of what it is then
    with the second, and still do with the fourth after the end.
    """
    recipe = replace(RECIPE, mean_least=0.45)
    values = np.zeros(SIZE)
    stop = start + 120
    values[start:stop] = 0.9 * sign
    alarms = judged(values, recipe=recipe)
    assert np.flatnonzero(alarms.alarm[0]).tolist() == [*range(start + 1, stop + 4)]
    assert np.flatnonzero(alarms.certain[0]).tolist() == [*range(start + 20, stop + 4)]
    assert alarms.strength[0, start + 60] == pytest.approx(0.9 / 0.45)
    assert alarms.mean[0, start + 60] == pytest.approx(0.9 * sign)
    assert alarms.mean_threshold[0, start] == pytest.approx(0.45)
    assert not judged(values, recipe=recipe, scale=2.1).alarm.any()


def test_a_mean_is_of_what_is_beyond_the_tolerance():
    recipe = replace(RECIPE, mean_least=0.45)
    values = np.zeros(SIZE)
    values[300:420] = 1.2
    alarms = judged(values, recipe=recipe, tolerance=0.5)
    assert np.nanmax(alarms.mean) == pytest.approx(0.7)
    assert np.flatnonzero(alarms.alarm[0])[0] == 301
    assert not judged(values, recipe=recipe, tolerance=0.8).alarm.any()


@pytest.mark.parametrize(("spread", "samples"), [(0.0, LEAST), (1.0, 2)])
def test_without_a_stated_spread_nothing_says_how_much_beyond_is_much(spread, samples):
    for length, raised in ((samples - 1, False), (samples, True)):
        values = np.zeros(SIZE)
        values[300 : 300 + length] = 99.0
        bounds = bounds_by_hand(told_by_hand(), SIZE, tolerance=1.0, noise=spread, spread=spread)
        assert judged(values, bounds).alarm.any() == raised


def test_strength_is_the_size_over_its_threshold():
    values = np.zeros(SIZE)
    values[300:310] = -12.0
    values[400:410] = 1e12
    values[410] = np.nan
    bounds = bounds_by_hand(told_by_hand(), SIZE, tolerance=1.0, noise=2.0)
    strength = judged(values, bounds).strength[0]
    assert (strength[299], strength[300], strength[400]) == (0.0, 4.0, 1e6)
    assert np.isnan(strength[410])
    assert judged(values, bounds, scale=2.5).strength[0, 300] == 2.0


@pytest.mark.parametrize(("circular", "known"), [(True, False), (False, True)])
def test_an_angle_that_may_be_off_by_more_than_a_right_one_is_not_judged(circular, known):
    """Within 89 degrees of noise and 2 of tolerance lies every second angle there is."""
    told = told_by_hand(circular=np.array([circular]), mean_most=np.ones(1))
    wide = bounds_by_hand(told, SIZE, tolerance=np.radians(2), noise=np.radians(89), mean=1.6)
    alarms = judged(np.full(SIZE, 3.0), wide)
    assert (alarms.state[0] >= 0).all() == np.isfinite(alarms.strength).all() == known
    assert alarms.alarm.any() == known
    narrow = bounds_by_hand(told, SIZE, tolerance=np.radians(2), noise=np.radians(87))
    assert (judged(np.full(SIZE, 3.0), narrow).state == 1).all()


def test_what_is_not_judged_is_unknown_all_along():
    unfit = told_by_hand(unfit=np.ones(1, bool), mean_most=np.ones(1))
    alarms = judged(np.full(SIZE, 50.0), bounds_by_hand(unfit, SIZE, mean=1.0))
    assert (alarms.state == -1).all()
    assert np.isnan(alarms.strength).all()
    assert np.isnan(alarms.mean).all()
    assert not alarms.certain.any()
    assert alarms.unfit.all()


def test_what_the_model_states_is_not_scaled():
    values = np.full(SIZE, 1.5)
    for stated in (True, False):
        told = told_by_hand(stated=np.array([stated]))
        alarms = judged(values, bounds_by_hand(told, SIZE), scale=2.0)
        assert alarms.alarm.any() == stated
        assert (alarms.threshold == (1.0 if stated else 2.0)).all()
        assert alarms.scale == 2.0
