"""By how much a sensor is wrong: known sizes in noise of known kind."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.decision import load_policy
from fdi.diagnosis import Size, diagnose
from fdi.diagnosis.direction import BEGAN_S, Extent, directions, fit, gain, hypotheses, scene
from fdi.diagnosis.explain import size_in_words
from fdi.diagnosis.size import _against, size_of
from fdi.telemetry import Channel, Flight, Signals
from fdi.telemetry.events import flight_state

from .build import bank_of

RATE, SECONDS, ONSET = 4.0, 100, 60.0
POLICY = load_policy("default")
FLIGHTS = (Flight(0, SECONDS),)
T = np.arange(round(SECONDS * RATE)) / RATE
MODEL = """
format: 1
name: small
components:
  gps: {group: sensor, affects: [estimator]}
  baro: {group: sensor, affects: [estimator]}
  radar: {group: sensor}
  estimator: {computed: true}
variables:
  x: {unit: m}
measurements:
"""


def shows(component, name):
    """The lines of a channel of a component that shows x."""
    head = f"  {name}:\n    component: {component}\n    group: sensor\n    fields:\n"
    return head + "      x: {variable: x, accuracy: 1 m}\n"


def bank_with(**channels):
    """A bank where each component shows x by the channels given."""
    return bank_of(
        MODEL + "".join(shows(c, name) for c, names in channels.items() for name in names)
    )


THREE = bank_with(gps=["GPS"], baro=["BARO"], radar=["RADAR"])
TWINS = bank_with(gps=["GPS"], baro=["BARO", "BARO2"], radar=["RADAR"])
PAIR = bank_with(baro=["BARO", "BARO2"])


def alarms_of(bank, faults, seed=1, memory=0.0, scale=1.0):
    """Alarms of channels that show 100 m with noise that remembers, and faults that are added."""
    rng = np.random.default_rng(seed)
    columns = {}
    for request in bank.system.channels:
        noise = rng.normal(size=len(T))
        for k in range(1, len(T)):
            noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * noise[k]
        added = faults.get(str(request.channel), 0.0)
        columns[Channel.parse(str(request.channel))] = 100.0 + scale * noise + added
    state, period = flight_state(T, (), FLIGHTS), dict.fromkeys(columns, 0.0)
    signals = Signals(T, columns, period, state, RATE, (), FLIGHTS, {}, "by hand")
    return POLICY.decide(bank.evaluate(signals, POLICY.differentiation))


def sized(alarms, component="gps", onset=ONSET):
    rows = range(len(alarms.alarm))
    return size_of(alarms, component, rows, onset, (0.0, float(SECONDS)))


STEP = np.where(T >= ONSET, 1.0, 0.0)
RAMP = np.maximum(T - ONSET, 0.0)


@settings(max_examples=15, deadline=None)
@given(st.floats(6, 60), st.booleans(), st.integers(0, 10**6))
def test_size_of_a_bias_is_found_with_its_sign(size, is_low, seed):
    size = -size if is_low else size
    found = sized(alarms_of(THREE, {"GPS.x": size * STEP}, seed))
    assert found is not None
    assert found.channels == ("GPS.x",)
    assert found.shape == "bias"
    assert abs(found.value - size) < 4 * found.sigma < abs(size)
    assert found.unit == "m"
    assert abs(found.since - ONSET) <= 1.0


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_uncertainty_covers_the_truth_as_often_as_it_says(memory):
    """Two sigmas hold 95 %; of 40 flights at most six may miss (one in 2000 does so by chance)."""
    errors = []
    for seed in range(40):
        found = sized(alarms_of(THREE, {"GPS.x": 10.0 * STEP}, seed, memory))
        assert found is not None
        errors.append(abs(found.value - 10.0) / found.sigma)
    assert np.sum(np.array(errors) > 2.0) <= 6


def test_noise_that_remembers_makes_a_size_less_certain():
    alone, remembered = (
        np.median([sized(alarms_of(THREE, {"GPS.x": 10 * STEP}, s, m)).sigma for s in range(8)])
        for m in (0.0, 0.9)
    )
    assert remembered > 1.3 * alone


def test_drift_is_told_per_second():
    found = sized(alarms_of(THREE, {"GPS.x": -0.8 * RAMP}))
    assert found.shape == "drift"
    assert found.value == pytest.approx(-0.8, abs=3 * found.sigma)
    assert found.sigma < 0.2


def test_noise_alone_has_no_size():
    assert all(sized(alarms_of(THREE, {}, seed)) is None for seed in range(10))


def test_what_is_not_one_size_has_none():
    """Twice as large after three seconds, and back, and again: neither a bias nor a drift."""
    wild = 12.0 * STEP * np.sign(np.sin(2 * np.pi * (T - ONSET) / 3.0))
    assert sized(alarms_of(THREE, {"GPS.x": wild})) is None


@pytest.mark.parametrize("seed", range(4))
def test_fault_that_becomes_smaller_has_the_size_that_it_had_at_first(seed):
    """Over 20 s it would be 5.2 m, and explain nearly all; its halves tell that it was not one."""
    shrunk = np.where(T < ONSET + 10.0, 6.5, 4.0) * STEP
    found = sized(alarms_of(THREE, {"GPS.x": shrunk}, seed))
    assert found is not None
    assert found.value == pytest.approx(6.5, abs=0.8)


@pytest.mark.parametrize("seed", range(4))
def test_a_bias_that_is_over_after_seconds_has_its_size(seed):
    found = sized(alarms_of(THREE, {"GPS.x": np.where(T < ONSET + 5.0, 12.0, 0.0) * STEP}, seed))
    assert found.shape == "bias"
    assert found.value == pytest.approx(12.0, abs=4 * found.sigma)


def test_wrong_component_has_no_size():
    """What the others agree on cannot be the fault of one of them."""
    alarms = alarms_of(THREE, {"GPS.x": 10.0 * STEP})
    assert sized(alarms, "baro") is None
    assert sized(alarms, "gps") is not None


def test_sensors_that_are_off_alike_are_told_together():
    both = {"BARO.x": 9.0 * STEP, "BARO2.x": 9.0 * STEP}
    found = sized(alarms_of(TWINS, both), "baro")
    assert set(found.channels) == {"BARO.x", "BARO2.x"}
    assert found.against == ()
    assert found.value == pytest.approx(9.0, abs=3 * found.sigma)


def test_one_of_two_that_nothing_else_watches_is_told_against_the_other():
    found = sized(alarms_of(PAIR, {"BARO.x": 9.0 * STEP}), "baro")
    assert {found.channels[0], found.against[0]} == {"BARO.x", "BARO2.x"}
    assert abs(found.value) == pytest.approx(9.0, abs=3 * found.sigma)
    assert (found.value > 0) == (found.channels == ("BARO.x",))


def test_gap_after_the_onset_leaves_the_size():
    fault = 10.0 * STEP + np.where((T > 63) & (T < 66), np.nan, 0.0)
    found = sized(alarms_of(THREE, {"GPS.x": fault}))
    assert found.value == pytest.approx(10.0, abs=3 * found.sigma)


def test_too_little_before_the_onset_gives_no_size():
    early = np.where(T >= 12.0, 10.0, 0.0)
    assert sized(alarms_of(THREE, {"GPS.x": early}), onset=12.0) is None


def test_finding_carries_the_size_and_says_it():
    (finding, *_) = diagnose(alarms_of(THREE, {"GPS.x": -20.0 * STEP}), THREE).findings
    assert finding.component == "gps"
    assert finding.size.value < 0
    assert finding.evidence.text.endswith(size_in_words(finding.size))
    assert "GPS.x reads" in finding.evidence.text
    assert "too low" in finding.evidence.text


def test_place_is_told_in_metres_and_a_pressure_with_what_it_shows():
    place = Size(("GPS.lat",), (), "bias", -1e-6, 1e-7, "rad", 10.0, 6.4, "m")
    assert size_in_words(place) == "GPS.lat reads 6.4 +- 0.6 m too low from 10.0 s on"
    pressure = Size(("A.p",), ("B.p",), "bias", 95.0, 5.0, "Pa", 10.0, 8.2, "m")
    assert (
        size_in_words(pressure)
        == "A.p reads 0.95 +- 0.05 hPa (8.2 m) higher than B.p from 10.0 s on"
    )


def test_a_sensor_may_be_off_by_each_channel_alone_and_by_all_alike():
    found = hypotheses(TWINS, "baro")
    assert {(one.names, one.shape) for one in found} == {
        (names, shape)
        for names in (("BARO.x",), ("BARO2.x",), ("BARO.x", "BARO2.x"))
        for shape in ("bias", "drift")
    }
    assert {one.component for one in found} == {"baro"}
    assert {one.unit for one in found} == {"m"}
    assert {one.field for one in found} == {"x"}
    assert all(len(one.equations) == len(one.names) for one in found)


def fitted(fault, shape="bias", length=20.0, end=SECONDS, moments=None):
    """The best fit of a fault of the receiver in three sensors that hardly scatter."""
    where = scene(alarms_of(THREE, {"GPS.x": fault}, scale=0.01), "gps", ONSET, 0.0, end)
    (one,) = [h for h in hypotheses(THREE, "gps") if h.shape == shape]
    begun = directions(where, one, moments or BEGAN_S[shape])
    return where, fit(where, one, Extent(length), begun), gain(where, one, Extent(length), begun)


def test_without_noise_a_step_is_explained_whole():
    where, found, roughly = fitted(8.0 * STEP)
    assert found.value == pytest.approx(8.0, abs=0.02)
    assert found.halves == pytest.approx((8.0, 8.0), abs=0.02)
    assert abs(found.since - ONSET) <= 0.5
    assert found.explained > 0.99
    assert found.gain == pytest.approx(roughly, rel=0.02)
    # each of the two tests that hold the receiver is moved by the step, as seen over its spread
    after = where.piece.t >= ONSET + 1.0
    sizes = np.abs(found.moved * where.spread)[:, after]
    held = [("GPS.x" in THREE.generators[row].faults) for row in where.rows]
    assert sizes[held] == pytest.approx(8.0, abs=0.05)
    assert sizes[~np.array(held)] == pytest.approx(0.0)


def test_samples_beside_the_beginning_do_not_count():
    """Sampling smears a step: half of it shows at first, and all of it 0.4 s later."""
    _, found, _ = fitted(np.where(ONSET == T, 4.0, 8.0) * STEP)
    assert found.value == pytest.approx(8.0, abs=0.01)


def test_without_noise_a_ramp_is_explained_whole_and_not_by_seconds_of_it():
    _, found, _ = fitted(0.5 * RAMP, "drift")
    assert found.value == pytest.approx(0.5, abs=0.02)
    assert abs(found.since - ONSET) <= 1.0
    assert found.explained > 0.99
    short, enough = (fitted(0.5 * RAMP, "drift", s, moments=[0.0])[1] for s in (5.0, 7.0))
    assert short is None
    assert enough.value == pytest.approx(0.5, abs=0.02)


def test_of_a_fault_that_changes_the_halves_tell_two_sizes():
    _, found, _ = fitted(np.where(T < ONSET + 10.0, 12.0, 6.0) * STEP)
    assert found.halves[0] == pytest.approx(12.0, abs=0.2)
    assert found.halves[1] < 9.0


def test_nothing_counts_after_the_flight_is_over_nor_long_after_the_onset():
    changed = np.where(T < ONSET + 10.0, 8.0, 80.0) * STEP
    for _, found, _ in (fitted(changed, length=10.0), fitted(changed, end=ONSET + 10.0)):
        assert found.value == pytest.approx(8.0, abs=0.02)


def test_what_is_usual_is_learned_from_calm_seconds_before_the_onset():
    alarms = alarms_of(THREE, {"GPS.x": 8.0 * STEP})
    where = scene(alarms, "gps", ONSET, 0.0, 100.0)
    assert np.nanmedian(where.calm, axis=1) == pytest.approx(0.0, abs=1e-12)
    # 60 s at most, 3 s of them a guard, 5 s for settling after take-off
    assert where.calm.shape[1] == (ONSET - 3.0 - 5.0) * RATE
    late = scene(alarms, "gps", 90.0, 0.0, 100.0)
    assert late.calm.shape[1] == (60.0 - 3.0) * RATE
    assert scene(alarms, "gps", ONSET, 47.0, 100.0) is None
    assert scene(alarms, "gps", ONSET, 45.0, 100.0) is not None
    times = where.piece.t[[0, -1]]
    assert times == pytest.approx([ONSET - 12.0 - 8.0, ONSET + 20.0 + 8.0], abs=1.0)


@pytest.mark.parametrize("memory", [0.0, 0.6])
def test_memory_of_the_noise_widens_variances_as_the_process_says(memory):
    """Of an autoregression of first order a mean's variance is (1 + a) / (1 - a) times as large."""
    found = [
        scene(alarms_of(THREE, {}, seed, memory), "gps", 90.0, 0.0, 100.0) for seed in range(4)
    ]
    expected = (1 + memory) / (1 - memory)
    assert np.median([one.inflation for one in found]) == pytest.approx(expected, rel=0.3)
    # a difference of two sensors of 1 m each has a variance of 2 m^2
    deviation = np.mean([np.diag(one.covariance) for one in found], axis=0)
    spread = np.mean([one.spread[:, 0] for one in found], axis=0)
    assert deviation * spread**2 == pytest.approx(2.0, rel=0.3)


