"""Finds as many disjoint pairs (equation, unknown) as there can be.

In: for each equation its unknowns. Out: two arrays that map into each other. By the method of
Hopcroft and Karp after a greedy start, without recursion. Which edges *may* be matched (solvable,
integral, derivative) is not asked here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fdi.structure.incidence import Rows


@dataclass(frozen=True, slots=True, eq=False)
class Matching:
    """Is a matching of equations with unknowns, as two read-only arrays.

    Parameters
    ----------
    equation_of_unknown : (n,) int array
        The equation matched to each unknown, -1 where there is none.
    unknown_of_equation : (m,) int array
        The unknown matched to each equation, -1 where there is none.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> maximum_matching(((0,), (0, 1), (1,)), 2)
    <Matching of 2: 3 equations, 2 unknowns>
    """

    equation_of_unknown: NDArray[np.intp]
    unknown_of_equation: NDArray[np.intp]

    def __post_init__(self) -> None:
        self.equation_of_unknown.flags.writeable = False
        self.unknown_of_equation.flags.writeable = False

    def __len__(self) -> int:
        return int(np.count_nonzero(self.equation_of_unknown >= 0))

    def __repr__(self) -> str:
        return (
            f"<Matching of {len(self)}: {len(self.unknown_of_equation)} equations, "
            f"{len(self.equation_of_unknown)} unknowns>"
        )


def maximum_matching(rows: Rows, n_unknowns: int) -> Matching:
    """Return a matching with the largest possible number of pairs.

    Parameters
    ----------
    rows : sequence of sequences of int
        For each of the m equations the indices of its unknowns.
    n_unknowns : int
        Number of unknowns, n.

    Returns
    -------
    Matching
        The same one every time for the same rows.

    Notes
    -----
    Cost O(edges * sqrt(m + n)).

    References
    ----------
    Hopcroft and Karp, SIAM J. Computing 2(4), 1973.

    Examples
    --------
    >>> matching = maximum_matching(((0, 1), (0,)), 2)
    >>> matching.unknown_of_equation.tolist()
    [1, 0]
    """
    equation_of, unknown_of = match(rows, n_unknowns)
    return Matching(np.array(equation_of, dtype=np.intp), np.array(unknown_of, dtype=np.intp))


def match(rows: Rows, n_unknowns: int) -> tuple[list[int], list[int]]:
    """Return a maximum matching as two lists, which pure Python indexes faster than arrays.

    Parameters
    ----------
    rows, n_unknowns
        As for :func:`maximum_matching`.

    Returns
    -------
    equation_of_unknown, unknown_of_equation : list of int
        -1 where unmatched.

    References
    ----------
    Hopcroft and Karp, SIAM J. Computing 2(4), 1973.

    Examples
    --------
    >>> match(((0,), (0,)), 1)
    ([0], [0, -1])
    """
    equation_of = [-1] * n_unknowns
    unknown_of = [-1] * len(rows)
    for equation, row in enumerate(rows):
        for unknown in row:
            if equation_of[unknown] < 0:
                equation_of[unknown] = equation
                unknown_of[equation] = unknown
                break
    roots = [e for e, unknown in enumerate(unknown_of) if unknown < 0 and rows[e]]
    while roots:
        distance = _layers(rows, roots, equation_of)
        if not distance:
            break
        roots = [r for r in roots if not _augment(rows, r, distance, equation_of, unknown_of)]
    return equation_of, unknown_of


def _layers(rows: Rows, roots: list[int], equation_of: list[int]) -> dict[int, int]:
    """Return the distance of equations from unmatched ones; empty if no free unknown is reached."""
    distance = dict.fromkeys(roots, 0)
    layer, found, depth = roots, False, 0
    while layer and not found:
        depth += 1
        deeper: list[int] = []
        for equation in layer:
            for unknown in rows[equation]:
                other = equation_of[unknown]
                if other < 0:
                    found = True
                elif other not in distance:
                    distance[other] = depth
                    deeper.append(other)
        layer = deeper
    return distance if found else {}


def _augment(
    rows: Rows,
    root: int,
    distance: dict[int, int],
    equation_of: list[int],
    unknown_of: list[int],
) -> bool:
    """Return whether a path from ``root`` through the layers could be found, and turn it over."""
    path = [root]
    chosen: list[int] = []
    edges = [iter(rows[root])]
    while path:
        equation = path[-1]
        for unknown in edges[-1]:
            other = equation_of[unknown]
            if other < 0:
                chosen.append(unknown)
                for e, u in zip(path, chosen, strict=True):
                    equation_of[u], unknown_of[e] = e, u
                return True
            if distance.get(other) == distance[equation] + 1:
                path.append(other)
                chosen.append(unknown)
                edges.append(iter(rows[other]))
                break
        else:
            del distance[equation]  # a dead end stays one for the rest of the phase
            path.pop()
            edges.pop()
            if chosen:
                chosen.pop()
    return False
