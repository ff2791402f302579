"""What of a model holds with one log."""

import numpy as np
import pytest

from fdi.errors import LogError, ModelError
from fdi.model import load_airframe
from fdi.model.expression import parse
from fdi.model.parts import Kind, Measurement, read_by
from fdi.telemetry import Channel

MODEL = """format: 1
name: cart
variables:
  v: {unit: m/s, domain: [0, null]}
  w: {unit: m/s}
  x: {unit: m}
  a: {unit: rad, circular: true}
  i: {unit: A}
parameters:
  scale: {value: 5, unit: "1", log: {name: [NEW_SCALE, OLD_SCALE], scale: 0.01}}
equations:
  k_1: v = der(x)
  k_2: v = sqrt(w**2 + 9)
  k_3: {text: "v = 2*w", solves: [v]}
limits:
  l_1: {variable: i, max: 30}
measurements:
  VFR_HUD:
    component: estimator
    fields:
      groundspeed: {variable: v, accuracy: 1, when: "airspeed > scale"}
      alt: {variable: x, value: "alt*scale"}
  74:
    fields: {airspeed: {variable: w}}
  ATTITUDE: {fields: {yaw: {variable: a}}}
  BATTERY_STATUS[1]: {fields: {current_battery: {variable: i, component: battery}}}
inputs:
  NAV_CONTROLLER_OUTPUT: {fields: {xtrack_error: {variable: x}}}
"""
UNITS = {"groundspeed": "m/s", "airspeed": "m/s", "alt": "m", "yaw": "rad", "current_battery": "A"}


class StubMessage:
    made_from = None

    def __init__(self, fields, units):
        self.fields, self._units = tuple(fields), units

    def has_known(self, name):
        return name in self.fields

    def unit(self, name):
        return self._units.get(name, "")


def stub_log(messages, parameters=None, units=UNITS):
    """As much of a log as observing asks for."""
    table = {key: StubMessage(fields, units) for key, fields in messages.items()}

    class StubLog(dict):
        name = "stub.tlog"
        format = "tlog"
        autopilot = "other"
        vehicle = "other"

    log = StubLog(table)
    log.parameters = parameters or {}
    log.inputs = ()
    log.compare = lambda pairs: ()  # without values nothing is a copy
    return log


@pytest.fixture(scope="module")
def airframe(tmp_path_factory):
    path = tmp_path_factory.mktemp("m") / "m.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return load_airframe(path)


def names(system):
    return [e.name for e in system.equations if e.kind in (Kind.MEASUREMENT, Kind.INPUT)]


def test_without_a_log_every_measurement_counts_as_present(airframe):
    system = airframe.observe()
    assert set(names(system)) == {
        "VFR_HUD.groundspeed", "VFR_HUD.alt", "VFR_HUD.airspeed", "ATTITUDE.yaw",
        "BATTERY_STATUS[1].current_battery", "NAV_CONTROLLER_OUTPUT.xtrack_error>x",
    }  # fmt: skip
    assert len(system.faults) == 5  # an input brings none


def test_what_an_input_shows_is_no_unknown_of_the_structure(airframe):
    system = airframe.observe()
    assert "x" in system.unknowns
    assert "x" not in system.structure().unknowns
    assert system.equations[system.inputs["x"]].kind is Kind.INPUT


def test_only_what_the_log_has_is_measured(airframe):
    system = airframe.observe(stub_log({"VFR_HUD": ["groundspeed", "airspeed"]}))
    assert set(names(system)) == {"VFR_HUD.groundspeed", "VFR_HUD.airspeed"}
    assert any("VFR_HUD.alt" in warning for warning in system.warnings)
    assert [fault.name for fault in system.faults] == ["VFR_HUD.groundspeed", "VFR_HUD.airspeed"]
    for fault in system.faults:
        assert system.equations[fault.equation].name == fault.name


