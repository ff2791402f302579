"""What would MAVLink have sent of a sensor that says nothing while the others go on?

A message's own records come only while the sensor speaks; MAVLink goes on sending, and says that
it is silent. In: the message. Out: the message with records of that, at its own rate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fdi.telemetry.meaning.values import GAP_PERIODS, Messages
from fdi.telemetry.message import Floats, Message


@dataclass(frozen=True, slots=True)
class Silence:
    """What MAVLink says of a sensor that is silent for ``after`` s while ``beside`` goes on."""

    after: float
    beside: str
    fields: Mapping[str, float]  # what is sent; all others are unknown


def with_silence(message: Message, silence: Silence | None, known: Messages) -> Message:
    """Return the message with records of silence, at its own rate, where another one goes on."""
    beside = known.get(silence.beside) if silence is not None else None
    if silence is None or beside is None or len(message) < 2 or not len(beside):
        return message
    t, there = message.t, beside.t
    period = float(np.median(np.diff(t)))
    ends = np.append(t, there[-1])
    since = np.clip(np.searchsorted(t, there, side="right") - 1, 0, None)  # the record before
    is_long = np.diff(ends, append=ends[-1]) > max(silence.after, GAP_PERIODS * period)
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
