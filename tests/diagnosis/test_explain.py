"""Sentences of evidence: the numbers in them are those of the alarm, in customary units."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.diagnosis import diagnose
from fdi.diagnosis.alarm_runs import find_runs
from fdi.diagnosis.explain import sentence
from fdi.telemetry import Flight

from .build import alarms_of, bank_of, limit_row, model, row

WHEN = "from 40.0 s for 10.0 s"
SHORT = {"seconds": 51, "flights": (Flight(0, 51),)}
"""A flight that ends soon after the alarm: it could not heal for long."""


def evidence(bank, *rows, **more):
    """The evidence when rows alarm from 40 to 50 s: 6 off where 2 is within health."""
    alarms = alarms_of(bank, {place: [(40, 50)] for place in rows}, **SHORT, **more)
    return diagnose(alarms, bank).findings[0].evidence


def limited(limit, *, unit="m", more=""):
    text = f"limits:\n  too_high: {{variable: x_1, component: gps, {limit}}}\n{more}"
    return bank_of(model({"gps": ["x_1"]}, more=text, unit=unit))


@pytest.mark.parametrize(
    ("limit", "unit", "reached", "allowed"),
    [
        ("max: 9", "m", "15 m", "at most 9 m"),
        ("min: 9", "m", "3 m", "at least 9 m"),
        ("min: -1", "m", "-7 m", "at least -1 m"),
        ("max: 9", '"1"', "15", "at most 9"),
        ("max: 1", "rad", "401 deg", "at most 57.3 deg"),
        ("max: 300", "Pa", "3.06 hPa", "at most 3 hPa"),
        ("max: 293.15", "K", "26 degC", "at most 20 degC"),
    ],
)
def test_one_sided_limit_tells_the_value_reached_and_the_one_allowed(limit, unit, reached, allowed):
    text = model({"gps": ["x_1"]}, more=f"limits:\n  too_high: {{variable: x_1, {limit}}}\n")
    bank = bank_of(text.replace("unit: m}", f"unit: {unit}}}").replace("1 m}", "1}"))
    assert evidence(bank, 0).text == (
        f"x 1: {reached} where {allowed} is allowed, {WHEN} (GPS.x_1)"
    )


def test_bound_that_is_a_parameter_is_told_by_its_value():
    bank = limited("max: most + 1", more="parameters:\n  most: {value: 8, unit: m}\n")
    assert "15 m where at most 9 m is allowed" in evidence(bank, 0).text


def test_bound_that_varies_in_flight_is_told_by_the_statement():
    shown = {"gps": ["x_1"], "baro": ["y"]}
    for bound in ("max: y", "min: y", "max: y + 1"):
        text = f"limits:\n  too_high: {{variable: x_1, component: gps, {bound}}}\n"
        bank = bank_of(model(shown, more=text))
        said = evidence(bank, limit_row(bank, "too_high")).text
        assert "is violated by up to 6" in said


def test_two_sided_limit_tells_what_is_allowed_and_by_how_much_it_is_beyond():
    said = evidence(limited("min: -1, max: 9"), 0).text
    assert said == (f"x 1: up to 6 m beyond the -1 m to 9 m that are allowed, {WHEN} (GPS.x_1)")


def test_cross_check_names_both_sensors_and_what_is_within_health():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    found = evidence(bank, 0)
    assert found.text == (
        f"GPS.x and BARO.x do not agree: off by up to 6 m {WHEN}, 2 m is within health"
    )
    assert found.residuals == ("r1",)
    assert found.channels == ("GPS.x", "BARO.x")


def test_what_should_be_a_number_is_told_by_what_it_is():
    """The name of a channel says neither of what that is a share nor from where."""
    stated = "equations:\n  at_rest: {text: x = 0, component: gps, says: is kept off}\n"
    text = model({"gps": ["x"]}, more=stated)
    told = text.replace("x: {unit: m}", "x: {unit: m, description: way from the middle}")
    bank = bank_of(told, "cross_checks")
    assert evidence(bank, limit_row(bank, "at_rest")).text == (
        f"way from the middle: off by up to 6 m {WHEN}, 2 m is within health (GPS.x)"
    )
    bank = bank_of(text, "cross_checks")
    assert evidence(bank, limit_row(bank, "at_rest")).text.startswith("GPS.x is off by up to 6 m")


def test_what_is_computed_of_inputs_alone_is_told_by_what_it_is():
    """Six channels that "do not agree" name neither the compass nor the heading."""
    text = """
