"""How often was it right? Rates over many flights, each with its interval.

In: scores. Out: `Totals` for a selection of flights. Beside every rate stands what a constant
answer would score: the commonest component of the faulty flights, accused on every flight at their
median onset.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import median
from typing import Any, Final

from fdi.evaluation.score import Score, score
from fdi.shown import Shown

_Z: Final = 1.959964  # 95 % of a normal distribution
_HOUR_S: Final = 3600.0


@dataclass(frozen=True, slots=True)
class Rate(Shown):
    """``hits`` of ``of``, with the Wilson score interval (95 %).

    References
    ----------
    Wilson, Journal of the American Statistical Association 22 (1927), 209.

    Examples
    --------
    >>> low, high = Rate(9, 10).interval
    >>> round(low, 3), round(high, 3)
    (0.596, 0.982)
    """

    hits: int
    of: int

    @property
    def share(self) -> float | None:
        """0..1, None of nothing."""
        return self.hits / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float]:
        """From and to, 0..1."""
        if not self.of:
            return 0.0, 1.0
        n, p = self.of, self.hits / self.of
        scale = 1 / (1 + _Z**2 / n)
        middle = (p + _Z**2 / (2 * n)) * scale
        half = _Z * sqrt(p * (1 - p) / n + _Z**2 / (4 * n**2)) * scale
        return max(0.0, middle - half), min(1.0, middle + half)


@dataclass(frozen=True, slots=True)
class Totals:
    """Rates over a selection of flights.

    Attributes
    ----------
    detected, named, in_three, timely : Rate
        Of the flights with a fault.
    clean : Rate
        Healthy flights on which nobody is accused.
    delay : float or None
        s, the median over the flights on which a right component is accused.
    false : int
        Accusations on healthy flights and too early ones, a component once per flight.
    cleared : int
        Flights on which a component that failed is ruled out.
    wrong : int
        Accusations of components that had nothing to do with it, each once per flight.
    bare_named, bare_timely : Rate
        With the tests left out that read a recorded command, of the flights scored so.
    false_healthy, healthy_hours
        The same on healthy flights only, and how long these were in the air.
    errors : int
        Logs without an analysis.
    """

    flights: int
    detected: Rate
    named: Rate
    in_three: Rate
    timely: Rate
    clean: Rate
    delay: float | None
    false: int
    cleared: int
    wrong: int
    bare_named: Rate
    bare_timely: Rate
    false_healthy: int
    healthy_hours: float
    errors: int

    @property
    def false_per_hour(self) -> float | None:
        """Accusations per hour in the air, on healthy flights."""
        return self.false_healthy / self.healthy_hours if self.healthy_hours else None


def totals(scores: Iterable[Score]) -> Totals:
    """Return the rates over some flights."""
    every = list(scores)
    faulty = [s for s in every if s.is_faulty]
    healthy = [s for s in every if not s.is_faulty]

    def rate(of: Sequence[Score], hit: Callable[[Score], bool]) -> Rate:
        return Rate(sum(map(hit, of)), len(of))

    bare = [s.bare for s in faulty if s.bare is not None]
    delays = [s.delay for s in faulty if s.delay is not None]
    return Totals(
        len(every),
        rate(faulty, lambda s: s.detected),
        rate(faulty, lambda s: s.named),
        rate(faulty, lambda s: s.in_three),
        rate(faulty, lambda s: s.timely),
        rate(healthy, lambda s: not s.false and s.error is None),
        median(delays) if delays else None,
        sum(len(s.false) for s in every),
        sum(bool(s.cleared) for s in every),
        sum(len(s.wrong) for s in every),
        rate(bare, lambda s: s.named),
        rate(bare, lambda s: s.timely),
        sum(len(s.false) for s in healthy),
        sum(s.airborne_s for s in healthy) / _HOUR_S,
        sum(s.error is not None for s in every),
    )


@dataclass(frozen=True, slots=True)
class Constant:
    """The commonest component of the faulty flights and the median onset, s."""

    component: str
    onset: float


def constant_answer(scores: Sequence[Score]) -> Constant | None:
    """Return the best constant answer, None where no flight has a fault."""
    faults = [fault for s in scores for fault in s.label.faults[:1]]
    if not faults:
        return None
    common = Counter(fault.component for fault in faults)
    component = min(common, key=lambda name: (-common[name], name))
    return Constant(component, median(fault.onset for fault in faults))


def totals_of(constant: Constant, scores: Iterable[Score]) -> Totals:
    """Return what a constant answer scores on some flights."""
    answer: dict[str, Any] = {
        "rank": 1,
        "component": constant.component,
        "onset_s": constant.onset,
        "alarm_s": constant.onset,
    }
    row: dict[str, Any] = {
        "findings": [answer],
        **dict.fromkeys(("consequences", "ruled_out", "not_testable"), ()),
        "error": None,
    }
    return totals(score(s.label, {**row, "airborne_s": s.airborne_s}) for s in scores)


def groups(scores: Sequence[Score]) -> dict[str, dict[str, list[Score]]]:
    """Return the flights by origin, vehicle, component that failed, and kind of fault."""
    found: dict[str, dict[str, list[Score]]] = {}
    for one in scores:
        faults = one.label.faults
        names = {
            "origin": [one.label.origin],
            "vehicle": [one.label.vehicle],
            "component": [plain(fault.component) for fault in faults] or ["healthy"],
            "kind of fault": [fault.kind for fault in faults] or ["healthy"],
        }
        for kind, own in names.items():
            for name in dict.fromkeys(own):
                found.setdefault(kind, {}).setdefault(name, []).append(one)
    return {kind: dict(sorted(parts.items())) for kind, parts in found.items()}


def plain(component: str) -> str:
    """Return the kind of component: ``motor_3`` is a motor."""
    head, _, tail = component.rpartition("_")
    return head if tail.isdigit() else component