def test_statements_that_are_silent_within_their_bounds_have_no_direction():
    limits = "limits:\n  far: {variable: x, max: 500}\n"
    bank = bank_of(MODEL + shows("gps", "GPS") + shows("baro", "BARO") + limits)
    where = scene(alarms_of(bank, {}), "gps", ONSET, 0.0, 100.0)
    (pair,) = where.rows
    assert set(bank.generators[pair].faults) == {"GPS.x", "BARO.x"}


def test_in_white_noise_a_size_is_as_sure_as_least_squares_says():
    """The mean of 80 differences to two others of 1 m; it wanders by 15 % of what they scatter."""
    both = np.sqrt(1.0 + 1.0 / 2.0)
    found = [sized(alarms_of(THREE, {"GPS.x": 10 * STEP}, seed)).sigma for seed in range(10)]
    # and 4 % of the size by which sensitivities may be off
    expected = np.hypot(both * np.hypot(1 / np.sqrt(80), 0.15), 0.04 * 10.0)
    assert np.median(found) == pytest.approx(expected, rel=0.05)


PRESSED = MODEL.replace("  x: {unit: m}", "  x: {unit: m}\n  p: {unit: Pa}") + (
    "  GPS: {component: gps, group: sensor, fields: {x: {variable: x, accuracy: 1 m}}}\n"
    "  RADAR: {component: radar, group: sensor, fields: {x: {variable: x, accuracy: 1 m}}}\n"
    "  BARO: {component: baro, group: sensor, fields: {p: {variable: p, accuracy: 12 Pa}}}\n"
    "parameters:\n  slope: {value: -12, unit: Pa/m}\n  zero: {value: 1300, unit: Pa}\n"
    "equations:\n  air: {text: x = (p - zero)/slope, solves: [x]}\n"
)


