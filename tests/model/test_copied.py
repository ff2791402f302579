"""A channel that repeats another one is no witness: what it shows is said once."""

import pytest

from fdi.model import load_airframe
from fdi.telemetry import Channel, Copy

from .test_system import stub_log

MODEL = """format: 1
name: cart
variables:
  v: {unit: m/s}
  w: {unit: m/s}
  climb: {unit: m/s}
  down: {unit: m/s}
  u: {unit: V}
parameters:
  twice: {value: 2, unit: "1"}
equations:
  k_1: {text: "climb = -down", fault: estimator, component: estimator}
  k_2: v = twice*w
limits:
  low: {variable: u, min: 3}
measurements:
  SYS_STATUS: {component: battery, fields: {voltage_battery: {variable: u}}}
  BATTERY_STATUS: {component: battery, fields: {current_battery: {variable: u}}}
  VFR_HUD: {component: airspeed, fields: {groundspeed: {variable: v}, airspeed: {variable: w}}}
inputs:
  LOCAL_POSITION_NED: {fields: {vz: {variable: down}}}
  VFR_HUD: {fields: {climb: {variable: climb}}}
"""
UNITS = dict.fromkeys(("vz", "climb", "groundspeed", "airspeed"), "m/s") | {"voltage_battery": "V"}


@pytest.fixture
def airframe(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return load_airframe(path)


def log_with(*copies):
    log = stub_log(
        {
            "SYS_STATUS": ["voltage_battery"],
            "BATTERY_STATUS": ["current_battery"],
            "VFR_HUD": ["groundspeed", "airspeed", "climb"],
            "LOCAL_POSITION_NED": ["vz"],
        },
        units=UNITS | {"current_battery": "V"},
    )
    log.asked = []

    def compare(pairs):
        log.asked += [(str(a.channel), str(b.channel)) for a, b in pairs]
        return copies

    log.compare = compare
    return log


def copy(channel, of, scale=1.0, offset=0.0, share=1.0):
    return Copy(Channel.parse(channel), Channel.parse(of), scale, offset, share, 300)


CLIMB = ("VFR_HUD.climb", "LOCAL_POSITION_NED.vz")
BATTERY = ("BATTERY_STATUS.current_battery", "SYS_STATUS.voltage_battery")


def test_only_channels_that_the_model_relates_are_held_against_each_other(airframe):
    log = log_with()
    airframe.observe(log)
    pairs = {frozenset(pair) for pair in log.asked}
    assert pairs == {frozenset(CLIMB), frozenset(BATTERY)}


def test_a_sensor_that_repeats_another_brings_no_measurement(airframe):
    system = airframe.observe(log_with(copy(*BATTERY)))
    names = [e.name for e in system.equations]
    assert "SYS_STATUS.voltage_battery" in names
    assert "BATTERY_STATUS.current_battery" not in names
    assert "BATTERY_STATUS.current_battery" not in [fault.name for fault in system.faults]


def test_a_relation_between_a_channel_and_its_copy_is_left_out(airframe):
    found = copy(*CLIMB, scale=-1.0)
    system = airframe.observe(log_with(found))
    assert "k_1" not in [e.name for e in system.equations]
    assert system.implied == {"k_1": found}
    assert not system.curtailed


def test_a_relation_that_the_copy_contradicts_stays(airframe):
    """Up is not down: a copy of the same sign does not make the relation true."""
    system = airframe.observe(log_with(copy(*CLIMB, scale=1.0)))
    assert "k_1" in [e.name for e in system.equations]


def test_what_repeats_up_to_an_offset_is_another_sensor(airframe):
    system = airframe.observe(log_with(copy(*BATTERY, offset=0.3)))
    assert "BATTERY_STATUS.current_battery" in [e.name for e in system.equations]
    assert not system.copies


def test_what_only_comes_close_is_a_witness(airframe):
    system = airframe.observe(log_with(copy(*BATTERY, share=0.9)))
    assert "BATTERY_STATUS.current_battery" in [e.name for e in system.equations]


def test_copies_count_where_they_are_wanted(airframe):
    log = log_with(copy(*BATTERY))
    system = airframe.observe(log, repeated=True)
    assert "BATTERY_STATUS.current_battery" in [e.name for e in system.equations]
    assert not log.asked


def test_a_sensor_of_which_one_axis_differs_is_no_copy(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(
        """format: 1
name: field
variables: {x: {unit: T}, y: {unit: T}, x_2: {unit: T}, y_2: {unit: T}, h: {unit: T}}
equations: {k_1: h = x + y, k_2: h = x_2 + y_2}
measurements:
  RAW_IMU: {component: compass, fields: {xmag: {variable: x}, ymag: {variable: y}}}
  SCALED_IMU2: {component: compass, fields: {xmag: {variable: x_2}, ymag: {variable: y_2}}}
""",
        encoding="utf-8",
    )
    airframe = load_airframe(path)
    fields = ["xmag", "ymag"]
    log = stub_log({"RAW_IMU": fields, "SCALED_IMU2": fields}, units=dict.fromkeys(fields, "T"))
    same = copy("SCALED_IMU2.xmag", "RAW_IMU.xmag")
    for share, kept in ((1.0, False), (0.5, True)):
        other = copy("SCALED_IMU2.ymag", "RAW_IMU.ymag", share=share)
        log.compare = lambda pairs, other=other: (same, other)
        system = airframe.observe(log)
        assert ("SCALED_IMU2.xmag" in [e.name for e in system.equations]) is kept
        assert ("k_2" in [e.name for e in system.equations]) is kept
