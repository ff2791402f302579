"""Do signs, frames and units of what a log says in MAVLink's words agree with physics?

Independent of the tables: what moves must move as its rate says, and gravity points down. Logs are
Copter 3.1 to 4.6, Plane 4.6 and PX4 1.12 and 1.15, simulated and recorded.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from fdi.telemetry import Log, read

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "flights"
pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")

NEW = (
    "crash/motor2_lost.bin",
    "propeller_cut/good_prop_straight_line_3.bin",
    "sitl/plane/p01_rect_calm.BIN",
    "sitl/copter/c03_ref_square_wind.BIN",
    "triplex/comm_fail/instance_0.ulg",
    "crash/motors_cut_in_air.ulg",
)
ALL = (*NEW, "healthy/quad_short.bin")
STEP_S = 0.25  # over which a rate is taken


@lru_cache
def log_of(name: str) -> Log:
    return read(SHARED / name)


def in_air(name: str, *channels: str) -> tuple[np.ndarray, ...]:
    """Return channels on one grid while the vehicle flies; angles unwrapped."""
    log = log_of(name)
    (low, high) = log.flights[0].airborne
    t = np.arange(low + 1, high - 1, STEP_S)
    out = []
    for channel in channels:
        at, value, unit = log.channel(channel)
        known = np.isfinite(value)
        value = np.unwrap(value[known]) if unit == "rad" else value[known]
        out.append(np.interp(t, at[known], value))
    return tuple(out)


def agreement(moved: np.ndarray, rate: np.ndarray) -> tuple[float, float]:
    """Return correlation and slope between the change of a quantity and its rate."""
    change = np.gradient(moved, STEP_S)
    return float(np.corrcoef(change, rate)[0, 1]), float(change @ rate / (rate @ rate))


@pytest.mark.parametrize("name", ALL)
def test_height_changes_as_the_climb_rate_says(name):
    height, climb, down = in_air(
        name, "GLOBAL_POSITION_INT.relative_alt", "VFR_HUD.climb", "GLOBAL_POSITION_INT.vz"
    )
    r, slope = agreement(height, climb)
    assert r > 0.8
    assert slope == pytest.approx(1, abs=0.25)
    np.testing.assert_allclose(np.corrcoef(climb, -down)[0, 1], 1, atol=0.01)


@pytest.mark.parametrize("name", NEW)
@pytest.mark.parametrize("axis", "xy")
def test_position_changes_as_the_velocity_says(name, axis):
    place, velocity = in_air(name, f"LOCAL_POSITION_NED.{axis}", f"LOCAL_POSITION_NED.v{axis}")
    r, slope = agreement(place, velocity)
    assert r > 0.95
    assert slope == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("name", NEW)
def test_latitude_grows_towards_north(name):
    latitude, north = in_air(name, "GPS_RAW_INT.lat", "GLOBAL_POSITION_INT.vx")
    r, _ = agreement(latitude, north)
    assert r > 0.6  # a receiver's position is coarse and late


@pytest.mark.parametrize("name", ALL)
def test_nose_turns_as_the_yaw_rate_says(name):
    yaw, rate, gyro = in_air(name, "ATTITUDE.yaw", "ATTITUDE.yawspeed", "RAW_IMU.zgyro")
    assert agreement(yaw, rate)[0] > 0.7  # banked, the two differ
    assert np.corrcoef(rate, gyro)[0, 1] > 0.9


@pytest.mark.parametrize("name", ALL)
def test_heading_is_the_yaw_and_speeds_are_one(name):
    yaw, heading, speed, measured = in_air(
        name, "ATTITUDE.yaw", "GLOBAL_POSITION_INT.hdg", "VFR_HUD.groundspeed", "GPS_RAW_INT.vel"
    )
    turn = (yaw - heading + np.pi) % (2 * np.pi) - np.pi
    assert np.median(np.abs(turn)) < 0.02
    assert np.median(np.abs(speed - measured)) < 0.5
    raw = log_of(name)["ATTITUDE"].si("yaw")
    assert np.nanmin(raw) >= -np.pi
    assert np.nanmax(raw) <= np.pi


@pytest.mark.parametrize("name", ALL)
def test_specific_force_points_up_and_has_the_size_of_gravity(name):
    x, y, z = in_air(name, *(f"RAW_IMU.{axis}acc" for axis in "xyz"))
    assert -12 < np.median(z) < -8
    assert abs(np.median(x)) < 3
    assert abs(np.median(y)) < 3


@pytest.mark.parametrize("name", NEW)
def test_field_is_the_earths_and_pressure_falls_with_height(name):
    log = log_of(name)
    size = np.sqrt(sum(log["RAW_IMU"].si(f"{axis}mag") ** 2 for axis in "xyz"))
    assert 25e-6 < np.nanmedian(size) < 65e-6
    height, pressure = in_air(name, "VFR_HUD.alt", "SCALED_PRESSURE.press_abs")
    assert np.corrcoef(height, pressure)[0, 1] < -0.85
    assert 8e4 < np.median(pressure) < 1.1e5


@pytest.mark.parametrize("name", ["triplex/comm_fail/instance_0.ulg"])
def test_attitude_is_that_of_the_simulated_vehicle(name):
    for angle in ("roll", "pitch", "yaw"):
        mine, truth = in_air(name, f"ATTITUDE.{angle}", f"SIMSTATE.{angle}")
        apart = (mine - truth + np.pi) % (2 * np.pi) - np.pi
        assert np.median(np.abs(apart)) < 0.02
