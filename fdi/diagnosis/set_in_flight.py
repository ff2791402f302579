"""Which parameters were set in flight, by whom, and what left health soon after?

In: alarms. Out: a `Fact` for each moment at which some were. An order is no failure: what comes
after it is told, and nobody is accused for coming before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from fdi.decision import Alarms
from fdi.diagnosis.concerns import concerns
from fdi.diagnosis.ending import BEFORE_S, left_health
from fdi.diagnosis.stood_out import Fact
from fdi.model.naming import inside
from fdi.telemetry import Event
from fdi.telemetry.ordered import parameter_words, set_in_flight

PARAMETER: Final = "parameter"
TOGETHER_S: Final = 5.0
"""Between two parameters of one order: a ground station sends a list one by one."""
MOST: Final = 3
"""Of an order that are told by name, and orders of a flight that are told."""


def orders_by_parameter(alarms: Alarms) -> tuple[Fact, ...]:
    """Return what was set in the air and may change how it flies, in the order of time."""
    signals = alarms.residuals.signals
    orders: list[list[Event]] = []
    for event in set_in_flight(signals.events, signals.flights):
        if orders and event.t - orders[-1][-1].t <= TOGETHER_S:
            orders[-1].append(event)
        else:
            orders.append([event])
    return tuple(_facts(orders, alarms))


def _record(event: Event) -> str:
    """Return the record by which a parameter is known to have been set."""
    value = "" if event.value is None else f": {event.value:g}"
    before = "" if event.before is None else f", {event.before:g} until then"
    return f"parameter {event.text} at log {event.t:.1f} s{value}{before}"


def _facts(orders: Sequence[Sequence[Event]], alarms: Alarms) -> Iterator[Fact]:
    whom = concerns(alarms.residuals.bank)
    for one in orders[:MOST]:
        named = ", ".join(parameter_words(event) for event in one[:MOST])
        more = f" and {len(one) - MOST} more" if len(one) > MOST else ""
        by = next((f", by {event.by}" for event in one if event.by), "")
        until = f" to {one[-1].t:.1f}" if one[-1].t - one[0].t >= 0.1 else ""
        text = f"{named}{more} in flight (log {one[0].t:.1f}{until} s){by}"
        soon = left_health(one[0].t + BEFORE_S, alarms, whom)
        # what only triggers may be nothing, and is not told as what came of it
        later = (found for found in soon if found.kind != "trigger" and found.at >= one[0].t)
        first = min(later, key=lambda found: found.at, default=None)
        if first is not None:
            since = "after the first" if until else "later"
            text += f"; {first.at - one[0].t:.1f} s {since}: {inside(first.text)}"
        yield Fact(PARAMETER, text, records=tuple(_record(event) for event in one))
    if len(orders) > MOST:
        yield Fact(PARAMETER, f"parameters were set {len(orders) - MOST} more times in flight")
