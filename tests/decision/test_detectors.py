"""When a residual is beyond health: what every detector keeps, then each by its own claims."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.decision.bounds import learn
from fdi.decision.detectors import DETECTORS
from fdi.decision.judging import persistent
from fdi.decision.noise import trailing_mean
from fdi.model.parts import Kind
from fdi.telemetry.airtime import airborne_mask, reference_mask

from .build import DEFAULT as SHIPPED
from .build import PAPER, RATE, flown, residuals, signals

# without a budget thresholds are not scaled: that has its own tests (diagnosis/test_budget.py)
DEFAULT = replace(SHIPPED, decision=replace(SHIPPED.decision, budget_per_hour=None))
POLICIES = {"predicted_spread": DEFAULT, "rank": PAPER}
EVERY = pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES.keys())
RECIPE = DEFAULT.decision
LEAST = round(RECIPE.persistence_s * RATE)  # samples in a row that make an alarm
MINUTE = round(60 * RATE)
HALF_HOUR = 30 * MINUTE
SUDDEN = replace(DEFAULT, decision=replace(RECIPE, mean_least=1e9, mean_most=1e9, least_factor=0.5))
"""The default without its look at means; without noise its threshold is 2.5 spreads."""


def noise(n, seed=0):
    return np.random.default_rng(seed).normal(size=n)


def test_every_detector_is_checked():
    assert set(POLICIES) == set(DETECTORS)


@EVERY
def test_input_is_untouched_and_output_cannot_be_written(policy):
    given_ = residuals(noise(MINUTE))
    before = given_.values.copy()
    alarms = policy.decide(given_)
    assert np.array_equal(given_.values, before)
    for array in (alarms.threshold, alarms.centre, alarms.state, alarms.alarm, alarms.strength):
        assert not array.flags.writeable


@EVERY
def test_order_of_residuals_does_not_matter(policy):
    values = np.array([noise(MINUTE, seed) * (1 + seed) for seed in range(4)])
    order = [2, 0, 3, 1]
    alarms, other = policy.decide(residuals(values)), policy.decide(residuals(values[order]))
    assert np.array_equal(other.state, alarms.state[order])
    assert np.array_equal(other.alarm, alarms.alarm[order])
    assert np.array_equal(other.threshold, alarms.threshold[order])


@EVERY
def test_unknown_samples_are_unknown_and_no_others(policy):
    values = noise(MINUTE)
    values[50:80] = np.nan
    assert np.array_equal(policy.decide(residuals(values)).state[0] == -1, np.isnan(values))


@EVERY
def test_triggered_is_above_the_threshold_and_strength_says_by_how_much(policy):
    values = noise(MINUTE)
    values[100:140] += 30
    policy = SUDDEN if policy is DEFAULT else policy
    alarms = policy.decide(residuals(values))
    over = np.abs(values - alarms.centre[0]) > alarms.threshold[0]
    assert over.any()
    assert np.array_equal(alarms.state[0] == 1, over)
    assert np.array_equal(alarms.strength[0] > 1, over)


@EVERY
def test_alarm_begins_and_ends_with_a_trigger(policy):
    values = noise(MINUTE)
    values[100:140] += 30
    values[110:115] = np.nan
    alarms = policy.decide(residuals(values))
    edges = np.flatnonzero(np.diff(np.pad(alarms.alarm[0], 1).astype(int)))
    assert len(edges)
    assert (alarms.state[0, edges[::2]] == 1).all()
    assert (alarms.state[0, edges[1::2] - 1] == 1).all()


def test_alarms_say_how_many_residuals_raised_one():
    values = np.zeros((3, MINUTE))
    values[1, 100:] = 50.0
    assert repr(SUDDEN.decide(residuals(values))) == "<Alarms: 1 of 3 residuals raised one>"


@EVERY
def test_residual_that_is_never_known_is_unknown_and_raises_nothing(policy):
    alarms = policy.decide(residuals(np.full((2, MINUTE), np.nan), spread=np.nan))
    assert (alarms.state == -1).all()
    assert not alarms.alarm.any()


@EVERY
@pytest.mark.parametrize(("rows", "samples"), [(0, 0), (0, 10), (1, 0), (3, 0), (1, 1)])
def test_nothing_to_decide_on_is_no_failure(policy, rows, samples):
    alarms = policy.decide(residuals(np.zeros((rows, samples))))
    assert alarms.state.shape == alarms.alarm.shape == (rows, samples)
    assert alarms.alarm.dtype == bool
    assert not alarms.alarm.any()


@EVERY
def test_constant_zero_never_triggers(policy):
    alarms = policy.decide(residuals(np.zeros(MINUTE), spread=0.0))
    assert (alarms.state == 0).all()


# The published threshold.


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60), st.integers(0, 10))
def test_rank_threshold_is_the_sample_of_that_rank_among_the_known(values, unknown):
    column = np.array([*values, *[np.nan] * unknown])
    alarms = PAPER.decide(residuals(column))
    rank = max(1, int(0.97 * len(values)))
    expected = sorted(abs(value) for value in values)[rank - 1]
    assert (alarms.threshold == expected).all()


def test_rank_is_strict():
    values = np.arange(1.0, 101.0)
    assert np.flatnonzero(PAPER.decide(residuals(values)).state[0] == 1).tolist() == [97, 98, 99]
    level = PAPER.decide(residuals(np.full(100, 3.0)))
    assert not level.alarm.any()


def test_rank_takes_no_centre_and_every_trigger_is_an_alarm():
    alarms = PAPER.decide(residuals(noise(200), allowance=9.0))
    assert alarms.centre.tolist() == [0.0]
    assert alarms.scale == 1.0
    assert np.array_equal(alarms.alarm, alarms.state == 1)


def test_rank_does_not_see_rounding():
    values = noise(200) * 1e-17
    values[:20] = np.nan
    alarms = PAPER.decide(residuals(values))
    assert (alarms.state[0, :20] == -1).all()
    assert (alarms.state[0, 20:] == 0).all()


def test_rank_strength_is_finite_where_the_threshold_is_zero():
    values = np.zeros(200)
    values[7] = 1.0
    alarms = PAPER.decide(residuals(values))
    assert alarms.alarm[0].nonzero()[0].tolist() == [7]
    assert np.isfinite(alarms.strength[0, 7])


def test_rank_strength_beyond_what_a_float_holds_is_cut():
    values = np.full(MINUTE, 1e-309)
    values[100:104] = 1e300
    assert (PAPER.decide(residuals(values)).strength[0, 100:104] == 1e6).all()


# Thresholds from stated accuracies.


@pytest.mark.parametrize("seed", range(10))
def test_white_noise_of_the_stated_accuracy_raises_no_alarm_in_half_an_hour(seed):
    alarms = DEFAULT.decide(residuals(0.3 * noise(HALF_HOUR, seed), spread=0.3))
    assert not alarms.alarm.any()


@pytest.mark.parametrize("share", [0.1, 0.5])
@pytest.mark.parametrize("seed", range(3))
def test_noise_below_the_stated_accuracy_raises_no_alarm_either(seed, share):
    alarms = DEFAULT.decide(residuals(share * noise(HALF_HOUR, seed)))
    assert not alarms.alarm.any()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("sign", [-1, 1])
def test_step_of_ten_sigma_is_an_alarm_from_its_first_sample(seed, sign):
    values = noise(10 * MINUTE, seed)
    values[5 * MINUTE : 6 * MINUTE] += sign * 10
    alarm = DEFAULT.decide(residuals(values)).alarm[0]
    assert np.flatnonzero(alarm)[0] == 5 * MINUTE
    assert alarm[5 * MINUTE : 6 * MINUTE].all()
    assert not alarm[6 * MINUTE + round(6 * RATE) :].any()


def test_stronger_fault_is_alarmed_wherever_a_weaker_one_is():
    values = noise(10 * MINUTE)
    span = slice(5 * MINUTE, 6 * MINUTE)
    weaker = np.zeros(len(values), bool)
    for size in (0, 4, 6, 8, 12, 20, 100):
        stepped = values.copy()
        stepped[span] += size
        alarm = DEFAULT.decide(residuals(stepped)).alarm[0]
        assert (alarm >= weaker).all()
        weaker = alarm
    assert weaker[span].all()


@pytest.mark.parametrize(("samples", "raised"), [(LEAST - 1, False), (LEAST, True)])
def test_trigger_is_an_alarm_when_it_lasts(samples, raised):
    values = np.zeros(MINUTE)
    values[100 : 100 + samples] = 4.0
    alarms = SUDDEN.decide(residuals(values))
    assert (alarms.state[0] == 1).sum() == samples
    assert alarms.alarm.any() == raised


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_slow_sampling_still_asks_for_the_least_number_of_samples(rate):
    values = np.zeros(100)
    values[50 : 50 + RECIPE.least_samples - 1] = 4.0
    assert not SUDDEN.decide(residuals(values, rate=rate)).alarm.any()
    values[50 : 50 + RECIPE.least_samples] = 4.0
    assert SUDDEN.decide(residuals(values, rate=rate)).alarm.any()


def test_unknown_sample_neither_ends_a_run_nor_counts_for_it():
    values = np.zeros(MINUTE)
    values[100 : 100 + 2 * LEAST - 2 : 2] = 4.0
    values[101 : 100 + 2 * LEAST - 2 : 2] = np.nan
    assert not SUDDEN.decide(residuals(values)).alarm.any()
    values[100 + 2 * LEAST - 2] = 4.0
    alarm = SUDDEN.decide(residuals(values)).alarm[0]
    assert np.flatnonzero(alarm).tolist() == list(range(100, 100 + 2 * LEAST - 1))


def test_gap_between_two_quiet_stretches_is_no_alarm():
    values = noise(10 * MINUTE)
    values[MINUTE : 3 * MINUTE] = np.nan
    alarms = DEFAULT.decide(residuals(values))
    assert not alarms.alarm.any()
    assert (alarms.state[0, MINUTE : 3 * MINUTE] == -1).all()


def test_alarm_is_certain_when_persistence_and_its_data_are_over():
    values = np.zeros(200)
    values[100:140] = 4.0  # beyond the threshold, and not twice
    alarms = SUDDEN.decide(residuals(values, delay=0.5))
    assert np.flatnonzero(alarms.certain[0]).tolist() == list(range(100 + LEAST - 1, 140))
    assert alarms.delay_s.tolist() == [0.5]


@given(
    st.lists(st.sampled_from([1, 0, -1]), max_size=30),
    st.integers(1, 5),
)
def test_persistent_equals_counting_along_the_known_samples(states, least):
    state = np.array(states, dtype=int)
    found, complete = persistent(state == 1, state == -1, least)
    expected, run = np.zeros(len(state), bool), []
    for place, own in [*enumerate(states), (len(states), 0)]:
        if own == 1:
            run.append(place)
        elif own == 0:
            if len(run) >= least:
                expected[run[0] : run[-1] + 1] = True
                assert complete[run[least - 1]]
            run = []
    assert np.array_equal(found, expected)
    assert (complete <= found).all()


def test_without_stated_spread_and_tolerance_any_deviation_triggers():
    values = np.zeros(MINUTE)
    values[100:120] = 1e-3
    alarms = DEFAULT.decide(residuals(values, spread=0.0))
    assert np.flatnonzero(alarms.alarm[0]).tolist() == list(range(100, 120))
    assert np.isfinite(alarms.strength[0, 100:120]).all()


def test_tolerance_is_added_to_the_spread():
    values = np.zeros(2 * MINUTE)
    values[200:240] = 8.0
    assert SUDDEN.decide(residuals(values)).alarm.any()
    assert not SUDDEN.decide(residuals(values, tolerance=6.0)).alarm.any()


@given(st.floats(-30, 30), st.floats(0, 5))
def test_centre_is_the_offset_as_far_as_the_model_allows_one(offset, allowed):
    alarms = DEFAULT.decide(residuals(np.full(2 * MINUTE, offset), allowance=allowed))
    assert alarms.centre[0] == pytest.approx(np.clip(offset, -allowed, allowed))


def test_fault_since_boot_beyond_the_allowance_is_a_condition():
    """Nothing in the flight tells it from a test that does not fit the vehicle: it is said."""
    values = noise(2 * MINUTE) + 5.0 + 1.2 * RECIPE.sigmas * RECIPE.most_factor
    alarms = DEFAULT.decide(residuals(values, allowance=5.0))
    assert alarms.unfit.tolist() == [True]
    assert (alarms.state == -1).all()
    assert not DEFAULT.decide(residuals(values, allowance=30.0)).alarm.any()


@pytest.mark.parametrize("size", [40.0, 4000.0])
@pytest.mark.parametrize("start", [12, 20])
def test_fault_that_begins_soon_after_take_off_is_no_condition(start, size):
    """However large it is, and whether the model allows a constant or none."""
    values = noise(4 * MINUTE)
    values[round(start * RATE) :] += size
    for allowed in (0.0, 2 * size):
        alarms = DEFAULT.decide(residuals(values, allowance=allowed))
        assert alarms.unfit.tolist() == [False]
        assert not alarms.alarm[0, : round(start * RATE)].any()
        assert alarms.alarm[0, round((start + 2) * RATE) :].mean() > 0.9


@pytest.mark.parametrize("size", [0.0, 40.0])
def test_what_a_test_showed_first_tells_a_fault_from_a_condition_whenever_that_was(size):
    """Unknown for 8 s, well for 4 s, then off: it did hold, as far as it was seen."""
    values = noise(4 * MINUTE)
    values[: round(8 * RATE)] = np.nan
    values[round(12 * RATE) :] += size
    assert DEFAULT.decide(residuals(values)).unfit.tolist() == [False]
    assert DEFAULT.decide(residuals(values + 60.0)).unfit.tolist() == [True]


@pytest.mark.parametrize(("start", "judged"), [(0.11, False), (0.15, True)])
def test_means_are_judged_where_the_first_third_of_the_flight_is_mostly_calm(start, judged):
    """A mean of 5 fills 67 % of the first third, or 55 %; so large it may be the test's nature."""
    values = noise(HALF_HOUR)
    values[round(start * HALF_HOUR) :] += 5.0
    (most,) = learn(residuals(values), RECIPE).told.mean_most
    assert np.isfinite(most) == judged


