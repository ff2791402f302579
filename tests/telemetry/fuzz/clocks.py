"""Which input, wrong in its clocks, belongs to a number?

The records stay whole and their checksums right. What is changed are the times that they tell: the
recorder's stamps and the vehicle's times in their payloads (tlog), ``TimeUS``, ``TimeMS`` and the
receiver's ``T`` (DataFlash, binary and text), ``timestamp`` (ULog), ``t`` (a table of one's own).
Thrown forward or back by half a second to centuries, for one record, some, or all that follow; of
one message or of all; wrapped, zero, constant, in other units, backwards, or noise.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as mav

from .heads import (
    EXAMPLES,
    SHARED,
    Head,
    binary_records,
    heads,
    telemetry_records,
    ulog_messages,
)
from .mutations import SIZES, Input, with_checksum

HOUR: Final = 3600.0
SHIFTS_S: Final = (
    *(0.5, 1.5, 5.0, 60.0, 599.0, 1800.0, 3599.0, 3601.0, 6 * HOUR, 24 * HOUR, 49.7 * 24 * HOUR),
    *(2**32 / 1e6, 2**31 / 1e3, 365 * 24 * HOUR, 100 * 365 * 24 * HOUR),
)
FLIGHTS: Final = (
    ("tlog", EXAMPLES / "copter_motor_failure_crash.tlog"),
    ("tlog", EXAMPLES / "plane_engine_failure_stall.tlog"),
    ("tlog", EXAMPLES.parent / "healthy_logs" / "px4_quad.tlog"),
    ("bin", SHARED / "flights" / "real" / "joey_211907.bin"),
    ("bin", SHARED / "flights" / "sitl" / "copter" / "c90_crash_motor1_x0.2.BIN"),
    ("log", SHARED / "flights" / "crash" / "mechanical_fail.log"),
    ("ulg", SHARED / "flights" / "odd" / "sitl_2017.ulg"),
)
"""Small logs of whole flights, for what analyses them."""


@dataclass(frozen=True, slots=True)
class Place:
    """A time in a chunk: which clock it is of, its first byte, size and unit."""

    chunk: int
    clock: str
    at: int
    size: int
    per_second: int
    order: str = "<"

    def read(self, chunk: bytes) -> int:
        """Return the time, in its own unit."""
        raw = chunk[self.at : self.at + self.size]
        return int.from_bytes(raw, "little" if self.order == "<" else "big")

    def written(self, chunk: bytes, value: int) -> bytes:
        """Return the chunk with another time, wrapped into its bits."""
        order = "little" if self.order == "<" else "big"
        raw = (value % (1 << 8 * self.size)).to_bytes(self.size, order)
        return chunk[: self.at] + raw + chunk[self.at + self.size :]


@dataclass(frozen=True, slots=True)
class Word(Place):
    """A time in a line: ``at`` is the number of its word."""

    def read(self, chunk: bytes) -> int:
        """Return the time, in its own unit; 0 where there is no number."""
        try:
            return round(float(chunk.split(b",")[self.at]) * (1 if self.size else 1e6))
        except ValueError:
            return 0

    def written(self, chunk: bytes, value: int) -> bytes:
        """Return the line with another time."""
        words = chunk.split(b",")
        end = b"\n" if words[self.at].endswith(b"\n") else b""
        words[self.at] = (b" %d" % value if self.size else b"%.6f" % (value / 1e6)) + end
        return b",".join(words)


Times = list[int]
Damage = Callable[[Random, Times, int], Times]
"""From the times of some records, in their unit, and how many of these are a second."""


def make_input(number: int) -> Input:
    """Return a short log with damaged clocks."""
    return _damaged(number, _short())


def make_flight(number: int) -> Input:
    """Return the log of a flight with damaged clocks; `base_of` tells which."""
    return _damaged(number, flights())


def base_of(number: int) -> Head:
    """Return the undamaged log that `make_flight` makes of."""
    return Random(number).choice(flights())


def short_of(number: int) -> Head:
    """Return the undamaged log that `make_input` makes of."""
    return Random(number).choice(_short())


def _short() -> tuple[Head, ...]:
    return *heads(), _table()


@cache
def flights() -> tuple[Head, ...]:
    """Return the flights at hand."""
    cut = {"tlog": telemetry_records, "ulg": ulog_messages, "log": _lines, "bin": _binary}
    found = [(kind, path) for kind, path in FLIGHTS if path.is_file()]
    return tuple(Head(kind, str(path), tuple(cut[kind](path.read_bytes()))) for kind, path in found)


def _lines(data: bytes) -> Sequence[bytes]:
    return data.splitlines(keepends=True)


def _binary(data: bytes) -> Sequence[bytes]:
    return [record for _, record in binary_records(data)]


def _damaged(number: int, bases: Sequence[Head]) -> Input:
    random = Random(number)
    head = random.choice(bases)
    chunks, story = list(head.chunks), [f"{head.kind} {Path(head.name).name}"]
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        places = _of_some_clock(random, places_of(head.kind, head.chunks))
        if not places:  # a log that tells no time
            break
        damage = random.choice(_DAMAGES)
        by_unit: dict[int, list[Place]] = {}
        for place in places:
            by_unit.setdefault(place.per_second, []).append(place)
        seed = random.random()
        for per_second, same in by_unit.items():
            times = [place.read(chunks[place.chunk]) for place in same]
            after = damage(Random(seed), times, per_second)
            for place, old, new in zip(same, times, after, strict=True):
                if old != new:
                    chunks[place.chunk] = place.written(chunks[place.chunk], new)
        story.append(f"{damage.__name__.strip('_')} of {len(places)}")
    if head.kind == "tlog":
        chunks = [with_checksum(chunk) for chunk in chunks]
    return Input(number, b"".join(chunks), ", ".join(story))


def _of_some_clock(random: Random, places: list[Place]) -> list[Place]:
    """Return the times of all records, of one clock, or of one message."""
    clocks = sorted({place.clock for place in places})
    if not clocks:
        return []
    what = random.choice(("all", "all", "kind", "one"))
    if what == "kind":  # the recorder's clock or the vehicle's
        kind = random.choice(sorted({clock.partition(" ")[0] for clock in clocks}))
        return [place for place in places if place.clock.partition(" ")[0] == kind]
    if what == "one":
        clock = random.choice(clocks)
        return [place for place in places if place.clock == clock]
    return places


# Where the times are.


@cache
def places_of(kind: str, chunks: tuple[bytes, ...]) -> list[Place]:
    """Return the places of all times of a log."""
    finders = {"tlog": _in_telemetry, "bin": _in_binary, "log": _in_text, "ulg": _in_ulog}
    return list(finders.get(kind, _in_table)(chunks))


@cache
def _boot_field(number: int) -> tuple[int, int, int] | None:
    """Return first byte, size and unit of a message's time since boot."""
    known = mav.mavlink_map.get(number)
    if known is None:
        return None
    names = list(known.ordered_fieldnames)
    for name, size, per_second in (("time_boot_ms", 4, 1000), ("time_usec", 8, 1_000_000)):
        if name in names:
            sizes = [struct.calcsize(f"<{c}") for c in _characters(known.unpacker.format)]
            return sum(sizes[: names.index(name)]), size, per_second
    return None


