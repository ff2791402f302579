"""Which MAVLink messages would have said what a log of another format says?

In: the log's own messages. Out: messages with MAVLink's names, units and signs, so that a model
written for telemetry runs on a `.bin` or `.ulg`. What corresponds stands in
``data/mavlink_dataflash.json`` and ``data/mavlink_ulog.json``, written as `sources` tells.

Such a message has the records of one message of the log, its base. What another message says is
interpolated between two of its records that are no gap apart, unknown elsewhere; counts and flags
are held instead. A source whose unit is not the field's is left out rather than guessed. ``raw`` of
such a field is what MAVLink would send, unrounded, NaN where unknown.

Nothing is decoded before a field is asked for. The trap: a log has more of these columns than of
its own, so whoever looks at all of them (`Log.channels`) must not make them stay in memory.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.dialect import is_discrete
from fdi.telemetry.meaning.sources import (
    FUNCTIONS,
    Read,
    Source,
    Term,
    expanded,
    source,
    wrap,
)
from fdi.telemetry.message import Column, Floats, Message
from fdi.units import Conversion, si

_GAP_S: Final = 1.0  # as when a model's grid is filled: max(1 s, 3 periods)
_LATEST: Final = 4  # pairs of messages: those of a message's fields take turns
_GAP_PERIODS: Final = 3.0
_INSTANCES: Final = 9  # of one message, at most (ESCs, estimators of PX4)
_ELEMENTS: Final = 4  # of a quaternion
_SILENT: Final = ("", "UNKNOWN")  # SI unit of a field whose unit the log does not state

Messages = Mapping[str, Message]


@dataclass(frozen=True, slots=True)
class _Field:
    name: str
    conversion: Conversion  # from what MAVLink sends
    is_discrete: bool
    sources: tuple[Source, ...]


@dataclass(frozen=True, slots=True)
class _Silence:
    """What MAVLink says of a sensor that is silent for ``after`` s while ``beside`` goes on."""

    after: float
    beside: str
    fields: Mapping[str, float]  # what is sent; all others are unknown


@dataclass(frozen=True, slots=True)
class _Row:
    """One MAVLink message of a table."""

    key: str
    base: tuple[tuple[str, str | None], ...]  # key and group of vehicles
    fields: tuple[_Field, ...]
    silence: _Silence | None


@dataclass(frozen=True, slots=True, eq=False)
class _Between:
    """Where the times of a message lie between those of another: (n,) each.

    ``right``: the later neighbour; ``weight``: how far from the earlier one to it, 0 to 1;
    ``inside``: there are two, no gap apart.
    """

    right: NDArray[np.int64]
    weight: Floats
    inside: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """A source in a log: the messages that it reads by key, and whose records it has."""

    source: Source
    home: Message
    messages: Messages
    latest: dict[
        tuple[str, str], _Between
    ]  # shared by all of a log: fields come message by message


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
    latest: dict[tuple[str, str], _Between] = {}
    for row in _rows(table):
        for_it = (name for name, group in row.base if group is None or vehicle in groups[group])
        base = next((known[name] for name in for_it if name in known), None)
        if base is None:
            continue
        columns = {}
        for field in row.fields:
            fitting = (s for s in field.sources if s.group is None or vehicle in groups[s.group])
            found = (_find(s, known, base, field.conversion.unit, latest) for s in fitting)
            first = next((f for f in found if f is not None), None)
            if first is not None:
                load = partial(_sent, first, base, field.conversion)
                columns[field.name] = Column(load, field.conversion, is_discrete=field.is_discrete)
        if columns:
            message = replace(_named(base, row.key), columns=columns, _cache={})
            made[row.key] = _with_silence(message, row.silence, known)
    return made


def as_ardupilot(own: Messages, vehicle: str) -> dict[str, Message]:
    """Return a PX4 telemetry log's messages with those that say what ArduPilot's say.

    Both autopilots speak MAVLink and do not mean the same: PX4 sends its inertial sensors in
    HIGHRES_IMU, and errors as actual minus demanded where ArduPilot sends demanded minus actual.

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
        if key not in own:
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
        (f for s in fitting if (f := _find(s, known, base, wanted.conversion.unit, {}))), None
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
        silence = _Silence(**row["silence"]) if "silence" in row else None
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