def test_fault_that_turns_a_constant_into_its_opposite_is_no_condition():
    values = noise(4 * MINUTE) - 20.0
    start = round(12 * RATE)
    values[start:] += 40.0
    alarms = DEFAULT.decide(residuals(values, allowance=50.0))
    assert alarms.centre[0] == pytest.approx(-20.0, abs=1.0)
    assert alarms.alarm[0, start:].mean() > 0.9


@pytest.mark.parametrize(("constant", "blamed"), [(1.0, True), (12.0, False)])
def test_constant_that_swings_excuses_as_much_as_it_was(constant, blamed):
    """Upside down a large constant may be as large on the other side, a small one may not."""
    swing = np.repeat([0.0, 2.0], 2 * MINUTE)
    values = noise(4 * MINUTE) + np.where(swing > 0, constant - 8.0, constant)
    given_ = residuals(values, allowance=15.0, swing=swing)
    assert DEFAULT.decide(given_).alarm.any() == blamed
    assert DEFAULT.decide(residuals(values, allowance=15.0)).alarm.any()


@pytest.mark.parametrize("turns", [12, 60])
@pytest.mark.parametrize("allowed", [0.0, 3.0])
def test_compass_that_fails_before_the_vehicle_turns_is_no_condition(turns, allowed):
    """What is off as soon as it turns may not be calibrated; turning later is no excuse."""
    values = 0.05 * noise(4 * MINUTE)
    values[round(12 * RATE) :] += 2.0
    swing = np.where(np.arange(len(values)) < turns * RATE, 0.0, 1.0)
    given_ = residuals(values, spread=0.05, swing=swing, allowance=allowed)
    start = slice(round(14 * RATE), round(50 * RATE))
    assert DEFAULT.decide(given_).alarm[0, start].all() == (turns == 60)


