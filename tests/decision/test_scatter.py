"""Noise of zero mean: what has begun to scatter alarms, and what merely moves does not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.decision.scatter import (
    CLIP,
    ENOUGH,
    KNOWN_SHARE,
    LEAST,
    SCATTER_S,
    differences,
    levels,
    samples_of,
    scatter,
)
from fdi.model.parts import Kind

from .build import DEFAULT as SHIPPED
from .build import PAPER, RATE, flown, residuals

# without a budget thresholds are not scaled: that has its own tests (diagnosis/test_budget.py)
DEFAULT = replace(SHIPPED, decision=replace(SHIPPED.decision, budget_per_hour=None))
MOST = DEFAULT.decision.scatter_most
SIZE = 0.06
"""Of the noise, of the stated spread: eight times as much is far from any threshold of a sample."""
N = round(240 * RATE)
T = np.arange(N) / RATE
START, END = 100.0, 160.0
FAULTY = (T >= START) & (T < END)
IN_THE_AIR = flown(0.0, T[-1])
SEEDS = pytest.mark.parametrize("seed", range(5))


def noise(seed, size=SIZE):
    return size * np.random.default_rng(seed).normal(size=N)


def decided(values, *, policy=DEFAULT, steady=True, **more):
    return policy.decide(residuals(values, steady=steady, flights=IN_THE_AIR, **more))


@SEEDS
def test_noise_that_rises_eightfold_is_an_alarm_from_about_its_beginning_to_its_end(seed):
    alarms = decided(np.where(FAULTY, 8.0, 1.0) * noise(seed))
    alarmed = T[alarms.alarm[0]]
    assert len(alarmed)
    assert START - 3 < alarmed[0] < START + 5
    assert END - 5 < alarmed[-1] < END + 3
    certain = T[alarms.certain[0]]
    assert START < certain[0] <= START + SCATTER_S
    assert alarms.strength[0][FAULTY].max() > 1.0
    assert (alarms.strength[0][alarms.state[0] == 1] > 0).all()


@SEEDS
@pytest.mark.parametrize("times", [1.0, 2.0, 3.0])
def test_noise_that_hardly_rises_is_none(seed, times):
    alarms = decided(np.where(FAULTY, times, 1.0) * noise(seed))
    assert not alarms.alarm.any()
    assert np.nanmax(alarms.scatter) < MOST


MOVES = {
    "a step": np.where(T >= START, 1.0, 0.0),
    "a ramp": np.clip((T - START) / 30, 0, 1),
    "a slow sine": 0.5 * np.sin(2 * np.pi * T / 40) * (T >= START),
    "a pulse of a second": np.where((T >= START) & (T < START + 1), 2.0, 0.0),
}


@SEEDS
@pytest.mark.parametrize("move", MOVES)
def test_what_moves_with_the_noise_of_the_beginning_does_not_scatter(seed, move):
    alarms = decided(noise(seed) + MOVES[move])
    assert np.nanmax(alarms.scatter) < 0.6 * MOST
    assert not alarms.alarm.any()


def test_less_than_rounding_is_no_scatter_however_much_it_grows():
    """From a thousandth of LEAST, and by a hundred times: it is nothing as before."""
    quiet = noise(0, LEAST / 1000)
    alarms = decided(np.where(FAULTY, 1000.0, 1.0) * quiet)
    assert not alarms.alarm.any()
    assert np.nanmax(alarms.scatter) < 1.5


def test_one_wild_sample_does_not_scatter():
    values = noise(3)
    values[round(START * RATE)] = 1e6
    alarms = decided(values)
    count = samples_of(RATE)
    assert np.nanmax(alarms.scatter) < (3 * CLIP + count * 2) / count


def test_where_the_level_was_not_seen_nothing_is_judged():
    values = np.where(FAULTY, 8.0, 1.0) * noise(1)
    values[T < 40] = np.nan
    alarms = decided(values)
    assert np.isnan(alarms.scatter).all()
    assert not alarms.alarm.any()


def test_a_gap_is_no_scatter_and_hides_none_beyond_it():
    values = np.where(FAULTY, 8.0, 1.0) * noise(1)
    gap = (T >= START - 30) & (T < START + 10)
    values[gap] = np.nan
    alarms = decided(values)
    known = np.isfinite(alarms.scatter[0])
    assert not known[(T >= START - 30 + SCATTER_S) & gap].any()
    assert not alarms.alarm[0][gap & (T < START + 5)].any()
    assert alarms.alarm[0][(T >= START + 30) & (T < END - 5)].all()


def test_a_fault_in_the_first_seconds_is_the_level_and_hides_itself():
    """So it is with all that is learned from them; its end is no alarm either."""
    alarms = decided(np.where(T < START, 8.0, 1.0) * noise(2))
    assert not alarms.alarm.any()
    assert np.nanmax(alarms.scatter[0]) < 2.0
    assert np.nanmax(alarms.scatter[0][T > START + SCATTER_S]) < 0.3


@pytest.mark.parametrize(
    "more",
    [
        {"steady": False},  # a manoeuvre may make it scatter
        {"kind": Kind.LIMIT},
        {"kind": Kind.EQUALITY},
        {"spread": 0.0, "tolerance": 1.0},
    ],
)
def test_only_what_no_manoeuvre_moves_and_has_a_stated_spread_is_judged(more):
    alarms = decided(np.where(FAULTY, 8.0, 1.0) * noise(0), **more)
    assert np.isnan(alarms.scatter).all()
    assert not alarms.alarm.any()


def test_a_policy_without_the_test_judges_no_scatter():
    without = replace(DEFAULT, decision=replace(DEFAULT.decision, scatter_most=None))
    alarms = decided(np.where(FAULTY, 8.0, 1.0) * noise(0), policy=without)
    assert not alarms.alarm.any()
    paper = decided(noise(0), policy=PAPER)
    assert np.isnan(paper.scatter).all()


@given(st.integers(0, 99), st.floats(0.5, 100))
def test_scatter_has_no_unit(seed, scale):
    """It is held against what it was at first, if that was more than rounding."""
    values = np.where(FAULTY, 8.0, 1.0) * noise(seed, 1.0)
    sizes, others = differences(values[None]), differences(scale * values[None])
    reference = T < 20
    one = scatter(sizes, levels(sizes, reference), RATE)[1]
    other = scatter(others, levels(others, reference), RATE)[1]
    np.testing.assert_allclose(one, other, rtol=1e-9)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_no_line_has_second_differences(start, slope):
    found = differences((start + slope * T)[None])[0]
    assert np.isnan(found[:2]).all()
    assert found[2:] == pytest.approx(np.zeros(N - 2), abs=1e-8)


def test_white_noise_has_differences_of_its_own_size():
    values = np.random.default_rng(0).normal(size=(1, 50_000))
    assert np.nanmean(differences(values) ** 2) == pytest.approx(1.0, rel=0.03)


def test_an_unknown_sample_makes_three_differences_unknown():
    values = np.ones((1, 20))
    values[0, 8] = np.nan
    assert np.flatnonzero(np.isnan(differences(values)[0])).tolist() == [0, 1, 8, 9, 10]


@pytest.mark.parametrize("samples", [0, 1, 2, 3])
def test_few_samples_have_no_scatter(samples):
    sizes = differences(np.ones((2, samples)))
    assert sizes.shape == (2, samples)
    level = levels(sizes, np.ones(samples, bool))
    assert np.isnan(level).all()
    relative, mean = scatter(sizes, level, RATE)
    assert np.isnan(relative).all()
    assert np.isnan(mean).all()


def test_a_level_takes_enough_differences_and_is_never_below_rounding():
    sizes = np.tile(np.arange(20.0), (3, 1))
    sizes[1, ENOUGH - 1 :] = np.nan
    sizes[2] = 0.0
    found = levels(sizes, np.ones(20, bool))
    assert found[0] == 9.5
    assert np.isnan(found[1])
    assert found[2] == LEAST


def test_a_mean_takes_its_share_of_known_samples():
    count = samples_of(RATE)
    sizes = np.ones((1, 2 * count))
    least = round(KNOWN_SHARE * count)
    sizes[0, count : count + (count - least)] = np.nan
    mean = scatter(sizes, np.array([0.5]), RATE)[1][0]
    assert np.isnan(mean[: count - 1]).all()
    assert (mean[count - 1 :] == 2.0).all()
    sizes[0, 2 * count - 1] = np.nan
    mean = scatter(sizes, np.array([0.5]), RATE)[1][0]
    assert np.isnan(mean[-1])


@pytest.mark.parametrize(("rate", "samples"), [(0.1, ENOUGH), (1.0, 15), (10.0, 150)])
def test_a_window_is_of_seconds_and_never_of_too_few_samples(rate, samples):
    assert samples_of(rate) == samples
