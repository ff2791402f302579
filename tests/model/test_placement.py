"""Which messages that a log lacks would show more."""

from itertools import combinations
from pathlib import Path

import pytest

from fdi.errors import LogError
from fdi.model import load_airframe
from fdi.model import placement as rules
from fdi.model.placement import place
from fdi.structure import detectable, isolability
from fdi.telemetry import read
from fdi.telemetry.dialect import definition_by_name

from .test_system import stub_log

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "crash_logs"
MODEL = """format: 1
name: balloon
components:
  gps: {group: sensor}
  barometer: {group: sensor}
  estimator: {group: navigation}
variables:
  altitude: {unit: m}
  climb: {unit: m/s}
  wind: {unit: m/s}
  gust: {unit: m/s}
equations:
  k_1: climb = der(altitude)
  k_2: wind = 2*gust
measurements:
  GPS_RAW_INT: {component: gps, fields: {alt: {variable: altitude}}}
  GLOBAL_POSITION_INT: {component: estimator, fields: {alt: {variable: altitude}}}
  SCALED_PRESSURE2: {component: barometer, fields: {press_abs: {variable: altitude, raw: true}}}
  VFR_HUD: {component: estimator, fields: {climb: {variable: climb}}}
  WIND: {component: estimator, fields: {speed: {variable: wind}}}
  WIND_COV: {component: estimator, fields: {wind_x: {variable: wind}}}
"""
UNITS = {"alt": "m", "climb": "m/s", "speed": "m/s", "wind_x": "m/s", "press_abs": "Pa"}


@pytest.fixture
def balloon(tmp_path):
    path = tmp_path / "balloon.yaml"
    path.write_text(MODEL)
    return load_airframe(path)


def test_a_third_altitude_tells_the_first_two_apart(balloon):
    log = stub_log({"GPS_RAW_INT": ["alt"], "GLOBAL_POSITION_INT": ["alt"]}, units=UNITS)
    found = place(balloon, log)
    assert found.kind == "message"
    assert found.candidates == ("SCALED_PRESSURE2", "VFR_HUD", "WIND", "WIND_COV")
    gps, own = "GPS_RAW_INT.alt", "GLOBAL_POSITION_INT.alt"
    assert {gain.name for gain in found.gains} == {"SCALED_PRESSURE2", "VFR_HUD"}
    for gain in found.gains:
        assert gain.detectable == ()
        assert set(gain.isolable) == {(gps, own), (own, gps)}
    assert found.sets == (("VFR_HUD",), ("SCALED_PRESSURE2",))


def test_a_lonely_fault_becomes_detectable_and_isolable(balloon):
    log = stub_log({"WIND": ["speed"], "GPS_RAW_INT": ["alt"]}, units=UNITS)
    gains = {gain.name: gain for gain in place(balloon, log).gains}
    assert gains["WIND_COV"].detectable == ("WIND.speed",)
    assert ("WIND.speed", "GPS_RAW_INT.alt") in gains["WIND_COV"].isolable


def test_the_sets_are_the_minimal_ones_by_trial(balloon):
    log = stub_log({"WIND": ["speed"], "GPS_RAW_INT": ["alt"]}, units=UNITS)
    found = place(balloon, log)
    own = [fault.name for fault in balloon.observe(log).structure().faults]

    def granted(messages):
        model = balloon.observe(log, also=messages).structure()
        place_of = [[fault.name for fault in model.faults].index(name) for name in own]
        pairs = isolability(model)[place_of][:, place_of].ravel()
        return {*detectable(model)[place_of].nonzero()[0], *(10 + pairs.nonzero()[0])}

    best, expected = granted(found.candidates), []
    for size in range(len(found.candidates) + 1):
        for some in combinations(found.candidates, size):
            if granted(some) >= best and not any(set(e) <= set(some) for e in expected):
                expected.append(some)
    assert {frozenset(names) for names in found.sets} == {frozenset(names) for names in expected}
    assert [len(names) for names in found.sets] == [2, 2, 2]


