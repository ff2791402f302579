"""Parameters are fitted to the flight's beginning, as sure as that makes them, and then frozen."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.decision import load_policy
from fdi.decision.bounds import learn
from fdi.errors import ModelError
from fdi.model.parameters import with_learned
from fdi.model.system import Estimate
from fdi.residuals import Differentiation, build_bank
from fdi.residuals.between import STRETCH_S
from fdi.residuals.departed import departed
from fdi.residuals.identify import fit_linear, fit_with_halves, identified
from fdi.telemetry.events import SETTLING_S

from .build import airframe
from .test_evaluate import RATE, signals

RECIPE = Differentiation()
TEXT = """
format: 1
name: scale
components:
  gauge: {group: sensor}
variables:
  force: {unit: "1"}
  load: {unit: "1"}
  left: {unit: "1"}
parameters:
  zero: {identify: {prior: 1, bounds: [0, 2], zero: left}, unit: "1"}
  gain: {identify: {prior: 2, bounds: [1, 3], zero: left}, unit: "1"}
equations:
  e_1: {text: "left = force - gain*load - zero", solves: [left]}
equalities:
  balanced: {text: "left = 0", solves: [], tolerance: 0.01, component: gauge}
measurements:
  VFR_HUD:
    component: gauge
    fields:
      alt: {variable: load, accuracy: 0.001}
      climb: {variable: force, accuracy: 0.001}