def test_centre_is_taken_in_the_air_and_after_settling():
    """What a sensor shows on the ground and just after take-off says nothing about the flight."""
    values = np.zeros(3 * MINUTE)
    values[: round(65 * RATE)] = 2.0
    given_ = residuals(values, allowance=3.0, flights=flown(60.0, 170.0))
    assert DEFAULT.decide(given_).centre.tolist() == [0.0]
    mask = reference_mask(given_.signals, 20.0)
    assert given_.t[mask][[0, -1]].tolist() == [65.0, 84.75]


@pytest.mark.parametrize(("seconds", "judged"), [(9, False), (11, True)])
def test_constant_that_could_not_be_learned_is_not_held_against_a_test(seconds, judged):
    """A window in the middle of a flight, too short to tell what is normal there."""
    given_ = {"flights": flown(-90.0, 200.0)}
    values = 12.0 + noise(round(seconds * RATE))
    assert DEFAULT.decide(residuals(values, allowance=15.0, **given_)).unfit.tolist() == [
        not judged
    ]
    assert not DEFAULT.decide(residuals(values - 12.0, **given_)).unfit.any()


def test_window_of_a_flight_needs_no_settling():
    given_ = signals(MINUTE, flights=flown(-90.0, 200.0))
    assert given_.t[reference_mask(given_, 20.0)][[0, -1]].tolist() == [0.0, 19.75]
    soon = signals(MINUTE, flights=flown(-2.0, 200.0))
    assert soon.t[reference_mask(soon, 20.0)][0] == 3.0


