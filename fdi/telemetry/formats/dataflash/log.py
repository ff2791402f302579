"""How do the tables of a DataFlash log, binary or text, become a `Log`?

In: the tables and what was found wrong with the file. Out: the `Log`. Times come from `clock`,
units from `layouts`, events from `events`. To the messages of the log itself come those of
`fdi.telemetry.meaning`, which say the same in MAVLink's words.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from fdi.telemetry.airframes import frame_of
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.events import Event
from fdi.telemetry.formats.dataflash.clock import Track, find_track, make_clock
from fdi.telemetry.formats.dataflash.events import (
    Timed,
    defaults,
    log_events,
    log_texts,
    parameters,
    told_too_much,
)
from fdi.telemetry.formats.dataflash.layouts import Bytes, Field, Ints, Layout, Units
from fdi.telemetry.formats.dataflash.tables import Table, Tables, columns
from fdi.telemetry.formats.dataflash.vehicle import vehicle_of
from fdi.telemetry.formats.gaps import gap_records
from fdi.telemetry.formats.wording import greeting
from fdi.telemetry.log import Log, Source
from fdi.telemetry.meaning import as_mavlink, with_motors, with_outputs, with_restarts
from fdi.telemetry.meaning.restarts import heard_again
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.quality import ANEW, Kind, QualityRecord
from fdi.units import Conversion

_APART_S: Final = 1e-6
_RATES_OF: Final = re.compile(r"(APM:|Ardu)Copter V(2|3\.[0-4])(?!\d)")
"""Copter logs rates in degrees a second since some development version of 3.4, whose controllers
count in radians, and in hundredths before."""
_RATES: Final = ("RDes", "R", "PDes", "P", "YDes", "Y")


class Finding(NamedTuple):
    """A quality record without its time: ``first`` and ``last`` are bytes of the file."""

    kind: Kind
    first: int | None
    last: int | None
    size: int
    text: str


def make_log(
    path: Path,
    form: str,
    data: Bytes,
    tables: Tables,
    findings: Iterable[Finding],
    *,
    heading: Sequence[str] = (),
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
    heading : sequence of str
        Texts that stand before the records.
    """
    units = _units(tables)
    tables = [part for table in tables for part in _instances(table, units)]
    track, times = find_track(tables)
    timed = Timed(tables, times)
    values, changes, named, beyond = parameters(timed)
    texts = [*(Event(0.0, "text", line) for line in heading), *log_texts(timed)]
    name = greeting(event.text for event in texts if event.kind == "text")
    by_name = vehicle_of(name, values, tables)
    vehicle, frame = frame_of(
        by_name, values, (event.text for event in texts), autopilot="ardupilot"
    )
    own = _messages(timed, units)
    if "RATE" in own and _is_in_hundredths(own, name):
        own["RATE"] = _in_hundredths(own["RATE"])
    said = as_mavlink(own, vehicle, table="mavlink_dataflash")
    messages = own | {k: m for k, m in said.items() if k not in own}
    messages = with_outputs(messages, values, "ardupilot", vehicle)
    messages = with_motors(messages, values, "ardupilot", vehicle)
    anew = [Event(heard_again(own.values(), t), "reboot", ANEW) for t in track.restarts]
    events = [*texts, *log_events(timed, vehicle, name), *named, *anew]
    messages = with_restarts(messages, events)
    ends = [x.t[[0, -1]] if x.is_ascending else np.array([x.t.min(), x.t.max()]) for x in times]
    span = float(np.min(ends)), float(np.max(ends))
    quality = [*(_told(f, track) for f in findings), *track.quality]
    quality += told_too_much(tables, beyond)
    if track.has_pause:
        quality += gap_records(own, events)
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
        tuple(sorted(events, key=lambda e: (e.t, e.kind))),
        tuple(sorted(quality, key=_place)),
        make_clock(tables, track, times),
        vehicle,
        "ardupilot",
        name,
        number,
        (Source(number, 1, count, 0, vehicle, "ardupilot", True),),
        frame=frame,
        defaults=MappingProxyType(defaults(timed)),
    )


def by_instance(tables: Tables) -> list[Table]:
    """Return the tables with one for every instance, as the log's messages are."""
    units = _units(tables)
    return [part for table in tables for part in _instances(table, units)]


def _told(found: Finding, track: Track) -> QualityRecord:
    start, end = (
        None if place is None else float(track.at(np.array([place]))[0])
        for place in (found.first, found.last)
    )
    return QualityRecord(found.kind, None, start, end, found.size, found.text)


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text


