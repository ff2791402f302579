"""The noise that a budget draws, by known answers; the search is in diagnosis/test_budget.py."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.decision import budget
from fdi.decision.alarms import Use
from fdi.decision.bounds import learn
from fdi.decision.budget import FLOOR, Noise, decide_within_budget, noise_of, scale_for, simulated
from fdi.decision.judging import judge
from fdi.decision.resampling import NoiseModel
from fdi.model.parts import Kind

from .build import DEFAULT, RATE, bounds_by_hand, flown, residuals, told_by_hand

USE = Use("majority", True, 10.0)
RECIPE = replace(DEFAULT.decision, mean_most=1e9, mean_least=1e9)
N = round(300 * RATE)
T = np.arange(N) / RATE


def normal(rows=1, seed=0):
    return np.random.default_rng(seed).normal(size=(rows, N))


def noise(values, **more):
    given_ = residuals(values, **({"flights": flown(0.0, 300.0)} | more))
    bounds = learn(given_, RECIPE)
    return noise_of(judge(given_, bounds, RECIPE, USE), bounds)


def test_noise_is_that_of_the_time_in_the_air():
    found = noise(normal(), flights=flown(50.0, 200.0))
    assert found.hours == pytest.approx(150 / 3600)
    assert found.first == 200
    assert found.known.shape == found.unit.shape == (1, 600)
    assert found.known.all()
    assert found.rate_hz == RATE
    assert found.bounds.noise.shape == (1, 600)


def test_of_a_long_flight_its_first_part_is_enough(monkeypatch):
    monkeypatch.setattr(budget, "MOST_SAMPLES", 100)
    found = noise(normal(), flights=flown(50.0, 200.0))
    assert (found.first, found.model.samples) == (200, 100)
    assert found.hours == pytest.approx(25 / 3600)


def test_where_nothing_flies_there_are_no_hours():
    found = noise(normal(), flights=flown(400.0, 500.0))
    assert (found.hours, found.first, found.known.size) == (0.0, 0, 0)
    assert scale_for(10.0, found, RECIPE) == FLOOR


@pytest.mark.parametrize(("per_hour", "rounds"), [(10.0, 5), (0.25, 8), (0.01, 25)])
def test_the_rarer_an_alarm_may_be_the_longer_is_simulated(per_hour, rounds, monkeypatch):
    """Five minutes at 4 Hz are drawn 13 times at once, 1.08 h: two alarms at 0.25 take 8 rounds."""
    drawn = []
    monkeypatch.setattr(budget, "simulated", lambda *a: drawn.append(1) or simulated(*a))
    scale_for(per_hour, noise(normal(2)), RECIPE)
    assert len(drawn) == rounds


@pytest.mark.parametrize("size", [0.01, 0.3, 1.0])
def test_noise_is_in_spreads_and_of_what_varies(size):
    values = size * normal(3)
    values[1] = 0.0
    found = noise(values, spread=np.array([[2.0], [1.0], [0.0]]), tolerance=9.0)
    assert found.rows.tolist() == [0, 2]
    assert (found.unit[0] == 2.0).all()
    assert (found.unit[2] == 1.0).all()
    assert found.model.deviation[[0, 2]] == pytest.approx([size / 2, size], rel=0.1)


@pytest.mark.parametrize("more", [{"kind": Kind.LIMIT}, {"kind": Kind.EQUALITY}])
def test_what_the_model_states_has_no_noise(more):
    assert not noise(normal(), **more).known.any()


@pytest.mark.parametrize(("near_s", "counts"), [(14.0, False), (16.0, True)])
def test_within_fifteen_seconds_of_an_alarm_nothing_is_calm(near_s, counts):
    values = 0.1 * normal()
    values[0, (T >= 100) & (T < 110)] = 60.0
    for start in (100.0 - near_s, 109.75 + near_s):
        other = values.copy()
        other[0, round(start * RATE)] = 2.0  # a single sample is no alarm
        changed = noise(other).model.deviation[0] > 1.1 * noise(values).model.deviation[0]
        assert changed == counts


def test_a_stretch_has_the_largest_scale_of_its_ten_seconds_and_its_end_is_never_an_alarm():
    """At 1 Hz two samples beyond twice a scale alarm; 25 samples are two stretches and a half."""
    told = told_by_hand(mean_most=np.array([np.nan]))
    drawn = np.zeros((1, 2, 25))
    drawn[0, 0, 3:5], drawn[0, 1, 9:11], drawn[0, 1, 23:25] = 8.0, 12.0, -16.0
    unit = np.full((4, 25), 0.5)
    rows = np.array([2])
    model = NoiseModel(*np.zeros((2, 4)), np.ones((4, 1)), np.zeros((4, 1)), 25)
    one = bounds_by_hand(told, 25)
    four = replace(
        one,
        told=replace(told, unfit=np.zeros(4, bool), stated=np.zeros(4, bool)),
        **{
            name: np.repeat(getattr(one, name), 4, axis=0)
            for name in ("tolerance", "noise", "spread", "mean_spread", "mean_bound")
        },
    )
    whole = Noise(model, unit, rows, np.ones((4, 25), bool), four, 0, 1.0, 25 / 3600)
    found = simulated(whole, drawn, RECIPE)
    assert found.keys() == {2}
    # a unit of a half, and twice the scale: 8 -> 4 -> 2
    assert found[2].tolist() == [[2.0, 0.0, 0.0], [0.0, 3.0, 4.0]]


def test_a_scale_stays_within_what_the_policy_allows():
    given_ = residuals(normal(), flights=flown(0.0, 300.0))
    free = decide_within_budget(replace(RECIPE, budget_per_hour=1.0, least_scale=0.0), given_, USE)
    assert 0.25 < free.scale < 1.0
    for least, most, scale in ((0.0, 9.0, free.scale), (1.0, 3.0, 1.0), (0.0, 0.25, 0.25)):
        recipe = replace(RECIPE, budget_per_hour=1.0, least_scale=least, most_scale=most)
        assert decide_within_budget(recipe, given_, USE).scale == scale
