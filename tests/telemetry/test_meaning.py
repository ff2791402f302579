"""Channels, units, sentinels, parameters, texts: what the numbers mean."""

import struct
from datetime import datetime

import numpy as np
import pytest

from fdi import units
from fdi.errors import LogError, UsageError
from fdi.telemetry import Channel
from fdi.telemetry.catalogue import is_failsafe_text, mavlink_meaning, mavlink_mode
from fdi.telemetry.dialect import _classes

from .build import Flight, mav, record


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("VFR_HUD.airspeed", "VFR_HUD.airspeed"),
        ("Vfr_Hud.AIRSPEED", "VFR_HUD.airspeed"),
        ("battery_status.voltage_v", "battery_status.voltage_v"),
        ("esc_status.esc[3].esc_rpm", "esc_status.esc[3].esc_rpm"),
        ("ATT#2.Roll", "ATT#2.Roll"),
        ("RPM.Qual", "RPM.Qual"),
        ("SBRM.13", "SBRM.13"),
        ("my-topic/left.x", "my-topic/left.x"),
        ("74/airspeed", "VFR_HUD.airspeed"),
        ("125/VCC", "POWER_STATUS.Vcc"),
        ("BATTERY_STATUS[1].voltages[0]", "BATTERY_STATUS[1].voltages[0]"),
        ("BATTERY_STATUS[0].temperature", "BATTERY_STATUS.temperature"),
        ("XKF4[1].SV", "XKF4[1].SV"),
        ("XKF4[0].SV", "XKF4.SV"),
        ("esc_status.esc[0].esc_rpm", "esc_status.esc[0].esc_rpm"),
    ],
)
def test_channel_is_parsed_to_the_dialects_spelling(text, written):
    assert str(Channel.parse(text)) == written


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("VFR_HUD", "is no channel"),
        ("VFR_HUD.airspeeed", "did you mean airspeed"),
        ("74/speed_of_light", "no field"),
        ("74/airspeed.x", "is no channel"),
        ("99999/x", "no MAVLink message"),
        ("BATTERY_STATUS.voltages[10]", "has 10 entries"),
        ("BATTERY_STATUS.voltages[0].x", "no field"),
        ("a" * 500, "is no channel"),
        ("../../etc.passwd", "is no channel"),
    ],
)
def test_what_is_no_channel_is_refused_with_a_hint(text, says):
    with pytest.raises(UsageError, match=says):
        Channel.parse(text)


def test_channels_sort_with_and_without_instance():
    first, second, other = Channel("M", "a"), Channel("M", "a", 1), Channel("A", "z", 2)
    assert sorted([second, first, other]) == [other, first, second]


def test_every_unit_of_the_dialect_is_known():
    """Those left as they are have no SI unit that says more (bytes, pixels, rates of bytes)."""
    used = {u for c in _classes().values() for u in c.fieldunits_by_name.values()}
    passed_on = {u for u in used if units.si(u) == units.Conversion(u)}
    assert passed_on - set(units._DIALECT) <= {
        "bytes",
        "pix",
        "bits/s",
        "KiB/s",
        "MiB",
        "MiB/s",
    }


def test_customary_undoes_what_people_do_not_expect():
    label, scale, offset = units.customary("K")
    assert (label, 300 * scale + offset) == ("degC", pytest.approx(26.85))
    assert units.customary("V") == units.Conversion("V")


@pytest.mark.parametrize(
    ("message", "field", "vehicle", "unit"),
    [
        ("NAV_CONTROLLER_OUTPUT", "aspd_error", "plane", "cm/s"),
        ("NAV_CONTROLLER_OUTPUT", "aspd_error", "quad", "m/s"),
        ("NAV_CONTROLLER_OUTPUT", "nav_roll", "rover", "m/s/s"),
        ("GPS_RAW_INT", "eph", "quad", "c1"),
        ("SERVO_OUTPUT_RAW", "servo3_raw", "quad", "us (pulse)"),
        ("SERVO_OUTPUT_RAW", "time_usec", "quad", "us"),
    ],
)
def test_unit_is_corrected_where_the_dialect_is_wrong(message, field, vehicle, unit):
    dialect = {"aspd_error": "m/s", "nav_roll": "deg", "time_usec": "us"}.get(field, "")
    found = mavlink_meaning(message, field, dialect, autopilot="ardupilot", vehicle=vehicle)
    assert found.unit == unit


