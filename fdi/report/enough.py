"""Which messages of this log, and which tests, are enough to tell two faults of given sizes?

In: the residuals of a flight and a wish, ``FAULT=SIZE`` (to see it) or two of them with a comma (to
tell each from the other), sizes in the unit of the fault. Out: the cheapest sets by the noise in
the middle of the flight, for 5 s, one false alarm an hour and a probability of 90 %.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fdi.errors import UsageError
from fdi.report.sizes import ALPHA, LENGTH_S, POWER
from fdi.report.text import heading, text
from fdi.report.words import clean
from fdi.residuals import Residuals
from fdi.residuals.suffice import Wish, both_ways, cheapest_sensors, cheapest_tests
from fdi.residuals.window import at_sizes, window_of
from fdi.shown import Shown
from fdi.telemetry.airtime import time_in_air

if TYPE_CHECKING:
    from rich.console import RenderableType


@dataclass(frozen=True, slots=True)
class Enough(Shown):
    """The cheapest sets for a wish; None where not even all are enough.

    Attributes
    ----------
    wished : tuple of (str, float, str)
        Fault, size and unit.
    messages, tests : tuple of str or None
    """

    wished: tuple[tuple[str, float, str], ...]
    messages: tuple[str, ...] | None
    tests: tuple[str, ...] | None


def enough_for(residuals: Residuals, wish: str) -> Enough:
    """Return what is enough on a flight.

    Parameters
    ----------
    residuals : Residuals
    wish : str
        ``FAULT=SIZE`` or ``FAULT=SIZE,FAULT=SIZE``.

    Raises
    ------
    UsageError
        The wish cannot be read, a fault is unknown, or the flight is too short.
    """
    sizes = _read(wish)
    start, end = max(time_in_air(residuals.signals), key=lambda span: span[1] - span[0])
    window = window_of(residuals, (start + end) / 2, LENGTH_S, faults=tuple(sizes))
    window = at_sizes(window, residuals, sizes)
    names = tuple(sizes)
    if len(names) == 1:
        wishes: tuple[Wish, ...] = (Wish(names[0], sizes[names[0]]),)
    else:
        wishes = both_ways(names[0], sizes[names[0]], names[1], sizes[names[1]])
    bank = residuals.bank
    messages = cheapest_sensors(window, bank, wishes, ALPHA, power=POWER)
    return Enough(
        tuple((name, sizes[name], unit) for name, unit in zip(names, window.units, strict=True)),
        messages,
        None if messages is None else cheapest_tests(window, bank, wishes, ALPHA, power=POWER),
    )


def _read(wish: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for part in wish.split(","):
        name, _, size = part.strip().rpartition("=")
        try:
            found[name] = float(size)
        except ValueError:
            found[name] = math.nan
        if not name or not found[name] > 0 or math.isinf(found[name]):
            raise UsageError(f"{part.strip()!r} is no fault with a size", hint="FAULT=SIZE")
    if len(found) > 2 or len(found) != wish.count(",") + 1:
        raise UsageError("one fault, or two different ones, can be asked about", hint="FAULT=SIZE")
    return found


def enough_document(enough: Enough) -> dict[str, Any]:
    """Return it as plain values; a set that there is not is null."""
    return {
        "wished": [
            {"fault": name, "size": size, "unit": unit} for name, size, unit in enough.wished
        ],
        "messages": None if enough.messages is None else list(enough.messages),
        "tests": None if enough.tests is None else list(enough.tests),
    }


def enough_summary(enough: Enough) -> Iterator[RenderableType]:
    """Yield what a terminal shows of it."""
    told = " from ".join(f"{clean(name)} of {size:g} {unit}" for name, size, unit in enough.wished)
    yield heading(f"Cheapest for {told}, within {LENGTH_S:g} s in the middle of the flight")
    if enough.messages is None:
        yield text("  nothing in this log is enough; --sizes says how large the faults must be")
        return
    yield text(f"  messages: {clean(', '.join(enough.messages))}")
    yield text(f"  tests: {clean(', '.join(enough.tests or ()))}")
