"""Who ordered what ended a flight: modes, failsafes, switches and commands, from the end backwards.

In: how a flight ends, the events of the log, its messages and parameters. Out: a chain of `Order`s
in the order of time. It begins with the last thing that a person, a mission or a ground station
ordered, or the beginning of the flight, and holds what has been in force since: the mode at the
end, what put it into force, and each failsafe, switch and stop after it. Who gave an order is said
only where the log says so; a mode switch of the remote control that moved at that moment counts,
and so do the mode AUTOTUNE and learning in flight, for what these set.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from fdi.shown import Shown
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.counters import steers
from fdi.telemetry.events import Event, Flight, over_words
from fdi.telemetry.message import Message

What = Literal["mode", "failsafe", "command", "parameter", "disarm"]

CAUSE_S: Final = 3.0
"""Before a mode, in which what made the autopilot choose it is reported: messages of 1 Hz and
checks of a second."""
AFTER_S: Final = 1.5
"""After an end, in which what brought it about is still seen: heartbeats come once a second."""
SWITCHED_S: Final = 1.5
"""Before a mode, in which the switch that chose it moves."""
MOVED_US: Final = 80.0
"""Of a switch's channel: six positions are 130 us and more apart."""
_OLD_CHANNEL: Final = 5.0  # of the mode switch of ArduCopter, before there was FLTMODE_CH (3.4)
MOST: Final = 8
"""Links that are told: of more the latest, and of modes no more than half as many."""
_ACTS: Final = re.compile(r"fail ?-?safe|fence|crash|emergency|terminat", re.IGNORECASE)
"""What an autopilot's report says where it acted; others are complaints."""
_LANDS: Final = re.compile(r"landing detected|land detector", re.IGNORECASE)
_DISARMED: Final = re.compile(r"\bdisarmed by (?P<by>[a-z ]{3,40})", re.IGNORECASE)
"""What PX4's commander reports, of no severity: it takes the motors off by itself then."""
_RADIO: Final = re.compile(r"radio|remote control|manual control|\brc\b|throttle", re.IGNORECASE)
_TUNED: Final = ("ATC_", "PTCH", "RLL", "YAW", "Q_A_")
"""Beginnings of the gains that ArduPilot's autotune sets (AC_AutoTune, AP_AutoTune)."""
_LEARNED: Final = ("COMPASS_OFS",)
_LEARNS: Final = re.compile(r"compass ?learn", re.IGNORECASE)
LEARNED_S: Final = 2.5
"""Between a parameter and a text of one happening (`together.happenings`)."""
_AUTOMATIC: Final = ("failsafe", "check", "detector", "geofence", "the autopilot", "glitch")
"""Words of those who order on nobody's behalf: what came before them belongs to the chain."""


@dataclass(frozen=True, slots=True)
class Order(Shown):
    """One link.

    Attributes
    ----------
    t : float
        s of the log's clock.
    what : str
    said : str
        What happened, a clause for a person.
    by : str
        Who ordered it; "" where the log does not say.
    """

    t: float
    what: What
    said: str
    by: str


