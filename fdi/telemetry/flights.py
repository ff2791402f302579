"""Which flights does a log hold?"""
from __future__ import annotations
from collections.abc import Mapping, Sequence
from fdi.telemetry.events import Event, Flight
from fdi.telemetry.message import Message


def find_flights(messages: Mapping[str, Message], events: Sequence[Event]) -> tuple[Flight, ...]:
    """Return the flights."""
    ends = [float(m.t[-1]) for m in messages.values() if m.t.size]
    end = max(ends, default=0.0)
    arms = [(e.t, e.kind) for e in events if e.kind in ("arm", "disarm")]
    out = []
    open_ = None
    for t, kind in arms:
        if kind == "arm" and open_ is None: open_ = t
        if kind == "disarm" and open_ is not None:
            out.append(Flight(open_, t)); open_ = None
    if open_ is not None: out.append(Flight(open_, end))
    return tuple(out)


def flight_events(flights: Sequence[Flight]) -> list[Event]:
    """Return take-offs, landings and impacts as events."""
    return []
