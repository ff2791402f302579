"""What other formats say in MAVLink's words: the tables, their reading, two logs of a flight."""

import json
import re
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import FdiError
from fdi.telemetry import read
from fdi.telemetry.catalogue import data_table, mavlink_meaning
from fdi.telemetry.dialect import definition_by_name
from fdi.telemetry.meaning.messages import _rows, as_mavlink
from fdi.telemetry.meaning.sources import FUNCTIONS, source
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion, si

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
MAPPING = SHARED / "telemetry" / "mapping.json"
TABLES = {"mavlink_dataflash": "dataflash", "mavlink_ulog": "ulog"}
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
# PX4 sends raw counts there; the table gives what ArduPilot sends, so that models of either run.
_OTHER_UNITS = re.compile(r"RAW_IMU\.[xyz](acc|gyro|mag)")


def message(key: str, t: list[float], **fields: tuple[str, list[float]]) -> Message:
    """Return a message of a log: per field the SI unit and the values."""
    name, _, number = key.partition("[")
    at = np.array(t, np.float64)
    columns = {
        field: Column(lambda v=values: np.array(v, np.float64), Conversion(unit))
        for field, (unit, values) in fields.items()
    }
    instance = int(number[:-1]) if number else None
    return Message(name, instance, at, at, np.arange(at.size), columns)


def log(*messages: Message) -> dict[str, Message]:
    return {m.key: m for m in messages}


# the tables


@pytest.mark.parametrize("table", TABLES)
def test_units_of_the_tables_are_those_of_the_dialect(table):
    autopilot, groups = (data_table(table)[key] for key in ("autopilot", "groups"))
    seen = 0
    for row in _rows(table):
        known = definition_by_name(row.key.partition("[")[0])
        assert known is not None, row.key
        for field in row.fields:
            bare = field.name.partition("[")[0]
            if autopilot == "px4" and _OTHER_UNITS.fullmatch(f"{known.name}.{bare}"):
                continue
            unit = next(f.unit for f in known.fields if f.name == bare)
            named = {s.group for s in field.sources}
            vehicles = set(groups["rotors"] + groups["wings"])
            if None not in named:
                vehicles = {v for group in named for v in groups[group]}
            for vehicle in sorted(vehicles):
                meaning = mavlink_meaning(
                    known.name, bare, unit, autopilot=autopilot, vehicle=vehicle
                )
                assert field.conversion == si(meaning.unit), (row.key, field.name, vehicle)
                seen += 1
    assert seen > 1000


@pytest.mark.parametrize("table", TABLES)
def test_base_and_every_array_entry_exist(table):
    for row in _rows(table):
        read_at_all = {r.message for f in row.fields for s in f.sources for r in s.reads}
        assert {name.partition("[")[0] for name, _ in row.base} <= read_at_all
        known = definition_by_name(row.key.partition("[")[0])
        counts = {f.name: f.count for f in known.fields}
        for field in row.fields:
            bare, _, index = field.name.partition("[")
            assert not index or int(index[:-1]) < counts[bare]


@needs_shared
@pytest.mark.parametrize("table", TABLES)
def test_every_quantity_of_the_mapping_is_covered_or_left_out_for_a_reason(table):
    left_out = data_table(table)["left_out"]
    reads: dict[str, set[str]] = {}
    for row in _rows(table):
        for field in row.fields:
            texts = {f"{r.message}.{r.field}" for s in field.sources for r in s.reads}
            for name in (field.name, re.sub(r"\[\d+\]$", "", field.name)):
                reads.setdefault(f"{row.key}.{name}", set()).update(texts)
    used: set[str] = set()

    def is_excused(name: str) -> bool:
        found = {pattern for pattern in left_out if fnmatchcase(name, pattern)}
        used.update(found)
        return bool(found)

    quantities = json.loads(MAPPING.read_text())["quantities"]
    covered = 0
    for quantity in quantities:
        wanted = [name for row in quantity["mavlink"] for name in _names(row["field"])]
        if not wanted:
            continue  # no MAVLink field: by its own name
        found = set().union(*(reads.get(name, set()) for name in wanted))
        for name in wanted:
            assert name in reads or is_excused(name), (quantity["name"], name)
        for name in (n for row in quantity[TABLES[table]] for n in _names(row["field"])):
            is_read = any(one == name or one.startswith(f"{name}[") for one in found)
            assert is_read or is_excused(name), (quantity["name"], name)
            covered += is_read
    assert covered > 100
    assert used == set(left_out), "reasons that nothing needs"


