"""Which MAVLink messages would have said what a log of another format says?

In: the log's own messages. Out: messages with MAVLink's names and signs, so that a model written
for telemetry runs on a `.bin` or `.ulg`. What corresponds stands in ``data/mavlink_dataflash.json``
and ``data/mavlink_ulog.json``.

Such a message has the records of one message of the log, its base. Fields of another message are
interpolated between two of its records that are no gap apart, unknown elsewhere. A field whose
unit is not the one MAVLink's has in SI is left out rather than guessed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table, mavlink_meaning
from fdi.telemetry.dialect import definition_by_name
from fdi.telemetry.message import Column, Floats, Message
from fdi.units import Conversion, si

_GAP_S: Final = 1.0  # as when a model's grid is filled: max(1 s, 3 periods)
_GAP_PERIODS: Final = 3.0
_VECTOR: Final = re.compile(r"(norm|from)\((.+),(.+)\)")
_PERCENT: Final = ("plane", "vtol")  # their CTUN.ThO is a percentage without a unit

Messages = Mapping[str, Message]


def as_mavlink(own: Messages, vehicle: str, *, table: str, autopilot: str) -> dict[str, Message]:
    """Return the MAVLink messages that can be made of the log's own, by key.

    Parameters
    ----------
    own : Mapping[str, Message]
        By key.
    vehicle, autopilot : str
        As in `Log`.
    table : str
        Which of the tables in ``data/`` says what corresponds: ``mavlink_dataflash``,
        ``mavlink_ulog``.
    """
    made = {}
    for key, row in data_table(table)["messages"].items():
        base = next((own[name] for name in row["base"] if name in own), None)
        if base is None or vehicle not in row.get("vehicles", (vehicle,)):
            continue
        name, _, number = key.partition("[")
        columns = {}
        for field, sources in row["fields"].items():
            unit = _unit(name, field, vehicle, autopilot)
            found = (_column(own, base, source, unit, vehicle, table) for source in sources)
            column = next((c for c in found if c is not None), None)
            if column is not None:
                columns[field] = column
        if columns:
            instance = int(number[:-1]) if number else None
            made[key] = replace(
                base,
                name=name,
                instance=instance,
                columns=columns,
                made_from=base.key,
                _cache={},
            )
    return made


def _unit(message: str, field: str, vehicle: str, autopilot: str) -> str:
    """Return the SI unit of a MAVLink field."""
    known = definition_by_name(message)
    bare = field.partition("[")[0]
    stated = "" if known is None else next(f.unit for f in known.fields if f.name == bare)
    meaning = mavlink_meaning(message, bare, stated, autopilot=autopilot, vehicle=vehicle)
    return si(meaning.unit).unit


def _column(
    own: Messages, base: Message, source: str, unit: str, vehicle: str, table: str
) -> Column | None:
    vector = _VECTOR.fullmatch(source)
    if vector is not None:
        pair = [_source(own, text, vehicle, table) for text in vector.groups()[1:]]
        (first, conversion), (second, _) = pair[0] or (None, None), pair[1] or (None, None)
        if first is not base or second is not base or conversion is None:
            return None
        fields = [text.partition(".")[2] for text in vector.groups()[1:]]
        return Column(partial(_vector, base, vector[1], fields), Conversion(unit))
    sign = -1.0 if source.startswith("-") else 1.0
    source = source.removeprefix("-")
    found = _source(own, source, vehicle, table)
    if found is None or found[1].unit != unit:
        return None
    message, conversion = found
    field = source.partition(".")[2]
    if message is base:
        _, scale, offset = conversion
        turned = Conversion(unit, sign * scale, sign * offset)
        invalid = data_table(table)["invalid"].get(f"{message.name}.{field}", ())
        return replace(message.columns[field], conversion=turned, invalid=tuple(invalid))
    factor = sign * conversion.scale / message.columns[field].conversion.scale
    return Column(partial(_interpolated, base, message, field, factor), Conversion(unit))


def _source(
    own: Messages, text: str, vehicle: str, table: str
) -> tuple[Message, Conversion] | None:
    """Return the message of a field and the field's conversion, None where the log has none."""
    key, _, field = text.partition(".")
    message = own.get(key)
    if message is None or field not in message or message.columns[field].is_text:
        return None
    conversion = message.columns[field].conversion
    plain = f"{message.name}.{field}"
    stated = data_table(table)["unit"].get(plain)
    if stated is not None and conversion.unit != stated:
        conversion = conversion._replace(unit=stated)
    if plain == "CTUN.ThO" and vehicle in _PERCENT and conversion.scale == 1.0:
        conversion = conversion._replace(unit="", scale=0.01)
    return message, conversion


def _vector(base: Message, kind: str, fields: list[str]) -> Floats:
    north, east = (base.si_of_records(field) for field in fields)
    size: Floats = np.hypot(north, east)
    origin: Floats = np.arctan2(-east, -north) % (2 * np.pi)
    return size if kind == "norm" else origin


def _interpolated(base: Message, message: Message, field: str, factor: float) -> NDArray[Any]:
    """Return a field of another message at the base's records, NaN beyond its own."""
    at = np.full(base.stamp.size, np.nan)
    at[base.kept] = base.t
    values = message.si(field) * factor
    t = message.t
    if t.size < 2:
        return np.full(at.size, np.nan)
    is_angle = message.unit(field) == "rad"
    known = np.isfinite(values)
    t, values = t[known], values[known]
    if t.size < 2:
        return np.full(at.size, np.nan)
    values_below_zero = bool(np.any(values < 0))  # the field counts from -pi, not from 0
    if is_angle:
        values = np.unwrap(values)
    made: Floats = np.interp(at, t, values, left=np.nan, right=np.nan)
    right = np.clip(np.searchsorted(t, at), 1, t.size - 1)
    step = np.diff(t)
    made[step[right - 1] > max(_GAP_S, _GAP_PERIODS * float(np.median(step)))] = np.nan
    if is_angle:
        made = made % (2 * np.pi)
        if values_below_zero:
            made = np.where(made > np.pi, made - 2 * np.pi, made)
    return made
