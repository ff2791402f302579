"""By which parameters do the autopilots compare, count, rank and vote?

In: nothing. Out: `Settings`, with the presets of the thesis and of its recorded tests. Times are in
seconds; inside, the rules count whole microseconds (`microseconds`), because they are strict ("more
than 3 s") and the stamps lie on a grid on which exactly 3 s occurs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final, Literal, NamedTuple

from fdi.errors import UsageError
from fdi.shown import Shown

SHORTEST_CYCLE_S: Final = 0.001
"""The simulator's clock steps 4 ms; a shorter cycle than a millisecond is a slip of the pen."""
LONGEST_S: Final = 1e6
"""Eleven days, longer than any log: what is meant to be never fits into 64 bits of microseconds."""


class Flag(NamedTuple):
    """A flag of an autopilot: field, topic of its own log, and the value that means an error."""

    name: str
    topic: str
    bad: int


@cache
def tables() -> Mapping[str, Any]:
    """Return ``tables.json``: the flags, which ones are compared, and the published priorities."""
    text = files("fdi.methods.voting").joinpath("tables.json").read_text("utf-8")
    return MappingProxyType(json.loads(text))


@cache
def known_flags() -> Mapping[str, Flag]:
    """Return every flag that can be compared, by name, in the published order."""
    return MappingProxyType({row["name"]: Flag(**row) for row in tables()["flags"]})


def microseconds(seconds: float) -> int:
    """Return seconds as whole microseconds."""
    return round(seconds * 1e6)


@dataclass(frozen=True, slots=True)
class Settings(Shown):
    """Parameters of the voter.

    Attributes
    ----------
    name : str
        Of the preset that they come from.
    flags : tuple of str
        Which flags are compared; all weigh the same.
    cycle : float
        s, from one comparison and vote to the next; also from one message to the next.
    delay : float
        s after take-off from which on there is a comparison.
    needs_takeoff : bool
        Whether a vehicle that has not taken off (or has landed) compares nothing. The recorded
        program counts the delay from the start of the autopilot then, so that it also compares on
        the ground.
    persistence : float
        s; an error counts once it has been blamed for longer.
    hold : float
        s; a counted error stays counted until it has not been blamed for longer.
    silence : float
        s; who was not heard of for longer is silent, and stays so.
    age_from : {"sent", "received"}
        Whether silence counts from the sender's stamp or from the reception.
    keeps_vote_when_equal : bool
        Whether the vote stays where all have the same number of errors, at least one; else the
        lowest number gets it (thesis, section 5.3.1).
    transport : float or None
        s from sending to arrival; None: as recorded.
    selection_hold : float
        s for which the program that counts the votes sleeps after each count.
    quorum : int or None
        How many autopilots must have voted before the votes are counted; None: all.
    unhealthy_after, unhealthy_after_first : float
        s; an autopilot with errors for longer is marked unhealthy, the first of the others by a
        time of its own. The mark is recorded and has no part in the vote.
    healthy_after : float
        s without errors after which the mark goes.
    """

    name: str
    flags: tuple[str, ...]
    cycle: float = 1.0
    delay: float = 10.0
    needs_takeoff: bool = False
    persistence: float = 1.0
    hold: float = 600.0
    silence: float = 3.0
    age_from: Literal["sent", "received"] = "sent"
    keeps_vote_when_equal: bool = True
    transport: float | None = None
    selection_hold: float = 3.0
    quorum: int | None = None
    unhealthy_after: float = 3.0
    unhealthy_after_first: float = 2.0
    healthy_after: float = 150.0

    def __post_init__(self) -> None:
        unknown = [name for name in self.flags if name not in known_flags()]
        if unknown or not self.flags:
            raise UsageError(
                f"no flag is called {unknown[0][:60]!r}" if unknown else "no flag is compared",
                hint=f"known: {', '.join(known_flags())}",
            )
        if len(set(self.flags)) < len(self.flags):
            raise UsageError(f"a flag is named twice in {', '.join(self.flags)}")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float):
                _check(field.name.replace("_", " "), value, field.name == "cycle")
        if self.quorum is not None and self.quorum < 1:
            raise UsageError(f"a quorum of {self.quorum} is none", hint="1 vote at the least")


def _check(name: str, value: float, is_cycle: bool) -> None:
    low = SHORTEST_CYCLE_S if is_cycle else 0.0
    if not (math.isfinite(value) and low <= value <= LONGEST_S):
        raise UsageError(
            f"{name} is {value:g} s", hint=f"it has to lie between {low:g} and {LONGEST_S:g} s"
        )


def _preset_flags(name: str) -> tuple[str, ...]:
    names = tuple(known_flags())
    return tuple(names[index] for index in tables()[name])


def _presets() -> Mapping[str, Settings]:
    return MappingProxyType(
        {
            "recorded": Settings("recorded", _preset_flags("recorded")),
            "thesis": Settings(
                "thesis",
                _preset_flags("thesis"),
                delay=30.0,
                needs_takeoff=True,
                keeps_vote_when_equal=False,
                unhealthy_after_first=3.0,
            ),
        }
    )


PRESETS: Final = _presets()
"""``recorded``: as the program ran in the published tests. ``thesis``: as its text states."""
