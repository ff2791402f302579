"""For how long has nothing come over the link?

In: when a telemetry log is silent. Out: the message ``LINK`` with the field ``pause``: how long
nothing has been received, s, once a second; 0 while messages come. A recorder on board has no link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fdi.telemetry.message import Column, Message
from fdi.units import Conversion

LINK: Final = "LINK"
PAUSE: Final = "pause"
_STEP_S: Final = 1.0
_HEARTBEAT: Final = "HEARTBEAT"  # what every link carries


def with_link(
    messages: Mapping[str, Message], span: tuple[float, float], gaps: Sequence[tuple[float, float]]
) -> dict[str, Message]:
    """Return the messages with ``LINK``.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key.
    span : (float, float)
        Of the log, s.
    gaps : sequence of (float, float)
        From the last record before to the first one after, s.
    """
    if LINK in messages or not span[1] > span[0]:
        return dict(messages)
    edges = np.array(gaps, float).ravel()
    # it lasts until just before something comes
    just = np.nextafter(edges[1::2], -np.inf)
    t = np.unique(np.concatenate([np.arange(*span, _STEP_S), edges, just, span[1:]]))
    last = np.searchsorted(edges, t, side="right") - 1
    # between an odd number of edges and the next one nothing comes
    pause = np.where(last % 2 == 0, t - edges[last], 0.0) if edges.size else np.zeros(t.size)
    columns = {PAUSE: Column(lambda: pause, Conversion("s"))}
    made = Message(LINK, None, t, t, np.arange(t.size), columns, made_from=_HEARTBEAT)
    return dict(sorted({**messages, LINK: made}.items()))
