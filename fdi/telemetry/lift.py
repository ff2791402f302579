"""What carries a vehicle that can take off upright and fly on its wings: rotors or wings?

In: a log's messages and what its autopilot reported. Out: events of kind ``lift``, whose text is
``wings``, ``rotors`` or ``in transition``, or ``unknown`` where the log does not tell. MAVLink says
so itself (``MAV_VTOL_STATE``); of ArduPilot's own logs the modes of a quadplane do, and the records
that it writes of its lifting motors only while these run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fdi.telemetry.events import Event
from fdi.telemetry.message import Message

_STATE: Final = ("EXTENDED_SYS_STATE", "vtol_state")
_CARRIED: Final = {1: "in transition", 2: "in transition", 3: "rotors", 4: "wings"}
_MOTORS: Final = "QTUN"
_STOPPED_S: Final = 2.0  # records of the lifting motors come 10 times a second or more often


def lift_events(
    messages: Mapping[str, Message], reported: Sequence[Event], begin: float, vehicle: str
) -> list[Event]:
    """Return from when on a vehicle was carried by what; none of one that cannot change.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key.
    reported : Sequence[Event]
        Those of kind ``mode`` count.
    begin : float
        s of the log's clock.
    vehicle : str
        As in `Log`.
    """
    if vehicle != "vtol":
        return []
    found = _told(messages) or _by_mode(messages, reported) or [(begin, "unknown")]
    events = [Event(t, "lift", text) for t, text in found]
    return [e for i, e in enumerate(events) if not i or e.text != events[i - 1].text]


def _told(messages: Mapping[str, Message]) -> list[tuple[float, str]]:
    message = messages.get(_STATE[0])
    if message is None or _STATE[1] not in message:
        return []
    states = message.si(_STATE[1])
    known = np.isin(states, list(_CARRIED))
    times = message.t[known].tolist()
    return [(t, _CARRIED[int(s)]) for t, s in zip(times, states[known], strict=True)]


def _by_mode(messages: Mapping[str, Message], reported: Sequence[Event]) -> list[tuple[float, str]]:
    modes = [
        (e.t, "rotors" if e.text.startswith("Q") else "wings") for e in reported if e.kind == "mode"
    ]
    running = messages.get(_MOTORS)
    if not modes or running is None or not len(running):
        return modes
    t = np.asarray(running.t)
    apart = np.flatnonzero(np.diff(t) > _STOPPED_S)
    starts, stops = t[np.append(0, apart + 1)], t[np.append(apart, t.size - 1)] + _STOPPED_S
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        after = [text for at, text in modes if at <= stop]
        inside = [(start, "rotors"), (stop, after[-1] if after else modes[0][1])]
        modes = sorted([m for m in modes if not start <= m[0] < stop] + inside)
    return modes
