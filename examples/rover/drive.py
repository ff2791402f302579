"""Simulates a drive of a small rover and writes what its telemetry would say: a MAVLink log.

A car-like rover (bicycle model, 0.55 m between the axles) follows a course of curves at changing
speed; speed answers the throttle as a first-order lag, drags on bumps and slopes, and a slow
controller keeps it. Half-way through the drive one of the two wheel motors dies: the rest gives
half of the speed for the same throttle. Sensors have noise, lag, steps of resolution. Run it as

    python examples/rover/drive.py LOG

The same seed gives the same log, byte for byte. Numbers are those of a small hobby rover.
"""

from __future__ import annotations

import argparse
import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

STEP = 0.025  # s
RATE_HZ = 4
LENGTH = 100.0  # s
ARMED = 3.0  # s
MOVES = 5.0  # s
FAILS = 52.0  # s: one of two wheel motors
EPOCH = 1_750_000_000  # s since 1970

TOP_SPEED = 6.0  # m/s at full throttle
LAG = 0.8  # s, speed behind throttle
AXLES = 0.55  # m
LOCK = 0.45  # rad, wheels at full steering
SERVO_LAG = 0.12  # s
HOME = (47.3977, 8.5456)  # deg
RADIUS = 6378137.0  # m


class Moment(NamedTuple):
    """The true state at t, s."""

    t: float
    throttle: float
    steering: float
    speed: float
    yaw: float
    yaw_rate: float
    way: float
    north: float
    east: float
    current: float


def drive(seed: int, *, works: float = 0.5, fails: float = FAILS) -> Iterator[Moment]:
    """Yield the drive step by step; from ``fails`` on the motors give ``works`` of the speed."""
    random = np.random.default_rng(seed)
    speed = yaw = way = north = east = wheels = drag = held = 0.0
    for k in range(round(LENGTH / STEP)):
        t = k * STEP
        moving = t >= MOVES
        wanted = (2.0 + 0.5 * math.sin(0.23 * (t - MOVES))) * moving
        held = float(np.clip(held + 0.05 * (wanted - speed) * STEP, -0.2, 0.6)) * moving
        throttle = float(np.clip(wanted / TOP_SPEED + 0.3 * (wanted - speed) + held, 0.0, 1.0))
        throttle *= moving
        curve = 0.35 * math.sin(0.37 * t) + 0.25 * math.sin(0.11 * t + 1.0)
        steering = float(np.clip(curve, -0.8, 0.8)) * moving
        wheels += (steering * LOCK - wheels) * STEP / SERVO_LAG
        drag += (random.normal(0.0, 0.12) - drag) * STEP / 2.0  # m/s: bumps, grass, slopes
        gives = works if t >= fails else 1.0
        speed += (TOP_SPEED * gives * throttle + drag * moving - speed) * STEP / LAG
        speed = max(speed, 0.0)
        yaw_rate = speed * math.tan(wheels) / AXLES
        yaw = (yaw + yaw_rate * STEP) % (2 * math.pi)
        way += speed * STEP
        north += speed * math.cos(yaw) * STEP
        east += speed * math.sin(yaw) * STEP
        current = 0.8 + 14.0 * throttle * gives
        yield Moment(t, throttle, steering, speed, yaw, yaw_rate, way, north, east, current)


