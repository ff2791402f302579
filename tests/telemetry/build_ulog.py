"""Composes ULogs for tests: messages one by one, and a whole small flight.

A damaged or unusual log is one changed argument, or one edit of the list of messages.
"""

import math
import struct
from collections.abc import Sequence

MAGIC = b"ULog\x01\x12\x35"
SYNC = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])


def create_message(kind: str, body: bytes) -> bytes:
    """Return a message: size, type, body."""
    return struct.pack("<HB", len(body), ord(kind)) + body


def header(start_us: int = 1_000_000, version: int = 1) -> bytes:
    return MAGIC + struct.pack("<BQ", version, start_us)


def flag_bits(incompatible: int = 0, offsets: Sequence[int] = ()) -> bytes:
    places = [*offsets, 0, 0, 0][:3]
    body = bytes(8) + incompatible.to_bytes(8, "little") + struct.pack("<3Q", *places)
    return create_message("B", body)


def topic(text: str) -> bytes:
    """Return a format, ``name:type field;...``."""
    return create_message("F", text.encode())


def keyed(kind: str, key: str, value: bytes, before: bytes = b"") -> bytes:
    """Return a message with a key: I, P, and with a byte before it M and Q."""
    return create_message(kind, before + bytes([len(key)]) + key.encode() + value)


def info(name: str, value: str) -> bytes:
    return keyed("I", f"char[{len(value.encode())}] {name}", value.encode())


def parameter(name: str, value: float) -> bytes:
    if isinstance(value, int):
        return keyed("P", f"int32_t {name}", struct.pack("<i", value))
    return keyed("P", f"float {name}", struct.pack("<f", value))


def subscribe(number: int, name: str, instance: int = 0) -> bytes:
    return create_message("A", struct.pack("<BH", instance, number) + name.encode())


def data(number: int, layout: str, *values: object) -> bytes:
    return create_message("D", struct.pack(f"<H{layout}", number, *values))


def logged(t_us: int, text: str, level: int = 6, tag: int | None = None) -> bytes:
    head = str(level).encode() + (b"" if tag is None else struct.pack("<H", tag))
    body = head + struct.pack("<Q", t_us) + text.encode()
    return create_message("L" if tag is None else "C", body)


def dropout(ms: int) -> bytes:
    return create_message("O", struct.pack("<H", ms))


def sync() -> bytes:
    return create_message("S", SYNC)


def definitions() -> list[bytes]:
    """Return the definitions of the small log."""
    return [
        info("sys_name", "PX4"),
        keyed("I", "uint32_t ver_sw_release", struct.pack("<I", 0x010F02FF)),
        topic("motor:float rpm;uint8_t state;uint8_t[3] _padding0;"),
        topic(
            "motors:uint64_t timestamp;motor[2] motor;char[8] label;bool ok;uint8_t[7] _padding0;"
        ),
        topic("wave:uint64_t timestamp;float height_m;int16_t[3] raw;"),
        topic("vehicle_status:uint64_t timestamp;uint8_t nav_state;uint8_t arming_state;"),
        parameter("MAV_TYPE", 13),
        parameter("GAIN", 0.5),
        subscribe(0, "wave"),
        subscribe(1, "wave", 1),
        subscribe(7, "motors"),
        subscribe(9, "vehicle_status"),
    ]


def records(count: int = 50, t_us: int = 1_000_000) -> list[bytes]:
    """Return the data of the small log, 10 Hz."""
    made = []
    for i in range(count):
        t = t_us + 100_000 * i
        made.append(data(0, "Qf3h", t, math.sin(i), i, -i, 7))
        made.append(data(1, "Qf3h", t + 500, math.cos(i), i, -i, 8))
        motors = (100.0 + i, 1, b"", 200.0 + i, 2, b"", b"left", 1)
        made.append(data(7, "QfB3sfB3s8sB", t + 700, *motors))
        if i % 10 == 0:
            made.append(data(9, "QBB", t + 800, 0 if i < 30 else 3, 2 if 10 <= i < 40 else 1))
    return made


def small(count: int = 50, *, start_us: int = 1_000_000) -> bytes:
    """Return a log with nested formats, instances, arrays, texts, a dropout and a change."""
    made = records(count)
    made.insert(30, logged(1_900_000, "[commander] Takeoff detected"))
    made.insert(40, sync())
    made.insert(50, parameter("GAIN", 0.75))
    made.insert(60, dropout(250))
    return b"".join([header(start_us), flag_bits(), *definitions(), *made])