@pytest.mark.parametrize(("fault", "shape", "shown"), [(STEP, "bias", 8.0), (RAMP, "drift", 0.4)])
def test_a_pressure_that_is_off_is_told_with_the_height_that_it_shows(fault, shape, shown):
    """12 Pa are a metre."""
    bank = bank_of(PRESSED)
    found = sized(alarms_of(bank, {"BARO.p": -12.0 * shown * fault}, scale=0.1), "baro")
    assert (found.channels, found.shape, found.unit) == (("BARO.p",), shape, "Pa")
    assert found.value == pytest.approx(-12.0 * shown, rel=0.05)
    assert (found.shown, found.shown_unit) == (pytest.approx(shown, rel=0.05), "m")


def test_only_a_twin_that_explains_as_much_by_the_opposite_is_told_beside_a_sensor():
    where, best, _ = fitted(8.0 * STEP)
    named = replace(best.hypothesis, names=("GPS2.x",))
    twin = replace(best, hypothesis=named, value=-best.value)
    assert _against([best], where) == ()
    assert _against([best, twin], where) == ("GPS2.x",)
    # a worse one is no rival: by six, after the memory of the noise and what is left
    apart = 6.0 * where.inflation
    for less, rival in ((0.99 * apart, ("GPS2.x",)), (1.01 * apart, ())):
        near = replace(twin, gain=best.gain - less)
        assert _against([replace(best, left=0.5), near], where) == rival
        wide = replace(twin, gain=best.gain - 2.0 * less)
        assert _against([replace(best, left=2.0), wide], where) == rival
    # one that explains as much otherwise leaves it open
    assert _against([best, replace(twin, gain=0.5 * best.gain)], where) == ()
    assert _against([best, replace(twin, value=best.value)], where) is None
    assert _against([best, replace(twin, hypothesis=replace(named, field="y"))], where) is None
    third = replace(twin, hypothesis=replace(named, names=("GPS3.x",)))
    assert _against([best, twin, third], where) is None


@pytest.mark.parametrize("side", ["above", "below"])
def test_a_statement_of_one_side_has_no_direction(side):
    more = f"equalities:\n  higher: {{text: x = y, side: {side}}}\n"
    text = MODEL.replace("  x: {unit: m}", "  x: {unit: m}\n  y: {unit: m}") + (
        shows("gps", "GPS") + shows("baro", "BARO") + shows("radar", "RADAR").replace("x", "y")
    )
    bank = bank_of(text + more)
    where = scene(alarms_of(bank, {}), "gps", ONSET, 0.0, 100.0)
    assert [set(bank.generators[row].faults) for row in where.rows] == [{"GPS.x", "BARO.x"}]