def chain_of(
    until: float,
    flight: Flight,
    events: Sequence[Event],
    messages: Mapping[str, Message],
    parameters: Mapping[str, float],
) -> tuple[Order, ...]:
    """Return what was ordered last, and what has been in force since, in the order of time.

    ``until`` is when control was lost, the ground met, or the log ends, s.
    """
    own = sorted((e for e in events if e.t <= until + AFTER_S), key=lambda e: e.t)
    modes = _changes([e for e in own if e.kind == "mode" and e.t <= until])
    orders, since = [], flight.start
    for before, mode in reversed(list(zip([None, *modes], modes, strict=False))):
        by = mode.by or _by_switch(mode.t, own, messages, parameters)
        begins = before is None or mode.t <= flight.start
        told = f"mode {mode.text}" + ("" if begins else f" instead of {_name(before)}")
        orders.append(Order(mode.t, "mode", told, by))
        since = mode.t
        if begins or not any(word in by for word in _AUTOMATIC):
            break
    kept = orders[: MOST // 2]  # the latest first
    low = flight.airborne[0]
    others = sorted(_others(own, max(since, low) - CAUSE_S, low), key=lambda one: one.t)
    # what is reported within a tenth of a second is the reason, whichever record came first
    return tuple(
        sorted(
            [*kept, *others[len(kept) - MOST :]],
            key=lambda one: (round(one.t, 1), one.what == "mode", one.t),
        )
    )


def order_words(order: Order) -> str:
    """Return a link as a person reads it.

    Examples
    --------
    >>> order_words(Order(3.0, "mode", "mode LAND instead of LOITER", "the battery failsafe"))
    'mode LAND instead of LOITER, ordered by the battery failsafe'
    >>> order_words(Order(3.0, "disarm", "disarmed", ""))
    'disarmed; the log does not say by whom'
    """
    if order.by:
        return f"{order.said}, ordered by {order.by}"
    return order.said if order.what == "failsafe" else f"{order.said}; the log does not say by whom"


def set_in_flight(events: Sequence[Event], flights: Sequence[Flight]) -> list[Event]:
    """Return the parameters set in the air that may change how it flies, in the order of time."""
    spans = [flight.airborne for flight in flights if flight.flew]
    return [
        event
        for event in events
        if event.kind == "parameter"
        and steers(event.text)
        and any(low <= event.t <= high for low, high in spans)
    ]


def with_setters(events: Sequence[Event], parameters: Mapping[str, float]) -> tuple[Event, ...]:
    """Return events, sorted by time, with what set a parameter by itself: autotune or learning.

    Where the log tells who asked for it that stays.
    """
    mode, found = "", []
    learned = [e.t for e in events if e.kind == "text" and _LEARNS.search(e.text)]
    learns = parameters.get("COMPASS_LEARN", 0.0) > 0
    for event in events:
        if event.kind == "mode":
            mode = event.text
        if event.kind == "parameter" and not event.by:
            near = learns or any(abs(t - event.t) <= LEARNED_S for t in learned)
            if "AUTOTUNE" in mode.upper() and event.text.startswith(_TUNED):
                event = replace(event, by="the autopilot's autotune")
            elif near and event.text.startswith(_LEARNED):
                event = replace(event, by="the autopilot's learning in flight")
        found.append(event)
    return tuple(found)


def parameter_words(event: Event) -> str:
    """Return a changed parameter as a person reads it.

    Examples
    --------
    >>> parameter_words(Event(3.0, "parameter", "ATC_RAT_RLL_P", value=1.5, before=0.135))
    'ATC_RAT_RLL_P set from 0.135 to 1.5'
    """
    old = "" if event.before is None else f" from {event.before:.6g}"
    return f"{event.text} set{old} to {event.value:.6g}"


def _disarmers(events: Sequence[Event]) -> list[tuple[float, str]]:
    """Return when the autopilot says who disarmed, s, and who."""
    said = ((e.t, _DISARMED.search(e.text)) for e in events if e.kind == "text")
    return [(t, found["by"].lower()) for t, found in said if found]


def _name(mode: Event | None) -> str:
    return "" if mode is None else mode.text


def _changes(modes: Sequence[Event]) -> list[Event]:
    """Return the modes that differ from the one before."""
    return [one for row, one in enumerate(modes) if not row or modes[row - 1].text != one.text]


def _others(events: Sequence[Event], since: float, low: float) -> Iterator[Order]:
    """Yield the failsafes, commands and disarming from a moment on, each once.

    And what was set since ``low``, when it left the ground: no mode takes that back.
    """
    armed = max((e.t for e in events if e.kind == "arm"), default=-np.inf)
    last = {event.text: event.t for event in events}
    told = _disarmers(events)
    seen = set()
    for event in events:
        if event.kind == "parameter" and event.t >= low and steers(event.text):
            yield Order(event.t, "parameter", parameter_words(event), event.by)
        if event.t < since or event.text in seen:
            continue
        is_over = last.get(over_words(event.text), -np.inf) >= last[event.text]
        if (event.kind == "failsafe" and _ACTS.search(event.text) and not is_over) or (
            event.kind == "text" and _LANDS.search(event.text)
        ):
            seen.add(event.text)
            yield Order(event.t, "failsafe", f"the autopilot reports: {event.text}", "")
        elif event.kind == "command":
            yield Order(event.t, "command", event.text, event.by)
        elif event.kind == "disarm" and event.t > armed:
            by = next((who for t, who in told if abs(t - event.t) <= AFTER_S), "")
            yield Order(event.t, "disarm", "disarmed", event.by or by)


def _by_switch(
    t: float,
    events: Sequence[Event],
    messages: Mapping[str, Message],
    parameters: Mapping[str, float],
) -> str:
    """Return that the remote control's mode switch moved just before, "" where it did not.

    Nobody moved it where the radio is reported lost: receivers then send preset values.
    """
    channels = messages.get("RC_CHANNELS")
    is_lost = any(
        e.kind == "failsafe" and _RADIO.search(e.text) and abs(e.t - t) <= CAUSE_S for e in events
    )
    if channels is None or is_lost:
        return ""
    own = {"FLTMODE_CH": _OLD_CHANNEL} if "FLTMODE1" in parameters else {}
    for name in data_table("orders")["switches"]:
        number = parameters.get(name, own.get(name, 0.0))
        field = f"chan{number:.0f}_raw"
        if not 1 <= number <= 18 or field not in channels:
            continue
        near = (channels.t > t - SWITCHED_S) & (channels.t <= t + AFTER_S)
        pulses = channels.si(field)[near]
        pulses = pulses[np.isfinite(pulses)]
        if pulses.size > 1 and np.ptp(pulses) > MOVED_US:
            return "the pilot's mode switch"
    return ""
