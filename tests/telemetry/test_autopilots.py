"""Both autopilots speak MAVLink, and what they mean is told apart before a model reads it."""

import numpy as np
import pytest

from fdi.telemetry.meaning import as_ardupilot, as_mavlink
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

T = np.arange(0.0, 2.0, 0.5)


def message(key: str, t: np.ndarray = T, /, **fields: tuple[str, float]) -> Message:
    """Return a message with constant fields: the SI unit and the value of each."""
    columns = {
        name.replace("__", "["): Column(
            lambda v=value: np.full(t.size, v), Conversion(unit), is_discrete=False
        )
        for name, (unit, value) in fields.items()
    }
    name, _, number = key.partition("[")
    return Message(name, int(number[:-1]) if number else None, t, t, np.arange(t.size), columns)


def by_key(*messages: Message) -> dict[str, Message]:
    return {m.key: m for m in messages}


def test_px4_sends_errors_as_actual_minus_demanded():
    own = by_key(
        message(
            "NAV_CONTROLLER_OUTPUT",
            alt_error=("m", -12.0),
            aspd_error=("m/s", -3.0),
            nav_roll=("rad", 0.2),
            nav_pitch=("rad", 0.1),
            wp_dist=("m", 40.0),
        )
    )
    told = as_ardupilot(own, "plane")["NAV_CONTROLLER_OUTPUT"]
    assert told.si("alt_error").tolist() == [12.0] * 4  # demanded minus actual: it is too low
    assert told.si("aspd_error").tolist() == [3.0] * 4
    assert told.si("nav_roll") == pytest.approx(0.2)
    assert told.si("wp_dist").tolist() == [40.0] * 4  # what is alike stays


def test_px4_sends_the_height_from_1_14_on_as_demanded_minus_actual():
    """It then sends no attitude, and the airspeed as before."""
    own = by_key(
        message(
            "NAV_CONTROLLER_OUTPUT",
            alt_error=("m", 12.0),
            aspd_error=("m/s", -3.0),
            nav_roll=("rad", 0.0),
            nav_pitch=("rad", 0.0),
        )
    )
    told = as_ardupilot(own, "plane")["NAV_CONTROLLER_OUTPUT"]
    assert told.si("alt_error").tolist() == [12.0] * 4
    assert told.si("aspd_error").tolist() == [3.0] * 4


def test_px4_demands_of_attitude_come_from_the_quaternion():
    half = 0.15
    quaternion = {f"q__{i}]": ("", v) for i, v in enumerate((np.cos(half), np.sin(half), 0, 0))}
    own = by_key(message("ATTITUDE_TARGET", **quaternion))
    told = as_ardupilot(own, "quad")["NAV_CONTROLLER_OUTPUT"]
    assert told.si("nav_roll") == pytest.approx(2 * half)
    assert told.si("nav_pitch") == pytest.approx(0.0)


def test_px4_inertial_sensors_and_compass_are_raw_imu():
    own = by_key(
        message("HIGHRES_IMU", xacc=("m/s^2", 1.0), zgyro=("rad/s", 0.5), xmag=("T", 2e-5))
    )
    told = as_ardupilot(own, "plane")["RAW_IMU"]
    assert told.si("xacc") == pytest.approx(1.0)
    assert told.si("zgyro") == pytest.approx(0.5)
    assert told.si("xmag") == pytest.approx(2e-5)


@pytest.mark.parametrize("told", [99_000.0, 9_900_000.0])  # Pa: as documented, and as PX4 sends it
def test_px4_barometer_is_read_where_it_is_told_more_often(told):
    own = by_key(
        message("HIGHRES_IMU", abs_pressure=("Pa", told)),
        message("SCALED_PRESSURE", T[::2], press_abs=("Pa", 99_500.0)),
    )
    barometer = as_ardupilot(own, "quad")["SCALED_PRESSURE"]
    assert barometer.si("press_abs").tolist() == [99_000.0] * 4
    often = by_key(
        message("HIGHRES_IMU", T[::2], abs_pressure=("Pa", told)),
        message("SCALED_PRESSURE", press_abs=("Pa", 99_500.0)),
    )
    assert as_ardupilot(often, "quad")["SCALED_PRESSURE"].si("press_abs").tolist() == [99_500.0] * 4


def test_px4_wind_comes_from_where_it_does_not_blow_to():
    own = by_key(message("WIND_COV", wind_x=("m/s", -3.0), wind_y=("m/s", 0.0)))
    told = as_ardupilot(own, "plane")["WIND"]
    assert told.si("speed") == pytest.approx(3.0)
    assert np.cos(told.si("direction")) == pytest.approx(1.0)  # from the north


def test_px4_vibration_metrics_are_no_acceleration():
    own = by_key(message("VIBRATION", vibration_z=("m/s^2", 0.1), vibration_x=("m/s^2", 0.1),
                         vibration_y=("m/s^2", 0.1)))  # fmt: skip
    assert as_ardupilot(own, "quad")["VIBRATION"].unit("vibration_z") == ""


@pytest.mark.parametrize(
    ("setpoint", "actual"),
    [
        (("altitudeSp", "altitude_filtered"), None),  # v1.6
        (("altitude_sp", "altitude_filtered"), None),  # v1.11
        (("altitude_sp", None), "vehicle_global_position"),  # v1.16
    ],
)
def test_height_wanted_is_known_in_every_version_of_px4(setpoint, actual):
    wanted, own = setpoint
    fields = {wanted: ("m", 100.0), **({own: ("m", 80.0)} if own else {})}
    messages = [
        message("tecs_status", **fields),
        message("vehicle_attitude_setpoint", roll_body=("rad", 0.0)),
    ]
    if actual:
        messages.append(message(actual, alt=("m", 80.0)))
    told = as_mavlink(by_key(*messages), "plane", table="mavlink_ulog")["NAV_CONTROLLER_OUTPUT"]
    assert told.si("alt_error") == pytest.approx(20.0)


@pytest.mark.parametrize("name", ["mag_test_ratio", "hdg_test_ratio"])
def test_compass_ratio_is_known_under_both_names(name):
    own = by_key(message("estimator_status", **{name: ("", 0.3)}))
    told = as_mavlink(own, "quad", table="mavlink_ulog")["EKF_STATUS_REPORT"]
    assert told.si("compass_variance") == pytest.approx(0.3)
