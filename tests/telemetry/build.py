"""Composes telemetry logs for tests: records over pymavlink, and a whole small flight.

A damaged, shifted or mixed log is one changed argument, or one edit of the list of records.
"""

import hashlib
import math
import struct
from dataclasses import dataclass, replace

from pymavlink.dialects.v20 import ardupilotmega as mav

EPOCH = 1_700_000_000.0  # s since 1970 at stamp 0
KEY = bytes(range(32))
RISE = 3.0  # m/s, climb of the example flight
DOWN = 0.5  # m/s, its descent


def record(
    t: float,
    message: mav.MAVLink_message,
    *,
    system: int = 1,
    component: int = 1,
    version: int = 2,
    sequence: int = 0,
    signed: bool = False,
    base_size: int | None = None,
    epoch: float = EPOCH,
) -> bytes:
    """Return one record: stamp and frame; ``base_size`` cuts the extensions off a MAVLink 1 one."""
    sender = mav.MAVLink(None, system, component)
    sender.seq = sequence % 256
    frame = bytes(message.pack(sender, force_mavlink1=version == 1))
    if base_size is not None:
        frame = cut(frame, base_size)
    if signed:
        frame = sign(frame)
    return struct.pack(">Q", round((epoch + t) * 1e6)) + frame


def cut(frame: bytes, size: int) -> bytes:
    """Return the MAVLink 1 frame with a payload of that size (pymavlink sends extensions too)."""
    body = bytes([frame[0], size]) + frame[2 : 6 + size]
    crc = mav.x25crc(body[1:])
    crc.accumulate(struct.pack("B", mav.mavlink_map[frame[5]].crc_extra))
    return body + struct.pack("<H", crc.crc)


def sign(frame: bytes) -> bytes:
    """Return the MAVLink 2 frame with the signed flag, a new checksum and a signature."""
    body = bytearray(frame[:-2])
    body[2] |= 1
    number = body[7] | body[8] << 8 | body[9] << 16
    crc = mav.x25crc(bytes(body[1:]))
    crc.accumulate(struct.pack("B", mav.mavlink_map[number].crc_extra))
    whole = bytes(body) + struct.pack("<H", crc.crc)
    tail = b"\x00" + (123456789).to_bytes(6, "little")
    return whole + tail + hashlib.sha256(KEY + whole + tail).digest()[:6]


@dataclass(frozen=True)
class Flight:
    """An example flight: 5 s at rest, a climb, some hovering, a descent, 5 s at rest."""

    boot: float = 20.0  # s since boot at t = 0
    epoch: float = EPOCH
    rate: float = 5.0
    hover: float = 10.0
    height: float = 12.0
    system: int = 1
    version: int = 2
    kind: int = mav.MAV_TYPE_QUADROTOR
    delay: float = 0.01  # s of the link
    down: float = DOWN  # m/s of descent
    vz_sign: float = 1.0
    heading: float = 0.1  # rad
    start: float = 0.0  # s on the recorder's clock at the flight's own 0

    def phases(self) -> tuple[float, float, float, float]:
        """Return take-off, top, begin of descent, touch-down."""
        up = 5.0
        top = up + self.height / RISE
        return up, top, top + self.hover, top + self.hover + self.height / self.down

    @property
    def duration(self) -> float:
        return self.phases()[3] + 5.0

    def height_at(self, t: float) -> tuple[float, float]:
        """Return height and climb rate."""
        up, top, down, ground = self.phases()
        if t < up or t >= ground:
            return 0.0, 0.0
        if t < top:
            return RISE * (t - up), RISE
        if t < down:
            return self.height, 0.0
        return self.down * (ground - t), -self.down

    @staticmethod
    def given(tick: int, *, flying: bool) -> list[int]:
        """Return what a controller that is at work gives its four motors, us."""
        return [1600 + (3 * tick + 5 * motor) % 11 if flying else 1000 for motor in range(4)]

    def messages(self, t: float, tick: int) -> list[mav.MAVLink_message]:
        height, climb = self.height_at(t)
        ms = round((self.boot + t) * 1000)
        armed = 4.0 <= t < self.phases()[3] + 2
        flying = self.phases()[0] <= t < self.phases()[3]
        mode = 5 if t < self.phases()[1] else 3
        out = [
            mav.MAVLink_attitude_message(ms, 0.01, -0.02, self.heading, 0, 0, 0.001 * tick),
            mav.MAVLink_global_position_int_message(
                ms,
                473000000,
                85000000,
                round(1000 * (400 + height)),
                round(1000 * height),
                0,
                0,
                round(-100 * self.vz_sign * climb),
                round(math.degrees(self.heading) * 100),
            ),
            mav.MAVLink_vfr_hud_message(0.0, 0.0, 6, 40 if flying else 0, 400 + height, climb),
            mav.MAVLink_raw_imu_message(ms * 1000, 3, -2, -1000, 1, 2, 3, 200, 10, 400),
            mav.MAVLink_servo_output_raw_message(
                (ms * 1000) % 2**32, 0, *self.given(tick, flying=flying), *([0] * 4)
            ),
            mav.MAVLink_gps_raw_int_message(
                ms * 1000, 3, 473000000, 85000000, 400000, 80, 120, 0, 65535, 12
            ),
        ]
        if tick % round(self.rate) == 0:
            base = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (0x80 if armed else 0)
            utc = round((EPOCH + t) * 1e6)
            out = [
                mav.MAVLink_heartbeat_message(self.kind, 3, base, mode, 4, 3),
                mav.MAVLink_system_time_message(utc, ms),
                *out,
            ]
        return out

    def records(self, until: float | None = None) -> list[bytes]:
        """Return the records in the order of the file."""
        made, sequence = [], 0
        ticks = int((self.duration if until is None else until) * self.rate)
        for tick in range(ticks + 1):
            t = tick / self.rate
            for i, message in enumerate(self.messages(t, tick)):
                made.append(
                    record(
                        self.start + t + self.delay + 1e-4 * i,
                        message,
                        system=self.system,
                        version=self.version,
                        sequence=sequence,
                        epoch=self.epoch,
                    )
                )
                sequence += 1
        return made

    def bytes(self, until: float | None = None) -> bytes:
        return b"".join(self.records(until))

    def but(self, **changes: object) -> "Flight":
        return replace(self, **changes)


AFTER = 13.0  # s, when an autopilot is heard again that starts anew in the air


class Later(Flight):
    """The same flight, from ``AFTER`` s on."""

    def messages(self, t: float, tick: int) -> list[mav.MAVLink_message]:
        return super().messages(t + AFTER, tick)


def started_anew(since_boot: float = 2.0) -> list[bytes]:
    """Return the records of the example flight by an autopilot that starts anew in it."""
    later = Later(boot=since_boot - AFTER, start=AFTER)
    return later.records(Flight().duration - AFTER)
