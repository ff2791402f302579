"""What does a PX4 log (`.ulg`) hold?

In: the bytes of the file. Out: a `Log`. Messages come from `ulog_records`, times from `ulog_times`,
units from `ulog_units`; this file makes columns and puts the log together. To the topics of the log
itself come the messages of `meaning`, which say the same in MAVLink's words.

=====  ===============================================================
bytes  header
=====  ===============================================================
0      ``55 4C 6F 67 01 12 35``
7      version
8      uint64 start of the log, us since boot
16     messages: uint16 size of the body, uint8 type, body
=====  ===============================================================

Flag bits, the first message if there are any, may say that data were appended later: at such an
offset a fresh message begins, although the part before may end within one.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.flights import find_flights, flight_events
from fdi.telemetry.formats.mavlink_quality import duplicate_record, gap_records
from fdi.telemetry.formats.meaning import as_mavlink
from fdi.telemetry.formats.texts import texts
from fdi.telemetry.formats.ulog_definitions import Bytes, Field, Layout
from fdi.telemetry.formats.ulog_events import (
    crash_dumps,
    firmware_of,
    information,
    log_events,
    log_texts,
    parameters,
    release_of,
    system_of,
    vehicle_of,
)
from fdi.telemetry.formats.ulog_quality import damage_records, definition_records, dropout_records
from fdi.telemetry.formats.ulog_records import Rows, find_records
from fdi.telemetry.formats.ulog_times import (
    Placed,
    Reference,
    Stamped,
    clock,
    placed,
    reference,
    repair_records,
)
from fdi.telemetry.formats.ulog_units import Release, field_meaning
from fdi.telemetry.formats.ulog_walk import words
from fdi.telemetry.log import Log, Source
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.quality import QualityRecord

Ints = NDArray[np.int64]
Stamps = NDArray[np.uint64]

MAGIC: Final = b"ULog\x01\x12\x35"
_HEADER: Final = struct.Struct("<7sBQ")
_FLAGS: Final = struct.Struct("<HB8s8s3Q")
_APPENDED: Final = 1  # incompatible flag: there are parts appended later
_UTC_RANGE_US: Final = (946684800e6, 4102444800e6)  # 2000 to 2100: what is outside is no UTC
_POSITIONS: Final = ("vehicle_gps_position", "sensor_gps")


def is_ulog(data: Bytes) -> bool:
    """Return whether the bytes begin as a ULog."""
    return data[: len(MAGIC)].tobytes() == MAGIC


def read_ulog(path: Path, data: Bytes, *, system: int | None = None) -> Log:
    """Return the log; ``system`` is without meaning here, the file is of one vehicle.

    Raises
    ------
    LogError
        There is no record of data in it, or it says that only a newer reader can read it.
    """
    start_us, parts = _header(path, data)
    records = find_records(data, parts)
    if not records.rows:
        raise LogError("is a ULog without a record of data", where=path.name)
    topics = _topics(data, records.rows)
    stamped = [topic.stamped() for topic in topics]
    known = reference(stamped, start_us)
    times = [placed(one, known) for one in stamped]
    info = information(records.others)
    release = release_of(info)
    own = _messages(topics, times, stamped, known, release)
    values, changes, named = parameters(records.others, known.at_place)
    vehicle = vehicle_of(own, values)
    autopilot = "px4" if info.get("sys_name") == "PX4" else "other"
    said = as_mavlink(own, vehicle, table="mavlink_ulog")
    messages = own | {k: m for k, m in said.items() if k not in own}
    end = max(float(p.t.max()) for p in times)
    events = [*log_texts(records.others, known.of_stamp), *log_events(own, release), *named]
    events += crash_dumps(records.others, end)
    events.sort(key=lambda e: e.t)
    has_wings = vehicle in ("plane", "vtol", "other")
    flights = find_flights(messages, events, (0.0, end), has_wings=has_wings)
    quality = [
        *damage_records(records, known),
        *definition_records(records, known),
        *dropout_records(records, known),
        *known.quality,
        *repair_records(list(zip(stamped, times, strict=True))),
        *gap_records(own),
        *duplicate_record(own),
    ]
    number = system_of(own, values)
    count = sum(rows.at.size for rows in records.rows)
    return Log(
        path,
        "ulog",
        data,
        end,
        (0.0, end),
        MappingProxyType(dict(sorted(messages.items()))),
        MappingProxyType(values),
        changes,
        tuple(sorted([*events, *flight_events(flights)], key=lambda e: (e.t, e.kind))),
        flights,
        tuple(sorted(quality, key=_place)),
        clock(known, *_utc(own)),
        vehicle,
        autopilot,
        firmware_of(info),
        number,
        (Source(number, 1, count, 0, vehicle, autopilot, True),),
    )


def _header(path: Path, data: Bytes) -> tuple[int, list[tuple[int, int]]]:
    """Return the stamp of the log's beginning (us), and the parts of the file to be read."""
    if data.size < _HEADER.size:
        text = f"is a ULog of {data.size} bytes, less than its header of {_HEADER.size}"
        raise LogError(text, where=path.name)
    _, _, start_us = _HEADER.unpack(data[: _HEADER.size].tobytes())
    first = data[_HEADER.size : _HEADER.size + _FLAGS.size].tobytes()
    if len(first) < _FLAGS.size or first[2] != ord("B"):
        return start_us, [(_HEADER.size, data.size)]
    _, _, _, incompatible, *offsets = _FLAGS.unpack(first)
    unknown = bytes([incompatible[0] & ~_APPENDED]) + incompatible[1:]
    if any(unknown):
        raise LogError(
            f"is a ULog with the unknown flags {unknown.hex()}, which only a newer reader can read",
            where=path.name,
        )
    starts = [_HEADER.size]
    if incompatible[0] & _APPENDED:
        starts += [x for x in sorted(offsets) if starts[0] < x < data.size]
    return start_us, list(zip(starts, [*starts[1:], data.size], strict=True))


