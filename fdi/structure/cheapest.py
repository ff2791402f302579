"""Finds the cheapest additions to a model with which faults can be detected or told apart.

In: as for ``additions.py``, and what each addition costs. Out: the cheapest choice, and a bound
that no choice can be cheaper than; when time is up, the choices found so far and the bound reached.

Method: what grants every wish is a set that hits certain others, which are found on the way
(implicit hitting sets). A choice that falls short is grown to a largest one that does not grant the
same wish either; every solution takes something beyond it. An integer program finds the cheapest
choice that does so for all that are known; it is a lower bound, and the solution when nothing is
refused any more. Every round also completes its choice to a minimal solution: an upper bound.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np

from fdi.structure.additions import Counts, Reach, largest_without, refused_wish
from fdi.structure.incidence import Model

TOLERANCE = 1e-6
"""Of the dearest addition: what two costs may differ by and count as equal."""


@dataclass(frozen=True, slots=True)
class Cheapest:
    """Is the cheapest choice of additions, as far as it was found.

    Parameters
    ----------
    choices : tuple of tuple of int
        Minimal choices, how often each addition is taken, the cheapest first. None if not even all
        additions together grant every wish.
    costs : tuple of float
        What each of them costs.
    bound : float
        No choice that grants every wish is cheaper; infinite if there is none.
    proven : bool
        Whether the first choice is a cheapest one, or none exists; otherwise time was up.

    References
    ----------
    As :func:`cheapest_additions`.

    Examples
    --------
    >>> Cheapest(((1, 0),), (1.0,), 1.0, True).choices
    ((1, 0),)
    """

    choices: tuple[Counts, ...]
    costs: tuple[float, ...]
    bound: float
    proven: bool


class _Cut(NamedTuple):
    """Is a demand: something beyond a choice, if all of some additions are taken."""

    largest: Counts
    if_taken: tuple[tuple[int, int], ...]  # (addition, count from which on it brings the fault)


class _Search(NamedTuple):
    extended: Callable[[Counts], Model]
    most: Counts
    prices: Sequence[float]
    wanted: Reach
    brings: dict[str, tuple[int, int]]
    """Which addition, taken how often, brings a fault that the model has not."""
    deadline: float

    def cost(self, counts: Counts) -> float:
        return sum(n * price for n, price in zip(counts, self.prices, strict=True))

    def is_late(self) -> bool:
        return perf_counter() > self.deadline


def cheapest_additions(
    extended: Callable[[Counts], Model],
    most: Counts,
    prices: Sequence[float],
    wanted: Reach,
    *,
    seconds: float = 10.0,
) -> Cheapest:
    """Return the cheapest choice that grants every wish about the faults that there then are.

    Parameters
    ----------
    extended : function of counts to Model
        The model with these additions; faults keep their names. A fault that additions bring comes
        with one of them.
    most : tuple of int
        How often each addition may be taken.
    prices : sequence of float
        What each costs, finite and not negative.
    wanted : Reach
        Wishes; those about faults that additions bring hold once these are taken.
    seconds : float
        When no further round is begun.

    Returns
    -------
    Cheapest

    Notes
    -----
    The same every time where it is proven; where time was up it depends on the machine.

    References
    ----------
    Moreno-Centeno and Karp, "The implicit hitting set approach", Operations Research 61(2), 2013;
    Reiter, Artificial Intelligence 32(1), 1987; Rosich, Sarrate, Nejjari, "Optimal sensor placement
    for FDI using binary integer linear programming", DX-09, 2009 (placement as such a program).

    Examples
    --------
    >>> from fdi.structure.additions import reach
    >>> model = Model.from_matrix([[1]], faults={"f": 0})
    >>> double = Model.from_matrix([[1], [1]], faults={"f": 0})
    >>> cheapest_additions(lambda counts: double if any(counts) else model, (1, 1), (3.0, 2.0),
    ...                    reach(double))
    Cheapest(choices=((0, 1),), costs=(2.0,), bound=2.0, proven=True)
    """
    if refused_wish(extended(most), wanted):
        return Cheapest((), (), float("inf"), True)
    deadline = perf_counter() + seconds
    search = _Search(extended, most, prices, wanted, _brings(extended, most), deadline)
    tolerance = TOLERANCE * max(prices, default=0.0)
    cuts: list[_Cut] = []
    found: dict[Counts, float] = {}
    counts, bound, least = (0,) * len(most), 0.0, float("inf")
    while True:
        new, complete = _completed(search, counts)
        cuts += new
        if complete is not None:
            minimal = _reduced(search, complete)
            found.setdefault(minimal, search.cost(minimal))
            least = min(found.values())
        if least <= bound + tolerance or not new or search.is_late():
            break
        counts, better = _cheapest_beyond(search, cuts, counts)
        bound = max(bound, min(better, least))
        if least <= bound + tolerance or search.is_late():
            break
    if not found:
        minimal = _reduced(search, most)
        found[minimal] = search.cost(minimal)
    order = sorted(found, key=lambda c: (found[c], sum(c), [-n for n in c]))
    proven = least <= bound + tolerance
    costs = tuple(found[choice] for choice in order)
    return Cheapest(tuple(order), costs, least if proven else bound, proven)


def _brings(extended: Callable[[Counts], Model], most: Counts) -> dict[str, tuple[int, int]]:
    """Return with which addition, taken how often, each fault comes that the model has not."""
    none = (0,) * len(most)
    own = {fault.name for fault in extended(none).faults}
    brings: dict[str, tuple[int, int]] = {}
    for k, limit in enumerate(most):
        for n in range(1, limit + 1):
            for fault in extended((*none[:k], n, *none[k + 1 :])).faults:
                if fault.name not in own:
                    brings.setdefault(fault.name, (k, n))
    return brings


def _completed(search: _Search, counts: Counts) -> tuple[list[_Cut], Counts | None]:
    """Return the demands that a choice does not meet, and it with the cheapest that meets each.

    The second is None when time is up.
    """
    new: list[_Cut] = []
    while (wish := refused_wish(search.extended(counts), search.wanted)) is not None:
        largest = largest_without(search.extended, counts, search.most, wish)
        taken = tuple(search.brings[name] for name in wish if name in search.brings)
        new.append(_Cut(largest, taken))
        if search.is_late():
            return new, None
        beyond = (k for k, n in enumerate(largest) if n < search.most[k])
        best = min(beyond, key=lambda k: (search.prices[k], k))
        counts = (*counts[:best], largest[best] + 1, *counts[best + 1 :])
    return new, counts


def _reduced(search: _Search, counts: Counts) -> Counts:
    """Return a minimal choice within one that grants every wish: the dearest are left out first.

    Many are left out at once and only those that cannot go are found by halving.
    """
    taken = [k for k, n in enumerate(counts) for _ in range(n)]
    taken.sort(key=lambda k: (-search.prices[k], -k))
    ranges = [(0, len(taken))]
    while ranges:
        first, last = ranges.pop()
        smaller = list(counts)
        for k in taken[first:last]:
            smaller[k] -= 1
        if refused_wish(search.extended(tuple(smaller)), search.wanted) is None:
            counts = tuple(smaller)
        elif last - first > 1:
            middle = (first + last) // 2
            ranges += [(middle, last), (first, middle)]
    return counts


def _cheapest_beyond(
    search: _Search, cuts: Sequence[_Cut], otherwise: Counts
) -> tuple[Counts, float]:
    """Return the cheapest choice that meets all demands, and what no such choice is cheaper than.

    One binary variable says whether an addition is taken at least n times.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csr_array

    place = {(k, n): i for i, (k, n) in enumerate(_levels(search.most))}
    entries: list[tuple[int, int, float]] = []
    least: list[float] = []
    for cut in cuts:
        row = len(least)
        entries += [
            (row, place[k, n + 1], 1.0) for k, n in enumerate(cut.largest) if n < search.most[k]
        ]
        entries += [(row, place[level], -1.0) for level in cut.if_taken]
        least.append(1.0 - len(cut.if_taken))
    for k, n in place:  # to be taken twice is to be taken
        if n > 1:
            entries += [(len(least), place[k, n - 1], 1.0), (len(least), place[k, n], -1.0)]
            least.append(0.0)
    rows, columns, values = zip(*entries, strict=True)
    matrix = csr_array((values, (rows, columns)), shape=(len(least), len(place)))
    scale = max(search.prices) or 1.0
    result = milp(
        np.array([search.prices[k] / scale for k, _ in place]),
        integrality=np.ones(len(place)),
        bounds=Bounds(0, 1),
        constraints=LinearConstraint(matrix, lb=np.array(least)),
        options={"time_limit": max(search.deadline - perf_counter(), 0.05), "mip_rel_gap": 0.0},
    )
    bound = result.mip_dual_bound
    known = 0.0 if bound is None or not np.isfinite(bound) else float(bound) * scale
    if result.x is None:
        return otherwise, known
    counts = [0] * len(search.most)
    for (k, _), value in zip(place, result.x, strict=True):
        counts[k] += value > 0.5
    return tuple(counts), known


def _levels(most: Counts) -> Iterator[tuple[int, int]]:
    for k, limit in enumerate(most):
        for n in range(1, limit + 1):
            yield k, n
