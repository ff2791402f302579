"""Which values solve a small system of equations, at all samples at once?

In: the equations of an algebraic loop as expressions that are zero, and the columns they know. Out:
one column for each unknown of the loop. A damped Newton (Levenberg-Marquardt) runs on all samples
together from a few starting points, one per combination of signs; roots outside a variable's domain
are dropped, and among several the one nearest to what a channel shows is taken, or the one that
continues the previous sample where no channel shows the unknown.

The iteration is capped; a sample that has not converged is unknown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.model.calculus import derivative
from fdi.model.evaluate import Column, Floats, evaluate
from fdi.model.expression import Expression
from fdi.model.parts import Variable

MAX_ITERATIONS: Final = 60
MAX_STARTS: Final = 8
TOLERANCE: Final = 1e-9
"""Of the residual norm, relative to the size of the known values."""


def solve_loop(
    equations: Sequence[Expression],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    near: Floats | None = None,
) -> list[Floats]:
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
    known = [np.abs(np.asarray(c, dtype=float)) for c in columns.values() if np.ndim(c)]
    size = len(known[0]) if known else 1
    scale = np.nan_to_num(np.nanmax(np.vstack([*known, np.ones(size)]), axis=0), nan=1.0)
    slopes = [[derivative(equation, u.name) for u in unknowns] for equation in equations]
    tracks = []
    for signs in list(product((1.0, -1.0), repeat=len(unknowns)))[:MAX_STARTS]:
        start = np.array([sign * scale for sign in signs])
        tracks.append(_iterate(equations, slopes, unknowns, columns, start, scale))
    candidates = np.array(tracks)  # (starts, unknowns, n)
    outside = np.any([_outside(candidates[:, i], u) for i, u in enumerate(unknowns)], axis=0)
    candidates = np.where(outside[:, None, :], np.nan, candidates)
    chosen = follow(candidates) if near is None else choose(candidates, near)
    return [chosen[place] for place in range(len(unknowns))]


def _outside(values: Floats, variable: Variable) -> NDArray[np.bool_]:
    low = -np.inf if variable.low is None else variable.low
    high = np.inf if variable.high is None else variable.high
    return np.asarray((values < low - 1e-9) | (values > high + 1e-9))


def _iterate(
    equations: Sequence[Expression],
    slopes: Sequence[Sequence[Expression | None]],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    start: Floats,
    scale: Floats,
) -> Floats:
    size = start.shape[1]
    point = start.copy()
    damping = np.full(size, 1e-3)
    best = np.full(size, np.inf)
    kept = point.copy()
    for _ in range(MAX_ITERATIONS):
        here = {**columns, **{u.name: point[i] for i, u in enumerate(unknowns)}}
        value = np.array([np.broadcast_to(evaluate(e, here), size) for e in equations])
        norm = np.nan_to_num(np.sqrt(np.sum(value**2, axis=0)), nan=np.inf)
        better = norm < best
        best = np.where(better, norm, best)
        kept = np.where(better, point, kept)
        damping = np.clip(np.where(better, damping / 5, damping * 5), 1e-12, 1e6)
        if np.all((best < TOLERANCE * scale) | ~np.isfinite(best)):
            break
        point = kept + _step(equations, slopes, unknowns, columns, kept, damping)
    return np.where(best < TOLERANCE * scale, kept, np.nan)


def _step(
    equations: Sequence[Expression],
    slopes: Sequence[Sequence[Expression | None]],
    unknowns: Sequence[Variable],
    columns: Mapping[str, Column],
    point: Floats,
    damping: Floats,
) -> Floats:
    size = point.shape[1]
    here = {**columns, **{u.name: point[i] for i, u in enumerate(unknowns)}}
    value = np.array([np.broadcast_to(evaluate(e, here), size) for e in equations])
    jacobian = np.empty((size, len(equations), len(unknowns)))
    for row, equation in enumerate(equations):
        for column, unknown in enumerate(unknowns):
            slope = slopes[row][column]
            if slope is None:
                width = 1e-6 * (1 + np.abs(point[column]))
                moved = {**here, unknown.name: point[column] + width}
                entry = (evaluate(equation, moved) - value[row]) / width
            else:
                entry = np.broadcast_to(evaluate(slope, here), size)
            jacobian[:, row, column] = entry
    jacobian = np.nan_to_num(jacobian)
    transposed = jacobian.transpose(0, 2, 1)
    square = transposed @ jacobian
    diagonal = np.einsum("nii->ni", square)
    diagonal += damping[:, None] * (diagonal + 1e-9)
    right = transposed @ np.nan_to_num(value.T[:, :, None])
    return -np.linalg.solve(square, right)[:, :, 0].T


def choose(candidates: Floats, near: Floats) -> Floats:
    """Return of several candidate roots the one that is nearest to what was measured.

    Parameters
    ----------
    candidates : (k, m, n) float
        k roots of m unknowns at n samples; NaN where a root does not exist.
    near : (m, n) float
        What a channel shows of the unknowns; NaN where none does. Where it shows none of them, the
        root follows from continuity (:func:`follow`).

    Returns
    -------
    (m, n) float

    Notes
    -----
    ``tan(course) = v_e/v_n`` with the ground speed has two solutions, one the reverse of the other,
    and at rest they meet: continuity alone would leave such a place on the wrong one for the rest
    of the flight.
    """
    track = follow(candidates)
    gap = candidates - near[None]
    shown = np.isfinite(near).any(axis=0) & np.isfinite(candidates).all(axis=1).any(axis=0)
    if len(candidates) == 1 or not shown.any():
        return track
    distance = np.sqrt(np.nansum(gap**2, axis=1))
    distance[~np.isfinite(candidates).all(axis=1)] = np.inf
    best = np.argmin(distance, axis=0)
    nearest: Floats = candidates[best, :, np.arange(candidates.shape[2])].T
    return np.where(shown, nearest, track)


def follow(candidates: Floats) -> Floats:
    """Return the track through several candidate roots that is continuous.

    Parameters
    ----------
    candidates : (k, m, n) float
        k roots of m unknowns at n samples; NaN where a root does not exist.

    Returns
    -------
    (m, n) float
        From every sample to the next the nearest root is taken; of the tracks that start at the
        roots of the first sample, the one that is known longest and moves least.

    Notes
    -----
    The map from the roots of a sample to those of the next is composed over all samples by doubling
    (a prefix scan), so no loop runs over samples: O(k^2 n) for the map, O(k n log n) for the scan.
    """
    k, _, n = candidates.shape
    if k == 1 or n == 1:
        first: Floats = candidates[int(np.argmax(np.isfinite(candidates[:, 0, 0])))]
        return first
    jump = np.linalg.norm(candidates[:, None, :, :-1] - candidates[None, :, :, 1:], axis=2)
    nearest = np.argmin(np.nan_to_num(jump, nan=np.inf), axis=1)  # (k, n-1)
    # A root that ceases to exist hands over to itself, so that the track survives a gap.
    lost = ~np.isfinite(jump).any(axis=1)
    nearest = np.where(lost, np.arange(k)[:, None], nearest)
    path = np.concatenate([np.arange(k)[:, None], nearest], axis=1)
    shift = 1
    while shift < n:
        later = path[:, shift:].copy()
        path[:, shift:] = np.take_along_axis(later, path[:, :-shift], axis=0)
        shift *= 2
    tracks = candidates[path, :, np.arange(n)]  # (k, n, m)
    known = np.isfinite(tracks[:, :, 0]).sum(axis=1)
    moved = np.nansum(np.linalg.norm(np.diff(tracks, axis=1), axis=2), axis=1)
    best = min(range(k), key=lambda i: (-known[i], moved[i], i))
    return tracks[best].T  # type: ignore[no-any-return]
