"""What happened in a flight that several logs tell of, each thing once?

In: the events and parameters of several logs, on one clock. Out: one list of each.

The vehicle's own recorder knows a change to the microsecond, telemetry with the next heartbeat, up
to a second late, and may lose a text. So events of the vehicle's own logs stand first, and one of
another log is told only where they do not have it: the same change within ``CHANGE_S``, the same
text within ``TEXT_S``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from fdi.telemetry.events import Event
from fdi.telemetry.log import Log, ParameterChange

CHANGE_S: Final = 2.5
"""A heartbeat comes once a second and may be lost once."""
TEXT_S: Final = 2.5
"""Texts wait in the autopilot's queue while the link is busy. One that waits longer is told twice:
two equal texts 10 s apart are two, and the second may be the one that matters."""
_STATES: Final = (("mode",), ("arm", "disarm"))
_AT_ONCE_S: Final = 1.0  # a log's first mode is what was set before it began
_FLOAT32: Final = 1e-6  # relative; some logs write a parameter with seven digits only

Shifted = Sequence[tuple[Log, float]]  # logs, and what is added to their times


def merged_events(logs: Shifted) -> list[Event]:
    """Return what all logs report in the order of time, each once."""
    told: list[Event] = []
    for log, offset in sorted(logs, key=lambda pair: pair[0].format == "tlog"):
        free: dict[tuple[str, str], list[float]] = {}
        for event in told:
            free.setdefault(_what(event), []).append(event.t)
        for event in log.reported:
            moved = replace(event, t=event.t + offset)
            if _was_set_before(log, event, moved.t, logs):
                continue
            if not _take(free.get(_what(moved), []), moved):
                told.append(moved)
    told.sort(key=lambda e: (e.t, e.kind))
    return _without_repeats(told)


def merged_parameters(
    logs: Shifted,
) -> tuple[dict[str, float], tuple[ParameterChange, ...], tuple[str, ...]]:
    """Return parameters, their changes, and the names of those about which the logs differ.

    A parameter has the value of the log that began first; changes stand apart.
    """
    order = sorted(logs, key=lambda pair: pair[0].span[0] + pair[1])
    values: dict[str, float] = {}
    changes: list[ParameterChange] = []
    differ: set[str] = set()
    for log, offset in order:
        changed = {change.name for one, _ in order for change in one.parameter_changes}
        for name, value in log.parameters.items():
            if not _is_same(values.setdefault(name, value), value) and name not in changed:
                differ.add(name)
        for change in log.parameter_changes:
            moved = change._replace(t=change.t + offset)
            if not any(_is_same_change(moved, other) for other in changes):
                changes.append(moved)
    changes.sort(key=lambda change: (change.t, change.name))
    return dict(sorted(values.items())), tuple(changes), tuple(sorted(differ))


def differing(first: Mapping[str, float], second: Mapping[str, float]) -> tuple[int, list[str]]:
    """Return how many parameters two logs share, and the names of those that differ."""
    both = sorted(first.keys() & second.keys())
    return len(both), [name for name in both if not _is_same(first[name], second[name])]


def _what(event: Event) -> tuple[str, str]:
    value = f" {event.value:.6g}" if event.kind == "parameter" and event.value is not None else ""
    return event.kind, event.text + value


def _was_set_before(log: Log, event: Event, t: float, logs: Shifted) -> bool:
    """Return whether a mode only stands at a log's beginning, and another log knows since when."""
    if event.kind != "mode" or event.t - log.span[0] > _AT_ONCE_S:
        return False
    return any(
        other.span[0] + offset < t <= other.span[1] + offset
        and any(e.kind == "mode" and e.t + offset < t for e in other.reported)
        for other, offset in logs
        if other is not log
    )


def _take(free: list[float], event: Event) -> bool:
    """Return whether the event is told already, and take what tells it off the list."""
    within = TEXT_S if event.kind in ("text", "failsafe", "parameter") else CHANGE_S
    near = [t for t in free if abs(t - event.t) <= within]
    if near:
        free.remove(min(near, key=lambda t: abs(t - event.t)))
    return bool(near)


def _without_repeats(events: list[Event]) -> list[Event]:
    """Return the events without changes to what already was."""
    now: dict[tuple[str, ...], tuple[str, str]] = {}
    told = []
    for event in events:
        kinds = next((kinds for kinds in _STATES if event.kind in kinds), None)
        if kinds is not None:
            if now.get(kinds) == (event.kind, event.text):
                continue
            now[kinds] = event.kind, event.text
        told.append(event)
    return told


def _is_same(one: float, other: float) -> bool:
    return abs(one - other) <= _FLOAT32 * max(abs(one), abs(other))


def _is_same_change(one: ParameterChange, other: ParameterChange) -> bool:
    return (
        one.name == other.name and _is_same(one.new, other.new) and abs(one.t - other.t) <= TEXT_S
    )
