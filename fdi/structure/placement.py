"""Finds the smallest sets of added sensors with which faults can be detected or told apart.

In: a model, the unknowns that a sensor could measure, what is wanted and, optionally, what each
sensor costs. Out: every minimal set of sensors that reaches what all candidates together reach. A
new sensor is an equation of its own with one unknown and no fault.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np

from fdi.errors import UsageError
from fdi.structure.incidence import Model, bitset, members
from fdi.structure.isolability import Mask, detectable, isolability

GOALS = ("detectability", "isolability")


def add_sensors(model: Model, unknowns: Iterable[int]) -> Model:
    """Return the model with one more equation, free of faults, for each measured unknown.

    Parameters
    ----------
    model : Model
    unknowns : iterable of int
        Indices into ``model.unknowns``; repeats are further sensors.

    Returns
    -------
    Model
        Its new equations come last and are called ``sensor of NAME``, numbered from the second.

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
    labels, rows = list(model.equations), list(model.rows)
    for unknown in unknowns:
        _require_unknown(model, unknown)
        base = label = f"sensor of {model.unknowns[unknown]}"
        number = 2
        while label in labels:
            label, number = f"{base} {number}", number + 1
        labels.append(label)
        rows.append((unknown,))
    return replace(model, equations=tuple(labels), rows=tuple(rows))


def place_sensors(
    model: Model,
    candidates: Iterable[int] | None = None,
    *,
    goal: str = "isolability",
    costs: Mapping[int, float] | None = None,
    limit: int = 10_000,
) -> tuple[tuple[int, ...], ...]:
    """Return all minimal sets of added sensors that reach what all candidates together reach.

    Parameters
    ----------
    model : Model
    candidates : iterable of int, optional
        Unknowns that a sensor could measure; by default all.
    goal : {"isolability", "detectability"}
        "detectability": every fault that all candidates make detectable. "isolability": these and
        every pair that all candidates make isolable, in mixed causality.
    costs : mapping of unknown to float, optional
        Finite, not negative; 1 where an unknown is not named.
    limit : int
        Most sets to keep while searching.

    Returns
    -------
    tuple of tuple of int
        Sets of unknowns, none a part of another, each ascending; by cost, then size, then index. A
        single empty set says that nothing needs to be added.

    Raises
    ------
    UsageError
        When an unknown, the goal or a cost is wrong, or the sets are more than ``limit``.

    Notes
    -----
    What is reached only grows with the sensors. So the sets sought are the minimal ones that hit
    the complement of every largest set that falls short; those complements are found one by one,
    whenever a set that hits all known ones still falls short.

    References
    ----------
    Krysander, Frisk, "Sensor placement for fault diagnosis", IEEE Trans. SMC-A 38(6), 2008; the
    search by hitting sets is that of Reiter, Artificial Intelligence 32(1), 1987.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1]], faults={"f": 0, "g": 2})
    >>> place_sensors(model, goal="detectability"), place_sensors(model)
    (((),), ((0,), (1,)))
    >>> place_sensors(model, costs={0: 5})
    ((1,), (0,))
    """
    chosen = sorted(set(range(len(model.unknowns)) if candidates is None else candidates))
    for unknown in chosen:
        _require_unknown(model, unknown)
    if goal not in GOALS:
        raise UsageError(f"goal {goal!r} is none of {', '.join(GOALS)}")
    price = {unknown: (costs or {}).get(unknown, 1.0) for unknown in chosen}
    for unknown, cost in price.items():
        if not (math.isfinite(cost) and cost >= 0):
            raise UsageError(f"{model.unknowns[unknown]}: cost is {cost}, must be finite, not < 0")
    wanted = _reached(model, chosen, goal)

    def suffices(places: int) -> bool:
        sensors = [chosen[k] for k in members(places)]
        return bool((_reached(model, sensors, goal) >= wanted).all())

    sets = [
        tuple(chosen[k] for k in members(places))
        for places in _minimal_sets(len(chosen), suffices, limit)
    ]
    return tuple(sorted(sets, key=lambda s: (math.fsum(price[u] for u in s), len(s), s)))


def _reached(model: Model, sensors: list[int], goal: str) -> Mask:
    extended = add_sensors(model, sensors)
    seen = detectable(extended)
    if goal == "detectability":
        return seen
    return np.concatenate([seen, isolability(extended).ravel()])


def _minimal_sets(n: int, suffices: Callable[[int], bool], limit: int) -> list[int]:
    """Return the minimal sets over n elements for which a monotone property holds, as bit sets."""
    everything = bitset(range(n))
    hitting, verified = [0], set[int]()
    while True:
        falling_short = None
        for places in hitting:
            if places not in verified:
                if not suffices(places):
                    falling_short = places
                    break
                verified.add(places)
        if falling_short is None:
            return hitting
        for k in range(n):  # grow it to a largest set that falls short
            if not falling_short >> k & 1 and not suffices(falling_short | 1 << k):
                falling_short |= 1 << k
        hitting = _also_hit(hitting, everything & ~falling_short)
        if len(hitting) > limit:
            raise UsageError(
                f"more than {limit} sets of sensors are in question",
                hint="name fewer candidates or raise the limit",
            )


def _also_hit(hitting: list[int], complement: int) -> list[int]:
    """Return the minimal sets that hit what the given minimal sets hit, and the complement."""
    kept = [places for places in hitting if places & complement]
    added = [
        places | 1 << k
        for places in hitting
        if not places & complement
        for k in members(complement)
    ]
    # Those that hit already stay minimal; an extended one can only contain one of them.
    return kept + [new for new in dict.fromkeys(added) if not any(old & new == old for old in kept)]


def _require_unknown(model: Model, unknown: int) -> None:
    if not 0 <= unknown < len(model.unknowns):
        raise UsageError(f"unknown {unknown} of {len(model.unknowns)} unknowns does not exist")
