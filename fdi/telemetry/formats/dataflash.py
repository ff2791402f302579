"""What does an ArduPilot DataFlash log (`.bin`) hold?

In: the bytes of the file. Out: a `Log`. Layouts and units come from `dataflash_layouts`, records
from `dataflash_records`; this file gives every record a time, makes columns and puts the log
together. To the messages of the log itself come those of `meaning`, which say the same in
MAVLink's words.

Times are the vehicle's own, ``TimeUS`` (``TimeMS`` before 2015), microseconds since boot. A record
without one has that of the record before it in the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.clock import Timeline, make_clock, timeline
from fdi.telemetry.flights import find_flights, flight_events
from fdi.telemetry.formats.dataflash_events import (
    Groups,
    log_events,
    log_texts,
    parameters,
    vehicle_of,
)
from fdi.telemetry.formats.dataflash_layouts import (
    FMT,
    Bytes,
    Ints,
    Layout,
    Units,
    defined,
    fmt_layout,
    headers,
    with_known,
)
from fdi.telemetry.formats.dataflash_records import Records, find_records
from fdi.telemetry.formats.mavlink_events import firmware
from fdi.telemetry.formats.mavlink_quality import gap_records
from fdi.telemetry.formats.meaning import as_mavlink
from fdi.telemetry.log import Log, Source
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.quality import QualityRecord

_HEAD: Final = b"\xa3\x95\x80"
_SNIFF: Final = 1 << 20  # bytes looked at when the format is in question
_SPECIMEN: Final = 4 << 20  # bytes that decide between known versions
_SINGLE: Final = 20  # more findings of one kind are told as one
_SLACK_S: Final = 2.0  # a record's own time further from its neighbours' is damaged
_APART_S: Final = 1e-6
_LARGEST_US: Final = 2**42  # 50 days since boot: more is noise, and the record has no time
_GPS_EPOCH: Final = 315964800  # s since 1970: 6 January 1980
_WEEK_S: Final = 604800
_FIRST_WEEK: Final = (
    1560  # before December 2009 no such log was written: the receiver's week wrapped
)
_LEAPS: Final = ((0, 14), (1230768000, 15), (1341100800, 16), (1435708800, 17), (1483228800, 18))
_FIX_3D: Final = 3


def is_dataflash(data: Bytes) -> bool:
    """Return whether the bytes hold DataFlash records."""
    if data[:3].tobytes() == _HEAD:
        return True
    part = data[:_SNIFF]
    if headers(part, 0, part.size).size < max(part.size // 256, 3):
        return False
    records = _records(part)
    covered = part.size - int((records.lost[:, 1] - records.lost[:, 0]).sum())
    return records.start.size > 2 and covered > part.size // 2


def read_dataflash(path: Path, data: Bytes, *, system: int | None = None) -> Log:
    """Return the log; ``system`` is without meaning here, the file is of one vehicle.

    Raises
    ------
    LogError
        There is no record in it.
    """
    if data[:3].tobytes() == _HEAD and data[9:25].tobytes().endswith(b" "):
        raise LogError(
            "is a PX4 sdlog2 log (.px4log), which this version does not read",
            where=path.name,
            hint="give a .tlog or an ArduPilot .bin",
        )
    records = _records(data)
    if not np.any(np.array([one.number for one in records.layouts])[records.layout] != FMT):
        raise LogError("is a DataFlash log without a record of data", where=path.name)
    rows = _by_layout(records)
    stamp_us, timed = _stamps(records, rows)
    line, t = _timeline(records, stamp_us, timed)
    groups = Groups(records, rows, t)
    values, changes, named = parameters(groups)
    texts = log_texts(groups)
    name = firmware({}, texts, None)
    vehicle = vehicle_of(name, values)
    own = _messages(groups, _units(groups), (stamp_us - stamp_us[0]) / 1e6, timed)
    said = as_mavlink(own, vehicle, table="mavlink_dataflash")
    messages = own | {k: m for k, m in said.items() if k not in own}
    events = [*texts, *log_events(groups, vehicle), *named]
    events.sort(key=lambda e: e.t)
    span = float(t.min()), float(t.max())
    has_wings = vehicle in ("plane", "vtol", "other")
    flights = find_flights(messages, events, span, has_wings=has_wings)
    quality = [*_damage(records, t), *_layout_records(records, rows), *line.quality]
    number = int(values.get("SYSID_THISMAV", values.get("MAV_SYSID", 1)))
    return Log(
        path,
        "dataflash",
        data,
        max(span[1], 0.0),
        span,
        MappingProxyType(dict(sorted(messages.items()))),
        MappingProxyType(values),
        changes,
        tuple(sorted([*events, *flight_events(flights)], key=lambda e: (e.t, e.kind))),
        flights,
        tuple(sorted([*quality, *gap_records(own)], key=_place)),
        make_clock(line, *_utc(groups), stamp_us),
        vehicle,
        "ardupilot",
        name,
        number,
        (Source(number, 1, records.start.size, 0, vehicle, "ardupilot", True),),
    )


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text


def _records(data: Bytes) -> Records:
    own = defined(data)
    if not any(one.number == FMT for one in own):
        own.append(fmt_layout())
    head = data[:_SPECIMEN]

    def explained(layouts: list[Layout]) -> int:
        lost = find_records(head, layouts).lost
        return head.size - int((lost[:, 1] - lost[:, 0]).sum())

    return find_records(data, with_known(own, explained))


def _by_layout(records: Records) -> dict[int, Ints]:
    order = np.argsort(records.layout, kind="stable")
    bounds = np.searchsorted(records.layout[order], np.arange(len(records.layouts) + 1))
    parts = {i: order[bounds[i] : bounds[i + 1]] for i in range(len(records.layouts))}
    return {i: rows for i, rows in parts.items() if rows.size}


def _stamps(
    records: Records, rows: Mapping[int, Ints]
) -> tuple[NDArray[np.uint64], NDArray[np.bool_]]:
    """Return every record's time since boot in us, and which of them state it themselves."""
    stamp = np.zeros(records.start.size, np.uint64)
    timed = np.zeros(records.start.size, np.bool_)
    for i, here in rows.items():
        one = records.layouts[i]
        micros, millis = one.field("TimeUS"), one.field("TimeMS")
        if one.name == "GPS" and one.field("T") is not None:
            millis = one.field("T")  # TimeMS is the week's there
        field = micros or millis
        if field is None or field.character not in "IQ":
            continue
        said = records.values(here, field).astype(np.uint64)
        likely = said < np.uint64(_LARGEST_US)
        here = here[likely]
        stamp[here] = said[likely] * np.uint64(1 if micros else 1000)
        timed[here] = True
    if timed.any():
        last = np.maximum.accumulate(np.where(timed, np.arange(timed.size), -1))
        stamp = stamp[np.where(last < 0, np.flatnonzero(timed)[0], last)]
    return stamp, timed


