"""Which log's records stand for each message, where several logs hold it?

In: the messages of several logs under one key, on one clock. Out: one `Message`, and from which log
it and its parts come.

One log is chosen: of those that cover the flights equally well the ones with the higher rate, of
these the ones with fewer gaps, then the one with the finer values, then the first. Two things of
the others are taken as well: fields that the chosen one lacks, interpolated to its records between
two of their own that are no gap apart (whole numbers without a unit, states and counts, are those
of the record before); and records where it has none (it began later, ended earlier or has a gap). A
field whose values in the other log differ from its own while both are there stays unknown in such
records: it is not the same quantity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Masks = NDArray[np.bool_]

AS_COMPLETE: Final = 0.95
"""Share of the best coverage that is as good."""
AS_OFTEN: Final = 0.8
"""Share of the highest rate that is as good."""
_GAP_S: Final = 1.0  # as where a model's grid is filled
_GAP_PERIODS: Final = 3.0
_SAMPLE: Final = 5000  # records that show how fine values are
_SAME: Final = 0.2  # of a field's own spread
_LEAST_COMPARED: Final = 10


@dataclass(frozen=True, slots=True)
class Taken:
    """From which logs (by position) a message comes: the chosen one, and what others add."""

    chosen: int
    fields: dict[int, tuple[str, ...]]
    records: dict[int, int]


def shifted(message: Message, offset: float) -> Message:
    """Return the message with its times on another clock."""
    if not offset:
        return message
    t, stamp = message.t + offset, message.stamp + offset
    t.flags.writeable = stamp.flags.writeable = False
    return replace(message, t=t, stamp=stamp)


def united(
    candidates: Sequence[tuple[int, Message]], flights: Sequence[tuple[float, float]]
) -> tuple[Message, Taken]:
    """Return one message of several logs, and what came from which.

    Parameters
    ----------
    candidates : sequence of (position of the log, Message)
        All on one clock, the logs in the order given.
    flights : sequence of (from, to)
        s, when it matters.
    """
    place, chosen = _choose(candidates, flights)
    fields: dict[int, tuple[str, ...]] = {}
    records: dict[int, int] = {}
    for other_place, other in candidates:
        if other is chosen or not len(other):
            continue
        lacking = tuple(
            name for name in other.fields if name not in chosen and not other.columns[name].is_text
        )
        rows = _in_holes(chosen, other)
        if rows.size:
            chosen = _with_records(chosen, other, rows, lacking)
            records[other_place] = int(rows.size)
        elif lacking:
            chosen = _with_fields(chosen, other, lacking)
        if lacking:
            fields[other_place] = lacking
    return chosen, Taken(place, fields, records)


def _choose(
    candidates: Sequence[tuple[int, Message]], flights: Sequence[tuple[float, float]]
) -> tuple[int, Message]:
    left = list(candidates)
    for worth, share in ((partial(_coverage, flights=flights), AS_COMPLETE), (_rate, AS_OFTEN)):
        if len(left) > 1:
            values = [worth(message) for _, message in left]
            left = [
                pair
                for pair, value in zip(left, values, strict=True)
                if value >= share * max(values)
            ]
    if len(left) > 1:
        gaps = [int((np.diff(message.t) > _longest(message)).sum()) for _, message in left]
        left = [pair for pair, count in zip(left, gaps, strict=True) if count == min(gaps)]
    finest = left[0]
    for pair in left[1:]:
        if _is_finer(pair[1], finest[1]):
            finest = pair
    return finest


def _period(message: Message) -> float:
    return float(np.median(np.diff(message.t))) if len(message) > 1 else np.inf


def _rate(message: Message) -> float:
    return 1 / _period(message)


def _longest(message: Message) -> float:
    return max(_GAP_S, _GAP_PERIODS * _period(message))


def _coverage(message: Message, flights: Sequence[tuple[float, float]]) -> float:
    """Return how long the message is there during the flights, s."""
    if len(message) < 2:
        return 0.0
    low, high = message.t[:-1], message.t[1:]
    held = high - low <= _longest(message)
    return float(
        sum(
            np.clip(np.minimum(high, end) - np.maximum(low, start), 0, None)[held].sum()
            for start, end in flights
        )
    )


def _is_finer(one: Message, other: Message) -> bool:
    """Return whether more of the fields that both have are finer in the one than in the other."""
    votes = 0
    for name in one.fields:
        if name in other:
            steps = [_step(message.si(name)[:_SAMPLE]) for message in (one, other)]
            votes += int(steps[0] < 0.5 * steps[1]) - int(steps[1] < 0.5 * steps[0])
    return votes > 0


def _step(values: Floats) -> float:
    """Return the smallest step between two values; infinite where nothing changes."""
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    return float(steps.min()) if steps.size else np.inf


def _in_holes(chosen: Message, other: Message) -> Ints:
    """Return the rows of the other message that lie where the chosen one has no records."""
    t, longest = chosen.t, _longest(chosen)
    if not np.isfinite(longest):
        longest = _longest(other)
    if not t.size:
        return np.arange(len(other))
    margin = min(longest, _period(other)) / 2
    after = np.searchsorted(t, other.t)
    before = other.t - t[np.maximum(after - 1, 0)]
    until = t[np.minimum(after, t.size - 1)] - other.t
    before[after == 0] = np.inf
    until[after == t.size] = np.inf
    if not np.isfinite(margin):
        margin = longest / 2
    return np.flatnonzero((before + until > longest) & (np.minimum(before, until) > margin))


def _with_fields(chosen: Message, other: Message, names: Sequence[str]) -> Message:
    """Return the chosen message with fields of another, interpolated to its records."""
    added = {
        name: other.columns[name]._replace(
            load=partial(_placed_values, chosen, other, name),
            invalid=(),
            blank=(),
            absent=_nowhere,
        )
        for name in names
    }
    columns = MappingProxyType({**chosen.columns, **added})
    return replace(chosen, columns=columns, _cache={})


def _nowhere() -> None:
    return None


def _placed_values(chosen: Message, other: Message, name: str) -> Floats:
    """Return a field of the other message at each raw record of the chosen one, as on the wire."""
    values = np.full(chosen.stamp.size, np.nan)
    values[chosen.kept] = _at(other, name, chosen.t)
    return _as_raw(values, other.columns[name].conversion)


def _as_raw(values: Floats, conversion: Conversion) -> Floats:
    raw: Floats = (values - conversion.offset) / conversion.scale
    return raw


def _at(message: Message, name: str, t: Floats) -> Floats:
    """Return a field in SI at other times: NaN outside its records and in its gaps."""
    own, value = message.t, message.si(name)
    if own.size < 2:
        return np.full(t.size, np.nan)
    left = np.clip(np.searchsorted(own, t, side="right") - 1, 0, own.size - 2)
    inside = (t >= own[0]) & (t <= own[-1]) & (own[left + 1] - own[left] <= _longest(message))
    made = value[left]
    if not message.columns[name].is_discrete:
        rise = value[left + 1] - made
        if message.unit(name) == "rad" and np.nanmax(np.abs(value), initial=0.0) <= 2 * np.pi:
            rise = (rise + np.pi) % (2 * np.pi) - np.pi  # the short way round
        made = made + (t - own[left]) / (own[left + 1] - own[left]) * rise
    at_last = t == own[-1]
    made[at_last] = value[-1]
    return np.where(inside, made, np.nan)


def _with_records(chosen: Message, other: Message, rows: Ints, lacking: Sequence[str]) -> Message:
    """Return the chosen message with records (and fields) of another one in between."""
    t = np.concatenate((chosen.t, other.t[rows]))
    order = np.argsort(t, kind="stable")
    stamp = np.concatenate((chosen.stamp[chosen.kept], other.stamp[other.kept[rows]]))[order]
    t = t[order]
    kept = np.arange(t.size)
    for array in (t, stamp, kept):
        array.flags.writeable = False
    columns: dict[str, Column] = {}
    for name, column in {**other.columns, **chosen.columns}.items():
        if name not in chosen and name not in lacking:
            continue
        load = partial(_spliced, chosen, other, rows, order, name)
        columns[name] = column._replace(load=load, invalid=(), blank=(), absent=_nowhere)
    return replace(
        chosen, t=t, stamp=stamp, kept=kept, columns=MappingProxyType(columns), _cache={}
    )


def _spliced(chosen: Message, other: Message, rows: Ints, order: Ints, name: str) -> NDArray[Any]:
    """Return a field's values as on the wire: the chosen message's, the other's in between."""
    if name in chosen and chosen.columns[name].is_text:
        own = chosen.raw(name)[chosen.kept]
        is_there = name in other and other.columns[name].is_text
        foreign = other.raw(name)[other.kept[rows]] if is_there else np.full(rows.size, "")
        return np.concatenate((own.astype(object), foreign.astype(object)))[order]
    if name not in chosen:
        own, conversion = _at(other, name, chosen.t), other.columns[name].conversion
    else:
        own, conversion = chosen.si(name), chosen.columns[name].conversion
    is_same = name in other and (name not in chosen or _is_same(chosen, other, name))
    foreign = other.si(name)[rows] if is_same else np.full(rows.size, np.nan)
    return _as_raw(np.concatenate((own, foreign))[order], conversion)


def _is_same(chosen: Message, other: Message, name: str) -> bool:
    """Return whether a field says the same in two messages, as far as they overlap."""
    if chosen.unit(name) != other.unit(name):
        return False
    expected, found = _at(chosen, name, other.t), other.si(name)
    apart = np.abs(expected - found)
    if chosen.unit(name) == "rad":
        apart = np.minimum(apart, np.abs(2 * np.pi - apart))
    known = np.isfinite(apart)
    if known.sum() < _LEAST_COMPARED:
        return True
    values = found[known]
    spread = float(np.median(np.abs(values - np.median(values))))
    step = _step(values[:_SAMPLE])
    allowed = _SAME * spread + (step if np.isfinite(step) else 0.0)
    return float(np.median(apart[known])) <= allowed + 1e-9 * float(np.abs(values).max())
