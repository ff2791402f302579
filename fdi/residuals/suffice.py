"""Which tests, or which sensors, are enough to tell faults of given sizes from each other?

In: a window of a flight with all residuals, wishes (a fault of a size, and the fault that it is to
be told from), and what tests or sensors cost. Out: the cheapest set that grants every wish at a
false-alarm rate, by the noise and not by structure alone. A sensor set has the residuals that read
nothing but its channels, so candidates are the channels of the log.

More tests or sensors never bring faults nearer to each other, so the search is that of hitting sets
(``fdi.structure.additions``): a set that falls short is grown to a largest one that does, and every
answer holds something beyond it. Sets are looked at cheapest first: the first answer is the
cheapest.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.errors import UsageError
from fdi.residuals.bank import Bank
from fdi.residuals.distinguish import distinguishability, smallest_size
from fdi.residuals.window import Window

MOST_SETS: Final = 2_000
"""Sets that are looked at: each costs the factors of a matrix, some ms."""


@dataclass(frozen=True, slots=True)
class Wish:
    """A fault of a size, in its own unit, and the one to tell it from; None: to detect it."""

    fault: str
    size: float
    other: str | None = None


def both_ways(fault: str, size: float, other: str, other_size: float) -> tuple[Wish, Wish]:
    """Return that each of two faults is to be told from the other."""
    return Wish(fault, size, other), Wish(other, other_size, fault)


def cheapest_tests(
    window: Window,
    bank: Bank,
    wishes: Sequence[Wish],
    alpha: float,
    *,
    power: float = 0.9,
    costs: Mapping[str, float] | None = None,
) -> tuple[str, ...] | None:
    """Return the cheapest residual generators that grant every wish.

    Parameters
    ----------
    window : Window
        Of residuals of that bank.
    bank : Bank
    wishes : sequence of Wish
    alpha, power : float
        As of :func:`fdi.residuals.distinguish.smallest_size`.
    costs : mapping of str to float, optional
        Of generators by their ids; by default the number of their equations.

    Returns
    -------
    tuple of str or None
        Ids; None where not even all generators are enough.

    Raises
    ------
    UsageError
        A fault is unknown, or more sets than :data:`MOST_SETS` are in question.
    """
    price = {g.id: float(len(g.equations)) for g in bank.generators} | dict(costs or {})
    of = {g.id: row for row, g in enumerate(bank.generators)}
    concerned = np.unique(window.residual[_moved(window, wishes)])
    names = [g.id for row, g in enumerate(bank.generators) if row in concerned]
    enough = _enough(window, wishes, alpha, power)
    return _cheapest(names, price, lambda own: enough([of[name] for name in own]))


def cheapest_sensors(
    window: Window,
    bank: Bank,
    wishes: Sequence[Wish],
    alpha: float,
    *,
    power: float = 0.9,
    costs: Mapping[str, float] | None = None,
) -> tuple[str, ...] | None:
    """Return the cheapest messages of the log whose residuals grant every wish.

    Parameters are those of :func:`cheapest_tests`; a sensor is a message (``GPS_RAW_INT``), and
    costs 1 where nothing else is said. Only residuals that the faults move count.
    """
    read = {
        row: frozenset(channel.source for channel in bank.channels(own))
        for row, own in enumerate(bank.generators)
    }
    concerned = {int(row) for row in window.residual[_moved(window, wishes)]}
    read = {row: needs for row, needs in read.items() if row in concerned}
    names = sorted(set().union(*read.values()))
    price = dict.fromkeys(names, 1.0) | dict(costs or {})
    enough = _enough(window, wishes, alpha, power)
    return _cheapest(
        names, price, lambda own: enough([row for row, needs in read.items() if needs <= own])
    )


def _moved(window: Window, wishes: Sequence[Wish]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return the rows that a fault of a wish moves."""
    names = [name for wish in wishes for name in (wish.fault, wish.other) if name]
    if strangers := [name for name in names if name not in window.names]:
        raise UsageError(f"{strangers[0]!r} is no fault of this window")
    places = [window.names.index(name) for name in names]
    return np.asarray(np.any([window.free[i].any(axis=1) for i in places], axis=0))


def _enough(
    window: Window, wishes: Sequence[Wish], alpha: float, power: float
) -> Callable[[Sequence[int]], bool]:
    _moved(window, wishes)  # refuses unknown faults

    def enough(bank: Sequence[int]) -> bool:
        found = distinguishability(window, bank)
        for wish in wishes:
            i = found.names.index(wish.fault)
            distance = found.detected[i]
            if wish.other is not None:
                distance = found.told[i, found.names.index(wish.other)]
            if not smallest_size(distance, alpha, power) <= wish.size:
                return False
        return True

    return enough


def _cheapest(
    names: Sequence[str], price: Mapping[str, float], enough: Callable[[frozenset[str]], bool]
) -> tuple[str, ...] | None:
    """Return the cheapest set that is enough, where more never harms."""
    if not enough(frozenset(names)):
        return None
    dearest_first = sorted(names, key=lambda name: (-price[name], name))
    short: list[frozenset[str]] = []
    todo: list[tuple[float, tuple[str, ...]]] = [(0.0, ())]
    seen: set[tuple[str, ...]] = {()}
    while todo:
        _, own = heapq.heappop(todo)
        chosen = frozenset(own)
        largest = next((known for known in short if chosen <= known), None)
        if largest is None:
            if enough(chosen):
                return own
            largest = chosen
            for name in dearest_first:
                if name not in largest and not enough(largest | {name}):
                    largest |= {name}
            short.append(largest)
        for name in names:
            larger = tuple(sorted((*own, name)))
            if name not in largest and larger not in seen:
                seen.add(larger)
                heapq.heappush(todo, (sum(price[one] for one in larger), larger))
        if len(seen) > MOST_SETS:
            raise UsageError(
                f"more than {MOST_SETS} sets are in question", hint="wish for less, or fewer faults"
            )
    return None
