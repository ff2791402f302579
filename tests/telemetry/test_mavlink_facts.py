"""What is known of MAVLink fields beyond the dialect, and what a log itself must decide."""

import json
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from math import pi
from pathlib import Path

import numpy as np
import pytest

from fdi import units
from fdi.telemetry import Log
from fdi.telemetry.catalogue import mavlink_meaning
from fdi.telemetry.dialect import _classes, definition_by_name

from .build import Flight, mav, record

FACTS = Path(__file__).resolve().parents[2].parent / "shared" / "telemetry" / "fields_units.json"
SI = {
    "m/s2": "m/s^2",
    "m/s down": "m/s",
    "deg": "rad",
    "degC": "K",
    "1": "",
    "rpm": "rad/s",
    "A.s": "A*s",
}
# said in words there, or about what a value stands for: nothing that a unit or a sentinel holds
NO_UNIT = (
    "HIGHRES_IMU.*",
    "NAV_CONTROLLER_OUTPUT.*",
    "AHRS2.*",
    "LOCAL_POSITION_NED.*",
    "AHRS3.v1..v4",
    "HIGH_LATENCY2.*",
    "HEARTBEAT.custom_mode",
    "PARAM_VALUE.param_value",
    "GPS_RAW_INT.time_usec",
)
SPELLED_OUT = {
    "*.temperature (RAW_IMU, SCALED_IMU*)": ["RAW_IMU.temperature", "SCALED_IMU*.temperature"],
    "GPS_RAW_INT.h_acc,v_acc,vel_acc,hdg_acc": ["GPS_RAW_INT.?_acc"],
    "RAW_IMU.*": ["RAW_IMU.?acc", "RAW_IMU.?gyro", "RAW_IMU.?mag"],
    "SERVO_OUTPUT_RAW.servo1_raw..8, RC_CHANNELS_RAW.chan*_raw": [
        "SERVO_OUTPUT_RAW.servo[1-8]_raw",
        "RC_CHANNELS_RAW.chan*_raw",
    ],
    "SERVO_OUTPUT_RAW.servo9_raw..16": ["SERVO_OUTPUT_RAW.servo9_raw"],
}
# decided by the log itself, see tlog/signs.py
SIGNS = ("GLOBAL_POSITION_INT.vz",)


def rows() -> list[dict]:
    known = json.loads(FACTS.read_text())["fields"] if FACTS.is_file() else []
    return [row for row in known if row["field"] not in (*NO_UNIT, *SIGNS)]


def fields(text: str) -> list[tuple[str, str, str]]:
    """Return message, field and the dialect's unit of all fields that a row is about."""
    patterns = SPELLED_OUT.get(text) or [
        f"{text.partition('.')[0]}.{name}" for name in text.partition(".")[2].split(",")
    ]
    return [
        (known.msgname, name, known.fieldunits_by_name.get(name, ""))
        for known in _classes().values()
        for name in known.fieldnames
        if any(fnmatchcase(f"{known.msgname}.{name}", pattern) for pattern in patterns)
    ]


def facts(row: dict) -> dict[str, str | None]:
    """Return autopilot, vehicle and time that a row is about."""
    when = row.get("when", "")
    vehicle = next((v for v in ("plane", "rover") if v in when), "quad")
    if "px4" in when or "other autopilots" in when:
        recorded = "2014-06-01" if "older" in when else None
        return {"autopilot": "px4", "vehicle": vehicle, "recorded": recorded}
    return {"autopilot": "ardupilot", "vehicle": vehicle, "recorded": None}


@pytest.mark.skipif(not FACTS.is_file(), reason="needs the shared folder")
@pytest.mark.parametrize("row", rows(), ids=lambda row: row["field"])
def test_field_has_the_unit_and_sentinels_that_were_found(row):
    known = fields(row["field"])
    assert known
    for message, field, dialect in known:
        found = mavlink_meaning(message, field, dialect, **facts(row))
        conversion = units.si(found.unit)
        if row["scale"] == "none":
            assert found.unit == "1"
            continue
        if "time_usec" in field or row["unit"] in ("s", "enum", ""):
            continue
        degrees = pi / 180 if row["unit"] == "deg" else 1.0
        turn = 2 * pi / 60 if row["unit"] == "rpm" else 1.0
        assert conversion.unit == SI.get(row["unit"].split(",")[0], row["unit"].split(",")[0])
        assert conversion.scale == pytest.approx(float(row["scale"]) * degrees * turn)
        missing = set(map(float, row.get("invalid") or ())) - set(found.invalid)
        assert not missing, (message, field)


