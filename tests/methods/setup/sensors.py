"""Telemetry of a vehicle that turns and leans as it is told, with sensors that may be turned.

The Earth's field at the place is pygeomag's; everything else is rotation matrices by scipy.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pygeomag import GeoMag
from pymavlink.dialects.v20 import ardupilotmega as mav
from scipy.spatial.transform import Rotation
from telemetry.build import record

PLACE = (47.0, 8.0)
G = 9.80665
EYE = np.eye(3)


@dataclass(frozen=True)
class Ride:
    """A flight of a minute; matrices take a sensor's axes to the vehicle's."""

    kind: int = mav.MAV_TYPE_QUADROTOR
    compass: np.ndarray = field(default_factory=lambda: EYE)
    accelerometer: np.ndarray = field(default_factory=lambda: EYE)
    gyroscope: np.ndarray = field(default_factory=lambda: EYE)
    heading_off: float = 0.0  # rad, what the log's heading is too much
    course_off: float = 0.0  # rad, what the receiver's course is too much; its places are right
    upset: float = np.inf  # s, from when on the vehicle spins, 0.2 m beside its sensors
    spin: float = 20.0  # rad/s
    lies: bool = False  # on its side all along, as its attitude says
    turns: bool = True
    rate: float = 10.0
    length: float = 60.0
    output: int = 1500
    per_ampere: float = 0.0  # mgauss
    hard_iron: float = 0.0  # mgauss on every axis of the compass
    has_place: bool = True
    told: Mapping[str, float] = field(default_factory=dict)


def earth() -> np.ndarray:
    """Return the Earth's field at the place, mgauss, north, east, down."""
    model = GeoMag(coefficients_file="wmm/WMM_2020.COF")
    at = model.calculate(glat=PLACE[0], glon=PLACE[1], alt=0.0, time=2023.9)
    return np.array([at.x, at.y, at.z]) / 100


def write(path: Path, ride: Ride) -> Path:
    """Write the telemetry log of a ride."""
    t = np.arange(0.0, ride.length, 1 / ride.rate)
    flies = np.clip(t - 4.0, 0.0, 1.0) * np.clip(ride.length - 5 - t, 0.0, 1.0)
    roll = 0.25 * flies * np.sin(0.9 * t)
    pitch = 0.2 * flies * np.sin(0.6 * t + 1.0)
    yaw = 0.4 + (2.5 * flies * np.sin(0.15 * t) if ride.turns else 0.0 * t)
    turn = Rotation.from_euler("ZYX", np.c_[yaw, pitch, roll])
    rates = (turn[:-1].inv() * turn[1:]).as_rotvec() * ride.rate
    rates = np.vstack([rates, rates[-1]])
    up = turn.apply(np.tile([0.0, 0.0, -1.0], (t.size, 1)))
    pull = G * up[:, :2] / -up[:, 2:]
    pull[flies > 0] -= pull[flies > 0].mean(axis=0)  # it lands where it took off, and stands before
    speed = np.cumsum(pull, axis=0) / ride.rate
    place = np.radians(PLACE) + np.cumsum(speed, axis=0) / ride.rate / 6.37e6 / [1, np.cos(0.82)]
    held = turn.inv().apply(np.c_[pull, np.full(t.size, -G)])
    held[t > ride.upset, 0] += ride.spin**2 * 0.2
    rates[t > ride.upset, 2] = ride.spin
    amperes = 10.0 + 8.0 * np.sin(0.37 * t) * flies
    field_ = turn.inv().apply(np.tile(earth(), (t.size, 1))) + ride.per_ampere * amperes[:, None]
    seen = {
        "mag": field_ @ ride.compass + ride.hard_iron,
        "acc": held @ ride.accelerometer / G * 1000,
        "gyro": rates @ ride.gyroscope * 1000,
    }
    parts = [
        record(0.0, mav.MAVLink_param_value_message(n.encode(), v, 9, len(ride.told), i))
        for i, (n, v) in enumerate(ride.told.items())
    ]
    angles = np.c_[roll + ride.lies * np.pi / 2, pitch, yaw + ride.heading_off]
    for k in range(t.size):
        at = (*(speed[k]), *(np.degrees(place[k]) * ride.has_place))
        parts += _at(k, t[k], ride, angles[k], rates[k], at, seen, flies[k], amperes[k])
    path.write_bytes(b"".join(parts))
    return path


def _at(k, t, ride, angles, rates, moved, seen, flies, amperes) -> list[bytes]:
    stamp, height = round(1000 * t), 20.0 * flies
    wrapped = (angles + np.pi) % (2 * np.pi) - np.pi
    readings = [round(float(x)) for name in ("acc", "gyro", "mag") for x in seen[name][k]]
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    beat = mav.MAVLink_heartbeat_message(ride.kind, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, 0, 4, 3)
    north, east, *place = moved
    course = np.degrees(np.arctan2(east, north) + ride.course_off) % 360
    lat, lon = (round(1e7 * x) for x in place)
    position = (lat, lon, round(1000 * (400 + height)), round(1000 * height), 0, 0, 0, 0)
    fix = (1000 * stamp, 3, lat, lon, 400000, 80, 80, round(100 * np.hypot(north, east)))
    battery = (0, 0, 0, 0, [12000] + [65535] * 9, round(100 * amperes), 0, 0, 50)
    outputs = [ride.output + (3 * k + motor) % 5 - 2 for motor in range(4)]  # a controller's
    messages = [
        *([beat] if k % round(ride.rate) == 0 else []),
        mav.MAVLink_attitude_message(stamp, *wrapped, *rates),
        mav.MAVLink_raw_imu_message(1000 * stamp, *readings),
        mav.MAVLink_gps_raw_int_message(*fix, min(round(100 * course), 35999), 12),
        mav.MAVLink_global_position_int_message(stamp, *position),
        mav.MAVLink_vfr_hud_message(0.0, 0.0, 0, round(35 * flies), 400 + height, 0.0),
        mav.MAVLink_battery_status_message(*battery),
        mav.MAVLink_servo_output_raw_message(1000 * stamp, 0, *outputs, 0, 0, 0, 0),
    ]
    return [record(t, message) for message in messages]
