"""Which of a log's channels does the page hold, and at how many samples?

In: a log, and the messages that the page's own plots need. Out: `Held`: every numeric channel in
customary units, down-sampled so that all fit. Messages that plots need have `FINE` samples, others
as many as the room leaves. What a log writes to describe itself (formats, units, parameters) is no
channel. Where a log holds too many values to look at all, the longest messages are left out first
and named; those that plots need never are.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.report.page.columns import Spans, packed, thinned
from fdi.report.words import clean
from fdi.telemetry import Channel, Log, Message
from fdi.units import customary

Floats = NDArray[np.float64]

FINE: Final = 4000
"""Samples of a message that a plot of the page needs."""
LEAST: Final = 60
MOST_BYTES: Final = 3_600_000
"""Of all channels, as text, where plots leave as much."""
BYTES: Final = 16 / 3
"""A 32-bit number in base64."""
MOST_VALUES: Final = 30_000_000
"""That are decoded for the page alone: about a second."""
DESCRIBING: Final = frozenset(
    {"FMT", "FMTU", "UNIT", "MULT", "PARM", "PARAM_VALUE", "MSG", "STATUSTEXT", "AUTOPILOT_VERSION"}
)
TIMES: Final = frozenset(
    {"TimeUS", "TimeMS", "time_boot_ms", "time_usec", "time_unix_usec", "timestamp"}
)


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    """A message as it is kept: t (n,) s, and columns (k, n) of the fields."""

    records: int
    fields: tuple[str, ...]
    units: tuple[str, ...]
    steps: tuple[bool, ...]
    t: Floats
    values: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """The channels that the page holds.

    Attributes
    ----------
    messages : dict
        JSON, by the message's key.
    left_out : tuple of str
        Messages that are not in it.
    thinned : int
        How many messages have fewer samples than records.
    """

    messages: dict[str, Any]
    left_out: tuple[str, ...]
    thinned: int


def held_channels(
    log: Log, needed: Collection[str], room: float = MOST_BYTES, keep: Spans = ()
) -> Held:
    """Return the channels that the page holds.

    Parameters
    ----------
    log : Log
    needed : collection of str
        Channels that its plots show, by name.
    room : float
        Bytes that all may take as text.
    keep : sequence of (float, float)
        s; of what lies between more samples are kept.
    """
    wanted = {Channel.parse(name).source for name in needed}
    chosen, left_out = _chosen(log, wanted)
    kept = {key: _kept(log[key], keep) for key in chosen}
    kept = {key: one for key, one in kept.items() if one.fields}
    fine, most = _room(kept, wanted, min(room, MOST_BYTES))
    messages: dict[str, Any] = {}
    reduced = 0
    for key, one in kept.items():
        t, values = thinned(one.t, one.values, fine if key in wanted else most, keep)
        reduced += len(t) < one.records
        fields = {
            clean(name): packed(column) | {"u": clean(unit)} | ({"s": 1} if is_stepped else {})
            for name, unit, is_stepped, column in zip(
                one.fields, one.units, one.steps, values, strict=True
            )
        }
        messages[clean(key)] = {"n": one.records, "k": len(t), "t": packed(t), "f": fields}
    return Held(messages, left_out, reduced)


def _chosen(log: Log, wanted: Collection[str]) -> tuple[list[str], tuple[str, ...]]:
    """Return the messages to look at, in the log's order, and those that are too long for it."""
    keys = [
        key
        for key, message in log.messages.items()
        if len(message) and message.name not in DESCRIBING
    ]
    cost = {key: len(log[key]) * len(log[key].fields) for key in keys}
    room, taken = MOST_VALUES, set[str]()
    for key in sorted(keys, key=lambda key: (key not in wanted, cost[key], key)):
        if key in wanted or cost[key] <= room:
            taken.add(key)
            room -= cost[key]
    return [k for k in keys if k in taken], tuple(clean(k) for k in keys if k not in taken)


def _kept(message: Message, keep: Spans) -> _Kept:
    fields, units, steps, columns = list[str](), list[str](), list[bool](), list[Floats]()
    for name, column in message.columns.items():
        if column.is_text or name in TIMES:
            continue
        values = message.glance(name)[message.kept]
        if not np.isfinite(values).any():
            continue
        label, scale, offset = customary(column.conversion.unit)
        fields.append(name)
        units.append("" if label == "1" else label)
        steps.append(column.is_discrete)
        columns.append(values * scale + offset)
    stacked = np.array(columns).reshape(len(columns), len(message))
    t, values = thinned(message.t, stacked, FINE, keep)
    return _Kept(len(message), tuple(fields), tuple(units), tuple(steps), t, values)


def _room(kept: dict[str, _Kept], wanted: Collection[str], room: float) -> tuple[int, int]:
    """Return how many samples a message may have that plots need, and every other, so all fit."""

    def size(fine: int, most: int) -> float:
        return sum(
            min(len(one.t), fine if key in wanted else most) * BYTES * (1 + len(one.fields))
            for key, one in kept.items()
        )

    fine = most = FINE
    while most > LEAST and size(fine, most) > room:
        most = most * 4 // 5
    while fine > LEAST and size(fine, most) > room:
        fine = fine * 4 // 5
    return fine, most