def position(t: float, lat: int) -> bytes:
    return record(
        t, mav.MAVLink_global_position_int_message(round(1000 * t), lat, 0, 0, 0, 0, 0, 0, 0)
    )


def test_impossible_values_are_unknown_and_told(load):
    attitude = [
        record(t, mav.MAVLink_attitude_message(1000 * t, roll, 0.1, 0, 0, 0, 0))
        for t, roll in enumerate([0.1, float("nan"), 0.1, 0.1, float("inf"), 5e9, 0.1])
    ]
    log = load(b"".join([*attitude, position(8.0, 950_000_000), position(9.0, 470_000_000)]))
    assert np.isnan(log["ATTITUDE"].si("roll")).tolist() == [0, 1, 0, 0, 1, 1, 0]
    assert np.isfinite(log["ATTITUDE"].si("pitch")).all()
    told = [(q.channel, q.start, q.end, q.count) for q in log.quality if q.kind == "invalid_values"]
    assert told == [("ATTITUDE.roll", 1.0, 5.0, 3), ("GLOBAL_POSITION_INT.lat", 8.0, 8.0, 1)]


def test_what_a_broken_barometer_says_is_left_to_the_diagnosis(load):
    """Only what no sensor can say is unknown, and deep water is as possible."""
    parts = [
        record(t, mav.MAVLink_scaled_pressure_message(1000 * t, value, 0.0, 1500))
        for t, value in enumerate([1013.0, 1519.5, 4000.0, 0.0, -1e30])
    ]
    found = load(b"".join(parts))["SCALED_PRESSURE"].si("press_abs")
    assert np.isfinite(found).tolist() == [1, 1, 1, 0, 0]


def test_overloaded_processor_is_no_impossible_value(load):
    """What a limit of a model looks for must not be taken away before."""
    status = mav.MAVLink_sys_status_message(0, 0, 0, 1200, 12000, -1, -1, 0, 0, 0, 0, 0, 0)
    log = load(record(0, status) + record(1, status))
    np.testing.assert_allclose(log["SYS_STATUS"].si("load"), 1.2)


def test_codes_bits_and_counts_are_discrete_and_measurements_are_not(load):
    log = load(Flight().bytes(until=5.0) + record(5.5, mav.MAVLink_gps_raw_int_message(*[0] * 10)))
    discrete = ("HEARTBEAT.base_mode", "HEARTBEAT.custom_mode", "GPS_RAW_INT.fix_type")
    steady = ("GPS_RAW_INT.eph", "GPS_RAW_INT.alt", "ATTITUDE.roll", "VFR_HUD.throttle")
    for names, wanted in ((discrete, True), (steady, False)):
        for message, _, field in (name.partition(".") for name in names):
            assert log[message].columns[field].is_discrete is wanted, (message, field)


def test_sentinels_are_no_impossible_values(load):
    """65535 lies beyond any course; it says that there is none."""
    gps = mav.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 80, 120, 0, 65535, 12)
    log = load(record(0, gps) + record(1, gps))
    assert not log.quality
    assert np.isnan(log["GPS_RAW_INT"].si("cog")).all()


def test_zero_of_a_sensor_that_is_not_there_is_unknown(load):
    status = mav.MAVLink_ekf_status_report_message(0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.0)
    ranger = mav.MAVLink_rangefinder_message(0.0, 0.0)
    log = load(record(0, status) + record(1, ranger) + record(2, status))
    assert np.isnan(log["EKF_STATUS_REPORT"].si("airspeed_variance")).all()
    assert np.isfinite(log["EKF_STATUS_REPORT"].si("velocity_variance")).all()
    assert np.isnan(log["RANGEFINDER"].si("distance")).all()