def test_where_nothing_can_be_added_the_empty_set_says_so(balloon):
    names = {str(m.channel.source) for m in balloon.measurements}
    log = stub_log(
        {name: ["alt", "climb", "speed", "press_abs", "wind_x"] for name in names}, units=UNITS
    )
    found = place(balloon, log)
    assert (found.candidates, found.gains, found.sets) == ((), (), ((),))


def test_of_too_many_choices_there_is_one_of_the_smallest(balloon, monkeypatch):
    log = stub_log({"GPS_RAW_INT": ["alt"], "GLOBAL_POSITION_INT": ["alt"]}, units=UNITS)
    every = place(balloon, log).sets
    monkeypatch.setattr(rules, "LIMIT", 0)
    found = place(balloon, log)
    assert len(found.gains) == 2
    (smallest,) = found.sets
    assert smallest in every
    assert len(smallest) == min(map(len, every))


def test_without_the_time_to_prove_a_set_the_gains_are_left(balloon, monkeypatch):
    monkeypatch.setattr(rules, "LIMIT", 0)
    monkeypatch.setattr(rules, "SECONDS", -1.0)
    log = stub_log({"GPS_RAW_INT": ["alt"], "GLOBAL_POSITION_INT": ["alt"]}, units=UNITS)
    found = place(balloon, log)
    assert found.sets is None
    assert len(found.gains) == 2


def test_without_a_log_it_is_sensors_of_variables(tmp_path):
    path = tmp_path / "pair.yaml"
    lines = MODEL.splitlines(keepends=True)
    dropped = ("SCALED_PRESSURE2", "VFR_HUD", "WIND")
    path.write_text("".join(x for x in lines if not x.strip().startswith(dropped)))
    found = place(load_airframe(path), None)
    assert found.kind == "sensor"
    assert found.sets == (("altitude",),)
    assert {gain.name for gain in found.gains} == {"altitude", "climb"}


def test_nobody_is_told_to_record_what_a_method_makes(tmp_path):
    path = tmp_path / "balloon.yaml"
    made = "{component: barometer, made_by: heading, fields:"
    path.write_text(MODEL.replace("{component: barometer, fields:", made))
    log = stub_log({"GPS_RAW_INT": ["alt"], "GLOBAL_POSITION_INT": ["alt"]}, units=UNITS)
    assert place(load_airframe(path), log).candidates == ("VFR_HUD", "WIND", "WIND_COV")


def test_a_log_without_anything_of_the_model_is_refused(balloon):
    with pytest.raises(LogError, match="no message that the model 'balloon' measures"):
        place(balloon, stub_log({"HEARTBEAT": ["type"]}, units=UNITS))


def test_who_gains_most_stands_first(balloon):
    """A second height makes its fault and the first one's detectable; a second wind just these."""
    log = stub_log({"GPS_RAW_INT": ["alt"], "WIND": ["speed"]}, units=UNITS)
    gains = place(balloon, log).gains
    sizes = [len(gain.detectable) + len(gain.isolable) for gain in gains]
    assert sizes == sorted(sizes, reverse=True)
    many = rules.Gain("many", ("a",), (("a", "b"), ("b", "a")))
    some = rules.Gain("some", ("a", "b"), ())
    few = rules.Gain("few", (), (("a", "b"),))
    assert [one.name for one in rules._ordered([few, some, many])] == ["many", "some", "few"]


@pytest.mark.parametrize("model", ["quadcopter", "fixed_wing"])
def test_a_message_is_told_once_and_by_a_name_that_the_format_has(model):
    log = read(EXAMPLES / "copter_motor_failure_crash.tlog")
    candidates = place(load_airframe(model), log).candidates
    assert len(candidates) == len(set(candidates)) > 0
    assert all(definition_by_name(name) is not None for name in candidates)
    assert not set(candidates) & log.messages.keys()