@dataclass(frozen=True, slots=True, eq=False)
class _Topic:
    """The records of one instance of a topic, (n,): first bytes of their fields, stamps."""

    name: str
    instance: int | None
    layout: Layout
    data: Bytes
    at: Ints
    stamp: Stamps
    # the records of the topic that was asked for last, shared by all
    cache: dict[int, Bytes] = field(repr=False)

    def stamped(self) -> Stamped:
        """Return the stamps with the topic's name."""
        key = self.name if self.instance is None else f"{self.name}[{self.instance}]"
        return Stamped(key, self.at, self.stamp)

    def is_unset(self, flag: Field) -> NDArray[np.bool_]:
        """Return in which records a flag is not set."""
        unset: NDArray[np.bool_] = self.values(flag) == 0
        return unset

    def values(self, wanted: Field) -> NDArray[Any]:
        """Return a field's raw values, (n,); texts as `str`."""
        size = self.layout.size
        block = self.cache.get(id(self))
        if block is None:
            block = words(self.data, f"V{size}")[self.at].view(np.uint8)
            self.cache.clear()  # columns are asked for topic by topic
            self.cache[id(self)] = block
        part = np.ndarray(self.at.shape, wanted.dtype, block, wanted.offset, (size,))
        values: NDArray[Any] = np.ascontiguousarray(part)
        return texts(values) if wanted.is_text else values


def _topics(data: Bytes, rows: Sequence[Rows]) -> list[_Topic]:
    """Return the topics; subscriptions of one topic together, other layouts of it apart."""
    groups: dict[tuple[str, int], list[Rows]] = {}
    for one in rows:
        groups.setdefault((one.layout.topic, one.instance), []).append(one)
    cache: dict[int, Bytes] = {}
    made = []
    for (name, instance), group in sorted(groups.items()):
        layouts = list(dict.fromkeys(one.layout for one in group))
        for i, layout in enumerate(layouts):
            same = [one for one in group if one.layout == layout]
            at, stamp = same[0].at, same[0].stamp
            if len(same) > 1:
                at = np.concatenate([one.at for one in same])
                order = np.argsort(at)
                at, stamp = at[order], np.concatenate([one.stamp for one in same])[order]
            label = name if not i else f"{name}#{i + 1}"
            made.append(_Topic(label, instance or None, layout, data, at, stamp, cache))
    return made


def _messages(
    topics: Sequence[_Topic],
    times: Sequence[Placed],
    stamped: Sequence[Stamped],
    known: Reference,
    release: Release,
) -> dict[str, Message]:
    count = np.arange(max(topic.at.size for topic in topics))
    count.flags.writeable = False
    made = {}
    for topic, time, one in zip(topics, times, stamped, strict=True):
        t, kept = _ascending(time.t, count)
        stamp = time.t if time.wrong else known.said(one.at, one.stamp)
        columns = {wanted.name: _column(topic, wanted, release) for wanted in topic.layout.fields}
        message = Message(topic.name, topic.instance, t, stamp, kept, MappingProxyType(columns))
        for array in (t, stamp):
            array.flags.writeable = False
        made[message.key] = message
    return made


def _column(topic: _Topic, wanted: Field, release: Release) -> Column:
    meaning = field_meaning(topic.layout.topic, wanted.name, wanted.plain, wanted.dtype, release)
    flag = None if meaning.flag is None else topic.layout.field(meaning.flag)
    load = partial(topic.values, wanted)
    if flag is None:
        return Column(load, meaning.conversion, meaning.invalid, is_text=wanted.is_text)
    return Column(load, meaning.conversion, meaning.invalid, absent=partial(topic.is_unset, flag))


def _ascending(t: Floats, count: Ints) -> tuple[Floats, Ints]:
    """Return t, strictly ascending, and the records that it belongs to."""
    if np.all(t[1:] > t[:-1]):
        return t, count[: t.size]
    rows = np.argsort(t, kind="stable")
    t = t[rows]
    is_last = np.append(t[1:] > t[:-1], True)
    return t[is_last], rows[is_last]


def _utc(own: dict[str, Message]) -> tuple[Floats, Floats]:
    """Return when a receiver tells UTC, and what it tells (s since 1970)."""
    for name in _POSITIONS:
        message = own.get(name)
        if message is not None and "time_utc_usec" in message:
            utc = message.raw("time_utc_usec")[message.kept].astype(np.float64)
            good = (utc > _UTC_RANGE_US[0]) & (utc < _UTC_RANGE_US[1])
            if good.any():
                return message.t[good], utc[good] / 1e6
    return np.empty(0), np.empty(0)


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text
