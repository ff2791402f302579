"""Finds the smallest sets of added sensors with which faults can be detected or told apart.

In: a model, the unknowns that a sensor could measure, what is wanted and, optionally, what each
sensor costs and which of them may fail. Out: every minimal set of sensors that grants it. A new
sensor is an equation of its own with one unknown, and with a fault of its own if it may fail.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fdi.errors import UsageError
from fdi.structure.decomposition import overdetermined
from fdi.structure.incidence import Fault, Model
from fdi.structure.isolability import Mask, detectable, isolability

GOALS = ("detectability", "isolability")

Counts = tuple[int, ...]
"""How many sensors measure each candidate."""

Wish = tuple[str, str]
"""The name of a fault and of the one that it shall be told from, or "" for being detectable."""


def add_sensors(model: Model, unknowns: Iterable[int], faulty: Iterable[int] = ()) -> Model:
    """Return the model with one more equation for each measured unknown.

    Parameters
    ----------
    model : Model
    unknowns : iterable of int
        Indices into ``model.unknowns``; repeats are further sensors.
    faulty : iterable of int
        Unknowns whose new sensors may fail: each brings a fault of its own.

    Returns
    -------
    Model
        Its new equations come last and are called ``sensor of NAME``, numbered from the second;
        so do the faults, ``fault of sensor of NAME``.

    Raises
    ------
    UsageError
        When there is no such unknown.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008.

    Examples
    --------
    >>> add_sensors(Model.from_matrix([[1, 1]]), [1]).equations
    ('e0', 'sensor of x1')
    """
    labels, rows, faults = list(model.equations), list(model.rows), list(model.faults)
    failing = set(faulty)
    for unknown in unknowns:
        _require_unknown(model, unknown)
        base = label = f"sensor of {model.unknowns[unknown]}"
        number = 2
        while label in labels:
            label, number = f"{base} {number}", number + 1
        if unknown in failing:
            faults.append(Fault(f"fault of {label}", (len(rows),)))
        labels.append(label)
        rows.append((unknown,))
    return replace(model, equations=tuple(labels), rows=tuple(rows), faults=tuple(faults))


def place_sensors(
    model: Model,
    candidates: Iterable[int] | None = None,
    *,
    goal: str | Iterable[str | tuple[str, str]] = "isolability",
    costs: Mapping[int, float] | None = None,
    faulty: Iterable[int] = (),
    limit: int = 10_000,
) -> tuple[tuple[int, ...], ...]:
    """Return all minimal sets of added sensors that reach what is wanted.

    Parameters
    ----------
    model : Model
    candidates : iterable of int, optional
        Unknowns that a sensor could measure; by default all.
    goal : {"isolability", "detectability"} or iterable
        "detectability": every fault that all candidates together make detectable. "isolability":
        these and every pair that they make isolable, in mixed causality. Or single wishes: the name
        of a fault that shall be detectable, or (name, other name), the first to be isolable from
        the second.
    costs : mapping of unknown to float, optional
        Finite, not negative; 1 where an unknown is not named.
    faulty : iterable of int
        Candidates whose sensors may fail. Such a sensor brings a fault of its own, which has to be
        detectable and, unless the goal is detectability, isolable from all others and they from it,
        as far as that can be reached at all; for this its unknown may be measured twice.
    limit : int
        Most sets to look at.

    Returns
    -------
    tuple of tuple of int
        Sets of unknowns, none a part of another, each ascending, with a repeat where two sensors
        measure the same; by cost, then size, then index. A single empty set says that nothing
        needs to be added, no set at all that not even all candidates grant every wish.

    Raises
    ------
    UsageError
        When an unknown, the goal, a fault or a cost is wrong, or the sets are more than ``limit``.

    Notes
    -----
    A wish that a set of sensors does not grant is not granted by any part of it either, and what
    is granted stays so with more sensors. So a set that falls short is grown to a largest one that
    does, and every solution has a sensor outside that one: a tree of sets, smallest first, that
    branches over these sensors.

    References
    ----------
    Krysander, Frisk, "Sensor placement for fault diagnosis", IEEE Trans. SMC-A 38(6), 2008; the
    tree is that of Reiter, Artificial Intelligence 32(1), 1987.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 0, "g": 2})
    >>> place_sensors(model, goal="detectability"), place_sensors(model)
    (((),), ((0,), (1,)))
    >>> place_sensors(model, costs={0: 5})
    ((1,), (0,))
    >>> place_sensors(model, goal=[("f", "g")], candidates=[1])
    ((1,),)

    One sensor that may fail cannot be told from what it is compared with; two can.

    >>> place_sensors(Model.from_matrix([[1]], faults={"f": 0}), faulty=[0])
    ((0, 0),)
    """
    chosen = sorted(set(range(len(model.unknowns)) if candidates is None else candidates))
    failing = set(faulty)
    for unknown in (*chosen, *failing):
        _require_unknown(model, unknown)
    if stray := failing.difference(chosen):
        raise UsageError(f"{model.unknowns[min(stray)]} may fail but is no candidate")
    price = {unknown: (costs or {}).get(unknown, 1.0) for unknown in chosen}
    for unknown, cost in price.items():
        if not (math.isfinite(cost) and cost >= 0):
            raise UsageError(f"{model.unknowns[unknown]}: cost is {cost}, must be finite, not < 0")
    search = _Search.for_goal(model, chosen, failing, goal, limit)
    sets = (
        tuple(u for u, n in zip(chosen, counts, strict=True) for _ in range(n))
        for counts in search.minimal()
    )
    return tuple(sorted(sets, key=lambda s: (math.fsum(price[u] for u in s), len(s), s)))


@dataclass(frozen=True, slots=True, eq=False)
class _Reach:
    """Is what some sensors grant: detectable faults, and pairs of which the first is told apart."""

    names: dict[str, int]
    seen: Mask
    told: Mask

    @classmethod
    def of(cls, model: Model) -> _Reach:
        names = {fault.name: i for i, fault in enumerate(model.faults)}
        return cls(names, detectable(model), isolability(model))


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    model: Model
    chosen: list[int]
    most: Counts  # how often each candidate may be measured
    failing: set[int]
    wanted: _Reach
    limit: int

    @classmethod
    def for_goal(
        cls,
        model: Model,
        chosen: list[int],
        failing: set[int],
        goal: str | Iterable[str | tuple[str, str]],
        limit: int,
    ) -> _Search:
        most = tuple(2 if unknown in failing else 1 for unknown in chosen)
        search = cls(model, chosen, most, failing, _Reach.of(model), limit)
        best = _Reach.of(search.extended(most))
        n = len(model.faults)
        if goal == "detectability":
            best = replace(best, told=np.zeros_like(best.told))
        elif goal != "isolability":
            if isinstance(goal, str):
                raise UsageError(f"goal {goal!r} is none of {', '.join(GOALS)}")
            best.seen[:n], best.told[:n, :n] = False, False
            for wish in goal:
                name, other = (wish, "") if isinstance(wish, str) else wish
                for known in filter(None, (name, other)):
                    if known not in best.names or best.names[known] >= n:
                        raise UsageError(f"the model has no fault {known!r}")
                if other:
                    best.told[best.names[name], best.names[other]] = True
                else:
                    best.seen[best.names[name]] = True
        return replace(search, wanted=best)

    def extended(self, counts: Counts) -> Model:
        """Return the model with sensors."""
        sensors = [u for u, n in zip(self.chosen, counts, strict=True) for _ in range(n)]
        return add_sensors(self.model, sensors, self.failing)

    def minimal(self) -> Iterator[Counts]:
        """Yield the minimal sets that grant every wish about the faults that they bring along."""
        if self.refused(self.most):
            return  # of single wishes, not even all candidates grant this one
        start = (0,) * len(self.chosen)
        todo, seen = [(0, start)], {start}
        found: list[Counts] = []
        short: list[
            tuple[Wish, Counts]
        ] = []  # sets that do not grant a wish, grown as far as can be
        while todo:
            _, counts = heapq.heappop(todo)
            if any(_is_part(other, counts) for other in found):
                continue
            largest = self.falling_short(counts, short)
            if largest is None:
                found.append(counts)
                yield counts
                continue
            for k, n in enumerate(largest):
                if n < self.most[k]:
                    larger = (*counts[:k], n + 1, *counts[k + 1 :])
                    if larger not in seen:
                        seen.add(larger)
                        heapq.heappush(todo, (sum(larger), larger))
            if len(seen) > self.limit:
                raise UsageError(
                    f"more than {self.limit} sets of sensors are in question",
                    hint="name fewer candidates or raise the limit",
                )

    def falling_short(self, counts: Counts, short: list[tuple[Wish, Counts]]) -> Counts | None:
        """Return a largest set around this one that does not grant a wish of this one."""
        names = {fault.name for fault in self.extended(counts).faults}
        for wish, largest in short:
            if names.issuperset(filter(None, wish)) and _is_part(counts, largest):
                return largest
        refused = self.refused(counts)
        if refused is None:
            return None
        for k, most in enumerate(self.most):
            while counts[k] < most:
                larger = (*counts[:k], counts[k] + 1, *counts[k + 1 :])
                if self.grants(larger, refused):
                    break
                counts = larger
        short.append((refused, counts))
        return counts

    def refused(self, counts: Counts) -> Wish | None:
        """Return a wish about the faults there are that is not granted."""
        found = _Reach.of(self.extended(counts))
        place = [self.wanted.names[name] for name in found.names]
        names = list(found.names)
        seen = self.wanted.seen[place] & ~found.seen
        told = self.wanted.told[np.ix_(place, place)] & ~found.told
        if seen.any():
            return names[int(seen.argmax())], ""
        if told.any():
            i, j = np.argwhere(told)[0].tolist()
            return names[i], names[j]
        return None

    def grants(self, counts: Counts, wish: Wish) -> bool:
        model = self.extended(counts)
        where = {fault.name: fault.equations for fault in model.faults}
        gone = where.get(wish[1], ())
        kept = [e for e in range(len(model.rows)) if e not in gone]
        over = overdetermined([model.rows[e] for e in kept])
        return not set(where[wish[0]]).isdisjoint(kept[i] for i in over)


def _is_part(some: Counts, others: Counts) -> bool:
    return all(a <= b for a, b in zip(some, others, strict=True))


def _require_unknown(model: Model, unknown: int) -> None:
    if not 0 <= unknown < len(model.unknowns):
        raise UsageError(f"unknown {unknown} of {len(model.unknowns)} unknowns does not exist")
