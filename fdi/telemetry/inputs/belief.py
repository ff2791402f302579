"""Which inputs of the tests are believed in a log, and the log without the others.

In: messages and what the recorder reported. Out: the same messages, of which what is not believed
is unknown, and `Judged` inputs. Nothing is decoded before a field that is judged is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Final

import numpy as np

from fdi.telemetry.events import Event
from fdi.telemetry.inputs.attitude import judge_attitude
from fdi.telemetry.inputs.battery import judge_batteries
from fdi.telemetry.inputs.demands import judge_demands
from fdi.telemetry.inputs.outputs import judge_outputs
from fdi.telemetry.inputs.steering import STEERS, judge_pulses
from fdi.telemetry.inputs.values import Input, Judged, Mask
from fdi.telemetry.inputs.velocity import ESTIMATED, judge_velocity
from fdi.telemetry.message import Column, Floats, Message

_Field = tuple[str, str]
Judge = Callable[[], tuple[Judged, ...]]
_JUDGED: Final = {
    "ATTITUDE": None,
    "MOTORS": None,
    "SYS_STATUS": ("battery_remaining", "current_battery"),
    "BATTERY_STATUS": ("battery_remaining", "current_battery"),
    **ESTIMATED,
    **STEERS,
}
"""The messages whose fields are judged; None: all of them."""


def believed(
    messages: Mapping[str, Message],
    reported: Sequence[Event],
    *,
    wings: bool = True,
    autopilot: str = "",
) -> tuple[dict[str, Message], Judge]:
    """Return the messages with what is not believed of them unknown, and what was judged of them.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    reported : sequence of Event
        Arming and modes.
    wings : bool
        Whether wings may carry the vehicle; else rotors alone do.
    autopilot : str
        As in `Log`.
    """
    known = dict(messages)

    @cache
    def judge() -> tuple[Judged, ...]:
        return tuple(_judge(messages, reported, wings=wings, autopilot=autopilot))

    @cache
    def unbelieved() -> dict[_Field, Mask]:
        return {field: rows for one in judge() for field, rows in one.unbelieved.items()}

    for key, message in messages.items():
        if message.name not in _JUDGED:
            continue
        fields = _JUDGED[message.name] or message.fields
        changed = {
            field: _without(message.columns[field], partial(_of, unbelieved, (key, field)))
            for field in fields
            if field in message
        }
        known[key] = replace(message, columns={**message.columns, **changed}, _cache={})
    return known, judge


def inputs_of(found: Iterable[Judged]) -> tuple[Input, ...]:
    """Return the inputs, those of which the same is said as one."""
    merged: dict[Input, tuple[str, ...]] = {}
    for one in found:
        alike = replace(one.input, channels=())
        merged[alike] = merged.get(alike, ()) + one.input.channels
    return tuple(replace(alike, channels=channels) for alike, channels in merged.items())


def _of(unbelieved: Callable[[], dict[_Field, Mask]], field: _Field) -> Mask | None:
    return unbelieved().get(field)


def _judge(
    messages: Mapping[str, Message], reported: Sequence[Event], *, wings: bool, autopilot: str
) -> Iterator[Judged]:
    armed = _armed(reported)
    yield from judge_outputs(messages, armed)
    yield from judge_attitude(messages, armed)
    yield from judge_velocity(messages, armed)
    idle = tuple(judge_pulses(messages, armed)) if autopilot == "ardupilot" else ()
    yield from idle or judge_demands(messages, reported, wings=wings)
    yield from judge_batteries(messages, armed)


def _armed(reported: Sequence[Event]) -> Floats:
    """Return from when to when the vehicle is armed, (k, 2) s; all along where nothing tells."""
    arming = [e for e in reported if e.kind in ("arm", "disarm")]
    if not arming:
        return np.array([[-np.inf, np.inf]])
    since = -np.inf if arming[0].kind == "disarm" else None
    spans = []
    for event in arming:
        if event.kind == "arm":
            since = event.t if since is None else since
        elif since is not None:
            spans.append((since, event.t))
            since = None
    if since is not None:
        spans.append((since, np.inf))
    return np.array(spans, np.float64).reshape(-1, 2)


def _without(column: Column, unbelieved: Callable[[], Mask | None]) -> Column:
    """Return a column of which some records are unknown besides its own."""

    def absent() -> Mask | None:
        own, more = column.absent(), unbelieved()
        if own is None or more is None:
            return more if own is None else own
        return own | more

    return column._replace(absent=absent)
