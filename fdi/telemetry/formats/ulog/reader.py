"""What does a PX4 log (`.ulg`) hold?

In: the bytes of the file. Out: a `Log`. Messages come from `records`, times from `times`, units
from `units`; this file makes columns and puts the log together. To the topics of the log itself
come the messages of `fdi.telemetry.meaning`, which say the same in MAVLink's words.

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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.airframes import frame_of
from fdi.telemetry.formats.gaps import gap_records
from fdi.telemetry.formats.ulog.columns import Places, Store
from fdi.telemetry.formats.ulog.definitions import Bytes, Field, Layout
from fdi.telemetry.formats.ulog.events import (
    board_of,
    crash_dumps,
    defaults,
    firmware_of,
    information,
    log_events,
    log_texts,
    parameters,
    release_of,
    system_of,
    vehicle_of,
)
from fdi.telemetry.formats.ulog.quality import (
    damage_records,
    definition_records,
    dropout_records,
    left_out_records,
)
from fdi.telemetry.formats.ulog.records import Rows, find_records
from fdi.telemetry.formats.ulog.times import (
    Placed,
    Reference,
    Stamped,
    clock,
    placed,
    reference,
    time_records,
)
from fdi.telemetry.formats.ulog.units import Release, field_meaning
from fdi.telemetry.log import Log, Source
from fdi.telemetry.meaning import as_mavlink, with_motors, with_outputs
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.quality import QualityRecord

Ints = NDArray[np.int64]
Stamps = NDArray[np.uint64]

MAGIC: Final = b"ULog\x01\x12\x35"
_HEADER: Final = struct.Struct("<7sBQ")
_FLAGS: Final = struct.Struct("<HB8s8s3Q")
_PLACE: Final = struct.Struct("<Q")
_APPENDED: Final = 1  # incompatible flag: there are parts appended later
_UTC_RANGE_US: Final = (946684800e6, 4102444800e6)  # 2000 to 2100: what is outside is no UTC
_NAMED: Final = 4  # topics that an error names
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
        names = ", ".join(records.undefined[:_NAMED])
        what = f"whose topics it does not define: {names}" if names else "without data"
        raise LogError(f"is a ULog {what}", where=path.name)
    topics = _topics(records.rows)
    store = Store(data, [Places(topic.layout, topic.at) for topic in topics])
    stamped = [topic.stamped() for topic in topics]
    known = reference(stamped, start_us)
    times = [placed(one, known) for one in stamped]
    info = information(records.others)
    release = release_of(info)
    own = _messages(topics, times, store, release)
    values, changes, named = parameters(records.others, known.at_place)
    by_type, kind = vehicle_of(own, values)
    autopilot = "px4" if info.get("sys_name") == "PX4" else "other"
    vehicle, frame = frame_of(by_type, values, (), autopilot=autopilot, mav_type=kind)
    said = as_mavlink(own, vehicle, table="mavlink_ulog")
    messages = own | {k: m for k, m in said.items() if k not in own}
    messages = with_outputs(messages, values, autopilot, vehicle)
    messages = with_motors(messages, values, autopilot, vehicle)
    end = max(float(one.t[-1]) for one in times)
    events = [*log_texts(records.others, known.of_stamp), *log_events(own, release), *named]
    events += crash_dumps(records.others, end)
    quality = [
        *damage_records(records, known),
        *definition_records(records, known),
        *dropout_records(records, known),
        *left_out_records(records),
        *known.quality,
        *time_records(list(zip(stamped, times, strict=True))),
        *(gap_records(own, events) if known.has_pause else ()),
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
        tuple(sorted(events, key=lambda e: (e.t, e.kind))),
        tuple(sorted(quality, key=_place)),
        clock(known, *_utc(own, info, known)),
        vehicle,
        autopilot,
        firmware_of(info),
        number,
        (Source(number, 1, count, 0, vehicle, autopilot, True),),
        frame=frame,
        board=board_of(info),
        defaults=MappingProxyType(defaults(records.others)),
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
class Topic:
    """The records of one instance of a topic, (n,): first bytes of their fields, stamps."""

    name: str
    instance: int | None
    layout: Layout
    at: Ints
    stamp: Stamps

    @property
    def key(self) -> str:
        """The name in `Log.messages`."""
        return self.name if self.instance is None else f"{self.name}[{self.instance}]"

    def stamped(self) -> Stamped:
        """Return the stamps with the topic's name."""
        return Stamped(self.key, self.at, self.stamp)


