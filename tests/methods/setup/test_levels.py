"""How much a compass reads, how much gyroscopes turn at rest, how much a vehicle shakes."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fdi.methods.setup import Check, check_setup
from fdi.methods.setup.motors import thrust_of
from fdi.telemetry import Log, read
from fdi.telemetry.log import ParameterChange
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

from .sensors import Ride, earth, write

T = np.arange(0.0, 60.0, 0.1)


def ride(tmp_path: Path, **how: object) -> Log:
    return read(write(tmp_path / "ride.tlog", Ride(**how)))


def checked(log: Log) -> dict[str, Check]:
    return {check.name: check for check in check_setup(log)}


def with_columns(log: Log, key: str, unit: str, **values: np.ndarray) -> Log:
    """Return a log with a message of these columns at `T`, or with them in place of its own."""
    columns = {
        name: Column(partial(np.asarray, value), Conversion(unit)) for name, value in values.items()
    }
    known = log.messages.get(key)
    if known is not None:
        made = replace(known, columns={**known.columns, **columns}, _cache={})
    else:
        made = Message(key, None, T, T, np.arange(T.size), columns)
    return replace(log, messages={**log.messages, key: made})


def test_a_compass_reads_the_earths_field(tmp_path: Path) -> None:
    check = checked(ride(tmp_path))["field at compass 1"]
    assert check.verdict == "in order"
    assert check.numbers["field_mgauss"] == pytest.approx(np.linalg.norm(earth()), rel=0.02)


@pytest.mark.parametrize(("scale", "verdict"), [(0.2, "wrong"), (1.5, "in order"), (2.2, "wrong")])
def test_a_field_with_which_nobody_arms_is_wrong(tmp_path: Path, scale, verdict) -> None:
    check = checked(ride(tmp_path, compass=scale * np.eye(3)))["field at compass 1"]
    assert check.verdict == verdict


def test_a_compass_that_never_moves_measures_nothing_if_it_is_to_be_used(tmp_path: Path) -> None:
    dead = ride(tmp_path, compass=np.zeros((3, 3)), told={"COMPASS_USE": 1.0})
    assert checked(dead)["readings of compass 1"].verdict == "wrong"
    assert "compass" not in checked(dead)  # not "the log holds no readings"
    # telemetry sends zeros of a compass that is not there
    for parameters in ({}, {"COMPASS_USE": 0.0}):
        assert "readings of compass 1" not in checked(replace(dead, parameters=parameters))


@pytest.mark.parametrize(("bias", "verdict"), [(0.03, "in order"), (0.3, "wrong")])
def test_gyroscopes_that_turn_at_rest_are_wrong(tmp_path: Path, bias, verdict) -> None:
    log = ride(tmp_path)
    off = log.messages["RAW_IMU"].si("xgyro") + bias
    found = checked(with_columns(log, "RAW_IMU", "rad/s", xgyro=off))["gyroscopes at rest"]
    assert found.verdict == verdict
    assert found.numbers["rate_deg_s"] == pytest.approx(np.degrees(bias), rel=0.01)


@pytest.mark.parametrize(
    ("level", "verdict", "strikes"),
    [(12.0, "in order", False), (45.0, "not known", True), (75.0, "wrong", True)],
)
def test_vibration_is_judged_by_what_ardupilot_calls_acceptable(
    tmp_path: Path, level: float, verdict: str, strikes: bool
) -> None:
    shakes = level + np.random.default_rng(2).normal(0, 1, T.size)
    calm = np.ones(T.size)
    log = with_columns(
        ride(tmp_path), "VIBRATION", "m/s^2", vibration_x=calm, vibration_y=shakes, vibration_z=calm
    )
    check = checked(log)["vibration"]
    assert (check.verdict, check.strikes) == (verdict, strikes)
    assert "to the side" in check.text
    assert check.numbers["level_m_s2"] == pytest.approx(level, abs=0.3)


def test_an_accelerometer_that_clips_in_the_air_is_told(tmp_path: Path) -> None:
    calm, clips = np.ones(T.size), np.where(T >= 30, 4.0, np.where(T >= 1, 1.0, 0.0))
    log = with_columns(ride(tmp_path), "VIBRATION", "m/s^2", vibration_z=calm, clipping_0=clips)
    check = checked(log)["vibration"]
    assert check.verdict == "not known"
    assert check.numbers["clipped"] == 3.0  # not the one that it had on the ground


def test_px4_has_its_own_levels_and_old_firmware_none(tmp_path: Path) -> None:
    log = ride(tmp_path)
    raw, level = np.full(T.size, 2000.0), np.full(T.size, 12.0)
    told = with_columns(
        log, "vehicle_imu_status", "", accel_vibration_metric=level, accel_raw_rate_hz=raw
    )
    assert checked(told)["vibration"].verdict == "wrong"
    old = with_columns(log, "vehicle_imu_status", "", accel_vibration_metric=level)
    assert "vibration" not in checked(old)


def test_offsets_that_are_calibrated_before_take_off_count(tmp_path: Path) -> None:
    told = {"COMPASS_OFS_X": 900.0, "COMPASS_OFS_Y": 0.0, "COMPASS_OFS_Z": 0.0}
    log = ride(tmp_path, told=told)
    name = "offsets of compass 1"
    assert checked(log)[name].verdict == "not known"  # 600 or 1800, by the firmware
    changed = ParameterChange(2.0, "COMPASS_OFS_X", 900.0, 90.0)
    assert checked(replace(log, parameter_changes=(changed,)))[name].verdict == "in order"
    late = changed._replace(t=30.0)
    assert checked(replace(log, parameter_changes=(late,)))[name].verdict == "not known"


def test_a_compass_is_numbered_as_its_readings_are(tmp_path: Path) -> None:
    """ArduPilot's offsets go by the order in which it found them, the records by priority."""
    told = {"COMPASS_OFS2_X": 90.0, "COMPASS_OFS2_Y": 0.0, "COMPASS_OFS2_Z": 0.0}
    ids = {"COMPASS_DEV_ID": 11.0, "COMPASS_DEV_ID2": 22.0, "COMPASS_DEV_ID3": 33.0}
    order = {"COMPASS_PRIO1_ID": 11.0, "COMPASS_PRIO2_ID": 33.0, "COMPASS_PRIO3_ID": 22.0}
    found = checked(ride(tmp_path, told={**told, **ids, **order}))
    assert "offsets of compass 3" in found
    assert "offsets of compass 2" not in found