def _units(tables: Tables) -> Units:
    standard = data_table("units_dataflash")
    unit = dict(standard["characters"])
    multiplier = dict(standard["multipliers"])
    of_type: dict[int, tuple[str, str]] = {}
    for _, (character, label) in columns(tables, "UNIT", "Id", "Label"):
        stated = dict(zip(character.tolist(), label.tolist(), strict=True))
        unit.update({chr(i & 0xFF): text for i, text in stated.items()})
    for _, (character, value) in columns(tables, "MULT", "Id", "Mult"):
        for i, number in dict(zip(character.tolist(), value.tolist(), strict=True)).items():
            if np.isfinite(number) and number:
                multiplier[chr(i & 0xFF)] = float(f"{number:.7g}")  # float32 written as double
    for _, (kind, *pair) in columns(tables, "FMTU", "FmtType", "UnitIds", "MultIds"):
        of_type.update(
            zip(kind.tolist(), zip(*(p.tolist() for p in pair), strict=True), strict=True)
        )
    return Units(unit, multiplier, of_type)


def _instances(table: Table, units: Units) -> Iterator[Table]:
    field = units.instance_field(table.layout)
    if field is None:
        yield table
    else:
        yield from table.source.split(table, field)


def _messages(timed: Timed, units: Units) -> dict[str, Message]:
    made: dict[str, Message] = {}
    names: dict[str, list[Layout]] = {}
    most = max(table.start.size for table in timed.tables)
    every: Ints = np.arange(most, dtype=np.int32 if most < 1 << 31 else np.int64)
    every.flags.writeable = False
    for table, times in zip(timed.tables, timed.times, strict=True):
        one = table.layout
        if not one.fields:
            continue
        layouts = names.setdefault(one.name, [one])
        if one is not layouts[-1]:
            layouts.append(one)
        name = one.name if len(layouts) == 1 else f"{one.name}#{len(layouts)}"
        made_of = {
            field.name: Column(
                partial(table.column, field),
                (conversion := units.conversion(one, field)),
                is_text=field.is_text,
                is_discrete=field.is_text or _is_count(field, conversion),
            )
            for field in one.fields
        }
        is_list = any(f.is_text for f in one.fields) or not times.is_own
        t, kept = times.t, every[: times.t.size]
        if not times.is_ascending:
            t, kept = _ascending(t, is_list=is_list)
        for array in (t, times.stamp, kept):
            array.flags.writeable = False
        message = Message(name, table.instance, t, times.stamp, kept, MappingProxyType(made_of))
        made[message.key] = message
    return made


def _is_in_hundredths(own: dict[str, Message], name: str | None) -> bool:
    """Return whether rates are logged in hundredths of a degree a second.

    Of the version between both the gyroscopes tell.
    """
    version = _RATES_OF.match(name or "")
    if version is None:
        return False
    gyroscopes = own.get("IMU", own.get("IMU[0]"))
    if version[2] != "3.4" or gyroscopes is None or "GyrX" not in gyroscopes:
        return version[2] != "3.4"
    known = [values[np.isfinite(values)]
             for values in (own["RATE"].glance("R"), gyroscopes.glance("GyrX"))]  # fmt: skip
    ours, theirs = (values.std() if values.size else 0.0 for values in known)
    return bool(ours > theirs * np.sqrt(100.0) > 0)


def _in_hundredths(rates: Message) -> Message:
    """Return a message whose rates are hundredths of what their unit says."""
    for field in _RATES:
        if field in rates:
            told = rates.columns[field].conversion
            rates = rates.with_conversion(field, told._replace(scale=told.scale / 100))
    return rates


def _is_count(field: Field, conversion: Conversion) -> bool:
    """Return whether a field counts or names: the format says no more than that it has no unit."""
    return np.dtype(field.dtype).kind in "iu" and conversion == Conversion("")


def _ascending(t: Floats, *, is_list: bool) -> tuple[Floats, Ints]:
    """Return t, strictly ascending, and the records that it belongs to."""
    rows = np.argsort(t, kind="stable")
    t = t[rows]
    if is_list:  # parameters and texts of one moment are not one record: a microsecond apart
        spread = np.arange(t.size) * _APART_S
        t = np.maximum.accumulate(t - spread) + spread
    is_last = np.diff(t, append=np.inf) > 0
    return t[is_last], rows[is_last]
