"""Which values solve a small system of equations, at all samples at once?

In: the equations of an algebraic loop as expressions that are zero, and the columns they know. Out:
one column for each unknown of the loop, and where they are unknown because more than one solution
lies in the domains. A loop that is linear in its unknowns is solved exactly, with rows and columns
brought to one size. Of any other all solutions are looked for (``roots.py``); among several the one
nearest to what a channel shows is taken. Where no channel shows any, or where it is not proven that
there is no other solution, the root is ambiguous: unknown, and told, instead of a guess.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.model.calculus import ZERO, derivative
from fdi.model.evaluate import Column, Floats, evaluate, wrap
from fdi.model.expression import Apply, Expression, count, substitute, walk
from fdi.model.parts import Variable
from fdi.residuals.roots import all_roots, domain_of, polished

SINGULAR: Final = 1e-12
"""Reciprocal condition of an equilibrated linear system below which it has no one solution."""
TIED: Final = 1e-9
"""Roots whose distances from what is shown differ by a smaller share are equally far."""


class Solved(NamedTuple):
    """Columns of the unknowns, (m, n), and where more than one root may be meant, (n,)."""

    columns: Floats
    ambiguous: NDArray[np.bool_]


def solve_loop(
    equations: Sequence[Expression],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    near: Floats | None = None,
) -> Solved:
    """Return a column for every unknown.

    Parameters
    ----------
    equations : sequence of Expression
        As many as unknowns, each zero at a solution.
    unknowns : sequence of Variable
    columns : mapping of str to (n,) float
        Everything else the equations hold.
    near : (m, n) float, optional
        What channels show of the unknowns, to tell several solutions apart.
    """
    size = max((len(c) for c in columns.values() if np.ndim(c)), default=1)
    slopes = linear_slopes(equations, unknowns)
    if slopes is not None:
        return _linear(equations, slopes, unknowns, columns, size)
    shown = np.full((len(unknowns), size), np.nan) if near is None else near
    told = np.asarray(np.isfinite(shown).any(axis=0))
    found = all_roots(equations, unknowns, columns, size, told)
    chosen = choose(found.values, shown, [u.circular for u in unknowns])
    return Solved(
        np.where(found.complete, chosen.columns, np.nan), chosen.ambiguous | ~found.complete
    )


def solve_moved(
    equations: Sequence[Expression],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    start: Floats,
) -> Floats:
    """Return the root, (m, n), that a root goes to where what is known moves a little.

    Parameters
    ----------
    equations, unknowns, columns
        As of :func:`solve_loop`.
    start : (m, n) float
        The root before; unknown where that is.
    """
    size = start.shape[1]
    slopes = linear_slopes(equations, unknowns)
    if slopes is not None:
        return _linear(equations, slopes, unknowns, columns, size).columns
    names = [u.name for u in unknowns]
    whole = {k: np.broadcast_to(np.asarray(v, dtype=float), size) for k, v in columns.items()}
    return polished(equations, names, whole, start)


def linear_slopes(
    equations: Sequence[Expression], unknowns: Sequence[Variable]
) -> list[list[Expression]] | None:
    """Return the slopes of equations by unknowns if these are in none of them, else None."""
    names = {u.name for u in unknowns}
    rows = []
    for equation in equations:
        if any(
            isinstance(node, Apply)
            and node.operator == "wrap"
            and any(count(node, n) for n in names)
            for node in walk(equation)
        ):
            return None  # slope one, but for its jumps
        row = []
        for unknown in unknowns:
            slope = derivative(equation, unknown.name)
            if slope is None or any(count(slope, name) for name in names):
                return None
            row.append(slope)
        rows.append(row)
    return rows


def _linear(
    equations: Sequence[Expression],
    slopes: Sequence[Sequence[Expression]],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    size: int,
) -> Solved:
    """Return the one solution of linear equations, unknown where there is none or many."""
    m = len(unknowns)
    nowhere = {u.name: ZERO for u in unknowns}
    matrix = np.array(
        [[np.broadcast_to(evaluate(s, columns), size) for s in row] for row in slopes]
    )
    right = np.array(
        [-np.broadcast_to(evaluate(substitute(e, nowhere), columns), size) for e in equations]
    )
    matrix, right = matrix.transpose(2, 0, 1).copy(), right.T.copy()
    known = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    matrix[~known], right[~known] = np.eye(m), 0.0
    across, down = np.ones((size, 1, m)), np.ones((size, m, 1))
    for _ in range(2):
        down /= _sizes(matrix * down * across, 2)
        across /= _sizes(matrix * down * across, 1)
    even = matrix * down * across
    values = np.linalg.svd(even, compute_uv=False)
    regular = values[:, -1] > SINGULAR * values[:, 0]
    even[~regular] = np.eye(m)
    solution = np.linalg.solve(even, right[:, :, None] * down)[:, :, 0] * across[:, 0]
    columns_of = np.where((known & regular)[:, None], solution, np.nan).T
    for own, unknown in zip(columns_of, unknowns, strict=True):
        low, high = domain_of(unknown)
        turned = wrap(own) if unknown.circular else own
        slack = 1e-9 * (1 + np.abs(turned))
        own[(turned < low - slack) | (turned > high + slack)] = np.nan
    columns_of[:, np.isnan(columns_of).any(axis=0)] = np.nan
    return Solved(columns_of, known & ~regular)


def _sizes(matrix: Floats, axis: int) -> Floats:
    size = np.abs(matrix).max(axis=axis, keepdims=True)
    # of a power of two, so that bringing to one size rounds nothing
    return np.where(size > 0, np.exp2(np.round(np.log2(np.where(size > 0, size, 1.0)))), 1.0)


def choose(candidates: Floats, near: Floats, circular: Sequence[bool]) -> Solved:
    """Return of several roots the only one, or the one nearest to what was measured.

    Parameters
    ----------
    candidates : (k, m, n) float
        k roots of m unknowns at n samples; NaN where a root does not exist.
    near : (m, n) float
        What a channel shows of the unknowns; NaN where none does.
    circular : sequence of bool
        Whether an unknown is an angle.

    Notes
    -----
    ``tan(course) = v_e/v_n`` with the ground speed has two solutions, one the reverse of the other,
    and at rest they meet: continuity would leave such a place on the wrong one for the rest of the
    flight. So only what is measured at a sample decides there.
    """
    exists = np.isfinite(candidates).all(axis=1)  # (k, n)
    shown = np.isfinite(near).any(axis=0)
    gap = candidates - near[None]
    turned = np.asarray(circular)[None, :, None]
    gap = np.where(turned, wrap(gap), gap)
    distance = np.sqrt(np.nansum(gap**2, axis=1))
    distance[~exists] = np.inf
    best = np.argmin(distance, axis=0)
    columns = candidates[best, :, np.arange(candidates.shape[2])].T
    several = exists.sum(axis=0) > 1
    # Roots of which the channel shows the same are not told apart by it.
    tied = np.zeros(several.shape, dtype=bool)
    level = np.sort(distance, axis=0)[:2, several]
    tied[several] = level[1:].sum(axis=0) <= (1 + TIED) * level[0]
    ambiguous = several & (~shown | tied)
    return Solved(np.where(ambiguous | ~exists.any(axis=0), np.nan, columns), ambiguous)