def test_old_copters_are_driven_by_two_straight_pieces(tmp_path: Path) -> None:
    """Copter 3.1: half of the thrust at MOT_TCRV_MIDPCT of the range, all at MOT_TCRV_MAXPCT."""
    log = ride(tmp_path, length=15.0)
    curve = {"MOT_TCRV_ENABLE": 1.0, "MOT_TCRV_MIDPCT": 52.0, "MOT_TCRV_MAXPCT": 93.0}
    share = np.array([0.26, 0.52, 0.725, 0.93, 1.0])
    found = thrust_of(replace(log, parameters=curve), share)
    np.testing.assert_allclose(found, [0.25, 0.5, 0.75, 1.0, 1.0])
    straight = thrust_of(replace(log, parameters={"MOT_TCRV_ENABLE": 0.0}), share)
    np.testing.assert_allclose(straight, share)
    third = {"MOT_SPIN_MIN": 0.0, "MOT_THST_MAX": 0.8, "MOT_THST_EXPO": 0.0}
    found = thrust_of(replace(log, parameters=third), share[:3])
    np.testing.assert_allclose(found, share[:3] / 0.8)


def test_a_motor_at_the_limit_of_an_old_curve_is_at_its_limit(tmp_path: Path) -> None:
    curve = {"MOT_TCRV_ENABLE": 1.0, "MOT_TCRV_MIDPCT": 52.0, "MOT_TCRV_MAXPCT": 93.0}
    told = {"RC3_MIN": 1000.0, "RC3_MAX": 2000.0, "THR_MIN": 130.0, **curve}
    log = ride(tmp_path, told=told, output=1932)
    assert checked(log)["motor limits"].verdict == "wrong"
