"""Finds the smallest sets of added sensors with which faults can be detected or told apart.

In: a model, the unknowns that a sensor could measure, what is wanted and, optionally, what each
sensor costs and which of them may fail. Out: every minimal set of sensors that grants it, or, where
these are too many, the cheapest with a proof that it is. A new sensor is an equation of its own
with one unknown, and with a fault of its own if it may fail.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import NamedTuple

import numpy as np

from fdi.errors import UsageError
from fdi.structure.additions import Counts, Reach, Wish, gained, minimal_additions, reach
from fdi.structure.cheapest import cheapest_additions
from fdi.structure.incidence import Fault, Model, place_of, places_of

GOALS = ("detectability", "isolability")
U = "unknown"
Wanted = int | str | tuple[int | str, int | str]
"""A fault, or two of which the first is to be told from the second, by index or name."""


def add_sensors(
    model: Model, unknowns: Iterable[int | str], faulty: Iterable[int | str] = ()
) -> Model:
    """Return the model with one more equation for each measured unknown.

    Parameters
    ----------
    model : Model
    unknowns : iterable of int or str
        Names or indices of ``model.unknowns``; repeats are further sensors.
    faulty : iterable of int or str
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
    taken = set(labels)
    failing = set(places_of(faulty, model.unknowns, U))
    for unknown in places_of(unknowns, model.unknowns, U):
        base = label = f"sensor of {model.unknowns[unknown]}"
        number = 2
        while label in taken:
            label, number = f"{base} {number}", number + 1
        if unknown in failing:
            faults.append(Fault(f"fault of {label}", (len(rows),)))
        labels.append(label)
        taken.add(label)
        rows.append((unknown,))
    return replace(model, equations=tuple(labels), rows=tuple(rows), faults=tuple(faults))