def _with_silence(message: Message, silence: _Silence | None, known: Messages) -> Message:
    """Return the message with records of silence, at its own rate, where another one goes on."""
    beside = known.get(silence.beside) if silence is not None else None
    if silence is None or beside is None or len(message) < 2 or not len(beside):
        return message
    t, there = message.t, beside.t
    period = float(np.median(np.diff(t)))
    ends = np.append(t, there[-1])
    since = np.clip(np.searchsorted(t, there, side="right") - 1, 0, None)  # the record before
    is_long = np.diff(ends, append=ends[-1]) > max(silence.after, _GAP_PERIODS * period)
    late, ahead = there - t[since], ends[since + 1] - there
    rows = np.flatnonzero(is_long[since] & (late > 1.5 * period) & (ahead > 0.5 * period))
    rows = rows[np.diff(np.floor(late[rows] / period), prepend=-1.0) != 0]
    share = (
        np.bincount(since[rows], minlength=t.size) * period
    )  # of the silence, in which it goes on
    rows = rows[share[since[rows]] > silence.after / 2]
    if not rows.size:
        return message
    joined = np.concatenate((t, there[rows]))
    order = np.argsort(joined, kind="stable")
    old = message.stamp.size
    kept = np.concatenate((message.kept, old + np.arange(rows.size)))[order]
    stamp = np.concatenate((message.stamp, beside.stamp[beside.kept[rows]]))
    columns = {
        name: column._replace(
            load=partial(_followed, column.load, silence.fields.get(name), rows.size)
        )
        for name, column in message.columns.items()
    }
    return replace(message, t=joined[order], stamp=stamp, kept=kept, columns=columns, _cache={})


def _followed(load: Callable[[], Floats], value: float | None, count: int) -> Floats:
    return np.concatenate((load(), np.full(count, np.nan if value is None else value)))


def _find(
    wanted: Source,
    known: Messages,
    base: Message,
    unit: str,
    latest: dict[tuple[str, str], _Between],
) -> _Found | None:
    """Return the source in this log, None where the log lacks a part or the unit does not fit."""
    messages: dict[str, Message] = {}
    for term in wanted.terms:
        for read in term.reads:
            message = known.get(read.key)
            if message is None or any(not _has(message, name) for name in _labels(term, read)):
                return None
            messages[read.key] = message
            if read.chooser is not None:
                messages |= _choices(read, known)
        if term.reads and _unit(term, messages, wanted.unit) != unit:
            return None
    conditions = tuple(c for c in wanted.conditions if _is_there(c.read, known))
    messages |= {c.read.key: known[c.read.key] for c in conditions}
    home = next((messages[read.key] for read in wanted.reads), base)
    if len(conditions) < len(wanted.conditions):
        wanted = replace(wanted, conditions=conditions)
    return _Found(wanted, home, messages, latest)


def _is_there(read: Read, known: Messages) -> bool:
    return read.key in known and _has(known[read.key], read.field)


def _has(message: Message, field: str) -> bool:
    return field in message and not message.columns[field].is_text


def _labels(term: Term, read: Read) -> tuple[str, ...]:
    """Return the fields that a reading means: itself, or the elements of an array."""
    if term.function is not None and FUNCTIONS[term.function].is_of_array:
        return tuple(f"{read.field}[{i}]" for i in range(_ELEMENTS))
    return (read.field,)


def _choices(read: Read, known: Messages) -> dict[str, Message]:
    """Return the instances among which a field chooses, and that field's message."""
    assert read.chooser is not None
    chooser, field = read.chooser
    others = (f"{read.message}[{i}]" for i in range(1, _INSTANCES))
    found = {key: known[key] for key in others if key in known and _has(known[key], read.field)}
    if found and chooser in known and _has(known[chooser], field):
        return {**found, chooser: known[chooser]}
    return {}


def _unit(term: Term, messages: Messages, stated: str | None) -> str | None:
    """Return the SI unit of a term, None where its function does not take what it is given."""
    units = []
    for read in term.reads:
        own = messages[read.key].unit(_labels(term, read)[0])
        units.append(own if own not in _SILENT else si(stated or "").unit)
    function = FUNCTIONS[term.function] if term.function else None
    if function is not None and function.takes is not None and tuple(units) != function.takes:
        return None
    if function is not None and function.gives is not None:
        return function.gives
    return units[0] if len(set(units)) == 1 else None