format: 1
name: small
components: {compass: {}, estimator: {}}
variables:
  h: {unit: m, description: heading}
  f: {unit: m}
  g: {unit: m}
equations:
  field: {text: h = f, fault: compass.heading, component: compass}
  filter: {text: h = g, fault: estimator.heading, component: estimator}
inputs:
  FIELD:
    fields:
      f: {variable: f, accuracy: 1 m}
      g: {variable: g, accuracy: 1 m}
"""
    bank = bank_of(text)
    alarms = alarms_of(bank, {0: [(40, 50)]}, **SHORT)
    (run,) = find_runs(alarms, 0.0, 51.0)
    assert sentence(run, alarms) == (
        f"heading: off by up to 6 m {WHEN}, 2 m is within health (FIELD.f and FIELD.g)"
    )


def test_the_accused_ones_channels_are_named_first():
    bank = bank_of(model({"baro": ["x"], "gps": ["x"]}))
    alarms = alarms_of(bank, {0: [(40, 50)]}, **SHORT)
    (run,) = find_runs(alarms, 0.0, 51.0)
    assert sentence(run, alarms, "gps").startswith("GPS.x and BARO.x do not agree")
    assert sentence(run, alarms, "baro").startswith("BARO.x and GPS.x do not agree")


def test_other_alarms_of_the_cause_are_counted():
    bank = bank_of(model({name: ["x"] for name in ("gps", "baro", "radar", "sun")}))
    others = ("BARO.x", "RADAR.x", "SUN.x")
    rows = [row(bank, "GPS.x", other) for other in others]
    assert evidence(bank, *rows[:2], peak=20.0).text.endswith("; 1 more test agrees")
    found = evidence(bank, *rows)
    assert found.text.endswith("; 2 more tests agree")
    assert set(found.channels) == {"GPS.x", *others}


def test_units_of_a_cross_check_are_customary():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, unit="rad"))
    assert "off by up to 344 deg" in evidence(bank, 0).text
    assert "115 deg is within health" in evidence(bank, 0).text


def test_what_only_scatters_is_told_so_and_not_how_far_it_is_off():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    scatter = np.full((1, 204), 8.0)
    # 0.5 thresholds off, 8 of 5 times the scatter
    alarms = alarms_of(bank, {0: [(40, 50)]}, peak=0.5, **SHORT, scatter=scatter, scatter_most=5.0)
    (run,) = find_runs(alarms, 0.0, 51.0)
    said = sentence(run, alarms)
    assert "scatter up to 8 times as much as at first" in said
    assert "5 times is within health" in said
    assert "off by" not in said
    # what is farther beyond its threshold is told first
    said = evidence(bank, 0, peak=3.0, scatter=scatter, scatter_most=5.0).text
    assert "off by up to 6 m" in said


def test_a_mean_beyond_a_tolerance_is_told_with_the_tolerance():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    means = {"mean": np.full((1, 204), 2.0), "mean_threshold": np.full((1, 204), 0.5)}
    alarms = alarms_of(bank, {0: [(40, 50)]}, peak=0.5, **SHORT, **means)
    wide = replace(alarms, residuals=replace(alarms.residuals, tolerance=np.array([3.0])))
    (run,) = find_runs(wide, 0.0, 51.0)
    assert "off by up to 5 m on average" in sentence(run, wide)
    assert "3.5 m is within health" in sentence(run, wide)
    strays = replace(wide, stray=np.array([7.0]))  # as healthy vehicles were measured to
    assert "off by up to 9 m on average" in sentence(run, strays)
    assert "7.5 m is within health" in sentence(run, strays)


@pytest.mark.parametrize(("mean", "said"), [(6.0, "6 m on average"), (2.0, "20 m")])
def test_told_is_what_is_farther_beyond_its_own_threshold(mean, said):
    """20 m are twice what a sample may be; the mean is four times its own, or a third more."""
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    means = {"mean": np.full((1, 204), mean), "mean_threshold": np.full((1, 204), 1.5)}
    alarms = alarms_of(bank, {0: [(40, 50)]}, peak=10.0, **SHORT, **means)
    alarms = replace(alarms, threshold=np.full((1, 204), 10.0))
    (run,) = find_runs(alarms, 0.0, 51.0)
    assert f"off by up to {said}" in sentence(run, alarms)
    assert ("on average" in sentence(run, alarms)) == ("average" in said)


def test_input_is_what_a_sensor_does_not_agree_with():
    text = model({"gps": ["x"]}) + (
        "inputs:\n  MAP:\n    fields:\n      x: {variable: x, accuracy: 1 m}\n"
    )
    said = evidence(bank_of(text), 0).text
    assert said.startswith("GPS.x against MAP.x does not agree: off by up to 6 m")


def test_difference_of_angles_is_told_the_short_way_round():
    text = model({"gps": ["x"], "baro": ["x"]}, unit="rad")
    bank = bank_of(text.replace("x: {unit: rad}", "x: {unit: rad, circular: true}"))
    assert bank.system.equations[bank.generators[0].residual].circular
    said = evidence(
        bank, 0, peak=-1.5, centre=np.array([3.0]), strength=np.full((1, 204), 5.0)
    ).text  # -3 against 3 rad
    assert "off by up to 16.2 deg" in said


def test_strongest_sample_is_told_and_not_an_unknown_one():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    alarms = alarms_of(bank, {0: [(40, 50)]}, unknown={0: [(42, 44)]}, **SHORT)
    alarms.residuals.values[0, 45 * 4] = -11
    assert "off by up to 11 m" in diagnose(alarms, bank).findings[0].evidence.text


AMOUNT = bank_of(
    """
