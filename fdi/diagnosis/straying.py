"""Which tests left what health explains in the air, and for how long?

In: alarms. Out: `Strays`, and the statements that were violated all along. The verdict counts by it
and what is open is told by it, so that the two cannot contradict each other: an alarm, a stretch of
`BRIEF_S` or more that made none, a moment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED, UNKNOWN
from fdi.decision.bounds import STANDING
from fdi.decision.judging import persistent
from fdi.model.parts import Kind
from fdi.telemetry.airtime import when_in_air

BRIEF_S: Final = 0.75
"""A test beyond its threshold for so long at a stretch has left what health explains: half of the
1.5 s that make an alarm. What passes sooner is an aliased manoeuvre or a late record."""


@dataclass(frozen=True, slots=True, eq=False)
class Strays:
    """When each test was beyond its threshold in the air; rows as the bank's generators.

    Attributes
    ----------
    raised : (r, n) bool
        It was in alarm.
    lasted : (r, n) bool
        It was beyond the threshold for `BRIEF_S` or longer at a stretch.
    moments : (r, n) bool
        It was so for less.
    """

    raised: NDArray[np.bool_]
    lasted: NDArray[np.bool_]
    moments: NDArray[np.bool_]


def strays(alarms: Alarms) -> Strays:
    """Return when the tests left health in the air, and how."""
    signals = alarms.residuals.signals
    flying = when_in_air(signals)
    least = max(2, round(BRIEF_S * signals.rate_hz))
    beyond = (alarms.state == TRIGGERED) & flying
    unknown = alarms.state == UNKNOWN
    lasted = np.zeros(beyond.shape, bool)
    for row in np.flatnonzero(beyond.any(axis=1)):
        lasted[row] = persistent(beyond[row], unknown[row], least)[0] & beyond[row]
    return Strays(alarms.alarm & flying, lasted, beyond & ~lasted)


def violated_from_start(alarms: Alarms) -> dict[int, float]:
    """Return the statements of a component that are violated from the flight's beginning on.

    No alarm of them is raised: they are a condition of the flight, and no event. Each is given with
    the share of the time in the air, above `STANDING`, for which it is violated.
    """
    bank = alarms.residuals.bank
    flying = when_in_air(alarms.residuals.signals)
    found = {}
    for row in np.flatnonzero(alarms.unfit).tolist():
        equation = bank.system.equations[bank.generators[row].residual]
        if equation.kind not in (Kind.LIMIT, Kind.EQUALITY) or equation.component is None:
            continue
        # a residual is right minus left: below zero where the left side is above
        off = alarms.residuals.values[row] - alarms.centre[row]
        size = {"above": -off, "below": off}.get(equation.side, np.abs(off))
        known = flying & np.isfinite(size) & np.isfinite(alarms.threshold[row])
        share = float((size > alarms.threshold[row])[known].mean()) if known.any() else 0.0
        if share >= STANDING:
            found[row] = share
    return found