def test_an_instance_is_another_message(airframe):
    other = airframe.observe(stub_log({"BATTERY_STATUS": ["current_battery"], "ATTITUDE": ["yaw"]}))
    assert names(other) == ["ATTITUDE.yaw"]
    own = airframe.observe(stub_log({"BATTERY_STATUS[1]": ["current_battery"]}))
    assert names(own) == ["BATTERY_STATUS[1].current_battery"]
    assert own.faults[0].component == "battery"


def test_a_log_without_any_measured_channel_is_refused(airframe):
    with pytest.raises(
        LogError, match=r"stub.tlog: holds no message that the model 'cart' measures"
    ):
        airframe.observe(stub_log({"HEARTBEAT": ["type"]}))


@pytest.mark.parametrize(
    ("parameters", "value", "source"),
    [
        ({}, 5.0, "default"),
        ({"OLD_SCALE": 700}, 7.0, "log"),
        ({"OLD_SCALE": 1, "NEW_SCALE": 900}, 9.0, "log"),
    ],
)
def test_a_parameter_comes_from_the_log_where_it_is_there(airframe, parameters, value, source):
    system = airframe.observe(stub_log({"VFR_HUD": ["airspeed", "alt", "groundspeed"]}, parameters))
    assert system.parameters["scale"].value == pytest.approx(value)
    assert system.parameters["scale"].source == source
    alt = next(r for r in system.channels if r.channel.field == "alt")
    assert alt.value({"alt": np.array([2.0])}) == pytest.approx([2.0 * value])


def test_a_request_names_the_fields_it_reads_and_no_parameter(airframe):
    requests = {r.channel.field: r for r in airframe.observe().channels}
    assert set(requests["groundspeed"].fields) == {"groundspeed", "airspeed"}
    assert requests["alt"].fields == ("alt",)
    valid = requests["groundspeed"].valid({"airspeed": np.array([1.0, 9.0, np.nan])})
    assert valid.tolist() == [False, True, False]


@pytest.mark.parametrize("unit", ["deg", "s", "bananas"])
def test_a_log_in_another_unit_is_refused(airframe, unit):
    log = stub_log({"ATTITUDE": ["yaw"]}, units={"yaw": unit})
    with pytest.raises(ModelError, match=rf"ATTITUDE.yaw: the log gives '{unit}'"):
        airframe.observe(log)


@pytest.mark.parametrize("unit", ["", "furlong", "s"])
def test_what_the_model_computes_needs_no_unit_of_the_log(airframe, unit):
    log = stub_log({"VFR_HUD": ["groundspeed", "airspeed", "alt"]}, units={**UNITS, "alt": unit})
    shown = {str(e.measurement.channel) for e in airframe.observe(log).equations if e.measurement}
    assert shown == {"VFR_HUD.groundspeed", "VFR_HUD.airspeed", "VFR_HUD.alt"}


def test_a_channel_whose_unit_the_log_does_not_state_is_left_out_and_told(airframe):
    log = stub_log({"VFR_HUD": ["groundspeed", "airspeed"]}, units={"airspeed": "m/s"})
    system = airframe.observe(log)
    shown = {str(e.measurement.channel) for e in system.equations if e.measurement}
    assert shown == {"VFR_HUD.airspeed"}
    (told,) = [text for text in system.warnings if "unit" in text]
    assert told == (
        "VFR_HUD.groundspeed: this log does not state its unit (raw: true takes it as it is)"
    )


@pytest.mark.parametrize(("unit", "is_used"), [("m", True), ("", False)])
def test_a_mean_of_counts_is_no_mean_in_units(tmp_path, unit, is_used):
    """A receiver or sensor of an autopilot that nobody knows may send counts."""
    path = tmp_path / "m.yaml"
    mean = '"xtrack_error:over": {variable: x, value: "kept(xtrack_error, 3)"}'
    path.write_text(MODEL.replace("xtrack_error: {variable: x}", mean), encoding="utf-8")
    units = {"xtrack_error": unit, "yaw": "rad"}
    log = stub_log({"NAV_CONTROLLER_OUTPUT": ["xtrack_error"], "ATTITUDE": ["yaw"]}, units=units)
    found = names(load_airframe(path).observe(log))
    assert any("xtrack_error:over" in name for name in found) == is_used