def test_raw_imu_of_other_autopilots_has_no_unit():
    found = mavlink_meaning("RAW_IMU", "xacc", "mG", autopilot="px4", vehicle="quad")
    assert found.unit == "1"


def test_sentinels_are_unknown(load):
    gps = mav.MAVLink_gps_raw_int_message(0, 1, 0, 0, 0, 9999, 65535, 65535, 18000, 255)
    ahrs2 = mav.MAVLink_ahrs2_message(0, 0, 0, 0, 0, 0)
    log = load(record(0, gps) + record(1, ahrs2) + record(2, gps))
    known = {f: np.isfinite(log["GPS_RAW_INT"].si(f)).any() for f in log["GPS_RAW_INT"].fields}
    assert not any(known[f] for f in ("eph", "epv", "vel", "satellites_visible", "h_acc"))
    assert log["GPS_RAW_INT"].si("cog")[0] == pytest.approx(np.pi)
    assert np.isnan(log["AHRS2"].si("roll")).all()


def test_units_are_si_and_pulse_widths_stay(load):
    log = load(Flight().bytes())
    wanted = {
        "GLOBAL_POSITION_INT.lat": "rad",
        "GLOBAL_POSITION_INT.vz": "m/s",
        "VFR_HUD.throttle": "",
        "RAW_IMU.zacc": "m/s^2",
        "RAW_IMU.xmag": "T",
        "SERVO_OUTPUT_RAW.servo1_raw": "us",
        "SERVO_OUTPUT_RAW.time_usec": "s",
        "ATTITUDE.roll": "rad",
    }
    assert {name: log.channel(name).unit for name in wanted} == wanted
    assert log.channel("RAW_IMU.zacc").value[0] == pytest.approx(-9.80665)
    assert log.channel("VFR_HUD.throttle").value.max() == pytest.approx(0.4)


def parameter(t: float, name: bytes, value: float, kind: int = 9) -> bytes:
    return record(t, mav.MAVLink_param_value_message(name, value, kind, 3, 0))


def test_parameters_are_those_of_the_download_and_changes_are_told(load):
    parts = [parameter(1, b"A", 1.5), parameter(1, b"B", 2.0), parameter(5, b"A", 3.0)]
    log = load(b"".join([*Flight().records(), *parts]))
    assert dict(log.parameters) == {"A": 1.5, "B": 2.0}
    assert [(c.name, c.old, c.new) for c in log.parameter_changes] == [("A", 1.5, 3.0)]
    assert [(e.text, e.value) for e in log.events if e.kind == "parameter"] == [("A", 3.0)]


def test_integer_parameters_of_px4_are_the_bytes_of_the_float(load):
    beat = mav.MAVLink_heartbeat_message(2, 12, 0x81, 4 << 16 | 4 << 24, 4, 3)
    packed = struct.unpack("<f", struct.pack("<i", 4001))[0]
    log = load(record(0, beat) + parameter(1, b"SYS_AUTOSTART", packed, 6))
    assert log.parameters["SYS_AUTOSTART"] == 4001
    assert log.autopilot == "px4"
    assert [e.text for e in log.events if e.kind == "mode"] == ["AUTO_MISSION"]


def test_parts_of_a_long_text_are_joined_and_made_safe(load):
    first = mav.MAVLink_statustext_message(4, b"x" * 50, 7, 0)
    second = mav.MAVLink_statustext_message(4, b"y\x1b[31m\x07end\x00rest", 7, 1)
    other = mav.MAVLink_statustext_message(2, b"Battery 1 Failsafe", 0, 0)
    log = load(record(1, first) + record(1.1, second) + record(2, other))
    texts = [(e.kind, e.text, e.severity) for e in log.events]
    assert texts[0] == ("text", "x" * 50 + "y [31m end", 4)
    assert texts[1:] == [("failsafe", "Battery 1 Failsafe", 2), ("text", "Battery 1 Failsafe", 2)]
    assert "\x1b" in log["STATUSTEXT"].raw("text")[1]
    assert "rest" not in log["STATUSTEXT"].raw("text")[1]