def messages(now: Moment, random: np.random.Generator) -> Iterator[mav.MAVLink_message]:
    """Yield what the autopilot sends at a moment."""
    boot, us = round(now.t * 1000) + 1000, round(now.t * 1e6) + 1_000_000
    wander = 0.4 * math.sin(0.05 * now.t), 0.3 * math.cos(0.07 * now.t)  # m, of the receiver
    v_n, v_e = (now.speed * f(now.yaw) + random.normal(0, 0.05) for f in (math.cos, math.sin))
    seen = _place(now.north + wander[0], now.east + wander[1])
    estimated = _place(now.north + random.normal(0, 0.05), now.east + random.normal(0, 0.05))
    roll, pitch = random.normal(0, 0.015, 2)
    turn = now.yaw_rate + random.normal(0, 0.01)
    course = round(math.degrees(now.yaw) * 100) % 36000 if now.speed > 0.3 else 0
    ground = max(now.speed + random.normal(0, 0.06), 0.0)
    heading = (now.yaw + random.normal(0, 0.01) + math.pi) % (2 * math.pi) - math.pi
    outputs = [round(1500 + 400 * now.steering), 0, round(1500 + 500 * now.throttle), 0]
    yield mav.MAVLink_servo_output_raw_message(us & 0xFFFFFFFF, 0, *outputs, 0, 0, 0, 0)
    yield mav.MAVLink_attitude_message(boot, roll, pitch, heading, 0.0, 0.0, turn)
    yield mav.MAVLink_gps_raw_int_message(
        us, 3, *seen, 450_000, 90, 150, round(ground * 100), course, 12
    )
    yield mav.MAVLink_global_position_int_message(
        boot, *estimated, 450_000, 0,
        round(v_n * 100), round(v_e * 100), 0, round(math.degrees(now.yaw) * 100) % 36000,
    )  # fmt: skip
    gyro = round((now.yaw_rate + 0.004 + random.normal(0, 0.01)) * 1000)
    yield mav.MAVLink_raw_imu_message(us, 0, 0, -1000, 0, 0, gyro, 200, 0, 400)
    way = round(now.way * 1.005, 2)  # wheels a little smaller than was set
    yield mav.MAVLink_wheel_distance_message(us, 1, [way] + [0.0] * 15)
    amperes = max(round((now.current + random.normal(0, 0.15)) * 100), 0)
    volts = round((12.4 - 0.02 * now.current - 0.002 * now.t) * 1000)
    yield mav.MAVLink_sys_status_message(0, 0, 0, 300, volts, amperes, 80, 0, 0, 0, 0, 0, 0)


def _place(north: float, east: float) -> tuple[int, int]:
    """Return latitude and longitude, 1e-7 deg, of a place so many metres from home."""
    across = RADIUS * math.cos(math.radians(HOME[0]))
    degrees = HOME[0] + math.degrees(north / RADIUS), HOME[1] + math.degrees(east / across)
    return round(degrees[0] * 1e7), round(degrees[1] * 1e7)


def beat(t: float) -> mav.MAVLink_message:
    """Return the heartbeat: an ArduPilot rover, in AUTO, armed or not."""
    mode = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    mode |= mav.MAV_MODE_FLAG_SAFETY_ARMED if t >= ARMED else 0
    return mav.MAVLink_heartbeat_message(
        mav.MAV_TYPE_GROUND_ROVER, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, mode, 10, 4, 3
    )


def log(seed: int, *, works: float = 0.5, fails: float = FAILS) -> bytes:
    """Return the bytes of the telemetry log of a drive."""
    random = np.random.default_rng(seed + 1)
    sender = mav.MAVLink(None, 1, 1)
    made = bytearray()

    def send(t: float, message: mav.MAVLink_message) -> None:
        made.extend(struct.pack(">Q", round((EPOCH + t) * 1e6)) + bytes(message.pack(sender)))
        sender.seq = (sender.seq + 1) % 256

    parameters = {
        "SERVO1_FUNCTION": 26,
        "SERVO3_FUNCTION": 70,
        "SERVO1_TRIM": 1500,
        "SERVO3_TRIM": 1500,
        "BATT_LOW_VOLT": 10.5,
    }
    every = round(1 / (RATE_HZ * STEP))
    for k, now in enumerate(drive(seed, works=works, fails=fails)):
        if k == 0:
            for i, (name, value) in enumerate(parameters.items()):
                send(
                    0.0,
                    mav.MAVLink_param_value_message(name.encode(), value, 9, len(parameters), i),
                )
        if k % round(1 / STEP) == 0:
            send(now.t, beat(now.t))
        if k % every == 0:
            for message in messages(now, random):
                send(now.t, message)
    return bytes(made)


def main() -> None:
    """Write the log that the command line asks for."""
    asked = argparse.ArgumentParser(description="simulate a drive of a rover")
    asked.add_argument("log", type=Path)
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--works", type=float, default=0.5, help="speed that is left for a throttle")
    asked.add_argument("--fails", type=float, default=FAILS, help="s; from then on")
    args = asked.parse_args()
    args.log.write_bytes(log(args.seed, works=args.works, fails=args.fails))


if __name__ == "__main__":
    main()