def test_vehicle_that_never_flies_is_judged_all_the_time():
    assert airborne_mask(signals(40)).all()


def factor(values, spread=1.0, **more):
    """The factor on the spread that a threshold without tolerance shows."""
    return DEFAULT.decide(residuals(values, spread=spread, **more)).threshold[0, 0] / (
        RECIPE.sigmas * spread
    )


@pytest.mark.parametrize("size", [0.0, 0.2, 0.7, 1.0, 2.0, 3.5, 50.0])
def test_factor_is_the_measured_spread_within_its_bounds(size):
    found = factor(size * noise(10 * MINUTE))
    assert found == pytest.approx(np.clip(size, RECIPE.least_factor, RECIPE.most_factor), rel=0.12)
    assert RECIPE.least_factor <= found <= RECIPE.most_factor


@pytest.mark.parametrize("share", [0.3, 0.6, 2.0])
def test_what_a_manoeuvre_adds_to_the_spread_a_calm_beginning_does_not_narrow(share):
    """Quieter than stated: a spread of 5 is a noise of 3 times the share, and a turn's 4."""
    n = 10 * MINUTE
    turning = np.arange(n) > 8 * MINUTE
    spread = np.where(turning, 5.0, 3.0)
    values = np.where(turning, 5.0, 3.0) * share * noise(n)
    threshold = DEFAULT.decide(residuals(values, spread=spread)).threshold[0] / RECIPE.sigmas
    assert threshold[0] == pytest.approx(3.0 * share, rel=0.12)
    expected = np.hypot(3.0 * share, 4.0) if share < 1 else 5.0 * share
    assert threshold[-1] == pytest.approx(expected, rel=0.12)


