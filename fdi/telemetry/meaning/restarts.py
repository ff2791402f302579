"""For how long did an autopilot that started anew give nothing, and was it powered as it ceased?

In: messages and events. Out: the message ``RESTART``, only where the log holds a reboot. Its fields
say how long it gave nothing, s, by what is known of the supply at its last record: ``powered``
(board and battery held), ``board`` (its voltage fell), ``battery`` (its voltage fell, and not the
board's); none of them where nothing tells the board's. A watchdog's report tells that it was
powered. 0 while it runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Final

import numpy as np

from fdi.telemetry.events import Event
from fdi.telemetry.message import Column, Floats, Message
from fdi.telemetry.supply import Supply, supplies
from fdi.units import Conversion

RESTART: Final = "RESTART"
HEADINGS: Final = frozenset(("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "VER", "WDOG"))
"""What a recorder on board writes as it begins, and no measurement of the vehicle."""
NEW_S: Final = 10.0
"""About a restart, in which an autopilot greets and says why: texts may come before it measures."""
_STOPPED: Final = re.compile(r"WDG: T-?\d|watchdog reset|processor crashed", re.IGNORECASE)
"""What ArduPilot says once after a reset by its watchdog (AP_Vehicle.cpp,
``send_watchdog_reset_statustext``), and what readers make of its record and of PX4's crash dump."""
_CAUSES: Final = ("powered", "board", "battery")
_STEP_S: Final = 0.1
SILENT_S: Final = 60.0
"""After a longer silence nobody knows where an autopilot started anew."""
_MOST: Final = 36_000  # records beside the silences, however long the log


def last_heard(messages: Iterable[Message], restart: float) -> float:
    """Return when the vehicle's last record before it started anew was made, s."""
    own = (m for m in messages if m.made_from is None and m.name not in HEADINGS)
    before = (m.t[: int(np.searchsorted(m.t, restart))] for m in own)
    return max((float(t[-1]) for t in before if t.size), default=restart)


def heard_again(messages: Iterable[Message], restart: float) -> float:
    """Return when the vehicle's first measurement after it started anew was made, s."""
    own = (m for m in messages if m.made_from is None and m.name not in HEADINGS)
    after = (m.t[int(np.searchsorted(m.t, restart)) :] for m in own)
    return min((float(t[0]) for t in after if t.size), default=restart)


def program_stopped(events: Iterable[Event], restart: float) -> Event | None:
    """Return what says that the program of an autopilot had stopped before it started anew."""
    near = (e for e in events if abs(e.t - restart) < NEW_S)
    return next((e for e in near if _STOPPED.search(e.text)), None)


def _cause(told: tuple[Supply, ...], report: Event | None) -> str | None:
    """Return the field that says what is known of the supply as an autopilot ceased, or None."""
    if report is not None:
        return "powered"
    fallen = [one.name for one in told if not one.kept]
    if "board" in fallen:
        return "board"
    if fallen:
        return "battery"
    return "powered" if any(one.name == "board" for one in told) else None


def with_restarts(messages: Mapping[str, Message], events: Sequence[Event]) -> dict[str, Message]:
    """Return the messages, by key, with ``RESTART`` where an event is a reboot."""
    anew = [event.t for event in events if event.kind == "reboot"]
    heard = [m.t for m in messages.values() if m.made_from is None and len(m)]
    if not anew or not heard:
        return dict(messages)
    first, last = min(float(t[0]) for t in heard), max(float(t[-1]) for t in heard)
    count = min(round((last - first) / _STEP_S) + 1, _MOST)
    t = [np.linspace(first, last, count)]
    silent: dict[str, list[tuple[float, float]]] = {cause: [] for cause in _CAUSES}
    for restart in anew:
        since = last_heard(messages.values(), restart)
        cause = _cause(supplies(messages, since), program_stopped(events, restart))
        if cause is not None and restart - since <= SILENT_S:
            t.append(np.linspace(since, restart, round((restart - since) / _STEP_S) + 1))
            silent[cause].append((since, restart))
    at = np.unique(np.concatenate(t))
    columns = {
        cause: Column(partial(_lasts, at, spans), Conversion("s"), is_discrete=True)
        for cause, spans in silent.items()
    }
    busiest = max(messages, key=lambda key: len(messages[key]))
    made = Message(RESTART, None, at, at, np.arange(at.size), columns, made_from=busiest)
    return dict(sorted({**messages, RESTART: made}.items()))


def _lasts(t: Floats, spans: list[tuple[float, float]]) -> Floats:
    """Return how long the silence lasts in which each time lies, s, else 0."""
    found = np.zeros(t.size)
    for low, high in spans:
        found[(t >= low) & (t < high)] = high - low
    return found
