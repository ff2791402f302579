"""Which short logs are mutated?

Real logs, thinned to a few messages and records each, where they are beside the repository;
composed ones everywhere. A head is a list of chunks (definitions, records, lines), so that
mutations can work on whole ones.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from ..build import Flight, sign

SHARED: Final = Path(__file__).resolve().parents[3].parent / "shared"
EXAMPLES: Final = Path(__file__).resolve().parents[3] / "examples" / "crash_logs"
RECORDS: Final = 6  # of each message
SIZE: Final = 6_000  # bytes, about, of a head

TELEMETRY: Final = (
    EXAMPLES / "copter_motor_failure_crash.tlog",
    EXAMPLES / "plane_engine_failure_stall.tlog",
    SHARED / "telemetry" / "samples" / "mixed_v1_v2_head.tlog",
    SHARED / "flights" / "healthy" / "copter_2013.tlog",
)
BINARY: Final = (
    SHARED / "telemetry" / "samples" / "copter_sitl_4.7.bin",
    SHARED / "flights" / "crash" / "motor2_lost.bin",
    SHARED / "flights" / "healthy" / "quad_short.bin",
    SHARED / "flights" / "sitl" / "plane" / "p20_engine_stop.BIN",
)
TEXT: Final = (
    SHARED / "flights" / "crash" / "mechanical_fail.log",
    SHARED / "flights" / "odd" / "nan.log",
    SHARED / "flights" / "odd" / "tradheli_brownout.log",
    SHARED / "flights" / "odd" / "underpowered.log",
)
ULOG: Final = (
    SHARED / "telemetry" / "samples" / "cubeorange_1.11.ulg",
    SHARED / "flights" / "odd" / "sitl_2017.ulg",
    SHARED / "flights" / "odd" / "not_a_flight.ulg",
    SHARED / "flights" / "healthy" / "no_battery_monitor.ulg",
)
_MESSAGES: Final = (
    "FMT FMTU UNIT MULT ATT IMU GPS BARO CTUN MODE MSG PARM EV ERR ARM RCOU BAT VIBE XKF4 POS "
    "CURR NTUN CMD ISBD"
)
_TOPICS: Final = (
    "vehicle_attitude sensor_combined vehicle_status battery_status vehicle_gps_position "
    "esc_status actuator_outputs vehicle_local_position vehicle_land_detected sensor_baro input_rc"
)
MESSAGES: Final = frozenset(_MESSAGES.split())
TOPICS: Final = frozenset(_TOPICS.split())


@dataclass(frozen=True, slots=True)
class Head:
    """A short log: its kind (``tlog``, ``bin``, ``log``, ``ulg``) and its chunks in order."""

    kind: str
    name: str
    chunks: tuple[bytes, ...]


@cache
def heads() -> tuple[Head, ...]:
    """Return all heads at hand, in the same order every time."""
    flight = Flight(hover=0.0, height=2.0, rate=3.0)
    signed = tuple(r[:8] + sign(r[8:]) for r in flight.records()[:80])
    found = [
        Head("tlog", "composed", tuple(flight.records())),
        Head("tlog", "composed, signed", signed),
        Head("tlog", "composed, version 1", tuple(flight.but(version=1).records()[:150])),
        Head("bin", "composed", tuple(composed_binary())),
        Head("log", "composed", tuple(composed_text())),
        Head("ulg", "composed", tuple(composed_ulog())),
    ]
    for path in TELEMETRY:
        if path.is_file():
            data = path.read_bytes()[: 60 * SIZE]
            found.append(Head("tlog", path.stem, _thin_telemetry(data)))
    for paths, kind, thin in (
        (BINARY, "bin", _thin_binary),
        (TEXT, "log", _thin_text),
        (ULOG, "ulg", _thin_ulog),
    ):
        for path in paths:
            if path.is_file():
                found.append(Head(kind, path.stem, tuple(thin(path.read_bytes()))))
    return tuple(found)


def telemetry_records(data: bytes) -> Iterator[bytes]:
    """Yield the records of an intact telemetry log."""
    at = 0
    while at + 16 <= len(data):
        is_v2 = data[at + 8] == 0xFD
        size = (20 if is_v2 else 16) + data[at + 9] + (13 if is_v2 and data[at + 10] & 1 else 0)
        if data[at + 8] not in (0xFD, 0xFE) or at + size > len(data):
            return
        yield data[at : at + size]
        at += size


def _thin_telemetry(data: bytes) -> tuple[bytes, ...]:
    """Return records spread over the file, so that there is a flight in it."""
    records = list(telemetry_records(data))
    step = max(len(data) // SIZE, 1)
    # a run of neighbours, then a leap: sequence numbers and rates stay like real ones in the run
    kept = [record for i, record in enumerate(records) if (i // 20) % step == 0]
    return tuple(kept)


def binary_records(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield name and bytes of the records of an intact binary DataFlash log."""
    layouts: dict[int, tuple[str, int]] = {0x80: ("FMT", 89)}
    at = 0
    while at + 3 <= len(data) and data[at + 2] in layouts:
        name, size = layouts[data[at + 2]]
        record = data[at : at + size]
        if name == "FMT" and len(record) == size:
            defined = record[5:9].rstrip(b"\0 ").decode("latin-1")
            layouts.setdefault(record[3], (defined, record[4]))
        yield name, record
        at += size