def _characters(form: str) -> list[str]:
    found, count = [], ""
    for c in form.lstrip("<"):
        if c.isdigit():
            count += c
        else:
            found.append(count + c)
            count = ""
    return found


def _in_telemetry(chunks: Sequence[bytes]) -> list[Place]:
    found = []
    for i, chunk in enumerate(chunks):
        if len(chunk) < 16:
            continue
        found.append(Place(i, "recorder", 0, 8, 1_000_000, ">"))
        is_v2 = chunk[8] == 0xFD
        number = int.from_bytes(chunk[15:18], "little") if is_v2 else chunk[13]
        field = _boot_field(number)
        start = 18 if is_v2 else 14
        if field is not None and field[0] + field[1] <= chunk[9]:
            found.append(Place(i, f"vehicle {number}", start + field[0], *field[1:]))
    return found


def _in_binary(chunks: Sequence[bytes]) -> list[Place]:
    layouts: dict[int, tuple[int, int, int]] = {}
    found = []
    for i, chunk in enumerate(chunks):
        if chunk[2] == 0x80 and len(chunk) == 89:
            form = chunk[9:25].rstrip(b"\0").decode("latin-1")
            labels = chunk[25:89].rstrip(b"\0").decode("latin-1").split(",")
            field = _clock_label(labels)
            if field is not None and len(labels) == len(form):
                before = sum(SIZES.get(c, 0) for c in form[: field[0]])
                layouts[chunk[3]] = 3 + before, SIZES.get(form[field[0]], 0), field[1]
        elif chunk[2] in layouts:
            at, size, per_second = layouts[chunk[2]]
            if at + size <= len(chunk):
                found.append(Place(i, f"vehicle {chunk[2]}", at, size, per_second))
    return found


def _clock_label(labels: Sequence[str]) -> tuple[int, int] | None:
    for name, per_second in (("TimeUS", 1_000_000), ("T", 1000), ("TimeMS", 1000)):
        if name in labels:
            return labels.index(name), per_second
    return None


