"""Which of a log's events does a person want to read?

In: a log. Out: its events without the changes of parameters on the ground, of which a download
alone brings hundreds, and of those that steer nothing; without the texts that already stand there
as a failsafe or an impact, and once what is repeated within a second: one message on several links,
a mode that flickers. Where these are too many, a text that is repeated for minutes is told once as
well, with how often and when last; where even these are too many, plain texts go first: the last
thing that happened is seldom the least.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

from fdi.report.words import at
from fdi.telemetry import Event, Log
from fdi.telemetry.ordered import parameter_words, set_in_flight

REPEAT_S: Final = 60.0
"""Where there are too many events, a text that comes again within this time is a repetition:
autopilots repeat what keeps them from arming every 30 s."""
FLICKER_S: Final = 1.0
"""What comes again within this time is the same, sent on several links or a mode that flickers:
after a crash an old copter logs its modes by the hundred."""


class Told(NamedTuple):
    """An event, how often it came, and when last (s)."""

    event: Event
    times: int
    last: float


def told_events(log: Log, most: int) -> tuple[list[Told], int]:
    """Return the events to tell, in the order of time, and how many more there would be.

    Parameters
    ----------
    log : Log
    most : int
        How many to tell.
    """
    told = _merged(_worth(log), FLICKER_S)
    if len(told) > most:
        told = _merged(_worth(log), REPEAT_S)
    if len(told) <= most:
        return told, 0
    order = sorted(range(len(told)), key=lambda i: (_rank(told[i].event), i))
    return [told[i] for i in sorted(order[:most])], len(told) - most


def told_text(event: Event, times: int, last: float) -> str:
    """Return an event's text with how often it came."""
    often = f"({times} times, last at {at(last)} s)" if times > 1 else ""
    return f"{event.text} {often}".strip()


def is_grave(event: Event) -> bool:
    """Return whether an event speaks of danger (MAVLink severities up to 3, error)."""
    return event.kind in ("impact", "failsafe") or (
        event.severity is not None and event.severity <= 3
    )


def _rank(event: Event) -> int:
    return 0 if is_grave(event) else 2 if event.kind == "text" else 1


def _worth(log: Log) -> list[Event]:
    known = {(event.t, event.text) for event in log.events if event.kind not in ("text", "mode")}
    in_flight = set(set_in_flight(log.events, log.flights))
    return [
        replace(event, text=parameter_words(event)) if event.kind == "parameter" else event
        for event in log.events
        if not (event.kind == "parameter" and event not in in_flight)
        and not (event.kind == "text" and (event.t, event.text) in known)
    ]


def _merged(events: list[Event], repeat: float) -> list[Told]:
    """Return the events with repeated ones told once, where they began.

    ``repeat``: how far apart equal texts are the same, s.
    """
    told: list[Told] = []
    place: dict[tuple[str, str], int] = {}
    for event in events:
        what = event.kind, event.text
        at = place.get(what)
        longest = repeat if event.kind == "text" else FLICKER_S
        if at is not None and event.t - told[at].last <= longest:
            told[at] = Told(told[at].event, told[at].times + 1, event.t)
            continue
        place[what] = len(told)
        told.append(Told(event, 1, event.t))
    return told