@pytest.mark.parametrize("start", [0.1, 0.3, 0.6])
def test_fault_in_forty_percent_of_the_flight_does_not_hide_itself(start):
    n = 10 * MINUTE
    values = noise(n)
    span = slice(round(start * n), round((start + 0.4) * n))
    values[span] += 12
    assert factor(values) < 1.3
    assert DEFAULT.decide(residuals(values)).alarm[0, span].mean() > 0.99


def test_flight_too_short_to_judge_takes_the_stated_spread():
    assert factor(3.0 * noise(round(2 * RECIPE.block_s * RATE) - 1)) == 1.0


def test_spread_is_judged_in_the_air_alone():
    values = noise(10 * MINUTE)
    values[: 4 * MINUTE] *= 30
    assert factor(values, flights=flown(240.0, 600.0)) == pytest.approx(1.0, rel=0.12)


def test_limit_keeps_the_bound_that_it_states():
    """Within a limit its residual is zero, which is no reason to narrow the stated spread."""
    alarms = DEFAULT.decide(residuals(np.zeros(10 * MINUTE), kind=Kind.LIMIT))
    assert (alarms.threshold == RECIPE.sigmas).all()
    loud = DEFAULT.decide(residuals(np.abs(9 * noise(10 * MINUTE)), kind=Kind.LIMIT))
    assert (loud.threshold == RECIPE.sigmas).all()