def _timeline(
    records: Records, stamp_us: NDArray[np.uint64], timed: NDArray[np.bool_]
) -> tuple[Timeline, Floats]:
    """Return the timeline and every record's t, 0 at the first."""
    at = np.flatnonzero(timed)
    which = records.layout[at]
    main = np.flatnonzero(which == np.argmax(np.bincount(which))) if at.size else at
    line = timeline(stamp_us, at, (stamp_us[at] // np.uint64(1000)).astype(np.int64), main)
    seconds = stamp_us / 1e6
    if not np.isfinite(line.offset).all():
        return line, line.created
    apart = line.created - seconds
    # the timeline knows boot times to the millisecond, the log to the microsecond
    offset = np.array([np.median(apart[line.boot == k]) for k in range(line.offset.size)])
    said = seconds + offset[line.boot]
    good = np.abs(said - line.created) <= _SLACK_S
    t = np.where(good, said, line.created)
    zero = float(t[0])
    return replace(line, created=t - zero, offset=offset - zero), t - zero


def _units(groups: Groups) -> Units:
    standard = data_table("units_dataflash")
    unit = dict(standard["characters"])
    multiplier = dict(standard["multipliers"])
    of_type = {}
    for _, character, label in groups.lines("UNIT", "Id", "Label"):
        unit[chr(character & 0xFF)] = label
    for _, character, value in groups.lines("MULT", "Id", "Mult"):
        if np.isfinite(value) and value:
            multiplier[chr(character & 0xFF)] = float(f"{value:.7g}")  # float32 written as double
    for _, number, units, multipliers in groups.lines("FMTU", "FmtType", "UnitIds", "MultIds"):
        of_type[number] = (units, multipliers)
    return Units(unit, multiplier, of_type)


def _messages(
    groups: Groups, units: Units, stamp: Floats, timed: NDArray[np.bool_]
) -> dict[str, Message]:
    made: dict[str, Message] = {}
    seen: dict[str, int] = {}
    for i, rows in groups.rows.items():
        one = groups.records.layouts[i]
        seen[one.name] = seen.get(one.name, 0) + 1
        name = one.name if seen[one.name] == 1 else f"{one.name}#{seen[one.name]}"
        for instance, part in _instances(groups.records, one, rows, units):
            columns = {
                field.name: Column(
                    partial(groups.records.values, part, field),
                    units.conversion(one, field),
                    is_text=field.is_text,
                )
                for field in one.fields
            }
            is_list = any(f.is_text for f in one.fields) or not timed[part[0]]
            t, kept = _times(groups.t[part], is_list=is_list)
            message = Message(name, instance, t, stamp[part], kept, MappingProxyType(columns))
            for array in (t, kept, message.stamp):
                array.flags.writeable = False
            made[message.key] = message
    return made


def _instances(
    records: Records, one: Layout, rows: Ints, units: Units
) -> Iterator[tuple[int | None, Ints]]:
    """Yield the rows per instance; instance 0 is None."""
    field = units.instance_field(one)
    if field is None:
        yield None, rows
        return
    numbers = records.values(rows, field)
    for number in np.unique(numbers).tolist():
        yield number or None, rows[numbers == number]


def _times(t: Floats, *, is_list: bool) -> tuple[Floats, Ints]:
    """Return t, strictly ascending, and the records that it belongs to."""
    rows = np.argsort(t, kind="stable")
    t = t[rows]
    if is_list:  # parameters and texts of one moment are not one record: a microsecond apart
        spread = np.arange(t.size) * _APART_S
        t = np.maximum.accumulate(t - spread) + spread
    is_last = np.diff(t, append=np.inf) > 0
    return t[is_last], rows[is_last]


def _utc(groups: Groups) -> tuple[Ints, Floats]:
    """Return where a receiver tells UTC, and what it tells (s since 1970)."""
    found: list[tuple[Ints, Floats]] = []
    for i, rows in groups.rows.items():
        one = groups.records.layouts[i]
        fields = [one.field("Status"), one.field("GWk") or one.field("Week")]
        fields.append(one.field("GMS") or one.field("TimeMS"))
        if one.name != "GPS" or None in fields:
            continue
        status, week, ms = (groups.records.values(rows, f) for f in fields if f is not None)
        good = (status >= _FIX_3D) & (week > 0)
        weeks = week[good].astype(np.float64)
        weeks[weeks < _FIRST_WEEK] += 1024
        utc = _GPS_EPOCH + weeks * _WEEK_S + ms[good] / 1000
        since, leaps = (np.array(column) for column in zip(*_LEAPS, strict=True))
        utc -= leaps[np.searchsorted(since, utc, side="right") - 1]
        found.append((rows[good], utc))
    if not found:
        return np.empty(0, np.int64), np.empty(0)
    rows, utc = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(rows, kind="stable")
    return rows[order], utc[order]


def _damage(records: Records, t: Floats) -> Iterator[QualityRecord]:
    """Yield what lies between the records, with offsets and byte counts."""
    lost = records.lost
    before = np.maximum(np.searchsorted(records.start, lost[:, 0]) - 1, 0)
    moments = t[before].tolist()
    if records.is_cut:
        low, high = lost[-1].tolist()
        text = f"the file ends in the middle of a record: {high - low} bytes at byte {low}"
        yield QualityRecord("truncated", None, moments[-1], moments[-1], high - low, text)
        lost = lost[:-1]
    if lost.shape[0] > _SINGLE:
        total, n = int((lost[:, 1] - lost[:, 0]).sum()), lost.shape[0]
        text = f"bytes that belong to no record: {n} places, {total} bytes in all, first at byte "
        text += f"{lost[0, 0]}, last at byte {lost[-1, 0]}"
        yield QualityRecord("lost_bytes", None, moments[0], moments[n - 1], total, text)
        return
    for (low, high), moment in zip(lost.tolist(), moments, strict=False):
        text = f"bytes that belong to no record: {high - low} bytes at byte {low}"
        yield QualityRecord("lost_bytes", None, moment, moment, high - low, text)


def _layout_records(records: Records, rows: Mapping[int, Ints]) -> Iterator[QualityRecord]:
    """Yield which definitions were missing or changed."""
    taken = [(records.layouts[i].name, r.size) for i, r in rows.items()]
    taken = [pair for i, pair in zip(rows, taken, strict=True) if records.layouts[i].is_known]
    if taken:
        names, count = ", ".join(name for name, _ in taken), sum(size for _, size in taken)
        text = f"{count} records of types that the file does not define, read as known firmware "
        text += f"writes them: {names}"
        yield QualityRecord("repaired", None, None, None, count, text)
    for i, r in rows.items():
        one = records.layouts[i]
        if one.since:
            text = f"{one.name} is defined anew at byte {one.since}: {r.size} records stand apart"
            yield QualityRecord("repaired", None, None, None, r.size, text)