def topics_of(path: Path, data: Bytes) -> list[Topic]:
    """Return where the records of every topic and instance are, for who rewrites them."""
    _, parts = _header(path, data)
    return _topics(find_records(data, parts).rows)


def appended_at(data: Bytes) -> list[int]:
    """Return the bytes at which the places stand where a part was appended later, 0: none was."""
    has_flags = data[_HEADER.size + 2 : _HEADER.size + 3].tobytes() == b"B"
    first = _HEADER.size + _FLAGS.size - 3 * _PLACE.size
    return [first + k * _PLACE.size for k in range(3)] if has_flags else []


def _topics(rows: Sequence[Rows]) -> list[Topic]:
    """Return the topics; subscriptions of one topic together, other layouts of it apart."""
    groups: dict[tuple[str, int], list[Rows]] = {}
    for one in rows:
        groups.setdefault((one.layout.topic, one.instance), []).append(one)
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
            made.append(Topic(label, instance or None, layout, at, stamp))
    return made


def _messages(
    topics: Sequence[Topic], times: Sequence[Placed], store: Store, release: Release
) -> dict[str, Message]:
    every = np.arange(max(topic.at.size for topic in topics))
    made = {}
    for number, (topic, time) in enumerate(zip(topics, times, strict=True)):
        kept = every[: topic.at.size] if time.kept is None else time.kept
        columns = _columns(topic.layout, partial(store.load, number), release)
        for array in (time.t, time.stamp, kept):
            array.flags.writeable = False
        message = Message(
            topic.name, topic.instance, time.t, time.stamp, kept, MappingProxyType(columns)
        )
        made[message.key] = message
    return made


def _columns(
    layout: Layout, load: Callable[[Field], NDArray[Any]], release: Release
) -> dict[str, Column]:
    made = {}
    for one in layout.fields:
        meaning = field_meaning(layout.topic, one.name, one.plain, one.dtype, release)
        flag = None if meaning.flag is None else layout.field(meaning.flag)
        absent = _never if flag is None else partial(_unset, partial(load, flag))
        made[one.name] = Column(
            partial(load, one),
            meaning.conversion,
            meaning.invalid,
            absent=absent,
            is_text=one.is_text,
            is_discrete=meaning.is_discrete,
        )
    return made


def _never() -> None:
    return None


def _unset(load: Callable[[], NDArray[Any]]) -> NDArray[np.bool_]:
    unset: NDArray[np.bool_] = load() == 0
    return unset


def _utc(
    own: Mapping[str, Message], info: Mapping[str, float | str], known: Reference
) -> tuple[Floats, Floats]:
    """Return when UTC is known, by a receiver or of the start, and what it is (s since 1970)."""
    for name in _POSITIONS:
        message = own.get(name)
        if message is not None and "time_utc_usec" in message:
            utc = message.raw("time_utc_usec")[message.kept].astype(np.float64)
            good = (utc > _UTC_RANGE_US[0]) & (utc < _UTC_RANGE_US[1])
            if good.any():
                return message.t[good], utc[good] / 1e6
    booted = info.get("boot_time_utc_us")
    if isinstance(booted, int) and _UTC_RANGE_US[0] < booted < _UTC_RANGE_US[1]:
        return np.zeros(1), np.array([booted / 1e6 - known.offset[0]])
    return np.empty(0), np.empty(0)


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text