def _names(text: str) -> list[str]:
    """Return the channels that a row of the mapping names, without its notation for instances."""
    message, field = re.sub(r"\[[A-Za-z]+\]", "", text).split(".", 1)
    field = re.sub(r"\[(\d+)\.\.\d+\]", r"[\1]", field)
    field = re.sub(r"^([qQ]1)\.\.[qQ]4$", r"\1", field)
    return [f"{message}.{part}" for part in re.split(r",| or ", field)]


# sources


@pytest.mark.parametrize(
    "text", ["", "ATT", "ATT.Roll *", "cube(ATT.Roll)", "ATT.Roll if", "ATT.Roll if ATT.Roll", "1*"]
)
def test_what_is_no_source_is_refused(text):
    with pytest.raises(FdiError, match=r" is no |no function"):
        source(text)


angles = st.floats(-3.1, 3.1)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_euler_angles_of_a_quaternion_are_those_it_was_made_of(roll, pitch, yaw):
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a / 2), np.sin(a / 2)) for a in (roll, pitch, yaw))
    q = [
        np.array([cr * cp * cy + sr * sp * sy]),
        np.array([sr * cp * cy - cr * sp * sy]),
        np.array([cr * sp * cy + sr * cp * sy]),
        np.array([cr * cp * sy - sr * sp * cy]),
    ]
    for name, angle in (("roll", roll), ("pitch", pitch), ("yaw", yaw)):
        assert FUNCTIONS[name].kernel(*q)[0] == pytest.approx(angle, abs=1e-6)
        assert FUNCTIONS[name].kernel(*(-part for part in q))[0] == pytest.approx(angle, abs=1e-6)


def test_quaternion_that_is_not_set_is_unknown():
    assert np.isnan(FUNCTIONS["roll"].kernel(*np.zeros((4, 1)))[0])


def test_wind_comes_from_where_its_vector_does_not_point():
    """Air that moves towards the east comes from the west."""
    assert FUNCTIONS["from"].kernel(np.array([0.0]), np.array([3.0]))[0] == pytest.approx(
        -np.pi / 2
    )


# messages made of a log's own