def test_modes_of_unknown_autopilots_are_numbers():
    assert mavlink_mode(3, autopilot="ardupilot", vehicle="rover") == "STEERING"
    assert mavlink_mode(77, autopilot="ardupilot", vehicle="quad") == "MODE_77"
    assert mavlink_mode(3, autopilot="generic", vehicle="quad") == "MODE_3"


@pytest.mark.parametrize(
    ("main", "sub", "right"),
    [
        *((3, 0, "POSCTL"), (3, 1, "ORBIT"), (3, 2, "POSITION_SLOW"), (4, 9, "AUTO_PRECLAND")),
        *((4, 11, "EXTERNAL1"), (4, 18, "EXTERNAL8"), (4, 19, "AUTO"), (10, 0, "TERMINATION")),
    ],
)
def test_px4s_modes_are_named_in_telemetry_as_in_its_own_log(main, sub, right):
    assert mavlink_mode(main << 16 | sub << 24, autopilot="px4", vehicle="quad") == right


def test_frame_is_pandas_in_si_with_texts(load):
    log = load(Flight().bytes())
    frame = log["ATTITUDE"].frame()
    assert frame.index.name == "t"
    assert frame["yaw"].iloc[0] == pytest.approx(0.1)


def test_unknown_names_are_refused_with_what_there_is(load):
    log = load(Flight().bytes())
    with pytest.raises(UsageError, match="ATTITUDE"):
        log["WIND"]
    with pytest.raises(UsageError, match="roll"):
        log.channel(Channel("ATTITUDE", "rol"))
    # a message does not know whether a person wrote the name or a log lacks the field
    with pytest.raises(LogError, match="roll"):
        log["ATTITUDE"].si("rol")


def test_loss_by_sequence_numbers_and_gaps_are_told(load):
    parts = [r for i, r in enumerate(Flight().records()) if not 300 < i < 500 and i % 10]
    log = load(b"".join(parts))
    gaps = [q.text for q in log.quality if q.kind == "gap"]
    assert any("telemetry gap" in text for text in gaps)
    assert any("did not arrive" in text for text in gaps)


OLD, NEW = "2013-10-13T21:58:53Z", "2021-12-05T19:01:08Z"


@pytest.mark.parametrize(
    ("greeting", "recorded", "said", "means"),
    [
        (b"ArduCopter V3.2-dev (40b13cf8)", NEW, 1, 6),  # SEVERITY_LOW: no ALERT
        (b"APM:Copter V3.3.3 (acf0e8f8)", NEW, 3, 3),
        (b"APM:Copter V3.3.3 (acf0e8f8)", NEW, 2, 4),
        (b"APM:Copter V3.4.6 (e707341b)", NEW, 1, 1),
        (b"ArduPlane V3.3.0 (1a2b3c4d)", NEW, 5, 5),
        (b"ArduPlane V3.5.2 (1a2b3c4d)", OLD, 1, 1),
        (b"nobody knows", OLD, 1, 6),
        (b"nobody knows", NEW, 1, 1),
    ],
)
def test_severities_of_old_firmware_are_those_of_mavlink(load, greeting, recorded, said, means):
    epoch = datetime.fromisoformat(recorded.replace("Z", "+00:00")).timestamp()
    is_utc = mav.MAVLINK_MSG_ID_SYSTEM_TIME.to_bytes(3, "little")
    flight = [r for r in Flight(epoch=epoch).records() if r[15:18] != is_utc]
    texts = [(1.0, 6, greeting), (6.0, said, b"the text in question")]
    told = [record(t, mav.MAVLink_statustext_message(*what), epoch=epoch) for t, *what in texts]
    log = load(b"".join(sorted([*flight, *told], key=lambda r: r[:8])))
    found = [e.severity for e in log.events if e.text == "the text in question"]
    assert found == [means]


@pytest.mark.parametrize(
    ("text", "is_one"),
    [
        ("GPS Glitch", True),
        ("GPS Glitch cleared", False),
        ("EKF3 primary changed:1", True),
        ("Max Alt and Circle fences breached", True),
        ("Vibration compensation ON", True),
        ("Vibration compensation OFF", False),
        ("PreArm: Internal Errors 0x100", False),
        ("Internal Errors 0x100 l:213", True),
    ],
)
def test_a_text_says_that_a_failsafe_acts_or_that_it_is_over(text, is_one):
    assert is_failsafe_text(text) is is_one
