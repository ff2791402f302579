"""Which commands from outside act on outputs or end a flight, and when were they sent?

In: MAVLink commands with their first two parameters. Out: an `Event` where one is sent that was not
the one before. Modes, arming and parameters have events of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from fdi.telemetry.catalogue import data_table
from fdi.telemetry.events import Event

OUTSIDE: Final = "the ground station or a companion"


def command_events(sent: Iterable[tuple[float, int, float, float]]) -> Iterator[Event]:
    """Yield the commands that ``orders.json`` has words for.

    Parameters
    ----------
    sent : iterable of (float, int, float, float)
        When, s; the number of the command; its first two parameters. In the order of time.
    """
    before = ""
    for t, number, first, second in sent:
        words = str(data_table("orders")["commands"].get(str(number), ""))
        text = words.replace("#1", f"{first:g}").replace("#2", f"{second:g}")
        if text and text != before:  # one that is sent over and over is told once
            yield Event(t, "command", text, by=OUTSIDE)
            before = text
