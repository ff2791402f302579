"""Does as `kalman.walk`, number by number: for machine code.

In and out: as there (``along`` an `Along`, ``state`` a `State`, ``told`` a `Filtered`, which numba
takes apart by itself). numba is needed to import this file. An operation on a whole row, short to
write, costs fifty times as much here as a loop over its numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from fdi.model.evaluate import Floats


def _compiled(function: Callable[..., None]) -> Callable[..., None]:
    try:
        return numba.njit(cache=True, nogil=True)(function)  # type: ignore[no-any-return]
    except RuntimeError:  # no folder to keep it in
        return numba.njit(nogil=True)(function)  # type: ignore[no-any-return]


@_compiled
def walk(along: Any, state: Any, low: Floats, high: Floats, circular: bool, told: Any) -> None:
    """Walk over the samples; the state is left before the one that follows."""
    n, sources = len(state.x), len(state.cross)
    seen, half = np.zeros((sources, n)), np.zeros((n, n))
    gain, moved = np.zeros(n), np.zeros(n)
    for k in range(len(along.h)):
        for i in range(n):
            told.before[k, i] = state.x[i]
        if not np.isnan(along.h[k]):
            _correct(along, state, k, circular, told, seen, gain)
        for i in range(n):
            state.x[i] = min(max(state.x[i], low[i]), high[i])
            told.after[k, i] = state.x[i]
            total = 0.0
            for s in range(sources):
                total += state.cov[s, i, i]
            told.deviation[k, i] = np.sqrt(max(total, 0.0))
        for i in range(n):
            total = along.push[k, i]
            for j in range(n):
                total += along.step[k, i, j] * told.after[k, j]
            state.x[i] = min(max(total, low[i]), high[i])
        for s in range(sources):
            _carry(along, state, k, s, gain, moved, half)


@_compiled
def _correct(
    along: Any,
    state: Any,
    k: int,
    circular: bool,
    told: Any,
    seen: Floats,
    gain: Floats,
) -> None:
    """Take in a sample; ``seen`` is the covariance of the state's error and the residual."""
    x, cov, cross, lasting = state
    c, direct = along.c, along.direct
    n, sources = len(x), len(cross)
    residual = along.h[k]
    for i in range(n):
        residual += c[k, i] * x[i]
        gain[i] = 0.0
    if circular:
        residual -= 2 * np.pi * np.round(residual / (2 * np.pi))
    told.residual[k] = residual
    total = 0.0
    for s in range(sources):
        variance, off = direct[k, s] ** 2, direct[k, s]
        for i in range(n):
            own = cross[s, i] * direct[k, s]
            for j in range(n):
                own += cov[s, i, j] * c[k, j]
            seen[s, i] = own
            gain[i] += own
            variance += c[k, i] * (own + cross[s, i] * direct[k, s])
            off += c[k, i] * lasting[s, i]
        told.variance[k, s] = max(variance, 0.0)  # rounding
        told.lasting[k, s] = off
        total += told.variance[k, s]
    for i in range(n):
        gain[i] = gain[i] / total if total > 0 else 0.0
        x[i] -= gain[i] * residual
    for s in range(sources):
        crossed = direct[k, s]
        for i in range(n):
            crossed += c[k, i] * cross[s, i]
        for i in range(n):
            lasting[s, i] -= gain[i] * told.lasting[k, s]
            cross[s, i] -= gain[i] * crossed
            for j in range(n):
                cov[s, i, j] += (
                    gain[i] * gain[j] * told.variance[k, s]
                    - seen[s, i] * gain[j]
                    - gain[i] * seen[s, j]
                )


@_compiled
def _carry(
    along: Any, state: Any, k: int, s: int, off: Floats, moved: Floats, half: Floats
) -> None:
    """Carry what a source did to the state on to the next sample."""
    _, cov, cross, lasting = state
    step, before, after = along.step[k], along.before[k, s], along.after[k, s]
    n = len(before)
    for i in range(n):
        moved[i], off[i] = 0.0, before[i] + after[i]
        for j in range(n):
            moved[i] += step[i, j] * cross[s, j]
            off[i] += step[i, j] * lasting[s, j]
            total = 0.0
            for q in range(n):
                total += step[i, q] * cov[s, q, j]
            half[i, j] = total
    for i in range(n):
        lasting[s, i] = off[i]
        cross[s, i] = after[i]
        for j in range(n):
            total = before[i] * before[j] + after[i] * after[j]
            total += moved[i] * before[j] + before[i] * moved[j]
            for q in range(n):
                total += half[i, q] * step[j, q]
            cov[s, i, j] = total
