"""Which commands from outside act on outputs or end a flight, and when were they sent?

In: MAVLink commands with their first two parameters. Out: an `Event` where one is sent that was not
the one before. Modes, arming and parameters have events of their own.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import chain
from typing import Final

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.events import Event

OUTSIDE: Final = "the ground station or a companion"
MOST: Final = 20
"""Of one command that are told, the first and the last half: a companion may move a servo by them
all the time."""


def command_events(sent: Iterable[tuple[float, int, float, float]]) -> Iterator[Event]:
    """Yield the commands that ``orders.json`` has words for, in the order of time.

    Parameters
    ----------
    sent : iterable of (float, int, float, float)
        When, s; the number of the command; its first two parameters. In the order of time.
    """
    first: dict[int, list[Event]] = defaultdict(list)
    last: dict[int, deque[Event]] = defaultdict(partial(deque, maxlen=MOST // 2))
    before = ""
    for t, number, *values in sent:
        text = str(data_table("orders")["commands"].get(str(number), ""))
        for place, value in enumerate(values, 1):
            text = text.replace(f"#{place}", f"{value:g}")
        if not text or text == before:  # one that is sent over and over is told once
            continue
        before = text
        begins = len(first[number]) < MOST // 2
        (first if begins else last)[number].append(Event(t, "command", text, by=OUTSIDE))
    told = chain(*first.values(), *last.values())
    yield from sorted(told, key=lambda event: event.t)