"""
GAIN, ZERO = 2.3, 0.8


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    system = airframe(tmp_path_factory.mktemp("model"), TEXT).observe()
    return build_bank(system, "mtes+cross_checks")


def flown(bank, *, seconds=120, noise=0.02, load=None, off=None, seed=1):
    """A gauge with noise; what ``off`` adds is a fault."""
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    load = np.sin(t / 3) if load is None else np.broadcast_to(np.float64(load), t.shape)
    force = GAIN * load + ZERO + noise * random.normal(size=len(t))
    force = force if off is None else force + off(t)
    return signals(bank.system, {"VFR_HUD.alt": load, "VFR_HUD.climb": force})


def told(bank, given_):
    found = identified(bank, given_, RECIPE).system
    return found.parameters["gain"], found.parameters["zero"], found.warnings


def test_gain_and_zero_are_found_as_well_as_is_said(bank):
    gain, zero, warnings = told(bank, flown(bank))
    assert gain.source == zero.source == "identified"
    assert abs(gain.value - GAIN) < 3 * gain.std < 0.1
    assert abs(zero.value - ZERO) < 3 * zero.std < 0.1
    assert not warnings


def test_what_the_flight_does_not_excite_keeps_the_prior_and_its_width(bank):
    """Without a load nothing tells the gain."""
    gain, zero, _ = told(bank, flown(bank, load=0.0))
    assert gain.value == pytest.approx(2.0)
    assert gain.std == pytest.approx(0.5)
    assert zero.value == pytest.approx(ZERO, abs=0.05)


def test_what_only_the_sum_tells_is_known_as_the_sum(bank):
    """Under a constant load gain and zero make up for each other: both stay wide."""
    gain, zero, _ = told(bank, flown(bank, load=1.0))
    assert gain.std > 0.3
    assert zero.std > 0.3
    assert gain.value + zero.value == pytest.approx(GAIN + ZERO, abs=0.05)


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_a_fault_after_the_beginning_changes_nothing(bank, size):
    clean = told(bank, flown(bank))[:2]
    faulty = told(bank, flown(bank, off=lambda t: size * (t > 60)))[:2]
    assert faulty == clean


def test_what_is_known_later_only_is_fitted_to_its_own_first_seconds(bank):
    """The wing of a VTOL bears it after a minute; what comes 20 s after that is no reference."""
    begins = 60.0

    def later(size):
        fails = begins + STRETCH_S + 1
        return lambda t: np.where(t < begins, np.nan, np.where(t > fails, size, 0.0))

    gain, zero, warnings = told(bank, flown(bank, off=later(0.0)))
    assert gain.source == zero.source == "identified"
    assert abs(gain.value - GAIN) < 3 * gain.std < 0.1
    assert not warnings
    assert told(bank, flown(bank, off=later(5.0)))[:2] == (gain, zero)


def test_a_fault_that_begins_within_the_beginning_makes_the_values_unsure(bank):
    clean = told(bank, flown(bank, load=0.0))[1]
    half = SETTLING_S + STRETCH_S / 2
    faulty = told(bank, flown(bank, load=0.0, off=lambda t: 0.4 * (t > half)))[1]
    assert faulty.std > 10 * clean.std
    assert abs(faulty.value - ZERO) < 2.1 * faulty.std
    # the calmer half tells the noise, so that what came is not taken for it
    assert faulty.wanders < 2 * clean.wanders


def test_a_spike_within_the_beginning_does_not_count(bank):
    clean = told(bank, flown(bank))[:2]
    spiked = told(bank, flown(bank, off=lambda t: 5.0 * (np.abs(t - 11.4) < 0.3)))[:2]
    for before, after in zip(clean, spiked, strict=True):
        assert abs(after.value - before.value) < 2 * before.std


def test_what_contradicts_the_bounds_is_refused_and_told(bank):
    """And with it what was fitted to the same: a gain that holds with that zero only."""
    gain, zero, warnings = told(bank, flown(bank, off=lambda t: np.full(len(t), 4.0)))
    assert (zero.source, zero.value, zero.std) == ("default", 1.0, 0.5)
    assert (gain.source, gain.value, gain.std) == ("default", 2.0, 0.5)
    assert warnings == (
        "zero, gain: not learned from this flight, "
        "whose beginning does not fit the range of the model",
    )


def test_a_log_that_is_too_short_tells_nothing(bank):
    gain, zero, warnings = told(bank, flown(bank, seconds=3))
    assert (gain.source, gain.std) == ("default", 0.5)
    assert (zero.source, zero.std) == ("default", 0.5)
    assert warnings == (
        "zero, gain: not learned from this flight, because its beginning tells too little",
    )


def test_unknown_columns_tell_nothing(bank):
    _, _, warnings = told(bank, flown(bank, off=lambda t: np.full(len(t), np.nan)))
    assert warnings == (
        "zero, gain: not learned from this flight, because its beginning tells too little",
    )


def test_what_is_not_linear_is_not_identified_and_told(tmp_path):
    text = TEXT.replace("left = force - gain*load - zero", "left = force - gain*load - zero**2")
    bank = build_bank(airframe(tmp_path, text).observe(), "mtes+cross_checks")
    gain, _, warnings = told(bank, flown(bank))
    assert gain.source == "default"
    assert warnings == (
        "zero, gain: not learned from this flight, because left is not linear in them",
    )


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("{prior: 3, bounds: [0, 2], zero: left}", "the prior 3 is not within the bounds [0, 2]"),
        ("{prior: 1, bounds: [2, 0], zero: left}", "the prior 1 is not within the bounds [2, 0]"),
        ("{prior: 1, bounds: [0, 2], zero: gain}", "unknown variable 'gain'"),
        ("{prior: 1, bounds: [0, 2]}", "identify.zero"),
    ],
)
def test_what_cannot_be_identified_is_one_problem_with_its_line(tmp_path, entry, said):
    with pytest.raises(ModelError) as error:
        airframe(tmp_path, TEXT.replace("{prior: 1, bounds: [0, 2], zero: left}", entry))
    assert "m.yaml:11: parameters.zero" in str(error.value)
    assert said in str(error.value)


def test_what_nothing_uses_is_not_identified(tmp_path):
    text = TEXT.replace("- gain*load - zero", "- gain*load")
    with pytest.raises(
        ModelError, match=r"m.yaml:11: parameter 'zero' is identified, and in no eq"
    ):
        airframe(tmp_path, text)


def taught(bank, **learned):
    """The bank with what earlier flights told."""
    return replace(bank, system=with_learned(bank.system, learned))


def test_what_was_learned_is_the_prior_of_what_the_flight_does_not_tell(bank):
    """Without a load nothing tells the gain but the flights before."""
    gain, zero, _ = told(taught(bank, gain=Estimate(2.2, 0.01, 5)), flown(bank, load=0.0))
    assert (gain.value, gain.std) == (pytest.approx(2.2), pytest.approx(0.01))
    assert zero.value == pytest.approx(ZERO, abs=0.05)
    assert zero.learned is None


def test_what_was_learned_makes_the_other_parameter_known(bank):
    """Under a constant load the flight tells the sum of gain and zero, others the gain."""
    learned = Estimate(GAIN, 0.01, 5)
    gain, zero, _ = told(taught(bank, gain=learned), flown(bank, load=1.0))
    assert zero.value == pytest.approx(ZERO, abs=0.05)
    assert zero.std < 0.05
    assert gain.source == "identified"


def test_a_flight_within_the_learned_spread_is_identified(bank):
    _, zero, _ = told(taught(bank, zero=Estimate(ZERO + 0.02, 0.05, 5)), flown(bank))
    assert zero.source == "identified"
    assert zero.value == pytest.approx(ZERO, abs=0.01)
    assert zero.flight.value == pytest.approx(ZERO, abs=0.01)


@pytest.mark.parametrize("off", [0.3, -0.3])
def test_a_fault_since_take_off_does_not_become_its_own_reference(bank, off):
    learned = Estimate(ZERO, 0.02, 5)
    given_ = flown(bank, off=lambda t: np.full(len(t), off))
    assert told(bank, given_)[1].value == pytest.approx(ZERO + off, abs=0.02)
    _, zero, warnings = told(taught(bank, zero=learned), given_)
    assert (zero.source, zero.value, zero.std) == ("policy", ZERO, 0.02)
    # what the flight tells by itself is kept for a person to compare
    assert zero.flight.value == pytest.approx(ZERO + off, abs=0.02)
    assert warnings == ()


def test_parameters_are_far_off_together(bank):
    """Each within two deviations; both at 1.9 of them is what few healthy flights have."""
    off = {"gain": Estimate(GAIN - 0.19, 0.1), "zero": Estimate(ZERO - 0.19, 0.1)}
    near = {"gain": Estimate(GAIN, 0.1), "zero": Estimate(ZERO - 0.19, 0.1)}
    given_ = flown(bank)
    assert [p.source for p in told(taught(bank, **off), given_)[:2]] == ["policy"] * 2
    assert [p.source for p in told(taught(bank, **near), given_)[:2]] == ["identified"] * 2


def test_one_parameter_is_not_adapted_beyond_two_learned_deviations(bank):
    """At 2.3 of them, the other as learned: no few healthy flights, and still no reference."""
    learned = {"gain": Estimate(GAIN, 0.1), "zero": Estimate(ZERO - 0.23, 0.1)}
    gain, zero, warnings = told(taught(bank, **learned), flown(bank))
    assert gain.source == "identified"
    assert abs(zero.value - learned["zero"].value) <= 0.2
    assert (zero.std, zero.shares) == (0.1, ())  # its own, not what the refused fit shares out
    said = (
        "zero: not learned from this flight, whose beginning does not fit "
        "the range of two deviations of what earlier flights taught"
    )
    assert warnings == (said,)


def test_a_fault_since_take_off_is_judged_with_what_was_learned(bank):
    """And not taken for a test that does not fit the vehicle, as without."""
    given_ = flown(bank, off=lambda t: np.full(len(t), 0.3))
    learned = {"zero": Estimate(ZERO, 0.02, 5), "gain": Estimate(GAIN, 0.02, 5)}
    row = [bank.system.equations[g.residual].name for g in bank.generators].index("balanced")
    known = identified(taught(bank, **learned), given_, RECIPE).evaluate(given_, RECIPE)
    recipe = load_policy("default").decision
    assert np.median(np.abs(known.values[row])) == pytest.approx(0.3, abs=0.02)
    assert not learn(known, recipe).told.unfit[row]
    alone = identified(bank, given_, RECIPE).evaluate(given_, RECIPE)
    assert np.median(np.abs(alone.values[row])) < 0.05


@pytest.mark.parametrize(("names", "unfit"), [(("zero", "gain"), False), (("gain",), True)])
def test_only_what_was_learned_whole_is_held_against_the_flight(bank, names, unfit):
    """With one parameter that nothing taught it may be the test that does not fit the vehicle."""
    learned = {"zero": Estimate(ZERO, 0.02, 5), "gain": Estimate(GAIN, 0.02, 5)}
    own = taught(bank, **{name: learned[name] for name in names})
    given_ = flown(bank, off=lambda t: np.full(len(t), 30.0))
    known = identified(own, given_, RECIPE).evaluate(given_, RECIPE)
    row = [bank.system.equations[g.residual].name for g in bank.generators].index("balanced")
    assert learn(known, load_policy("default").decision).told.unfit[row] == unfit


def test_what_departs_is_told_with_the_test_that_is_farthest_off(bank):
    given_ = flown(bank, off=lambda t: np.full(len(t), 0.3))
    known = identified(taught(bank, zero=Estimate(ZERO, 0.02, 5)), given_, RECIPE)
    found = departed(known.evaluate(given_, RECIPE))
    assert found.parameters == ("zero",)
    assert found.share < 0.01
    assert found.tests[0].component == "gauge"
    assert found.tests[0].value == pytest.approx(0.29, abs=0.02)  # beyond the tolerance of 0.01
    assert "zero is 1.1" in found.text
    assert "instead of 0.8 +- 0.02 on 5 flights" in found.text
    assert departed(identified(bank, given_, RECIPE).evaluate(given_, RECIPE)) is None


@pytest.mark.parametrize(
    ("learned", "said"),
    [
        (
            {"mass": Estimate(1.0, 0.1)},
            "no parameter .mass. to identify in scale, which identifies zero",
        ),
        ({"gain": Estimate(3.5, 0.1)}, r"the value 3.5 of gain is not within the bounds \[1, 3\]"),
    ],
)
def test_what_the_model_cannot_have_is_refused(bank, learned, said):
    with pytest.raises(ModelError, match=said):
        with_learned(bank.system, learned)


def test_a_bank_without_unknown_parameters_is_left_alone(bank):
    exact = {n: replace(p, bounds=None, std=None) for n, p in bank.system.parameters.items()}
    own = replace(bank, system=replace(bank.system, parameters=exact))
    assert identified(own, flown(bank), RECIPE) is own


def test_parameters_of_one_fit_err_together(bank):
    """Where it was calibrated a gauge is known; elsewhere by as much as its gain is not."""
    after = round(60 * RATE)
    load = np.ones(round(120 * RATE))
    load[after:] = 3.0
    given_ = flown(bank, load=load)
    fitted = identified(bank, given_, RECIPE)
    gain, zero = (fitted.system.parameters[name] for name in ("gain", "zero"))
    assert gain.std == pytest.approx(zero.std, rel=0.01)  # only their sum was seen
    assert gain.std > 0.3
    unsure = fitted.evaluate(given_, RECIPE).unsure
    row = next(
        i
        for i, g in enumerate(bank.generators)
        if bank.system.equations[g.residual].name == "balanced"
    )
    assert unsure[row, :after].max() < 0.02
    assert unsure[row, after:] == pytest.approx((3 - 1) * gain.std, rel=0.02)


def test_how_well_a_parameter_is_known_widens_what_may_last_and_not_the_noise(bank):
    """One unknown constant is no noise: no mean of many samples wears it off."""
    given_ = flown(bank, load=1.0)
    fitted = identified(bank, given_, RECIPE)
    exact = {n: replace(p, std=None) for n, p in fitted.system.parameters.items()}
    sure = replace(fitted, system=replace(fitted.system, parameters=exact))
    unsure, certain = fitted.evaluate(given_, RECIPE), sure.evaluate(given_, RECIPE)
    np.testing.assert_allclose(unsure.values, certain.values)
    row = next(
        i
        for i, g in enumerate(bank.generators)
        if bank.system.equations[g.residual].name == "balanced"
    )
    assert unsure.lasting[row] == pytest.approx(0.01 + 2 * unsure.unsure[row])
    assert (unsure.lasting[row] > certain.lasting[row]).all()
    assert certain.lasting[row] == pytest.approx(0.01)
    recipe = load_policy("default").decision
    assert learn(unsure, recipe).tolerance[row] == pytest.approx(unsure.lasting[row])


def test_what_the_fit_leaves_counts_as_noise(bank):
    given_ = flown(bank, load=0.0, noise=0.05)
    fitted = identified(bank, given_, RECIPE)
    spread = [
        own.evaluate(given_, RECIPE).spread[
            [bank.system.equations[g.residual].name for g in bank.generators].index("balanced")
        ]
        for own in (bank, fitted)
    ]
    # blocks of a second average 1 / RATE samples of noise
    block = 0.05 / np.sqrt(RATE)
    assert np.median(spread[1] ** 2 - spread[0] ** 2) ** 0.5 == pytest.approx(block, rel=0.6)


def blocks_of(random, count, values, noise):
    slopes = random.normal(size=(count, len(values)))
    wrong = -slopes @ values + noise * random.normal(size=count)
    return np.column_stack([wrong, slopes])


@given(seed=st.integers(0, 10_000), noise=st.floats(1e-6, 1e-3))
def test_many_good_blocks_give_the_values(seed, noise):
    random = np.random.default_rng(seed)
    values = random.uniform(-1, 1, 3)
    fit = fit_linear(blocks_of(random, 60, values, noise), np.full(3, 10.0))
    assert np.abs(fit.value - values).max() < 6 * noise


def test_two_sigma_hold_the_truth_as_often_as_they_say():
    """For few blocks too: 95 % are promised, and the rejection of outliers costs little of it."""
    random, held = np.random.default_rng(5), []
    for _ in range(400):
        values = random.uniform(-1, 1, 2)
        fit = fit_linear(blocks_of(random, 8, values, 0.3), np.full(2, 10.0))
        held.append(np.abs(fit.value - values) <= 2 * fit.std)
    assert 0.9 <= np.mean(held) <= 0.99


def held(blocks_with, values):
    """Return how often two standard errors hold the values."""
    random, found = np.random.default_rng(7), []
    for _ in range(300):
        fit = fit_linear(blocks_with(random, values), np.full(len(values), 10.0))
        found.append(np.abs(fit.value - values) <= 2 * fit.std)
    return np.mean(found)


def test_blocks_that_tell_most_and_err_most_make_no_value_too_sure():
    """A few turns in a calm flight: rates between records err as the turns themselves."""

    def turning(random, values):
        turns = np.where(np.arange(20) % 5 < 2, 1.0, 0.1)
        slopes = random.normal(size=20) * turns
        err = np.hypot(0.2, 0.3 * slopes) * random.normal(size=20)
        return np.column_stack([-slopes * values[0] + err, slopes])

    assert held(turning, np.array([0.5])) >= 0.85


def test_neighbouring_blocks_that_err_alike_count_as_fewer():
    """Several slow parameters take away much of what neighbours have in common."""

    def gusty(random, values):
        t = np.linspace(0, 1, 20)
        slopes = np.column_stack([np.ones(20), t, np.cos(np.pi * t), np.cos(2 * np.pi * t)])
        err = random.normal(size=20)
        for i in range(1, 20):
            err[i] += 0.5 * err[i - 1]
        return np.column_stack([-slopes @ values + 0.1 * err, slopes])

    assert held(gusty, np.array([0.5, -0.2, 0.1, 0.3])) >= 0.9


def test_halves_that_agree_leave_the_deviation_alone():
    random = np.random.default_rng(2)
    blocks = blocks_of(random, 20, np.array([0.5]), 0.1)
    assert fit_with_halves(blocks, np.array([1.0])).std == fit_linear(blocks, np.array([1.0])).std


def test_a_perfect_fit_is_no_division_by_nothing():
    fit = fit_linear(np.array([[1.0, -2.0]] * 6), np.array([1.0]))
    assert fit.value == pytest.approx([0.5])
    assert np.isfinite(fit.std).all()


def test_nothing_at_all_is_no_evidence():
    """Motors that stand still: no values make a difference."""
    fit = fit_linear(np.zeros((8, 2)), np.array([0.2]))
    assert (fit.value.item(), fit.std.item(), fit.wanders.item()) == (0.0, 0.2, 0.0)


@pytest.fixture(scope="module")
def against_others(tmp_path_factory):
    """The same, of which the test is asked only against what earlier flights taught."""
    text = TEXT.replace("tolerance: 0.01, component", "tolerance: 0.01, taught: true, component")
    assert text != TEXT
    return build_bank(airframe(tmp_path_factory.mktemp("model"), text).observe(), "mtes")


@pytest.mark.parametrize(("off", "asked"), [(0.0, False), (0.3, True)])
def test_what_earlier_flights_taught_is_asked_where_this_one_departs(against_others, off, asked):
    """In the stretch that tells so, and not of what comes later."""
    given_ = flown(against_others, off=lambda t: np.where(t < 60.0, off, 5.0))
    own = taught(against_others, zero=Estimate(ZERO, 0.02, 5), gain=Estimate(GAIN, 0.02, 5))
    known = identified(own, given_, RECIPE).evaluate(given_, RECIPE)
    (values,) = known.values
    judged = np.flatnonzero(np.isfinite(values))
    assert bool(judged.size) == asked
    if asked:
        assert np.ptp(given_.t[judged]) == pytest.approx(20.0, abs=0.5)
        assert np.median(np.abs(values[judged])) == pytest.approx(off, abs=0.02)


def test_without_earlier_flights_it_is_not_asked(against_others):
    given_ = flown(against_others, off=lambda t: np.full(len(t), 0.3))
    known = identified(against_others, given_, RECIPE).evaluate(given_, RECIPE)
    assert not np.isfinite(known.values).any()
