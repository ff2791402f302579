"""From which size on a fault would have shown: each rule by a known answer."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis.clearing import ruled_out, unpowered
from fdi.diagnosis.concerns import concerns
from fdi.diagnosis.would_show import powered
from fdi.telemetry import Flight

from .build import POLICY, RATE, alarms_of, bank_of, limit_row, model, named, row

SHOWN = {"sun": ["y"], "star": ["y"]}
FLOWN = (Flight(0, 100, takeoff=0.0, landing=100.0),)


def cleared(alarms):
    return {one.component: one for one in ruled_out(alarms, alarms.residuals.bank, ())}


QUIET = replace(POLICY.use, sigmas=0.0)
"""Of a limit only the quantity itself counts, and no noise."""


def limits_of(bank, **more):
    return alarms_of(bank, {}, use=QUIET, **more)


def sizes(alarms, component):
    """How a component's faults would have shown, and from which sizes on."""
    found = cleared(alarms)
    shown = found[component].would_show if component in found else ()
    return {one.how: one.size for one in shown}


def reading(alarms, values):
    """The alarms of a log whose only channel reads so."""
    signals = alarms.residuals.signals
    columns = dict.fromkeys(signals.columns, np.broadcast_to(values, signals.t.shape))
    residuals = replace(alarms.residuals, signals=replace(signals, columns=columns))
    return replace(alarms, residuals=residuals)


def limited(statement, group="airframe", more=""):
    text = model({"gps": ["x"]}, more=f"limits:\n  far: {{variable: x, {statement}}}\n{more}")
    return bank_of(text.replace("gps: {", f"gps: {{group: {group}, "), "mtes")


# What is left to a limit.


def test_a_limit_shows_what_is_left_to_it_in_its_direction():
    """At zero of a limit of 3: a rise of 3 is there."""
    assert sizes(limits_of(limited("max: 3")), "gps") == pytest.approx({"rises": 3.0})
    assert sizes(limits_of(limited("min: -4")), "gps") == pytest.approx({"falls": 4.0})


def test_a_limit_must_be_exceeded_by_what_noise_may_do():
    """Five standard deviations of a channel that is accurate to 1 m."""
    noisy = replace(limits_of(limited("max: 3")), use=POLICY.use)
    assert sizes(noisy, "gps") == pytest.approx({"rises": 8.0})


def test_of_two_limits_each_shows_its_own_direction():
    bank = limited("min: -4, max: 3", "sensor")
    assert sizes(limits_of(bank), "gps") == pytest.approx({"rises": 3.0, "falls": 4.0})
    bank = limited("min: -3, max: 3", "sensor")
    assert sizes(limits_of(bank), "gps") == pytest.approx({"changes": 3.0})


def test_a_sensor_that_is_bounded_on_one_side_only_is_not_cleared():
    """It may read too low as well."""
    assert not sizes(limits_of(limited("max: 3", "sensor")), "gps")


@pytest.mark.parametrize(("later", "size"), [(2.9, 2.0), (-2.0, 5.0)])
def test_what_a_fault_uses_up_of_a_limit_makes_no_size_smaller(later, size):
    """The size is what was left in the flight's beginning, or later on where that is more."""
    alarms = limits_of(limited("max: 3"), flights=FLOWN)
    t = alarms.residuals.t
    shown = sizes(reading(alarms, np.where(t > 40, later, 1.0)), "gps")
    assert shown == pytest.approx({"rises": size})


def test_a_noisy_quantity_must_be_beyond_its_limit_for_most_of_the_time():
    alarms = limits_of(limited("max: 3"), flights=FLOWN)
    swing = np.where(np.arange(len(alarms.residuals.t)) % 2, 0.5, -0.5)
    assert sizes(reading(alarms, swing), "gps") == pytest.approx({"rises": 3.5})


# What a difference must reach.


def test_what_must_be_reached_is_the_lower_of_the_two_thresholds():
    """A mean counts beyond the tolerance."""
    bank = bank_of(model(SHOWN))
    alarms = alarms_of(bank, {})
    mean = np.full(alarms.state.shape, 1.5)
    tolerance = np.full(len(mean), 0.25)
    for limit, size in ((mean, 1.75), (mean + 1.0, 2.0)):
        given = replace(
            alarms,
            mean_threshold=limit,
            residuals=replace(alarms.residuals, tolerance=tolerance),
        )
        assert sizes(given, "sun") == pytest.approx({"changes": size})


@pytest.mark.parametrize(("allowance", "size"), [(0.0, 2.0), (1.0, 3.25)])
def test_what_might_become_a_tests_own_constant_is_no_size(allowance, size):
    """A fault in most of the beginning is its constant up to the tolerance and five deviations."""
    alarms = alarms_of(bank_of(model(SHOWN)), {})
    shape = alarms.state.shape
    given = replace(
        alarms.residuals,
        allowance=np.full(shape, allowance),
        spread=np.full(shape, 0.6),
        tolerance=np.full(shape[0], 0.25),
    )
    assert alarms.use.sigmas == 5.0
    assert sizes(replace(alarms, residuals=given), "sun") == pytest.approx({"changes": size})


