"""Finds as many disjoint pairs (equation, unknown) as there can be.

In: for each equation its unknowns. Out: two arrays that map into each other. By alternating paths
after a greedy start, without recursion; from ``LARGE`` equations on scipy matches. Which edges
*may* be matched (solvable, integral, derivative) is not asked here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fdi.shown import html_table
from fdi.structure.incidence import Rows

LARGE = 5_000
"""Equations from which on scipy matches: its compiled code is 3 to 20 times faster, but importing
it takes as long as matching 10,000 equations here, and the smaller models come in thousands."""


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

    def _repr_html_(self) -> str:
        pairs = [(e, u) for e, u in enumerate(self.unknown_of_equation.tolist()) if u >= 0]
        return html_table(repr(self)[1:-1], ("equation", "unknown"), pairs)


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
    Cost O(edges) for each equation that the greedy start leaves over. The phases of Hopcroft and
    Karp (1973), which bound it by O(edges * sqrt(m + n)), took twice as long on the reference
    models, 1.5 times on 5,000 equations, and win only beyond that; there scipy's are used.

    References
    ----------
    Berge, Proc. National Academy of Sciences 43(9), 1957 (alternating paths); the search from free
    vertices is that of Kuhn, Naval Research Logistics Quarterly 2, 1955.

    Examples
    --------
    >>> matching = maximum_matching(((0, 1), (0,)), 2)
    >>> matching.unknown_of_equation.tolist()
    [1, 0]
    """
    equation_of, unknown_of = match(rows, n_unknowns)
    return Matching(np.array(equation_of, dtype=np.intp), np.array(unknown_of, dtype=np.intp))


def match(
    rows: Rows, n_unknowns: int, start: Sequence[int] | None = None
) -> tuple[list[int], list[int]]:
    """Return a maximum matching as two lists, which pure Python indexes faster than arrays.

    Parameters
    ----------
    rows, n_unknowns
        As for :func:`maximum_matching`.
    start : sequence of int, optional
        A matching to begin with: the unknown of each equation, -1 where it has none.

    Returns
    -------
    equation_of_unknown, unknown_of_equation : list of int
        -1 where unmatched.

    References
    ----------
    As for :func:`maximum_matching`.

    Examples
    --------
    >>> match(((0,), (0,)), 1)
    ([0], [0, -1])
    """
    if start is None and len(rows) >= LARGE:
        return _by_scipy(rows, n_unknowns)
    equation_of = [-1] * n_unknowns
    unknown_of = [-1] * len(rows)
    if start is not None:
        unknown_of = list(start)
        for equation, unknown in enumerate(unknown_of):
            if unknown >= 0:
                equation_of[unknown] = equation
    for equation, row in enumerate(rows):
        if unknown_of[equation] >= 0:
            continue
        for unknown in row:
            if equation_of[unknown] < 0:
                equation_of[unknown] = equation
                unknown_of[equation] = unknown
                break
    complete(rows, equation_of, unknown_of)
    return equation_of, unknown_of


def _by_scipy(rows: Rows, n_unknowns: int) -> tuple[list[int], list[int]]:
    """Match by the algorithm of Hopcroft and Karp, SIAM J. Computing 2(4), 1973."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    starts = np.cumsum([0, *map(len, rows)], dtype=np.int32)
    columns = np.fromiter((u for row in rows for u in row), dtype=np.int32, count=starts[-1])
    shape = len(rows), n_unknowns
    graph = csr_matrix((np.ones(len(columns), dtype=np.int8), columns, starts), shape=shape)
    unknown_of: list[int] = maximum_bipartite_matching(graph, perm_type="column").tolist()
    equation_of = [-1] * n_unknowns
    for equation, unknown in enumerate(unknown_of):
        if unknown >= 0:
            equation_of[unknown] = equation
    return equation_of, unknown_of


def in_order(rows: Rows, n_unknowns: int, order: Sequence[int]) -> tuple[list[int], list[int]]:
    """Return a maximum matching that uses the rows which come first, as far as they fit together.

    Parameters
    ----------
    rows, n_unknowns
        As for :func:`maximum_matching`.
    order : sequence of int
        Every row once, the most wanted first.

    Returns
    -------
    equation_of_unknown, unknown_of_equation : list of int
        -1 where unmatched. A row is unmatched only where it does not fit together with those that
        come before it.

    References
    ----------
    Edmonds and Fulkerson, J. Research NBS 69B, 1965 (transversal matroids, the greedy algorithm).

    Examples
    --------
    >>> in_order(((0,), (0, 1), (1,)), 2, [2, 1, 0])
    ([1, 2], [-1, 0, 1])
    """
    equation_of = [-1] * n_unknowns
    unknown_of = [-1] * len(rows)
    exhausted = [False] * n_unknowns
    for root in order:
        _augment(rows, root, equation_of, unknown_of, exhausted)
    return equation_of, unknown_of


def complete(rows: Rows, equation_of: list[int], unknown_of: list[int]) -> None:
    """Turn a matching, given as two lists, into a maximum one, in place.

    Parameters
    ----------
    rows : sequence of sequences of int
    equation_of, unknown_of : list of int
        A matching, see :func:`match`. What is matched stays matched, if with another partner.

    References
    ----------
    As for :func:`maximum_matching`.

    Examples
    --------
    >>> equation_of, unknown_of = [0, -1], [0, -1]
    >>> complete(((0, 1), (0,)), equation_of, unknown_of)
    >>> unknown_of
    [1, 0]
    """
    exhausted = [False] * len(equation_of)  # from there no free unknown is reached, now or later
    for root in [e for e, unknown in enumerate(unknown_of) if unknown < 0 and rows[e]]:
        _augment(rows, root, equation_of, unknown_of, exhausted)


def _augment(
    rows: Rows, root: int, equation_of: list[int], unknown_of: list[int], exhausted: list[bool]
) -> None:
    """Match an unmatched equation too, if it fits together with those that are matched."""
    reached_from = _search(rows, root, equation_of, exhausted)
    end = next(reversed(reached_from), -1)
    if end >= 0 and equation_of[end] < 0:
        _turn_over(end, reached_from, equation_of, unknown_of)
    else:
        for unknown in reached_from:
            exhausted[unknown] = True


def _search(rows: Rows, root: int, equation_of: list[int], exhausted: list[bool]) -> dict[int, int]:
    """Return from which equation each unknown was reached, breadth first; a free one ends it."""
    reached_from: dict[int, int] = {}
    queue = [root]
    for equation in queue:  # grows while it is walked
        for unknown in rows[equation]:
            if unknown in reached_from or exhausted[unknown]:
                continue
            reached_from[unknown] = equation
            if equation_of[unknown] < 0:
                return reached_from
            queue.append(equation_of[unknown])
    return reached_from


def _turn_over(
    unknown: int, reached_from: dict[int, int], equation_of: list[int], unknown_of: list[int]
) -> None:
    """Match along the path that ends with an unknown, so that its first equation is matched too."""
    while unknown >= 0:
        equation = reached_from[unknown]
        before = unknown_of[equation]
        equation_of[unknown], unknown_of[equation] = equation, unknown
        unknown = before
