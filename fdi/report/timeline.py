"""Which of a log's events does a person want to read?

In: a log. Out: its events without the changes of parameters, of which a download alone brings
hundreds, and without the texts that already stand there as a failsafe or an impact.
"""

from __future__ import annotations

from fdi.telemetry import Event, Log


def told_events(log: Log) -> list[Event]:
    """Return the events to tell, in the order of time."""
    known = {(event.t, event.text) for event in log.events if event.kind not in ("text", "mode")}
    return [
        event
        for event in log.events
        if event.kind != "parameter"
        and not (event.kind == "text" and (event.t, event.text) in known)
    ]


def is_grave(event: Event) -> bool:
    """Return whether an event speaks of danger (MAVLink severities up to 3, error)."""
    return event.kind in ("impact", "failsafe") or (
        event.severity is not None and event.severity <= 3
    )