format: 1
name: scale
variables: {force: {unit: N}, load: {unit: N}, left: {unit: N}}
equations: {off: {text: left = force - load, solves: [left]}}
equalities:
  balanced:
    text: left = 0
    solves: []
    component: gauge
    amounts:
      "it shows # of the load": force/load
      "it lasts, by #": {value: left, least: 20 s}
measurements:
  VFR_HUD:
    component: gauge
    fields:
      alt: {variable: load, accuracy: 0.1 N, raw: true}
      climb: {variable: force, accuracy: 0.3 N, raw: true}
"""
)


def weighed(known_s, until=50):
    """What is said where a force of 6 N on a load of 5 N was known for so long of an alarm."""
    alarms = alarms_of(AMOUNT, {0: [(40, until)]}, seconds=90, flights=(Flight(0, 90),))
    t, columns = alarms.residuals.t, alarms.residuals.signals.columns
    for channel, column in columns.items():
        column[:] = 5.0 if channel.field == "alt" else np.where(t < 40 + known_s, 6.0, np.nan)
    (run,) = find_runs(alarms, 0.0, 90.0)
    return sentence(run, alarms)


def test_an_alarm_is_told_by_what_a_person_can_check():
    """Relative errors of 0.3 of 6 and 0.1 of 5: 5.4 % of 1.2."""
    assert (
        weighed(50)
        == "it shows 120 +- 6 % of the load, from 40.0 s for 10.0 s (VFR_HUD.alt and VFR_HUD.climb)"
    )


def test_an_amount_is_told_of_an_alarm_that_lasts_as_long_as_it_asks():
    said = weighed(50, until=60)
    assert "it shows 120 +- 6 % of the load, it lasts, by 1.0 +- 0.3 N, from" in said
    assert "it lasts" not in weighed(50, until=59)


@pytest.mark.parametrize(("known_s", "is_told"), [(5.0, True), (4.5, False)])
def test_an_amount_is_told_that_is_known_for_half_of_the_alarm(known_s, is_told):
    assert ("it shows 120" in weighed(known_s)) == is_told


def test_evidence_that_is_a_statement_of_another_part_says_of_whom_it_is():
    """The estimator's ratio speaks against the gps, and is no quantity of the gps."""
    text = model(
        {"monitor": ["ratio"], "gps": ["x"], "baro": ["x"], "radar": ["x"]},
        {"gps": ["estimator"], "estimator": []},
        "limits:\n  off: {variable: ratio, max: 1, component: estimator, suspects: [gps]}\n",
    )
    bank = bank_of(text.replace("estimator: {affects", "estimator: {computed: true, affects"))
    own = [place for place, g in enumerate(bank.generators) if "GPS.x" in g.faults]
    limit = limit_row(bank, "off")
    raised = {limit: [(40, 100)], **{place: [(44, 100)] for place in own}}
    first = diagnose(alarms_of(bank, raised, peak=4.0), bank).findings[0]
    assert first.component == "gps"
    assert first.evidence.text.startswith(
        "a statement of the estimator, behind which the gps may be: ratio: "
    )