@pytest.mark.parametrize(("first", "unfit"), [(0, True), (40, False)])
def test_limit_that_is_exceeded_from_the_beginning_on_is_a_condition(first, unfit):
    values = np.zeros(5 * MINUTE)
    values[round(first * RATE) : 2 * MINUTE] = 3.0
    alarms = DEFAULT.decide(residuals(values, spread=0.1, allowance=2.0, kind=Kind.LIMIT))
    assert alarms.unfit.tolist() == [unfit]
    assert alarms.alarm.any() != unfit
    assert not alarms.alarm[0, 2 * MINUTE :].any()


@pytest.mark.parametrize("kind", [Kind.LIMIT, Kind.EQUALITY])
@pytest.mark.parametrize("always", [True, False])
def test_what_must_hold_always_is_judged_from_the_beginning_on(kind, always):
    given_ = residuals(np.full(5 * MINUTE, 60.0), kind=kind, always=always)
    alarms = DEFAULT.decide(given_)
    assert (alarms.unfit.tolist(), alarms.alarm.all()) == ([not always], always)


@pytest.mark.parametrize(("lost", "unfit"), [(0.4, True), (0.9, False)])
def test_poor_link_does_not_hide_that_a_limit_is_exceeded_from_the_beginning_on(lost, unfit):
    values = np.full(5 * MINUTE, 3.0)
    values[np.random.default_rng(1).random(values.size) < lost] = np.nan
    alarms = DEFAULT.decide(residuals(values, spread=0.1, kind=Kind.LIMIT))
    assert alarms.unfit.tolist() == [unfit]


def test_side_that_does_not_count_raises_nothing():
    values = np.zeros(5 * MINUTE)
    values[3 * MINUTE :] = 8.0  # right minus left: the left side is below
    assert not DEFAULT.decide(residuals(values, side="above")).alarm.any()
    assert DEFAULT.decide(residuals(values, side="below")).alarm.any()


@pytest.mark.parametrize(("side", "centre"), [("", 4.0), ("below", 4.0), ("above", 0.0)])
def test_side_that_does_not_count_is_no_reference(side, centre):
    values = np.full(5 * MINUTE, 4.0)
    alarms = DEFAULT.decide(residuals(values, allowance=9.0, side=side))
    assert alarms.centre[0] == pytest.approx(centre)


@pytest.mark.parametrize("supports", [True, False])
def test_supporting_test_that_does_not_hold_from_the_beginning_is_a_condition(supports):
    values = np.full(5 * MINUTE, 8.0)
    alarms = DEFAULT.decide(residuals(values, tolerance=5.0, supports=supports))
    assert alarms.unfit[0] == supports


