"""What was first, in the seconds before a flight went wrong?

In: alarms, with the log's events and how its flights ended. Out: an `Ending` per flight: for one
that ended badly the ordered list of what happened in the last seconds before control was lost, or
before the end where it never was: events, commands, tests that left health, alarms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED
from fdi.diagnosis.alarm_runs import onset_of
from fdi.diagnosis.concerns import Concerns, concerns
from fdi.diagnosis.plain import alarm_words
from fdi.diagnosis.values import Ending, First, FirstKind
from fdi.telemetry import Event, Flight
from fdi.telemetry.counters import steers
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.ordered import parameter_words
from fdi.windows import runs_of

BEFORE_S: Final = 10.0
"""What began earlier and led to the end is an alarm by then, and listed where it still stands."""
WARNING: Final = 4
"""MAVLink's severity; what an autopilot merely mentions is not listed."""
STATES_S: Final = 1.0
"""A period of MAVLink's heartbeat: mode and arming that come first were so before."""
LEAST: Final = 2
"""Samples in a row beyond a threshold; one alone is noise."""


def endings(alarms: Alarms) -> tuple[Ending, ...]:
    """Return how every flight ended, with what was first where that was badly."""
    whom = concerns(alarms.residuals.bank)
    return tuple(
        Ending(end, _first(end, alarms, whom) if end.is_bad else ())
        for end in alarms.residuals.signals.ends
    )


def went_wrong(end: FlightEnd) -> float:
    """Return when a flight went wrong, s: control was lost, or else the end."""
    return end.at if end.lost_control is None else min(end.lost_control, end.at)


def led_to(end: FlightEnd, flight: int, over: float | None) -> bool:
    """Return whether what stood in a flight until ``over``, s, still stood when one went wrong.

    What healed long before, or in another flight, explains no crash; None: it never healed.
    """
    return flight == end.flight and (over is None or over >= went_wrong(end) - BEFORE_S)


def _first(end: FlightEnd, alarms: Alarms, whom: Concerns) -> tuple[First, ...]:
    moment = went_wrong(end)
    tests = list(left_health(moment, alarms, whom))
    # what the autopilot said as the first of what still stands began belongs to it
    since = min([moment - BEFORE_S, *(one.at for one in tests if one.kind == "alarm")])
    signals = alarms.residuals.signals
    flight = signals.flights[end.flight]
    events = [
        event
        for event in signals.events
        if since <= event.t <= moment and not _is_state(event, flight)
    ]
    found = [*_events(events), *tests]
    if end.lost_by == "stop":
        found.append(First(moment, "command", "all motors are told to stop"))
    told: dict[tuple[str, float], First] = {}
    for one in sorted(found, key=lambda one: (one.at, one.kind, one.text)):
        # a mode that is chosen again is another order; a test or a report that comes again is not
        key = (one.text, one.at if one.kind == "command" and one.component is None else 0.0)
        known = told.get(key)
        if known is None or (known.kind == "trigger" and one.kind == "alarm"):
            told[key] = one if known is None else replace(one, at=known.at)
    return tuple(sorted(told.values(), key=lambda one: (one.at, one.kind, one.text)))


def _is_state(event: Event, flight: Flight) -> bool:
    """Return whether an event only tells how things stand as a log begins in the air."""
    return (
        event.kind in ("mode", "arm", "disarm")
        and flight.takeoff is None
        and abs(event.t - flight.start) <= STATES_S
    )


def _events(events: Iterable[Event]) -> Iterator[First]:
    """Yield what the autopilot reports and what was asked of it."""
    for event in events:
        if event.kind == "mode":
            yield First(event.t, "command", f"flight mode {event.text}")
        elif event.kind in ("arm", "disarm"):
            yield First(event.t, "command", f"{event.kind}ed")
        elif event.kind == "command":
            yield First(event.t, "command", event.text)
        elif event.kind == "parameter" and steers(event.text):
            by = f", by {event.by}" if event.by else ""
            yield First(event.t, "command", f"{parameter_words(event)}{by}")
        elif event.kind == "failsafe" or (
            event.kind in ("text", "sensor")
            and event.severity is not None
            and event.severity <= WARNING
        ):
            yield First(event.t, "event", event.text)


def left_health(moment: float, alarms: Alarms, whom: Concerns) -> Iterator[First]:
    """Yield the tests beyond their threshold in the last seconds, since when, what that means."""
    bank = alarms.residuals.bank
    t = alarms.residuals.t
    near = (t >= moment - BEFORE_S) & (t <= moment)
    for row in np.flatnonzero((alarms.state[:, near] == TRIGGERED).any(axis=1)):
        beyond = (alarms.state[row] == TRIGGERED) | alarms.alarm[row]
        for start, stop in runs_of(beyond):
            raised = bool(alarms.alarm[row, start:stop].any())
            if stop - start < LEAST or not near[start:stop].any():
                continue
            names = whom.in_order(int(row))
            component = names[0] if names else None
            generator = bank.generators[row]
            equation = bank.system.equations[generator.residual]
            text = alarm_words(component or equation.name, generator, bank.system)
            command = any(bank.system.equations[i].command for i in generator.equations)
            kind: FirstKind = "command" if command else "alarm" if raised else "trigger"
            yield First(onset_of(alarms, int(row), start, stop), kind, text, component)
