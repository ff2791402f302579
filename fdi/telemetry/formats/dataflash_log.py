"""How do the tables of a DataFlash log, binary or text, become a `Log`?

In: the tables and what was found wrong with the file. Out: the `Log`. Times come from
`dataflash_clock`, units from `dataflash_layouts`, events from `dataflash_events`. To the messages
of the log itself come those of `meaning`, which say the same in MAVLink's words.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.flights import find_flights, flight_events
from fdi.telemetry.formats.dataflash_clock import Times, Track, find_track, make_clock
from fdi.telemetry.formats.dataflash_events import (
    Timed,
    log_events,
    log_texts,
    parameters,
    vehicle_of,
)
from fdi.telemetry.formats.dataflash_layouts import Bytes, Ints, Units
from fdi.telemetry.formats.dataflash_tables import Table, Tables
from fdi.telemetry.formats.mavlink_events import firmware
from fdi.telemetry.formats.mavlink_quality import gap_records
from fdi.telemetry.formats.meaning import as_mavlink
from fdi.telemetry.log import Log, Source
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.quality import Kind, QualityRecord

_APART_S: Final = 1e-6


class Finding(NamedTuple):
    """A quality record without its time: ``first`` and ``last`` are bytes of the file."""

    kind: Kind
    first: int | None
    last: int | None
    size: int
    text: str


def make_log(
    path: Path, form: str, data: Bytes, tables: Tables, findings: Iterable[Finding]
) -> Log:
    """Return the log.

    Parameters
    ----------
    path : Path
    form : str
        ``dataflash`` or ``dataflash_text``.
    data : (n,) uint8
        The file's bytes.
    tables : sequence of Table
        At least one, none empty.
    findings : iterable of Finding
        What is wrong with the file.
    """
    track, times = find_track(tables)
    timed = Timed(tables, times)
    values, changes, named = parameters(timed)
    texts = log_texts(timed)
    name = firmware({}, texts, None)
    vehicle = vehicle_of(name, values)
    own = _messages(timed, _units(timed))
    said = as_mavlink(own, vehicle, table="mavlink_dataflash")
    messages = own | {k: m for k, m in said.items() if k not in own}
    events = [*texts, *log_events(timed, vehicle), *named]
    events.sort(key=lambda e: e.t)
    span = min(float(x.t.min()) for x in times), max(float(x.t.max()) for x in times)
    has_wings = vehicle in ("plane", "vtol", "other")
    flights = find_flights(messages, events, span, has_wings=has_wings)
    quality = [*(_told(f, track) for f in findings), *track.quality, *gap_records(own)]
    number = int(values.get("SYSID_THISMAV", values.get("MAV_SYSID", 1)))
    count = sum(table.start.size for table in tables)
    return Log(
        path,
        form,
        data,
        max(span[1], 0.0),
        span,
        MappingProxyType(dict(sorted(messages.items()))),
        MappingProxyType(values),
        changes,
        tuple(sorted([*events, *flight_events(flights)], key=lambda e: (e.t, e.kind))),
        flights,
        tuple(sorted(quality, key=_place)),
        make_clock(tables, track, times),
        vehicle,
        "ardupilot",
        name,
        number,
        (Source(number, 1, count, 0, vehicle, "ardupilot", True),),
    )


def _told(found: Finding, track: Track) -> QualityRecord:
    start, end = (
        None if place is None else float(track.at(np.array([place]))[0])
        for place in (found.first, found.last)
    )
    return QualityRecord(found.kind, None, start, end, found.size, found.text)


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text


def _units(timed: Timed) -> Units:
    standard = data_table("units_dataflash")
    unit = dict(standard["characters"])
    multiplier = dict(standard["multipliers"])
    of_type = {}
    for _, character, label in timed.lines("UNIT", "Id", "Label"):
        unit[chr(character & 0xFF)] = label
    for _, character, value in timed.lines("MULT", "Id", "Mult"):
        if np.isfinite(value) and value:
            multiplier[chr(character & 0xFF)] = float(f"{value:.7g}")  # float32 written as double
    for _, number, units, multipliers in timed.lines("FMTU", "FmtType", "UnitIds", "MultIds"):
        of_type[number] = (units, multipliers)
    return Units(unit, multiplier, of_type)


def _messages(timed: Timed, units: Units) -> dict[str, Message]:
    made: dict[str, Message] = {}
    seen: dict[str, int] = {}
    every = np.arange(max(table.start.size for table in timed.tables))
    every.flags.writeable = False
    for table, times in zip(timed.tables, timed.times, strict=True):
        one = table.layout
        if not one.fields:
            continue
        seen[one.name] = seen.get(one.name, 0) + 1
        name = one.name if seen[one.name] == 1 else f"{one.name}#{seen[one.name]}"
        conversions = [units.conversion(one, field) for field in one.fields]
        for instance, part, own in _instances(table, times, units):
            columns = {
                field.name: Column(partial(part.column, field), conversion, is_text=field.is_text)
                for field, conversion in zip(one.fields, conversions, strict=True)
            }
            is_list = any(f.is_text for f in one.fields) or not own.is_own
            t, kept = _ascending(own.t, every, is_list=is_list)
            for array in (t, own.stamp, kept):
                array.flags.writeable = False
            message = Message(name, instance, t, own.stamp, kept, MappingProxyType(columns))
            made[message.key] = message
    return made


def _instances(
    table: Table, times: Times, units: Units
) -> Iterator[tuple[int | None, Table, Times]]:
    """Yield the records per instance, and their times; instance 0 is None."""
    field = units.instance_field(table.layout)
    if field is None:
        yield None, table, times
        return
    parts = list(table.source.split(table, field))
    if len(parts) == 1:
        yield parts[0][0] or None, table, times
        return
    for number, part, rows in parts:
        is_same = times.stamp is times.t
        t = times.t[rows]
        yield number or None, part, Times(t, t if is_same else times.stamp[rows], times.is_own)


def _ascending(t: Floats, every: Ints, *, is_list: bool) -> tuple[Floats, Ints]:
    """Return t, strictly ascending, and the records that it belongs to."""
    if t.size < 2 or float(np.diff(t).min()) > 0:
        return t, every[: t.size]
    rows = np.argsort(t, kind="stable")
    t = t[rows]
    if is_list:  # parameters and texts of one moment are not one record: a microsecond apart
        spread = np.arange(t.size) * _APART_S
        t = np.maximum.accumulate(t - spread) + spread
    is_last = np.diff(t, append=np.inf) > 0
    return t[is_last], rows[is_last]