def test_what_health_has_off_its_centre_must_be_made_up_for():
    bank = bank_of(model(SHOWN))
    alarms = alarms_of(bank, {}, flights=FLOWN)
    off = replace(alarms.residuals, values=np.full(alarms.state.shape, 0.5))
    assert sizes(replace(alarms, residuals=off), "sun") == pytest.approx({"changes": 2.5})
    learned = replace(alarms, residuals=off, centre=np.full(len(alarms.state), 0.5))
    assert sizes(learned, "sun") == pytest.approx({"changes": 2.0})


def test_a_statement_of_one_side_shows_its_own_direction():
    more = "equations:\n  grown: {text: x = 0, side: above, component: gps}\n"
    text = model({"gps": ["x"]}, more=more).replace("gps: {", "gps: {group: airframe, ")
    assert sizes(alarms_of(bank_of(text), {}), "gps") == pytest.approx({"rises": 2.0})


def test_a_threshold_that_is_higher_for_a_fifth_of_the_time_counts():
    bank = bank_of(model(SHOWN))
    alarms = alarms_of(bank, {})
    threshold = np.where(np.arange(alarms.state.shape[1]) < 80 * RATE, 2.0, 3.0)
    given = replace(alarms, threshold=np.broadcast_to(threshold, alarms.state.shape))
    assert sizes(given, "sun") == pytest.approx({"changes": 3.0})


# Which tests may clear.


def test_what_a_sensor_is_compared_with_must_not_follow_it():
    """An estimator that uses a sensor takes a lasting error of it over, and both agree."""
    text = model({"gps": ["x"], "baro": ["x"], "filter": ["x"]}, {"gps": ["filter"]})
    bank = bank_of(text)
    whom = concerns(bank)
    assert np.flatnonzero(powered("gps", bank, whom)).tolist() == [row(bank, "GPS.x", "BARO.x")]
    assert powered("baro", bank, whom).sum() == 2
    alone = bank_of(model({"gps": ["x"], "filter": ["x"]}, {"gps": ["filter"]}))
    assert set(cleared(alarms_of(alone, {}))) == {"filter"}
    assert unpowered("gps", alone, concerns(alone))


def test_what_a_model_takes_as_known_may_follow_as_well():
    """An attitude is an estimate, whether or not the model asks for faults of it."""
    known = "inputs:\n  KNOWN:\n    fields:\n      x: {variable: x, accuracy: 1 m}\n"
    bank = bank_of(model({"gps": ["x"]}, more=known))
    assert len(bank.generators) > 0
    assert not powered("gps", bank, concerns(bank)).any()


def test_what_follows_at_second_hand_follows():
    affects = {"gps": ["filter"], "filter": ["control"]}
    text = model({"gps": ["x"], "control": ["x"], "filter": ["y"], "baro": ["y"]}, affects)
    bank = bank_of(text)
    assert "gps" not in cleared(alarms_of(bank, {}))


@pytest.mark.parametrize("supports", [False, True])
def test_a_test_that_merely_supports_clears_nobody(supports):
    merely = f"supports: {str(supports).lower()}, component: gps"
    bank = limited(f"max: 3, {merely}")
    assert powered("gps", bank, concerns(bank))[limit_row(bank, "far")] == (not supports)


def test_a_constant_that_is_fitted_to_the_flight_clears_nobody():
    more = (
        "parameters:\n  kept: {identify: {prior: 0, bounds: [-1, 1], zero: left}, unit: m, "
        "source: chosen}\n"
        "equations:\n  a: {text: left = x - y - kept, solves: [left]}\n"
        "  b: {text: left = 0, component: gps}\n"
    )
    text = model({"gps": ["x"], "baro": ["y"]}, more=more)
    bank = bank_of(text.replace("variables:\n", "variables:\n  left: {unit: m}\n"))
    assert len(bank.generators) > 0
    assert not powered("gps", bank, concerns(bank)).any()


def test_units_that_may_be_wrong_alike_do_not_clear_each_other():
    text = model({"imu": ["x"], "gps": ["y"], "sun": ["y"]})
    text += "  IMU_2:\n    component: imu\n    fields:\n      x: {variable: x, accuracy: 1 m}\n"
    bank = bank_of(text)
    assert row(bank, "IMU.x", "IMU_2.x") is not None
    assert named(ruled_out(alarms_of(bank, {}), bank, ())) == ["gps", "sun"]
    witness = bank_of(
        text.replace("y: {variable: y", "y: {variable: x").replace("  y: {unit: m}\n", "")
    )
    assert named(ruled_out(alarms_of(witness, {}), witness, ())) == ["gps", "imu", "sun"]
