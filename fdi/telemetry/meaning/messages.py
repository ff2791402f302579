"""Which MAVLink messages would have said what a log of another format says?

In: the log's own messages. Out: messages with MAVLink's names, units and signs, so that a model
written for telemetry runs on a `.bin` or `.ulg`. What corresponds stands in
``data/mavlink_dataflash.json`` and ``data/mavlink_ulog.json``, written as `sources` tells.

Such a message has the records of one message of the log, its base; what others say at them is told
by `values`. ``raw`` of such a field is what MAVLink would send, unrounded, NaN where unknown.

Nothing is decoded before a field is asked for. The trap: a log has more of these columns than of
its own, so whoever looks at all of them (`Log.channels`) must not make them stay in memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.dialect import is_discrete
from fdi.telemetry.meaning.silence import Silence, with_silence
from fdi.telemetry.meaning.sources import Read, Source, expanded, source
from fdi.telemetry.meaning.values import Between, Messages, find, sent
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion, si


@dataclass(frozen=True, slots=True)
class _Field:
    name: str
    conversion: Conversion  # from what MAVLink sends
    is_discrete: bool
    sources: tuple[Source, ...]


@dataclass(frozen=True, slots=True)
class _Row:
    """One MAVLink message of a table."""

    key: str
    base: tuple[tuple[str, str | None], ...]  # key and group of vehicles
    fields: tuple[_Field, ...]
    silence: Silence | None


def as_mavlink(own: Messages, vehicle: str, *, table: str) -> dict[str, Message]:
    """Return the MAVLink messages that can be made of the log's own, by key.

    A message that an old firmware numbers in its name (``IMU2``) comes under the key that newer
    ones give it (``IMU[1]``) as well.

    Parameters
    ----------
    own : Mapping[str, Message]
        By key.
    vehicle : str
        As in `Log`.
    table : str
        Which of the tables in ``data/`` says what corresponds: ``mavlink_dataflash``,
        ``mavlink_ulog``.
    """
    groups: Mapping[str, list[str]] = data_table(table)["groups"]
    made = _numbered(own, data_table(table)["instances"])
    known = {**made, **own}
    latest: dict[tuple[str, str], Between] = {}
    for row in _rows(table):
        for_it = (name for name, group in row.base if group is None or vehicle in groups[group])
        base = next((known[name] for name in for_it if name in known), None)
        if base is None:
            continue
        columns = {}
        for field in row.fields:
            fitting = (s for s in field.sources if s.group is None or vehicle in groups[s.group])
            found = (find(s, known, base, field.conversion.unit, latest) for s in fitting)
            first = next((f for f in found if f is not None), None)
            if first is not None:
                load = partial(sent, first, base, field.conversion)
                columns[field.name] = Column(load, field.conversion, is_discrete=field.is_discrete)
        if columns:
            message = replace(_named(base, row.key), columns=columns, _cache={})
            made[row.key] = with_silence(message, row.silence, known)
    return made


def as_ardupilot(own: Messages, vehicle: str) -> dict[str, Message]:
    """Return a PX4 telemetry log's messages with those that say what ArduPilot's say.

    Both autopilots speak MAVLink and do not mean the same: PX4 sends its inertial sensors in
    HIGHRES_IMU, and errors as actual minus demanded where ArduPilot sends demanded minus actual
    (the height since 1.14 as ArduPilot does).

    Parameters
    ----------
    own : Mapping[str, Message]
        By key.
    vehicle : str
        As in `Log`.
    """
    table = data_table("mavlink_tlog")
    told = dict(own)
    for key, message in as_mavlink(own, vehicle, table="mavlink_tlog").items():
        is_denser = key in table["denser"] and key in own and len(message.t) > len(own[key].t)
        if key not in own or is_denser:
            told[key] = message
        elif key in table["replaces"]:
            told[key] = replace(
                own[key], columns={**own[key].columns, **message.columns}, _cache={}
            )
    for key, fields in table["without_unit"].items():
        for field in fields:
            if key in own:
                told[key] = told[key].with_conversion(field, Conversion(""))
    return dict(sorted(told.items()))


def origin(
    messages: Messages, key: str, field: str, vehicle: str, *, form: str
) -> tuple[Read, float] | None:
    """Return the log's own field that a field in MAVLink's words repeats, and the factor.

    None where it is made of several, or of a function of one (but for angles put on a circle).

    Parameters
    ----------
    form : str
        The log's format.
    """
    table = f"mavlink_{form.partition('_')[0]}"
    groups: Mapping[str, list[str]] = data_table(table)["groups"]
    own = {k: m for k, m in messages.items() if m.made_from is None}
    known = {**_numbered(own, data_table(table)["instances"]), **own}
    fields = (f for row in _rows(table) if row.key == key for f in row.fields)
    wanted = next((f for f in fields if f.name == field), None)
    if wanted is None:
        return None
    fitting = (s for s in wanted.sources if s.group is None or vehicle in groups[s.group])
    base = messages[key]
    found = next(
        (f for s in fitting if (f := find(s, known, base, wanted.conversion.unit, {}))), None
    )
    if found is None or len(found.source.terms) != 1:
        return None
    (term,) = found.source.terms
    is_plain = term.function in (None, "wrap", "heading") and len(term.reads) == 1
    if not is_plain or term.reads[0].chooser is not None:
        return None
    message = known[term.reads[0].key]
    own_key = message.made_from or message.key
    name, _, number = own_key.partition("[")
    instance = int(number[:-1]) if number else 0
    return replace(term.reads[0], message=name, instance=instance), term.factor


@cache
def _rows(table: str) -> tuple[_Row, ...]:
    rows = []
    for key, row in data_table(table)["messages"].items():
        fields = tuple(
            _Field(name, si(unit), is_discrete(key, name, unit), tuple(map(source, texts)))
            for name, (unit, *texts) in expanded(row["fields"])
        )
        silence = Silence(**row["silence"]) if "silence" in row else None
        base = tuple(
            (name, group or None)
            for name, _, group in (text.partition(" on ") for text in row["base"])
        )
        rows.append(_Row(key, base, fields, silence))
    return tuple(rows)


def _numbered(own: Messages, names: Mapping[str, str]) -> dict[str, Message]:
    """Return messages with a number in their name under the key that newer firmware gives them."""
    old = {key: new for key, new in names.items() if key in own and new not in own}
    return {new: _named(own[key], new) for key, new in old.items()}


def _named(message: Message, key: str) -> Message:
    name, _, number = key.partition("[")
    instance = int(number[:-1]) if number else None
    return replace(
        message, name=name, instance=instance, made_from=message.made_from or message.key
    )
