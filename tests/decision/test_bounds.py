"""What a flight tells of how far its residuals may stray, by known answers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.decision.bounds import (
    held_against,
    key_of,
    lasting_mean,
    learn,
    normalised,
    over_spread,
    strayed,
    told_by,
)
from fdi.decision.noise import centres, spread_factors
from fdi.decision.recipes import Learned, PredictedSpread
from fdi.model.expression import Symbol
from fdi.model.parts import Kind, Measurement
from fdi.model.system import Estimate, ParameterValue
from fdi.telemetry import Channel

from .build import RATE, flown, residuals, told_by_hand

RECIPE = PredictedSpread(
    sigmas=5.0, least_factor=0.2, most_factor=4.0, mean_levels=6.0, mean_least=1.2, mean_most=4.0
)
NINETY = 1.645
"""Nine tenths of white noise lie within so many standard deviations."""
N = round(200 * RATE)
T = np.arange(N) / RATE
AIR = {"flights": flown(0.0, 200.0)}
EARLY = T < 25.0
"""Take-off at 0, settled at 5 s: the reference of 20 s is over at 25 s."""


def told(values, *, recipe=RECIPE, **more):
    return told_by(residuals(values, **(AIR | more)), recipe)


def swinging(size):
    """A residual of a size that is its own nine tenths, around zero: no mean shows it."""
    return size * np.where(np.arange(N) % 2, 1.0, -1.0)


# How far a residual is off.


def test_a_residual_is_off_its_centre_the_short_way_round_and_on_the_side_that_counts():
    values = np.array([[3.0, -3.0], [3.0, -3.0], [3.0, -3.0], [3.0, np.nan]])
    centre, circular = np.array([1.0, 1.0, 0.0, 2.0]), np.array([False, True, False, False])
    off, size = strayed(values, centre, circular, np.array([0, 0, -1, 1], np.int8))
    np.testing.assert_allclose(off[0], [2.0, -4.0])
    np.testing.assert_allclose(off[1], [2.0, 2 * np.pi - 4.0])
    np.testing.assert_allclose(size[:2], np.abs(off[:2]))
    assert off[2].tolist() == size[2].tolist() == [0.0, 3.0]
    np.testing.assert_array_equal(off[3], [1.0, np.nan])


def test_what_means_are_taken_of_is_beyond_the_tolerance_over_the_spread_and_clipped():
    off = np.array([[3.0, -3.0, 0.5, 100.0, -100.0, np.nan, 3.0, 3.0]])
    spread = np.array([[2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0, 2.0]])
    settled = np.array([True] * 7 + [False])
    found = normalised(off, np.ones((1, 8)), spread, settled)
    np.testing.assert_array_equal(found[0], [1.0, -1.0, 0.0, 5.0, -5.0, *[np.nan] * 3])


def test_a_mean_is_known_where_seven_tenths_of_it_are():
    ratio = np.full((1, 20), 2.0)
    ratio[0, 2:5] = np.nan
    assert np.flatnonzero(np.isfinite(lasting_mean(ratio, 10)[0])).tolist() == [*range(9, 20)]
    ratio[0, 5] = np.nan
    assert np.flatnonzero(np.isfinite(lasting_mean(ratio, 10)[0])).tolist() == [*range(12, 20)]


def test_what_has_no_spread_is_not_told_in_spreads():
    found = over_spread(np.array([[4.0, 4.0, -4.0]]), np.array([[2.0, 0.0, np.nan]]))
    np.testing.assert_array_equal(found, [[2.0, np.nan, np.nan]])


# The noise.


@pytest.mark.parametrize("size", [0.1, 0.5, 2.0, 3.9, 40.0])
def test_a_threshold_is_so_many_spreads_as_the_noise_shows_within_its_bounds(size):
    shown = np.clip(size, 0.2, 4.0)
    bounds = learn(residuals(swinging(NINETY * size), spread=0.5, **AIR), RECIPE)
    assert bounds.noise[0] == pytest.approx(np.full(N, 5.0 * 0.5 * np.clip(2 * size, 0.2, 4.0)))
    one = learn(residuals(swinging(NINETY * size), **AIR), RECIPE)
    assert one.noise[0] == pytest.approx(np.full(N, 5.0 * shown))


@pytest.mark.parametrize(("is_told", "share"), [(True, 1.0), (False, 0.2)])
def test_how_noisy_a_flight_is_shows_where_noise_is_most_of_what_is_expected(is_told, share):
    """As noisy as stated; beside that a constant may swing by ten times as much, as a rule."""
    turned = np.where(np.arange(N) % 10, 10.0, 0.0)
    values = NINETY * np.where(np.arange(N) // 10 % 2, 1.0, -1.0)
    found = told(values, spread=np.hypot(1.0, turned), swung=turned if is_told else None)
    assert found.quieter[0] == pytest.approx(share, abs=0.01)


def test_a_flight_may_become_three_times_as_rough_as_it_was_and_not_more():
    for later, kept in ((1.2, 1.2), (1.4, 1.4), (1.6, 1.5), (3.0, 1.5)):
        found = told(np.where(EARLY, 0.5, later) * swinging(NINETY))
        assert found.factor[0] == pytest.approx(5.0 * kept)
    # of what was quiet as can be three times the least that is believed
    quiet = told(np.where(EARLY, 0.0, 3.0) * swinging(NINETY))
    assert quiet.quieter[0] == pytest.approx(3 * 0.2)


def test_fewer_than_half_of_the_blocks_may_be_a_fault_that_does_not_widen_the_spread():
    known = np.ones(60, bool)
    ratio = np.concatenate([np.ones(36), np.full(24, 50.0)])[None] * NINETY
    assert spread_factors(ratio, np.ones((1, 60)), known, 6)[0] == pytest.approx(1.0)
    assert spread_factors(ratio, np.full((1, 60), 2.0), known, 6)[0] == pytest.approx(0.5)


@pytest.mark.parametrize(("samples", "is_told"), [(11, False), (12, True)])
def test_fewer_than_two_blocks_tell_no_factor(samples, is_told):
    known = np.arange(60) < samples
    found = spread_factors(np.ones((1, 60)), np.ones((1, 60)), known, 6)
    assert np.isfinite(found[0]) == is_told
    assert np.isnan(spread_factors(np.ones((1, 60)), np.zeros((1, 60)), known, 6)[0])


def test_a_block_is_as_wide_as_nine_tenths_of_it():
    block = np.arange(11.0)  # 9.0 is the quantile of 0.9 among 0 to 10
    found = spread_factors(np.tile(block, 3)[None], np.ones((1, 33)), np.ones(33, bool), 11)
    assert found[0] == pytest.approx(9.0 / NINETY)


def test_what_a_manoeuvre_adds_to_the_spread_counts_whole():
    """Half as noisy as the calm 3 that were predicted; the 4 that a turn adds stay 4."""
    quiet = told_by_hand(calm=np.array([3.0]), quieter=np.array([0.5]))
    found = quiet.noise(np.array([[2.0, 3.0, 5.0]]))
    np.testing.assert_allclose(found[0], [5.0, 7.5, 5 * np.hypot(1.5, 4.0)])


def test_the_calm_spread_is_the_median_of_the_reference():
    spread = np.where(EARLY, 2.0, 9.0)
    spread[round(6 * RATE) : round(10 * RATE)] = 50.0
    assert told(np.zeros(N), spread=spread).calm[0] == 2.0
    spread[EARLY] = np.inf
    assert np.isnan(told(np.zeros(N), spread=spread).calm[0])


# The mean.


@pytest.mark.parametrize(
    ("level", "most"), [(0.1, 1.2), (0.3, 1.8), (0.6, 3.6), (0.66, 3.96), (0.68, np.nan)]
)
def test_a_mean_may_be_six_times_what_means_are_within_its_bounds(level, most):
    """Where the first third has more than the bound, it is the nature of the test."""
    assert told(np.full(N, level)).mean_most[0] == pytest.approx(most, nan_ok=True)


def test_means_may_become_three_times_as_large_as_in_the_first_third():
    for later, most in ((0.5, 3.0), (0.59, 3.54), (0.63, 3.6), (2.0, 3.6)):
        found = told(np.where(T < 66.0, 0.2, later)).mean_most[0]
        assert found == pytest.approx(most)


def test_the_level_of_the_means_is_that_of_the_calmer_four_tenths():
    steps = np.where(T < 100.0, 0.3, 0.5)
    assert told(steps).mean_most[0] == pytest.approx(6 * 0.3)
    assert told(np.where(T < 70.0, 0.3, 0.5)).mean_most[0] == pytest.approx(6 * 0.5)


def test_the_threshold_of_a_mean_is_in_the_unit_of_the_residual():
    bounds = learn(residuals(np.full(N, 0.6), spread=2.0, **AIR), RECIPE)
    settled = T >= 5.0 + 10.0
    assert bounds.mean_spread[0, settled] == pytest.approx(np.full(settled.sum(), 2.0))
    assert bounds.mean_bound[0, settled] == pytest.approx(np.full(settled.sum(), 2.0 * 1.8))


def test_what_has_no_noise_has_no_mean():
    for stated in ({"kind": Kind.LIMIT}, {"spread": 0.0}):
        bounds = learn(residuals(np.zeros(N), **stated, **AIR), RECIPE)
        assert np.isnan(bounds.mean_bound).all()
        assert np.isnan(bounds.told.mean_most).all()


# The constant.


def test_a_constant_is_the_median_of_the_reference_within_what_is_allowed():
    values = np.array([[4.0, 5.0, 9.0, 100.0]] * 3)
    allowance = np.array([[20.0] * 4, [np.nan, 3.0, 2.0, 1.0], [np.nan] * 4])
    reference = np.array([True, True, True, False])
    assert centres(values, allowance, reference).tolist() == [5.0, 3.0, 0.0]
    assert centres(-values, allowance, reference).tolist() == [-5.0, -3.0, 0.0]


def test_a_constant_that_moves_is_that_of_the_first_block():
    """By a threshold and its tolerance; by less it is the median of all."""
    for moved, centre in ((5.4, 6.4), (5.6, 1.0)):
        values = np.where(T < 12.0, 1.0, 1.0 + moved)
        assert told(values, allowance=20.0, tolerance=0.5).centre[0] == pytest.approx(centre)


def test_a_constant_that_swings_may_move_by_half_a_turn_at_the_most():
    swing = np.where(T < 12.0, 0.0, 1.0)
    for moved, is_taken in ((3.1, True), (3.2, False)):
        values = np.where(T < 12.0, 1.0, 1.0 + moved)
        found = told(values, allowance=20.0, swing=swing, spread=0.1).centre[0]
        assert found == pytest.approx(1.0 + moved if is_taken else 1.0)


@pytest.mark.parametrize(("known_s", "centre"), [(2.4, 9.0), (2.6, 1.0)])
def test_half_of_the_first_block_must_be_known_to_tell_that_a_constant_moved(known_s, centre):
    values = np.where(T < 12.0, 1.0, 9.0)
    values[10.0 - known_s > T] = np.nan
    assert told(values, allowance=20.0).centre[0] == pytest.approx(centre)


def test_a_learned_test_keeps_its_centre_its_scale_and_its_stray():
    learned = {"e0: ": Learned(2.0, 0.7, (-1.0, 1.5))}
    found = told(np.full(N, 4.0), allowance=9.0, recipe=replace(RECIPE, learned=learned))
    assert (found.centre[0], found.stray[0]) == (1.5, 0.7)
    plain, wider = (
        told(swinging(NINETY), recipe=replace(RECIPE, learned=known)) for known in ({}, learned)
    )
    assert wider.factor[0] == 2.0 * plain.factor[0]
    assert wider.mean_most[0] == 2.0 * plain.mean_most[0]
    given_ = residuals(swinging(NINETY), tolerance=0.2, **AIR)
    assert (held_against(given_, wider, RECIPE).tolerance == 0.7).all()
    assert (held_against(given_, plain, RECIPE).tolerance == 0.2).all()


def test_a_key_names_the_equation_and_its_faults_in_their_order():
    bank = residuals(np.zeros(N)).bank
    generator = replace(bank.generators[0], faults=("gps.z", "baro.a"))
    assert key_of(bank.system, generator) == "e0: baro.a, gps.z"


def test_a_constant_that_swings_is_uncertain_by_a_third_of_what_it_was():
    given_ = residuals(np.full(N, 6.0), spread=1.5, allowance=9.0, swing=0.5, **AIR)
    assert learn(given_, RECIPE).spread[0] == pytest.approx(np.full(N, np.hypot(1.5, 1.0)))


@pytest.mark.parametrize(("words", "side"), [("", 0), ("above", -1), ("below", 1)])
def test_a_residual_is_right_minus_left(words, side):
    assert told(np.zeros(N), side=words).side[0] == side


@pytest.mark.parametrize(("kind", "stated"), [(Kind.LIMIT, True), (Kind.EQUALITY, True)])
def test_only_what_is_steady_and_of_noise_has_a_level_of_scatter(kind, stated):
    rough = np.random.default_rng(0).normal(size=N)
    assert told(rough, kind=kind, steady=True).stated[0] == stated
    for steady, own, is_judged in (
        (True, Kind.RELATION, True),
        (False, Kind.RELATION, False),
        (True, kind, False),
        (False, kind, False),
    ):
        assert np.isfinite(told(rough, kind=own, steady=steady).level[0]) == is_judged


# What does not hold from the beginning on.


@pytest.mark.parametrize(("share", "unfit"), [(0.76, False), (0.84, True)])
def test_a_limit_is_a_condition_where_it_is_exceeded_for_four_fifths_of_the_beginning(share, unfit):
    values = np.where(5.0 + 20.0 * share > T, 3.0, 0.0)
    assert told(values, kind=Kind.LIMIT).unfit[0] == unfit


@pytest.mark.parametrize(("command", "unfit"), [(False, True), (True, False)])
def test_an_order_that_comes_in_flight_is_no_condition_however_early(command, unfit):
    """Given 4.5 s after take-off, half a second before the reference begins."""
    values = np.where(T > 4.5, 3.0, 0.0)
    assert told(values, kind=Kind.LIMIT, command=command).unfit[0] == unfit


@pytest.mark.parametrize(("takeoff", "unfit"), [(0.0, True), (None, False)])
def test_what_begins_in_a_log_that_begins_in_the_air_is_no_condition(takeoff, unfit):
    """After a take-off a vehicle settles; one that flies already has nothing to settle from."""
    flights = tuple(replace(one, takeoff=takeoff) for one in flown(0.0, 200.0))
    values = np.where(T > 4.5, 3.0, 0.0)
    assert told(values, kind=Kind.LIMIT, flights=flights).unfit[0] == unfit


def test_an_order_that_stands_as_the_flight_begins_is_a_condition():
    assert told(np.full(N, 3.0), kind=Kind.LIMIT, command=True).unfit[0]


@pytest.mark.parametrize(("known", "unfit"), [(0.46, False), (0.54, True)])
def test_half_of_the_beginning_must_be_known_to_tell_a_condition(known, unfit):
    values = np.where(5.0 + 20.0 * known > T, 3.0, np.nan)
    assert told(values, kind=Kind.LIMIT).unfit[0] == unfit


def test_what_is_never_known_in_the_beginning_is_no_condition():
    assert not told(np.where(EARLY, np.nan, 3.0), kind=Kind.LIMIT).unfit[0]


MASS = ParameterValue(1.0, "m", "policy", 0.1, (0.0, 2.0), learned=Estimate(1.0, 0.1, 3))
UNTAUGHT = replace(MASS, learned=None)


@pytest.mark.parametrize(
    ("parameters", "uses", "unfit"),
    [
        ({"mass": MASS}, "mass", False),
        ({"mass": MASS}, "length", True),
        ({"mass": UNTAUGHT}, "mass", True),
        ({"mass": MASS, "other": UNTAUGHT}, "mass", False),  # which it does not need
    ],
)
def test_what_other_flights_taught_is_no_condition_where_a_test_needs_it(parameters, uses, unfit):
    given_ = residuals(np.full(N, 60.0), unsure=0.5, **AIR)
    system, (generator,) = given_.bank.system, given_.bank.generators
    equations = list(system.equations)
    number = generator.residual
    equations[number] = replace(equations[number], right=Symbol(uses))
    system = replace(system, parameters=parameters, equations=tuple(equations))
    generator = replace(generator, equations=(number,))
    bank = replace(given_.bank, system=system, generators=(generator,))
    assert learn(replace(given_, bank=bank), RECIPE).told.unfit[0] == unfit


@pytest.mark.parametrize(("size", "unfit"), [(6.4, False), (6.7, True)])
def test_a_test_that_is_four_times_as_wide_as_stated_does_not_hold(size, unfit):
    assert told(np.full(N, size)).unfit[0] == unfit


@pytest.mark.parametrize("supports", [True, False])
def test_who_uses_all_channels_of_a_support_that_does_not_hold_is_not_judged(supports):
    """A compass that does not show the field shows no heading either; another one does."""
    values = np.zeros((3, N))
    values[0] = 60.0
    given_ = residuals(values, **AIR)
    equations = list(given_.bank.system.equations)
    equations[0] = replace(equations[0], supports=supports)
    for channel in "xy":
        shown = Measurement(Channel("MAG", channel), channel, "compass", "sensor")
        equations.append(replace(equations[1], name=channel, kind=Kind.MEASUREMENT))
        equations[-1] = replace(equations[-1], measurement=shown)
    used = [(0, 3), (1, 3, 4), (2, 4)]
    generators = [
        replace(one, equations=own) for one, own in zip(given_.bank.generators, used, strict=True)
    ]
    system = replace(given_.bank.system, equations=tuple(equations))
    bank = replace(given_.bank, system=system, generators=tuple(generators))
    found = learn(replace(given_, bank=bank), RECIPE).told.unfit
    assert found.tolist() == [True, supports, False]


# All at once.


def test_bounds_of_some_samples_are_those_of_the_whole():
    bounds = learn(residuals(np.array([swinging(1.0), 2 * swinging(1.0)]), **AIR), RECIPE)
    part = bounds.at(slice(40, 90))
    assert part.told is bounds.told
    for name in ("tolerance", "noise", "spread", "mean_spread", "mean_bound"):
        assert getattr(part, name).shape == (2, 50)
        np.testing.assert_array_equal(getattr(part, name), getattr(bounds, name)[:, 40:90])
    np.testing.assert_array_equal(part.settled, bounds.settled[40:90])


@settings(max_examples=25)
@given(st.floats(0.01, 100), st.integers(0, 20))
def test_bounds_have_the_unit_of_the_residual(scale, seed):
    values = np.random.default_rng(seed).normal(size=(2, N))
    one = learn(residuals(values, spread=1.0, allowance=2.0, tolerance=0.3, **AIR), RECIPE)
    stated = {"spread": scale, "allowance": 2.0 * scale, "tolerance": 0.3 * scale}
    other = learn(residuals(scale * values, **stated, **AIR), RECIPE)
    np.testing.assert_allclose(other.told.centre, scale * one.told.centre, rtol=1e-9)
    np.testing.assert_allclose(other.noise, scale * one.noise, rtol=1e-9)
    np.testing.assert_allclose(other.mean_bound, scale * one.mean_bound, rtol=1e-9)
