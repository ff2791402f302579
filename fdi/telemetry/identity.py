"""Which vehicle is this, so that its logs are found among those of others?

In: a log. Out: `Identity`. The best witness is the serial number of the board. A ULog has a place
for it; ArduPilot greets with it: the board's name and three words of the processor's 96-bit number
(``fmuv3 002F001F 33375111 37353832``). Logs without it have at most the ids of the sensors: bus,
address and type, the same in every vehicle of that build. The system id says who is meant only as
far as somebody set it. Two vehicles that tell nothing else look alike here: whoever shows them
together has to say so (`Identity.kind`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from fdi.shown import Shown
from fdi.telemetry.log import Log

Kind = Literal["board", "sensors", "none"]
_BOARD: Final = re.compile(r"\b([\w.+-]{2,40}) ([0-9A-F]{8} [0-9A-F]{8} [0-9A-F]{8})$")
_SENSORS: Final = re.compile(
    r"COMPASS_DEV_ID[23]?|INS_(ACC|GYR)[23]?_ID|CAL_(ACC|GYRO|MAG)[0-2]_ID", re.ASCII
)


@dataclass(frozen=True, slots=True)
class Identity(Shown):
    """What tells a vehicle from others.

    Attributes
    ----------
    hardware : str
        The board's name and serial number, or the ids of sensors as ``PARAMETER=id``; "" for none.
    kind : str
        ``board``, ``sensors``, ``none``: what ``hardware`` is. Only a board's number is the
        vehicle's alone.
    """

    hardware: str
    kind: Kind


def identity_of(log: Log) -> Identity:
    """Return what a log tells of which vehicle recorded it."""
    if log.board:
        return Identity(log.board, "board")
    for event in log.reported:
        found = _BOARD.search(event.text.strip()) if event.kind == "text" else None
        if found:
            return Identity(" ".join(found.groups()), "board")
    ids = {
        name: int(value)
        for name, value in sorted(log.parameters.items())
        if _SENSORS.fullmatch(name) and value
    }
    if ids:
        return Identity(" ".join(f"{name}={value}" for name, value in ids.items()), "sensors")
    return Identity("", "none")