def _thin_binary(data: bytes) -> Iterator[bytes]:
    records = list(binary_records(data))
    total = Counter(name for name, _ in records)
    seen: Counter[str] = Counter()
    for name, record in records:
        if name not in MESSAGES:
            continue
        about = record[5:9].rstrip(b"\0 ").decode("latin-1")
        if name == "FMT" and about not in MESSAGES:
            continue
        seen[name] += 1
        step = 1 if name in ("FMT", "UNIT", "MULT", "MSG") else max(total[name] // RECORDS, 1)
        if seen[name] % step == 0:
            yield record


def _thin_text(data: bytes) -> Iterator[bytes]:
    lines = data.splitlines(keepends=True)
    names = [line.split(b",")[0].strip().decode("latin-1") for line in lines]
    total = Counter(names)
    seen: Counter[str] = Counter()
    for name, line in zip(names, lines, strict=True):
        about = line.split(b",")[3].strip().decode("latin-1") if line.count(b",") > 3 else ""
        if name == "FMT" and about not in MESSAGES:
            continue
        seen[name] += 1
        step = 1 if name == "FMT" else max(total[name] // RECORDS, 1)
        if seen[name] % step == 0:
            yield line


def ulog_messages(data: bytes) -> Iterator[bytes]:
    """Yield the header and the messages of an intact ULog."""
    yield data[:16]
    at = 16
    while at + 3 <= len(data):
        size = 3 + struct.unpack_from("<H", data, at)[0]
        yield data[at : at + size]
        at += size


def _thin_ulog(data: bytes) -> Iterator[bytes]:
    messages = list(ulog_messages(data))
    if len(data) < SIZE:
        yield from messages
        return
    topic_of: dict[bytes, str] = {}
    for message in messages:
        if message[2:3] == b"A":
            topic_of[message[4:6]] = message[6:].decode("latin-1")
    total = Counter(message[3:5] for message in messages if message[2:3] == b"D")
    seen: Counter[bytes] = Counter()
    for message in messages:
        kind = message[2:3]
        if kind == b"F":
            name = message[3:].split(b":")[0].decode("latin-1")
            if name not in TOPICS and name in topic_of.values():
                continue
        elif kind == b"A" and message[6:].decode("latin-1") not in TOPICS:
            continue
        elif kind == b"D":
            number = message[3:5]
            seen[number] += 1
            step = max(total[number] // RECORDS, 1)
            if topic_of.get(number) not in TOPICS or seen[number] % step:
                continue
        elif kind in b"PMIL":
            seen[kind] += 1
            if seen[kind] > RECORDS:
                continue
        yield message


def definition(number: int, name: str, form: str, labels: str, length: int) -> bytes:
    """Return a FMT record."""
    texts = name.encode(), form.encode(), labels.encode()
    return struct.pack("<3sBB4s16s64s", b"\xa3\x95\x80", number, length, *texts)


def composed_binary() -> Iterator[bytes]:
    """Yield the records of a small binary DataFlash log with units, instances and an array."""
    yield definition(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89)
    yield definition(10, "UNIT", "QbZ", "TimeUS,Id,Label", 76)
    yield definition(11, "MULT", "Qbd", "TimeUS,Id,Mult", 20)
    yield definition(12, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", 44)
    yield definition(20, "BARO", "QBffc", "TimeUS,I,Alt,Press,Temp", 22)
    yield definition(21, "MSG", "QZ", "TimeUS,Message", 75)
    yield definition(22, "PARM", "QNf", "TimeUS,Name,Value", 31)
    yield definition(23, "ISBD", "QHaB", "TimeUS,N,x,seq", 78)
    yield definition(24, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn", 14)
    yield b"\xa3\x95\x0a" + struct.pack("<Qb64s", 1_000_000, ord("m"), b"m")
    yield b"\xa3\x95\x0b" + struct.pack("<Qbd", 1_000_000, ord("B"), 0.01)
    yield b"\xa3\x95\x0c" + struct.pack("<QB16s16s", 1_000_000, 20, b"s#mPO", b"F-0--")
    yield b"\xa3\x95\x15" + struct.pack("<Q64s", 1_000_000, b"ArduCopter V4.6.3 (8264a9b4)")
    for name, value in ((b"FRAME_CLASS", 1.0), (b"SYSID_THISMAV", 3.0)):
        yield b"\xa3\x95\x16" + struct.pack("<Q16sf", 1_000_000, name, value)
    yield b"\xa3\x95\x18" + struct.pack("<QBBB", 1_000_000, 5, 5, 1)
    for i in range(40):
        t = 1_000_000 + 100_000 * i
        yield b"\xa3\x95\x14" + struct.pack("<QBffh", t, i % 2, i / 2, 101325.0 - i, 2500)
        if i % 8 == 0:
            yield b"\xa3\x95\x17" + struct.pack("<QH32hB", t, i, *range(32), 1)


def composed_text() -> Iterator[bytes]:
    """Yield the lines of a small text DataFlash log."""
    yield b"\r\nArduCopter V3.1 (abcdef01)\r\nFree RAM: 1000\r\n"
    yield b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format\r\n"
    yield b"FMT, 1, 21, ATT, IccccCC, TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw\r\n"
    yield b"FMT, 129, 23, PARM, Nf, Name,Value\r\n"
    yield b"FMT, 134, 67, MSG, Z, Message\r\n"
    yield b"FMT, 3, 6, MODE, Mh, Mode,ThrCrs\r\n"
    yield b"PARM, RATE_RLL_P, 0.15\r\nMSG, hello, world\r\nMODE, STABILIZE, 400\r\n"
    for i in range(40):
        yield b"ATT, %d, 0.00, %.2f, 0.00, -1.25, 10.00, 12.00\r\n" % (1000 + 100 * i, i / 10)


def message(kind: bytes, body: bytes) -> bytes:
    """Return a ULog message."""
    return struct.pack("<H", len(body)) + kind + body


def composed_ulog() -> Iterator[bytes]:
    """Yield header and messages of a small ULog with nested formats and every kind of message."""
    yield b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000)
    yield message(b"B", bytes(40))
    yield message(b"F", b"inner:uint8_t a;float[2] b;uint8_t[3] _padding0;")
    yield message(b"F", b"outer:uint64_t timestamp;inner[2] part;bool on;uint8_t[7] _padding0;")
    yield message(b"F", b"plain:uint64_t timestamp;float[3] x;char[8] text;int16_t n;")
    for key, value in (
        (b"char[9] sys_name", b"PX4 local"),
        (b"uint32_t ver_sw_release", struct.pack("<I", 0x010D00FF)),
    ):
        yield message(b"I", bytes([len(key)]) + key + value)
    key = b"char[5] perf"
    yield message(b"M", b"\0" + bytes([len(key)]) + key + b"first")
    key = b"float MC_P"
    yield message(b"P", bytes([len(key)]) + key + struct.pack("<f", 0.15))
    yield message(b"Q", b"\1" + bytes([len(key)]) + key + struct.pack("<f", 0.15))
    yield message(b"A", struct.pack("<BH", 0, 0) + b"outer")
    yield message(b"A", struct.pack("<BH", 0, 1) + b"plain")
    yield message(b"A", struct.pack("<BH", 1, 2) + b"plain")
    for i in range(30):
        t = 1_000_000 + 100_000 * i
        inner = struct.pack("<B2f3s", i, i / 2, -i, b"")
        yield message(b"D", struct.pack("<HQ", 0, t) + inner * 2 + b"\1")
        for number in (1, 2):
            yield message(b"D", struct.pack("<HQ3f8sh", number, t, i, 2, 3, b"text", -i))
        if i % 10 == 5:
            yield message(b"L", b"6" + struct.pack("<Q", t) + b"takeoff")
            yield message(b"C", b"6" + struct.pack("<HQ", 1, t) + b"tagged")
            yield message(b"S", bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12]))
            yield message(b"O", struct.pack("<H", 20))
    yield message(b"P", bytes([len(key)]) + key + struct.pack("<f", 0.2))
    yield message(b"R", struct.pack("<H", 2))
