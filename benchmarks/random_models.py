"""Random structural models of any size, as the reference models were made.

A matching is planted, entries are added at random, then more where they are needed so that every
equation is overdetermined and all of them form one graph component. ``band`` keeps the entries of
an equation near its place, as in a model of subsystems in a row. Part of the entries may be marked
as not solvable.
"""

from __future__ import annotations

from bisect import bisect, insort
from itertools import pairwise
from random import Random

from fdi.structure import Fault, Model
from fdi.structure.decomposition import connected, reached
from fdi.structure.matching import match


def random_model(
    equations: int,
    redundancy: int,
    faults: int,
    *,
    seed: int = 1,
    extra: float = 1.7,
    band: int | None = None,
    nonsolvable: float = 0.0,
) -> Model:
    """Return a random model: all of it overdetermined, and one graph component.

    Parameters
    ----------
    equations, redundancy, faults : int
        Their numbers; a fault enters one equation of its own.
    seed : int
        The same one gives the same model.
    extra : float
        Mean number of entries of an equation beside the planted one.
    band : int, optional
        How far from its place an equation may hold unknowns; by default anywhere.
    nonsolvable : float
        Share of the entries along which their equation cannot be solved.
    """
    random = Random(seed)
    n = equations - redundancy
    order = list(range(equations))
    random.shuffle(order)
    place = [0.0] * equations  # where along the unknowns an equation sits
    rows: list[set[int]] = [set() for _ in range(equations)]
    for unknown, equation in enumerate(order[:n]):
        rows[equation].add(unknown)
        place[equation] = unknown
    for equation in order[n:]:
        place[equation] = random.randrange(n)
        rows[equation].add(int(place[equation]))

    def near(equation: int) -> int:
        if band is None:
            return random.randrange(n)
        return min(n - 1, max(0, int(place[equation]) + random.randint(-band, band)))

    for equation in range(equations):
        for _ in range(int(random.expovariate(1 / (extra + 0.5)))):
            rows[equation].add(near(equation))
    _overdetermine(rows, n, place, random)
    _connect(rows, place)
    entries = [(e, u) for e, row in enumerate(rows) for u in sorted(row)]
    fixed = [entry for entry in entries if random.random() < nonsolvable]
    where = sorted(random.sample(range(equations), faults))
    return Model(
        tuple(f"e{i}" for i in range(equations)),
        tuple(f"x{i}" for i in range(n)),
        tuple(tuple(row) for row in rows),
        tuple(Fault(f"f{i}", (equation,)) for i, equation in enumerate(where)),
        nonsolvable=tuple(fixed),
        name=f"random_{'b' if band else 'u'}_{equations}_{redundancy}_{seed}",
    )


def _overdetermine(rows: list[set[int]], n: int, place: list[float], random: Random) -> None:
    """Add entries until alternating paths from unmatched equations reach every equation."""
    equation_of, unknown_of = match([sorted(row) for row in rows], n)
    inside = reached([sorted(row) for row in rows], equation_of, unknown_of)
    done = set(inside)
    missing = [e for e in range(len(rows)) if e not in done]
    random.shuffle(missing)
    by_place = sorted((place[e], e) for e in done)
    for equation in missing:
        if equation in done:
            continue
        k = bisect(by_place, (place[equation], equation))
        near = by_place[max(0, k - 1) : k + 1]
        nearest = min(near, key=lambda item: (abs(item[0] - place[equation]), item[1]))[1]
        rows[nearest].add(unknown_of[equation])
        done.add(equation)
        queue = [equation]
        for e in queue:  # grows while it is walked
            insort(by_place, (place[e], e))
            for unknown in rows[e]:
                other = equation_of[unknown]
                if other not in done:
                    done.add(other)
                    queue.append(other)


def _connect(rows: list[set[int]], place: list[float]) -> None:
    """Add one entry from each graph component to the one before it."""
    groups = connected([sorted(row) for row in rows])
    for before, after in pairwise(groups):
        e = min(after, key=lambda i: place[i])
        nearest = min(before, key=lambda i: (abs(place[i] - place[e]), i))
        rows[e].add(min(rows[nearest]))
