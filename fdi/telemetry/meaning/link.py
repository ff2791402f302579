"""For how long has nothing come over the link?

In: the messages of a telemetry log. Out: the message ``LINK`` with the field ``pause``: how long
nothing at all has been received, s, at every heartbeat and, in a pause, once a second; 0 while
messages come. A recorder on board has no link.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from fdi.grid import LEAST, PER_RECORD
from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

LINK: Final = "LINK"
_HEARTBEAT: Final = "HEARTBEAT"
_STEP_S: Final = 1.0
_PAUSE_S: Final = 2.0  # more than a period of what telemetry sends, heartbeats among it
_POINTS: Final = 1000  # of a pause, which damaged stamps may make as long as they like


def with_link(messages: Mapping[str, Message]) -> dict[str, Message]:
    """Return the messages of a vehicle, by key, with ``LINK`` where its heartbeat is among them."""
    if _HEARTBEAT not in messages:
        return dict(messages)
    return dict(sorted({**messages, LINK: link_of(messages.values())}.items()))


def link_of(received: Iterable[Message]) -> Message:
    """Return ``LINK`` by all messages that were received of a vehicle, heartbeats among them."""
    recorded = [m for m in received if m.made_from is None]
    heard = np.unique(np.concatenate([m.t for m in recorded]))
    told = np.concatenate([m.t for m in recorded if m.name == _HEARTBEAT])
    parts, pauses = [told, heard[-1:]], [np.zeros(told.size), np.zeros(1)]
    silent = np.flatnonzero(np.diff(heard) > _PAUSE_S)
    most = min(_POINTS, (LEAST + PER_RECORD * heard.size) // max(silent.size, 1))
    for row in silent:
        start, end = float(heard[row]), float(heard[row + 1])
        count = min(round((end - start) / _STEP_S) + 1, most)
        # until just before something comes
        t = np.linspace(start, np.nextafter(end, start), count)
        parts += [t, heard[row + 1 : row + 2]]
        pauses += [t - start, np.zeros(1)]
    t, first = np.unique(np.concatenate(parts), return_index=True)
    pause = np.concatenate(pauses)[first]
    columns = {"pause": Column(lambda: pause, Conversion("s"))}
    return Message(LINK, None, t, t, np.arange(t.size), columns, made_from=_HEARTBEAT)