def test_a_unit_spelled_otherwise_fits(airframe):
    log = stub_log({"VFR_HUD": ["airspeed"]}, units={"airspeed": "m*Hz"})
    assert names(airframe.observe(log)) == ["VFR_HUD.airspeed"]


def test_edges_say_what_an_equation_can_be_solved_for(airframe):
    edges = {e.name: dict(e.edges) for e in airframe.observe().equations}
    assert edges["k_1"] == {"v": "derivative", "x": "integral"}
    assert edges["k_2"] == {"v": "solvable", "w": "fixed"}  # two roots: w may be negative
    assert edges["k_3"] == {"v": "solvable", "w": "fixed"}  # as the model says
    assert edges["l_1"] == {"i": "fixed"}
    assert edges["ATTITUDE.yaw"] == {"a": "solvable"}


def test_a_limit_allows_nothing_beyond_its_bound(airframe):
    (limit,) = [e for e in airframe.observe().equations if e.kind is Kind.LIMIT]
    assert limit.tolerance == limit.window == limit.offset == 0
    assert limit.errors == limit.swings == ()
    assert not any((limit.supports, limit.steady, limit.always, limit.command))


@pytest.mark.parametrize(
    ("domain", "edge"),
    [("[0, null]", "solvable"), ("[-9, 9]", "fixed"), ("[1, 9]", "solvable"), ("null", "fixed")],
)
def test_a_square_is_undone_where_its_root_cannot_be_negative(tmp_path, domain, edge):
    text = MODEL.replace("  w: {unit: m/s}", f"  w: {{unit: m/s, domain: {domain}}}")
    if domain == "null":
        text = MODEL
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    edges = {e.name: dict(e.edges) for e in load_airframe(path).observe().equations}
    assert edges["k_2"]["w"] == edge


def test_structure_without_limits_keeps_the_rest_as_it_is(airframe):
    system = airframe.observe()
    whole, rest = system.structure(), system.structure(limits=False)
    assert set(whole.equations) - set(rest.equations) == {"l_1"}
    assert {f.name for f in whole.faults} == {f.name for f in rest.faults}
    for model in (whole, rest):
        for name, row in zip(model.equations, model.rows, strict=True):
            held = {model.unknowns[i] for i in row}
            equation = next(e for e in system.equations if e.name == name)
            assert held == set(equation.edges) - set(system.inputs)


def test_published_notation_names_a_message_by_its_number(airframe):
    assert "VFR_HUD.airspeed" in names(airframe.observe())


def test_by_what_a_message_reports_its_accuracy_is_read_only_where_asked_for():
    gps = Channel.parse("GPS.vel")
    shown = Measurement(gps, "v", "gps", "sensor", reported=parse("vel_acc"))
    assert read_by(shown, ()) == (gps,)
    assert read_by(shown, (), accuracy=True) == (gps, Channel.parse("GPS.vel_acc"))
    assert read_by(shown, ("vel_acc",), accuracy=True) == (gps,)


@pytest.mark.parametrize(
    ("written", "anew", "flies"),
    [
        ("max: 30", "max: 30", False),
        ("max: 30", "max: 30, when: airborne", True),
        ("variable: a", "variable: a, when: phase == 'flight'", True),
        ("variable: a", "variable: a, freeze: 4 s", False),
    ],
)
def test_what_has_no_statement_about_flight_drives_or_swims(tmp_path, written, anew, flies):
    path = tmp_path / "m.yaml"
    path.write_text(MODEL.replace(written, anew), encoding="utf-8")
    assert load_airframe(path).observe().flies == flies
