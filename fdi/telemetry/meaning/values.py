"""What does a source say at the records of another message?

In: a `Source` and the log's messages. Out: `Found`, a source with what it reads in this log, and
its values. What another message says is interpolated between two of its records that are no gap
apart, unknown elsewhere; counts and flags are held instead. A source whose unit is not the field's
is left out rather than guessed.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.meaning.sources import FUNCTIONS, Read, Source, Term, wrap
from fdi.telemetry.message import Floats, Message
from fdi.units import Conversion, si

_GAP_S: Final = 1.0  # as when a model's grid is filled: max(1 s, 3 periods)
_LATEST: Final = 4  # pairs of messages: those of a message's fields take turns
GAP_PERIODS: Final = 3.0
_INSTANCES: Final = 9  # of one message, at most (ESCs, estimators of PX4)
_ELEMENTS: Final = 4  # of a quaternion
_SILENT: Final = ("", "UNKNOWN")  # SI unit of a field whose unit the log does not state

Messages = Mapping[str, Message]


@dataclass(frozen=True, slots=True, eq=False)
class Between:
    """Where the times of a message lie between those of another: (n,) each.

    ``right``: the later neighbour; ``weight``: how far from the earlier one to it, 0 to 1;
    ``inside``: there are two, no gap apart.
    """

    right: NDArray[np.int64]
    weight: Floats
    inside: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A source in a log: the messages that it reads by key, and whose records it has."""

    source: Source
    home: Message
    messages: Messages
    latest: dict[tuple[str, str], Between]  # shared by all of a log: fields come message by message


def find(
    wanted: Source,
    known: Messages,
    base: Message,
    unit: str,
    latest: dict[tuple[str, str], Between],
) -> Found | None:
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
    return Found(wanted, home, messages, latest)


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


def sent(found: Found, base: Message, conversion: Conversion) -> Floats:
    """Return what MAVLink would send, unrounded, at the records of the base."""
    values = _onto(base, found.home, _total(found), conversion.unit, found.latest)
    with np.errstate(over="ignore"):  # damaged values may be of any size
        if conversion.offset:
            values = values - conversion.offset
        sent: Floats = values / conversion.scale
    return sent


def _total(found: Found) -> Floats:
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


def _term(term: Term, found: Found) -> Floats | float:
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


def _read(read: Read, found: Found) -> Floats:
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


def _holds(found: Found, key: str, field: str) -> bool:
    """Return whether a message was found, for whatever reading, and has the field."""
    return key in found.messages and _has(found.messages[key], field)


def _one(message: Message, field: str, found: Found) -> Floats:
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
    latest: dict[tuple[str, str], Between],
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


def _between(at: Floats, t: Floats) -> Between:
    right = np.clip(np.searchsorted(t, at, side="right"), 1, t.size - 1)
    before = t[right - 1]
    step = t[right] - before
    inside = (at >= t[0]) & (at <= t[-1])
    inside &= step <= max(_GAP_S, GAP_PERIODS * float(np.median(np.diff(t))))
    return Between(right, (at - before) / step, inside)