@pytest.mark.parametrize(("supports", "unfit"), [(False, False), (True, True)])
def test_a_test_that_is_not_judged_raises_no_alarm_by_its_mean_either(supports, unfit):
    """Noise is beyond a tolerance of nothing all along: what merely supports is not judged."""
    values = noise(10 * MINUTE, 0)
    values[5 * MINUTE : 6 * MINUTE] += 2.0
    alarms = DEFAULT.decide(residuals(values, supports=supports))
    assert alarms.unfit[0] == unfit
    assert alarms.alarm.any() != unfit
    assert np.isnan(alarms.mean).all() == unfit


@pytest.mark.parametrize("seed", range(3))
def test_small_offset_that_lasts_is_an_alarm_from_about_its_beginning_to_its_end(seed):
    """Two standard deviations: far below the threshold of five, far above any mean in health."""
    values = noise(10 * MINUTE, seed)
    values[5 * MINUTE : 6 * MINUTE] += 2.0
    alarms = DEFAULT.decide(residuals(values))
    place = np.flatnonzero(alarms.alarm[0])
    assert abs(place[0] - 5 * MINUTE) <= 3 * RATE
    assert abs(place[-1] - 6 * MINUTE) <= 3 * RATE
    sure = np.flatnonzero(alarms.certain[0])[0]
    assert 2 * RATE <= sure - 5 * MINUTE <= 10 * RATE
    assert np.nanmax(np.abs(alarms.mean[0])) == pytest.approx(2.0, abs=0.5)


@pytest.mark.parametrize(("size", "samples"), [(4.0, 6), (6.0, 3), (15.0, 2)])
def test_stronger_trigger_needs_less_time(size, samples):
    values = np.zeros(MINUTE)
    values[100 : 100 + samples - 1] = size
    assert not SUDDEN.decide(residuals(values)).alarm.any()
    values[100 : 100 + samples] = size
    assert SUDDEN.decide(residuals(values)).alarm.any()


def test_difference_of_angles_from_their_centre_wraps():
    """At a centre of 1 rad, -3.1 rad are 2.18 rad away, not 4.1."""
    values = np.full(5 * MINUTE, 1.0)
    values[3 * MINUTE :] = -3.1
    stated = {"spread": 0.1, "allowance": 1.0}
    turned = DEFAULT.decide(residuals(values, circular=True, **stated))
    straight = DEFAULT.decide(residuals(values, **stated))
    assert turned.centre.tolist() == straight.centre.tolist() == [1.0]
    off = turned.strength[0, -1] * turned.threshold[0, -1]
    assert off == pytest.approx(2 * np.pi - 4.1)
    assert straight.strength[0, -1] * straight.threshold[0, -1] == pytest.approx(4.1)


def test_a_statement_whose_constant_could_not_be_learned_is_not_judged():
    """Without the flight's beginning nothing tells an offset that health allows from a fault."""
    given_ = residuals(np.full(MINUTE, 3.0), kind=Kind.EQUALITY, allowance=5.0)
    reference = reference_mask(given_.signals, RECIPE.reference_s)
    unlearned = np.where(reference, np.nan, given_.values)
    assert not DEFAULT.decide(given_).unfit.any()
    assert DEFAULT.decide(replace(given_, values=unlearned)).unfit.all()


@given(st.integers(1, 60), st.integers(1, 70), st.integers(0, 9))
def test_trailing_mean_is_that_of_the_known_samples(size, count, seed):
    values = noise(size, seed)
    values[np.random.default_rng(seed).random(size) < 0.3] = np.nan
    found = trailing_mean(values[None], count, 2)[0]
    for i, mean in enumerate(found):
        window = values[max(0, i - count + 1) : i + 1]
        known = window[np.isfinite(window)]
        judged = i + 1 >= count and known.size >= 2
        assert mean == pytest.approx(known.mean() if judged else np.nan, nan_ok=True)


def test_wild_value_spoils_no_mean_that_it_is_not_in():
    values = np.ones(400)
    values[100] = 1e30
    found = trailing_mean(values[None], 40, 1)[0]
    assert (found[140:] == 1).all()