def _in_text(chunks: Sequence[bytes]) -> list[Place]:
    layouts: dict[str, tuple[int, int]] = {}
    found: list[Place] = []
    for i, chunk in enumerate(chunks):
        words = [word.strip().decode("latin-1") for word in chunk.split(b",")]
        if words[0] == "FMT" and len(words) > 5:
            field = _clock_label(words[5:])
            if field is not None:
                layouts[words[3]] = field
        elif words[0] in layouts:
            at, per_second = layouts[words[0]]
            if at + 1 < len(words):
                found.append(Word(i, f"vehicle {words[0]}", at + 1, 8, per_second))
    return found


def _in_ulog(chunks: Sequence[bytes]) -> list[Place]:
    found = []
    for i, chunk in enumerate(chunks[1:], 1):
        if chunk[2:3] == b"D" and len(chunk) >= 13:
            number = int.from_bytes(chunk[3:5], "little")
            found.append(Place(i, f"vehicle {number}", 5, 8, 1_000_000))
        elif chunk[2:3] == b"L" and len(chunk) >= 12:
            found.append(Place(i, "texts", 4, 8, 1_000_000))
    if len(chunks[0]) == 16:
        found.append(Place(0, "header", 8, 8, 1_000_000))
    return found


@cache
def _table() -> Head:
    """Return a table of one's own."""
    lines = [b"t,GPS.alt [m],ATT.roll [deg]\n"]
    lines += [b"%.6f,%.2f,%.2f\n" % (i / 10, 10 + i % 7, i % 5) for i in range(200)]
    return Head("csv", "composed", tuple(lines))


def _in_table(chunks: Sequence[bytes]) -> list[Place]:
    return [Word(i, "table", 0, 0, 1_000_000) for i in range(1, len(chunks))]


# What happens to them.


def _shift(random: Random, per_second: int) -> int:
    return round(random.choice((-1, 1)) * random.choice(SHIFTS_S) * per_second)


def _one(random: Random, times: Times, per_second: int) -> Times:
    at = random.randrange(len(times))
    times = list(times)
    times[at] += _shift(random, per_second)
    return times


def _some(random: Random, times: Times, per_second: int) -> Times:
    share, by = random.choice((0.01, 0.1, 0.5)), _shift(random, per_second)
    return [t + by if random.random() < share else t for t in times]


def _some_each(random: Random, times: Times, per_second: int) -> Times:
    share = random.choice((0.01, 0.1, 0.5))
    return [t + _shift(random, per_second) if random.random() < share else t for t in times]


def _after(random: Random, times: Times, per_second: int) -> Times:
    at, by = random.randrange(len(times)), _shift(random, per_second)
    return times[:at] + [t + by for t in times[at:]]


def _run(random: Random, times: Times, per_second: int) -> Times:
    low, by = random.randrange(len(times)), _shift(random, per_second)
    high = low + random.choice((2, 5, 50, 500))
    return times[:low] + [t + by for t in times[low:high]] + times[high:]


def _stairs(random: Random, times: Times, per_second: int) -> Times:
    """Leap again and again, every so many records."""
    every, by = random.choice((1, 10, 100)), abs(_shift(random, per_second))
    return [t + i // every * by for i, t in enumerate(times)]


def _wraps(random: Random, times: Times, per_second: int) -> Times:
    bits = random.choice((16, 24, 31, 32))
    middle = times[random.randrange(len(times))]
    return [(t - middle) % (1 << bits) for t in times]


def _zero(random: Random, times: Times, per_second: int) -> Times:
    share = random.choice((0.01, 0.5, 1.0))
    return [0 if random.random() < share else t for t in times]


def _constant(random: Random, times: Times, per_second: int) -> Times:
    at = random.choice((0, random.randrange(len(times))))
    return times[:at] + [times[at]] * (len(times) - at)


def _units(random: Random, times: Times, per_second: int) -> Times:
    factor = random.choice((0.0, 1e-6, 1e-3, 0.5, 2.0, 10.0, 60.0, 1e3, 1e6))
    at = random.choice((0, random.randrange(len(times))))
    return times[:at] + [times[at] + round((t - times[at]) * factor) for t in times[at:]]


def _backwards(random: Random, times: Times, per_second: int) -> Times:
    at = random.choice((0, random.randrange(len(times))))
    return times[:at] + times[at:][::-1]


def _noise(random: Random, times: Times, per_second: int) -> Times:
    share, bits = random.choice((0.01, 0.1, 1.0)), random.choice((20, 32, 40, 63))
    return [random.getrandbits(bits) if random.random() < share else t for t in times]


def _bits(random: Random, times: Times, per_second: int) -> Times:
    """Turn one bit of some."""
    share = random.choice((0.003, 0.03, 0.3))
    return [t ^ (1 << random.randrange(32)) if random.random() < share else t for t in times]


_DAMAGES: Final[tuple[Damage, ...]] = (
    *(_one, _some, _some_each, _after, _after, _run, _stairs, _wraps, _zero, _constant, _units),
    *(_backwards, _noise, _bits),
)