def test_units_signs_and_raw_are_mavlinks():
    own = log(
        message("POS", [0, 1, 2], Lat=("rad", [0.5] * 3), Alt=("m", [10, 11, 12])),
        message(
            "XKF1", [0, 1, 2], VN=("m/s", [3, 3, 3]), VE=("m/s", [4, 4, 4]), VD=("m/s", [1] * 3)
        ),
        message("CTUN", [0, 1, 2], ThO=("", [0.1, 0.2, 0.3])),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    position = made["GLOBAL_POSITION_INT"]
    np.testing.assert_allclose(position.raw("alt"), [10e3, 11e3, 12e3])
    np.testing.assert_allclose(position.raw("vx"), 300)
    np.testing.assert_allclose(position.raw("lat"), np.rad2deg(0.5) * 1e7)
    hud = made["VFR_HUD"]
    np.testing.assert_allclose(hud.si("groundspeed"), 5)
    np.testing.assert_allclose(hud.si("climb"), -1)
    np.testing.assert_allclose(hud.raw("throttle"), [10, 20, 30])
    assert hud.made_from == "CTUN"


def test_number_in_an_old_name_is_an_instance():
    own = log(message("IMU2", [0, 1, 2], GyrX=("rad/s", [0.1, 0.2, 0.3])))
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    assert made["IMU[1]"].made_from == made["SCALED_IMU2"].made_from == "IMU2"
    np.testing.assert_allclose(made["SCALED_IMU2"].raw("xgyro"), [100, 200, 300])
    np.testing.assert_allclose(made["IMU[1]"].si("GyrX"), [0.1, 0.2, 0.3])


def test_a_compass_needs_no_accelerometer_of_its_number():
    """Boards with two inertial units and three compasses are common."""
    imu = (message(f"IMU[{n}]", [0, 1], GyrX=("rad/s", [0.1, 0.2])) for n in (0, 1))
    mag = (message(f"MAG[{n}]", [0, 1], MagX=("T", [n * 1e-5, 2e-5])) for n in (1, 2))
    made = as_mavlink(log(*imu, *mag), "quad", table="mavlink_dataflash")
    np.testing.assert_allclose(made["SCALED_IMU2"].si("xmag"), [1e-5, 2e-5])
    np.testing.assert_allclose(made["SCALED_IMU3"].si("xmag"), [2e-5, 2e-5])
    assert made["SCALED_IMU2"].made_from == "IMU[1]"
    assert "xgyro" not in made["SCALED_IMU3"]


def test_yaw_is_counted_from_minus_pi_and_heading_from_zero():
    own = log(
        message("ATT", [0, 1, 2], Yaw=("rad", [0.1, 3.0, 6.0])),
        message("POS", [0, 1, 2], Alt=("m", [0] * 3)),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    np.testing.assert_allclose(made["ATTITUDE"].si("yaw"), [0.1, 3.0, 6.0 - 2 * np.pi])
    np.testing.assert_allclose(made["GLOBAL_POSITION_INT"].si("hdg"), [0.1, 3.0, 6.0])


def test_angles_are_interpolated_on_the_circle():
    own = log(
        message("ATT", [0, 1], Yaw=("rad", [6.2, 0.1])),
        message("POS", [0, 0.5, 1], Alt=("m", [0] * 3)),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    middle = (6.2 + 0.1 + 2 * np.pi) / 2 - 2 * np.pi
    np.testing.assert_allclose(
        made["GLOBAL_POSITION_INT"].si("hdg"), [6.2, middle % (2 * np.pi), 0.1]
    )


def test_fields_of_another_message_are_unknown_across_its_gaps_and_beyond_its_ends():
    t = [0.0, 0.1, 0.2, 0.3, 2.0, 2.1, 2.2]
    own = log(
        message("IMU", [-0.05, 0.05, 1.0, 2.05, 2.3], AccX=("m/s^2", [0.0] * 5)),
        message("MAG", t, MagX=("T", [1.0] * 7)),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    np.testing.assert_array_equal(
        np.isfinite(made["RAW_IMU"].si("xmag")), [False, True, False, True, False]
    )


def test_unknown_where_the_condition_does_not_hold():
    own = log(
        message("GPS", [0, 1, 2], Status=("", [1, 3, 4]), Spd=("m/s", [5.0, 6.0, 7.0])),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    np.testing.assert_array_equal(made["GPS_RAW_INT"].si("vel"), [np.nan, 6.0, 7.0])
    np.testing.assert_array_equal(made["GPS_RAW_INT"].si("fix_type"), [1, 3, 4])


def test_condition_on_a_field_that_the_log_lacks_is_left_out():
    own = log(message("ARSP", [0, 1, 2], Airspeed=("m/s", [5.0, 6.0, 7.0])))
    made = as_mavlink(own, "plane", table="mavlink_dataflash")
    np.testing.assert_array_equal(made["AIRSPEED"].si("airspeed"), [5.0, 6.0, 7.0])


def test_estimator_is_the_one_that_flies():
    """XKF4.PI names the primary core; MAVLink sends that core's velocity."""
    t = [0.0, 1.0, 2.0, 3.0]
    own = log(
        message("XKF1", t, VN=("m/s", [1.0] * 4)),
        message("XKF1[1]", t, VN=("m/s", [2.0] * 4)),
        message("XKF4", t, PI=("", [0, 0, 1, 0])),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    np.testing.assert_array_equal(made["LOCAL_POSITION_NED"].si("vx"), [1, 1, 2, 1])


def test_counts_are_held_and_not_interpolated():
    own = log(
        message("VIBE", [0, 0.5, 1], VibeX=("m/s^2", [0.0] * 3)),
        message("VIBE[1]", [0, 1], Clip=("", [4.0, 9.0])),
    )
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    np.testing.assert_array_equal(made["VIBRATION"].si("clipping_1"), [4, 4, 9])


def axes(names: str, unit: str, values: tuple[float, ...]) -> dict[str, tuple[str, list[float]]]:
    return {n: (unit, [v] * 3) for n, v in zip(names.split(), values, strict=True)}


def test_px4_sensors_of_their_own_frame_are_no_reading_of_the_body():
    """Since 1.11 nobody has turned or calibrated `sensor_accel`; `vehicle_imu` is of the body."""
    t = [0.0, 0.5, 1.0]
    raw = message("sensor_accel", t, **axes("x y z", "m/s^2", (0.0, -9.8, 1.4)))
    moved = axes(
        "delta_velocity[0] delta_velocity[1] delta_velocity[2]", "m/s", (0.002, 0.004, -0.04)
    )
    body = message("vehicle_imu", t, **moved, delta_velocity_dt=("s", [0.004] * 3))
    made = as_mavlink(log(raw), "quad", table="mavlink_ulog")
    assert not any("xacc" in m for m in made.values())
    made = as_mavlink(log(raw, body), "quad", table="mavlink_ulog")
    for name in ("RAW_IMU", "SCALED_IMU", "HIGHRES_IMU"):
        assert made[name].si("zacc") == pytest.approx(-10.0)


def test_px4_drivers_that_integrate_calibrate_too():
    """Until 1.10 a driver turned, calibrated and integrated what it sent."""
    t = [0.0, 0.5, 1.0]
    moved = axes("x_integral y_integral z_integral", "m/s", (0.0, 0.01, -0.039))
    own = message("sensor_accel", t, **moved, integral_dt=("s", [0.004] * 3))
    made = as_mavlink(log(own), "quad", table="mavlink_ulog")
    assert made["SCALED_IMU"].si("yacc") == pytest.approx(2.5)


def receiver(t: np.ndarray) -> Message:
    some = [0.0] * t.size
    return message("GPS", list(t), Status=("", [3.0] * t.size), Spd=("m/s", some))


def test_receiver_that_falls_silent_has_no_fix():
    """As ArduPilot tells by MAVLink; all else that it said is unknown then."""
    attitude = message("ATT", list(np.arange(0, 20, 0.1)), Roll=("rad", [0.0] * 200))
    before, after = np.arange(0, 5, 0.2), np.arange(15, 20, 0.2)
    gps = receiver(np.concatenate((before, after)))
    made = as_mavlink(log(gps, attitude), "quad", table="mavlink_dataflash")["GPS_RAW_INT"]
    silent = (made.t > 4.9) & (made.t < 14.9)
    np.testing.assert_array_equal(made.si("fix_type"), np.where(silent, 0, 3))
    np.testing.assert_array_equal(np.isnan(made.si("vel")), silent)
    assert np.all(np.diff(made.t) > 0)
    assert np.max(np.diff(made.t)) < 0.5
    assert made.stamp.size == made.raw("fix_type").size == len(made)
    assert len(gps) == before.size + after.size


@pytest.mark.parametrize(
    ("gps_back", "others_pause"), [(12.0, (5.2, 11.8)), (6.4, (99.0, 99.0))], ids=["all", "short"]
)
def test_pause_that_all_share_or_that_is_short_is_no_silence(gps_back, others_pause):
    t = np.arange(0, 20, 0.1)
    attitude = t[(t < others_pause[0]) | (t > others_pause[1])]
    gps = receiver(np.concatenate((t[t < 5][::2], t[t > gps_back][::2])))
    own = log(gps, message("ATT", list(attitude), Roll=("rad", [0.0] * attitude.size)))
    assert len(as_mavlink(own, "quad", table="mavlink_dataflash")["GPS_RAW_INT"]) == len(gps)


def test_specific_force_of_an_integral_and_its_time():
    own = log(
        message(
            "vehicle_imu[1]",
            [0, 1],
            **{
                "delta_velocity[0]": ("m/s", [0.02, 0.02]),
                "delta_velocity_dt": ("s", [0.005, 0.0]),
            },
        )
    )
    made = as_mavlink(own, "quad", table="mavlink_ulog")
    np.testing.assert_allclose(made["SCALED_IMU2"].si("xacc"), [4.0, np.nan])


def test_unit_that_does_not_fit_is_left_out():
    own = log(message("POS", [0, 1], Alt=("rad", [0, 0]), RelHomeAlt=("m", [0, 0])))
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    assert made["GLOBAL_POSITION_INT"].fields == ("relative_alt",)


def test_nothing_is_decoded_before_it_is_asked_for_and_nothing_kept_by_looking():
    def refuse() -> np.ndarray:
        raise AssertionError("decoded")

    t = np.arange(3.0)
    column = Column(refuse, Conversion("rad"))
    own = {"ATT": Message("ATT", None, t, t, np.arange(3), {"Roll": column, "Yaw": column})}
    made = as_mavlink(own, "quad", table="mavlink_dataflash")
    with pytest.raises(AssertionError, match="decoded"):
        made["ATTITUDE"].si("roll")
    told = log(message("ATT", [0, 1], Roll=("rad", [0.1, 0.2])))
    attitude = as_mavlink(told, "quad", table="mavlink_dataflash")["ATTITUDE"]
    assert attitude.has_known("roll")
    assert not attitude._cache
    assert not told["ATT"]._cache


def test_own_column_that_is_decoded_is_not_decoded_again():
    calls = []

    def once() -> np.ndarray:
        calls.append(1)
        return np.array([0.1, 0.2])

    t = np.arange(2.0)
    att = Message("ATT", None, t, t, np.arange(2), {"Roll": Column(once, Conversion("rad"))})
    att.si("Roll")
    made = as_mavlink({"ATT": att}, "quad", table="mavlink_dataflash")
    np.testing.assert_array_equal(made["ATTITUDE"].si("roll"), [0.1, 0.2])
    assert len(calls) == 1


# two logs of one flight

PAIRS = (  # a copter, a plane; all others in the folder hold as well
    "copter/c03_ref_square_wind",
    "plane/p01_rect_calm",
)
# Steps of the log's own fields (format C, c) that the values themselves do not show: a constant, a
# length of two components.
_STEPS = {"vel_acc": 0.01, "WIND.speed": 0.01, "WIND.direction": 0.01}
# MAVLink sends the rate of the demanded attitude, RATE.?Des adds what corrects its error.
_OTHER_MEANING = ("ATTITUDE_TARGET.body_yaw_rate", "ATTITUDE_TARGET.body_pitch_rate")
_GAP_S = 1.0


@needs_shared
@pytest.mark.parametrize("name", PAIRS)
def test_telemetry_and_dataflash_of_one_flight_agree_within_their_quantisation(name):
    folder = SHARED / "flights" / "sitl"
    tlog, binary = (read(folder / f"{name}.{end}") for end in ("tlog", "BIN"))
    later = binary.clock.boot(0.0) - tlog.clock.boot(0.0)
    compared = 0
    for key, made in binary.messages.items():
        if made.made_from is None or key not in tlog:
            continue
        for field in made.fields:
            if field in tlog[key]:
                compared += _agree(tlog[key], made, field, later)
    assert compared > 90


def _agree(sent: Message, made: Message, field: str, later: float) -> bool:
    """Check one field of two logs; whether there was something to compare.

    Each log samples the signal at times of its own: between two samples it moves by ``change``.
    """
    name = f"{sent.key}.{field}"
    if name in _OTHER_MEANING:
        return False
    assert made.unit(field) == sent.unit(field), name
    t, value, own = sent.t - later, sent.si(field), made.si(field)
    known = np.isfinite(own)
    if known.sum() < 3:
        return False
    at = made.t[known]
    right = np.clip(np.searchsorted(at, t), 1, at.size - 1)
    inside = np.isfinite(value) & (t >= at[0]) & (t <= at[-1]) & (np.diff(at)[right - 1] < _GAP_S)
    if inside.sum() < 3:
        return False
    stated = _STEPS.get(field, _STEPS.get(name, 0.0))
    quantum = _quantum(value[inside]) + max(_quantum(own[known]), stated)
    turns = made.unit(field) == "rad"
    own = np.unwrap(own[known]) if turns else own[known]
    here = np.interp(t[inside], at, own)
    apart = value[inside] - here
    if turns:
        apart = (apart + np.pi) % (2 * np.pi) - np.pi
    there = here + apart
    change = float(np.median(np.abs(np.diff(there))))
    assert np.median(np.abs(apart)) <= quantum + 2 * change + 1e-9, name
    if np.std(there) > 20 * (quantum + change):
        assert np.corrcoef(here, there)[0, 1] > 0.95, name
    return True


def _quantum(values: np.ndarray) -> float:
    """Return the smallest step between two values."""
    steps = np.diff(np.unique(values))
    return float(steps.min()) if steps.size else 0.0