def _sent(found: _Found, base: Message, conversion: Conversion) -> Floats:
    """Return what MAVLink would send, unrounded, at the records of the base."""
    values = _onto(base, found.home, _total(found), conversion.unit, found.latest)
    with np.errstate(over="ignore"):  # damaged values may be of any size
        if conversion.offset:
            values = values - conversion.offset
        sent: Floats = values / conversion.scale
    return sent


def _total(found: _Found) -> Floats:
    """Return a source's value in SI at the records of its home."""
    with np.errstate(invalid="ignore", over="ignore"):
        terms = (_scaled(term.factor, _term(term, found)) for term in found.source.terms)
        total = reduce(operator.add, terms)
        made = np.broadcast_to(total, found.home.stamp.shape)
        if found.source.conditions:
            made = made.copy()
        for condition in found.source.conditions:
            holds = condition.compare(_read(condition.read, found), condition.number)
            made[~holds] = np.nan
    return made


def _scaled(factor: float, values: Floats | float) -> Floats | float:
    return values if factor == 1.0 else factor * values


def _term(term: Term, found: _Found) -> Floats | float:
    if not term.reads:
        return 1.0
    values = [
        _read(replace(read, field=label), found)
        for read in term.reads
        for label in _labels(term, read)
    ]
    if term.function is None:
        return values[0]
    return FUNCTIONS[term.function].kernel(*values)


def _read(read: Read, found: _Found) -> Floats:
    """Return a reading in SI at the records of the source's home."""
    value = _one(found.messages[read.key], read.field, found)
    if read.chooser is None or not _holds(found, *read.chooser):
        return value
    chosen = _one(found.messages[read.chooser[0]], read.chooser[1], found)
    for number in range(1, _INSTANCES):
        key = f"{read.message}[{number}]"
        if _holds(found, key, read.field) and np.any(chosen == number):
            other = found.messages[key]
            value = np.where(chosen == number, _one(other, read.field, found), value)
    return value


def _holds(found: _Found, key: str, field: str) -> bool:
    """Return whether a message was found, for whatever reading, and has the field."""
    return key in found.messages and _has(found.messages[key], field)


def _one(message: Message, field: str, found: _Found) -> Floats:
    values, unit = message.glance(field), message.unit(field)
    if unit in _SILENT:
        unit, scale, offset = si(found.source.unit or "")
        values = values * scale + offset
    return _onto(found.home, message, values, unit, found.latest)


def _onto(
    base: Message,
    message: Message,
    values: Floats,
    unit: str,
    latest: dict[tuple[str, str], _Between],
) -> Floats:
    """Return values (one per record of a message) at the records of another.

    Between two known values that are no gap apart: on the line, angles on the circle, whole numbers
    without a unit (counts, flags) as the one before. Elsewhere unknown.
    """
    if message.t is base.t:
        return values
    made = np.full(base.stamp.size, np.nan)
    t, values = message.t, values[message.kept]
    known = np.isfinite(values)
    is_whole = bool(known.all())
    if not is_whole:
        t, values = t[known], values[known]
    if t.size < 2 or not base.t.size:
        return made
    if is_whole and np.array_equal(t, base.t):  # written together
        made[base.kept] = values
        return made
    pair = base.key, message.key
    place = latest.get(pair) if is_whole else None
    if place is None:
        place = _between(base.t, t)
        if is_whole:
            latest[pair] = place
            for old in list(latest)[:-_LATEST]:
                del latest[old]
    weight = place.weight
    before = values[place.right - 1]
    with np.errstate(over="ignore"):
        rise = values[place.right] - before
    rise[np.isinf(rise)] = np.nan  # damaged values may be of any size
    if unit == "rad":
        rise = wrap(rise)
    elif not unit and np.array_equal(values, np.rint(values)):
        weight = np.floor(weight)
    rise *= weight
    rise += before
    if unit == "rad":  # counted from -pi or from 0, as the records are
        rise = wrap(rise) if np.any(values < 0) else rise % (2 * np.pi)
    made[base.kept] = np.where(place.inside, rise, np.nan)
    return made


def _between(at: Floats, t: Floats) -> _Between:
    right = np.clip(np.searchsorted(t, at, side="right"), 1, t.size - 1)
    before = t[right - 1]
    step = t[right] - before
    inside = (at >= t[0]) & (at <= t[-1])
    inside &= step <= max(_GAP_S, _GAP_PERIODS * float(np.median(np.diff(t))))
    return _Between(right, (at - before) / step, inside)