def px4(day: datetime, load) -> Log:
    beat = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, 0, 0, 4, 3)
    gps = mav.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 250, 400, 0, 0, 12)
    epoch = day.timestamp()
    return load(b"".join(record(i, m, epoch=epoch) for i, m in enumerate([beat, gps, gps])))


def test_accuracy_of_px4_of_2014_is_a_length(load):
    """It sent an accuracy in cm; since the end of 2015 a dilution, as the definition says."""
    old, new = (
        px4(datetime(2014, 5, 1, tzinfo=UTC), load),
        px4(datetime(2019, 5, 1, tzinfo=UTC), load),
    )
    for log, unit in ((old, "m"), (new, "")):
        _, value, found = log.channel("GPS_RAW_INT.eph")
        assert (value.tolist(), found) == ([2.5, 2.5], unit)


def windy(*, says_to: bool, epoch: float, airspeed: float | None = None) -> bytes:
    """Return a plane that flies circles in wind from the south-west at 6 m/s."""
    blows_to = np.radians(45.0)
    wind = 6.0 * np.exp(1j * blows_to)
    beat = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_FIXED_WING, 3, 0, 0, 4, 3)
    parts = [record(0, beat, epoch=epoch)]
    direction = np.degrees(blows_to) if says_to else np.degrees(blows_to) - 180
    for i in range(200):
        t, heading = i / 2, (0.05 * i) % (2 * pi)
        ground = 18.0 * np.exp(1j * heading) + wind
        hud_speed = 18.0 if airspeed is None else airspeed
        course = round(np.degrees(np.angle(ground)) % 360 * 100)
        parts += [
            record(t + k / 100, message, epoch=epoch)
            for k, message in enumerate(
                [
                    mav.MAVLink_gps_raw_int_message(
                        round(t * 1e6), 3, 0, 0, 0, 80, 80, round(abs(ground) * 100), course, 9
                    ),
                    mav.MAVLink_vfr_hud_message(
                        hud_speed, abs(ground), round(np.degrees(heading)), 50, 100, 0
                    ),
                    mav.MAVLink_wind_message(direction, 6.0, 0.0),
                ]
            )
        ]
    return b"".join(parts)


OLD, NEW = (datetime(year, 8, 1, tzinfo=UTC).timestamp() for year in (2012, 2020))


@pytest.mark.parametrize(
    ("says_to", "epoch", "turned"), [(True, OLD, True), (False, OLD, False), (False, NEW, False)]
)
def test_wind_is_where_it_comes_from_whatever_was_sent(load, says_to, epoch, turned):
    log = load(windy(says_to=says_to, epoch=epoch))
    direction = log["WIND"].si("direction")
    np.testing.assert_allclose(np.exp(1j * direction), np.exp(1j * np.radians(225.0)), atol=1e-6)
    assert [q.channel for q in log.quality if q.kind == "repaired"] == ["WIND.direction"] * turned


def test_dead_airspeed_sensor_does_not_turn_the_wind_of_a_newer_log(load):
    log = load(windy(says_to=False, epoch=NEW, airspeed=0.0))
    np.testing.assert_allclose(log["WIND"].si("direction"), np.radians(-135.0), atol=1e-6)


def test_airspeed_error_of_a_plane_is_in_centimetres(load):
    nav = mav.MAVLink_nav_controller_output_message(0, 0, 0, 0, 0, 0, 250.0, 0)
    for kind, wanted in ((mav.MAV_TYPE_FIXED_WING, 2.5), (mav.MAV_TYPE_QUADROTOR, 250.0)):
        log = load(Flight(kind=kind).bytes(until=3.0) + record(3.5, nav))
        assert log["NAV_CONTROLLER_OUTPUT"].si("aspd_error").tolist() == [pytest.approx(wanted)]


def test_every_rule_of_the_table_is_about_a_field_of_the_dialect():
    from fdi.telemetry.catalogue import data_table

    names = [
        f"{message}.{field.name}"
        for message in (c.msgname for c in _classes().values())
        for field in definition_by_name(message).fields
    ]
    for rule in data_table("units_mavlink")["rules"]:
        for pattern in rule["fields"]:
            assert any(fnmatchcase(name, pattern) for name in names), pattern
        low, high = rule.get("range", (0, 1))
        assert low < high