def place_sensors(
    model: Model,
    candidates: Iterable[int | str] | None = None,
    *,
    goal: str | Iterable[Wanted] = "isolability",
    costs: Mapping[int | str, float] | None = None,
    faulty: Iterable[int | str] = (),
    limit: int = 10_000,
) -> tuple[tuple[int, ...], ...]:
    """Return all minimal sets of added sensors that reach what is wanted.

    Parameters
    ----------
    model : Model
    candidates : iterable of int or str, optional
        Unknowns that a sensor could measure, by index or name; by default all.
    goal : {"isolability", "detectability"} or iterable
        "detectability": every fault that all candidates together make detectable. "isolability":
        these and every pair that they make isolable, in mixed causality. Or single wishes: a fault
        that shall be detectable, or (fault, other), the first to be isolable from the second, by
        index or name.
    costs : mapping of unknown to float, optional
        Finite, not negative; 1 where an unknown is not named.
    faulty : iterable of int or str
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
    The search is :func:`fdi.structure.additions.minimal_additions`.

    References
    ----------
    Krysander, Frisk, "Sensor placement for fault diagnosis", IEEE Trans. SMC-A 38(6), 2008.

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
    problem = _problem(model, candidates, goal, costs, faulty)
    try:
        found = list(minimal_additions(problem.extended, problem.most, problem.wanted, limit))
    except UsageError as error:
        hint = "cheapest_sensors finds one of them; or name fewer candidates, or raise the limit"
        raise UsageError(error.message, hint=hint) from error
    sets = (_sensors(problem.chosen, counts) for counts in found)
    price = dict(zip(problem.chosen, problem.prices, strict=True))
    return tuple(sorted(sets, key=lambda s: (math.fsum(price[u] for u in s), len(s), s)))


@dataclass(frozen=True, slots=True)
class CheapestSensors:
    """Is the cheapest set of sensors, as far as it was found.

    Parameters
    ----------
    sets : tuple of tuple of int
        Minimal sets of unknowns, each ascending, with a repeat where two sensors measure the same;
        the cheapest first. Others may exist. None if not even all candidates grant every wish.
    costs : tuple of float
        What each of them costs.
    bound : float
        No set that grants every wish is cheaper; infinite if there is none.
    proven : bool
        Whether the first set is a cheapest one, or none exists; otherwise time was up.

    References
    ----------
    As :func:`cheapest_sensors`.

    Examples
    --------
    >>> CheapestSensors(((3,),), (1.0,), 1.0, True)
    <1 sensors, cost 1: the cheapest>
    """

    sets: tuple[tuple[int, ...], ...]
    costs: tuple[float, ...]
    bound: float
    proven: bool

    def __repr__(self) -> str:
        if not self.sets:
            return "<no set of sensors grants every wish>"
        proof = "the cheapest" if self.proven else f"none is cheaper than {self.bound:g}"
        return f"<{len(self.sets[0])} sensors, cost {self.costs[0]:g}: {proof}>"


def cheapest_sensors(
    model: Model,
    candidates: Iterable[int | str] | None = None,
    *,
    goal: str | Iterable[Wanted] = "isolability",
    costs: Mapping[int | str, float] | None = None,
    faulty: Iterable[int | str] = (),
    existing: Iterable[int | str] = (),
    seconds: float = 10.0,
) -> CheapestSensors:
    """Return the cheapest set of added sensors that reaches what is wanted, in any case something.

    Parameters
    ----------
    model, candidates, goal, costs, faulty
        As for :func:`place_sensors`.
    existing : iterable of int or str
        Unknowns that have a sensor already beyond the equations of the model. It costs nothing; if
        the unknown is one of the faulty, it may fail.
    seconds : float
        How long to look for cheaper sets and for the proof. What is proven does not depend on it.

    Returns
    -------
    CheapestSensors

    Raises
    ------
    UsageError
        When an unknown, the goal, a fault or a cost is wrong.

    Notes
    -----
    The method is :func:`fdi.structure.cheapest.cheapest_additions`.

    References
    ----------
    Krysander, Frisk, "Sensor placement for fault diagnosis", IEEE Trans. SMC-A 38(6), 2008; as an
    integer program Rosich, Sarrate, Nejjari, DX-09, 2009.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 0, "g": 2})
    >>> cheapest_sensors(model, costs={0: 5}).sets[0]
    (1,)
    >>> cheapest_sensors(model, existing=[0])
    <0 sensors, cost 0: the cheapest>
    """
    present = list(existing)
    standing = set(places_of(present, model.unknowns, U))
    failing = set(places_of(faulty, model.unknowns, U))
    base = add_sensors(model, present, standing & failing)
    new = set(
        places_of(
            range(len(model.unknowns)) if candidates is None else candidates, model.unknowns, U
        )
    )
    problem = _problem(base, new, goal, costs, failing - (standing - new))
    found = cheapest_additions(
        problem.extended, problem.most, problem.prices, problem.wanted, seconds=seconds
    )
    sets = tuple(_sensors(problem.chosen, counts) for counts in found.choices)
    return CheapestSensors(sets, found.costs, found.bound, found.proven)


class _Problem(NamedTuple):
    """Is a placement in the words of ``additions.py``: an addition is a sensor of one unknown."""

    extended: Callable[[Counts], Model]
    most: Counts
    wanted: Reach
    chosen: list[int]
    prices: list[float]


def _problem(
    model: Model,
    candidates: Iterable[int | str] | None,
    goal: str | Iterable[Wanted],
    costs: Mapping[int | str, float] | None,
    faulty: Iterable[int | str],
) -> _Problem:
    labels = model.unknowns
    everything = range(len(labels))
    chosen = sorted(set(places_of(everything if candidates is None else candidates, labels, U)))
    failing = set(places_of(faulty, labels, U))
    if stray := failing.difference(chosen):
        raise UsageError(f"{model.unknowns[min(stray)]} may fail but is no candidate")
    stated = {place_of(unknown, labels, U): cost for unknown, cost in (costs or {}).items()}
    prices = [stated.get(unknown, 1.0) for unknown in chosen]
    for unknown, cost in zip(chosen, prices, strict=True):
        if not (isinstance(cost, Real) and math.isfinite(cost) and cost >= 0):
            raise UsageError(f"{model.unknowns[unknown]}: cost is {cost}, must be finite, not < 0")
    most = tuple(2 if unknown in failing else 1 for unknown in chosen)

    def extended(counts: Counts) -> Model:
        return add_sensors(model, _sensors(chosen, counts), failing)

    wanted = _wanted(reach(extended(most)), len(model.faults), goal)
    return _Problem(extended, most, wanted, chosen, prices)


def sensor_gains(
    model: Model, candidates: Iterable[int | str] | None = None
) -> dict[int, tuple[tuple[str, ...], tuple[Wish, ...]]]:
    """Return what each single sensor, free of faults, would add.

    Parameters
    ----------
    model : Model
    candidates : iterable of int or str, optional
        Unknowns that a sensor could measure, by index or name; by default all.

    Returns
    -------
    dict of unknown to (detectable, isolable)
        What becomes detectable and which pairs become isolable, see
        :func:`fdi.structure.additions.gained`. Sensors that add nothing are missing.

    Raises
    ------
    UsageError
        When an unknown does not exist.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, section IV.

    Examples
    --------
    >>> sensor_gains(Model.from_matrix([[1, 0], [1, 1]], faults={"f": 0, "g": 1}))
    {0: (('f',), (('f', 'g'),)), 1: (('f', 'g'), ())}
    """
    before = reach(model)
    found = {}
    everything = range(len(model.unknowns))
    for unknown in places_of(everything if candidates is None else candidates, model.unknowns, U):
        gain = gained(before, reach(add_sensors(model, [unknown])))
        if any(gain):
            found[unknown] = gain
    return found


def _sensors(chosen: list[int], counts: Counts) -> tuple[int, ...]:
    return tuple(u for u, n in zip(chosen, counts, strict=True) for _ in range(n))


def _wanted(best: Reach, n_own: int, goal: str | Iterable[Wanted]) -> Reach:
    """Return what a goal asks for, of the best that there is; the model's own faults come first."""
    if goal == "isolability":
        return best
    if goal == "detectability":
        return replace(best, told=np.zeros_like(best.told))
    if isinstance(goal, str):
        raise UsageError(f"goal {goal!r} is none of {', '.join(GOALS)}")
    seen, told = best.seen.copy(), best.told.copy()
    seen[:n_own], told[:n_own, :n_own] = False, False
    if not isinstance(goal, Iterable):
        raise UsageError(f"goal {goal!r} is none of {', '.join(GOALS)}, and no list of faults")
    for wish in goal:
        pair = wish if isinstance(wish, tuple | list) else (wish,)
        places = [place_of(fault, best.names[:n_own], "fault") for fault in pair]
        match places:
            case [own]:
                seen[own] = True
            case [own, other]:
                told[own, other] = True
            case _:
                raise UsageError(f"{wish!r} is neither a fault nor a pair of faults")
    return replace(best, seen=seen, told=told)
