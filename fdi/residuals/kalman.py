"""Where is a state by a linear model that changes from sample to sample, and how surely?

In: the model between samples, what one residual shows of the state, and what every source of error
does to both. Out: the residual before each correction (the innovation), with the variance that
every source brings to it, and by how much it is off for a source that is constant. The gain is
Kalman's, from the sum of all sources.

The error of the state is kept source by source: the covariance of what the source did to the state,
and its covariance with the source's value at the present sample, because noise of an input enters
the step before a sample, the step after it and often the residual as well. The unknown start is one
more source, which never comes again. So the sum is the filter's own covariance, its parts are the
predicted spread, and the start's part says when the observer has settled.

One residual is one number, so that nothing has to be inverted. The loop over samples is there twice
and says the same: with numpy's operations on small matrices, and for numba (extra ``fast``), whose
machine code takes over where there are many samples.

References
----------
Kalman, J. Basic Engineering 82, 1960. Simon, Optimal State Estimation, 2006, section 7.1 (noise of
process and measurement that is correlated).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from fdi.model.evaluate import Floats

WORTH: Final = 2_000
"""Samples of a flight from which machine code is used: to load it costs 0.5 s, a sample without it
0.1 ms and with it 2 us."""


class Along(NamedTuple):
    """A linear model along m samples: ``x[k+1] = step[k] x[k] + push[k]``, residual ``c x + h``.

    ``n`` states, ``s`` sources; a source w moves a residual by ``direct[k] w[k]``, and the next
    state by ``before[k] w[k] + after[k] w[k+1]``.

    Attributes
    ----------
    step : (m, n, n) float
    push : (m, n) float
    before, after : (m, s, n) float
    c : (m, n) float
    h : (m,) float
        Unknown where the residual is: nothing is corrected there.
    direct : (m, s) float
    """

    step: Floats
    push: Floats
    before: Floats
    after: Floats
    c: Floats
    h: Floats
    direct: Floats


class State(NamedTuple):
    """What is known of the state before a sample is taken in.

    Attributes
    ----------
    x : (n,) float
    cov : (s, n, n) float
        What every source contributes to its covariance.
    cross : (s, n) float
        Covariance of its error and of the source at that sample.
    lasting : (s, n) float
        By how much it is off if a source is one all along.
    """

    x: Floats
    cov: Floats
    cross: Floats
    lasting: Floats


class Filtered(NamedTuple):
    """What an observer says along m samples.

    Attributes
    ----------
    residual : (m,) float
    variance : (m, s) float
        Of the residual, by source.
    lasting : (m, s) float
        By how much the residual is off if a source is one all along.
    before, after : (m, n) float
        The state, before and after a sample is taken in.
    deviation : (m, n) float
        Standard deviation of the state after it.
    end : State
        Before the sample that follows.
    """

    residual: Floats
    variance: Floats
    lasting: Floats
    before: Floats
    after: Floats
    deviation: Floats
    end: State


def follow(
    along: Along, start: State, low: Floats, high: Floats, *, circular: bool, fast: bool
) -> Filtered:
    """Return what an observer says along a linear model.

    Parameters
    ----------
    along : Along
    start : State
    low, high : (n,) float
        Within which a state is kept.
    circular : bool
        Whether the residual is an angle.
    fast : bool
        Whether machine code is worth its start.
    """
    m, n = along.c.shape
    s = along.direct.shape[1]
    x, cov, cross, lasting = (np.array(part, dtype=np.float64) for part in start)
    out = [np.full(shape, np.nan) for shape in ((m,), (m, s), (m, s), (m, n), (m, n), (m, n))]
    kernel: Callable[..., None] = _machine_code() if fast else walk
    inputs = [np.ascontiguousarray(part, dtype=np.float64) for part in along]
    kernel(*inputs, x, cov, cross, lasting, low, high, circular, *out)
    return Filtered(out[0], out[1], out[2], out[3], out[4], out[5], State(x, cov, cross, lasting))


def walk(
    step: Floats,
    push: Floats,
    before: Floats,
    after: Floats,
    c: Floats,
    h: Floats,
    direct: Floats,
    x: Floats,
    cov: Floats,
    cross: Floats,
    lasting: Floats,
    low: Floats,
    high: Floats,
    circular: bool,
    out_residual: Floats,
    out_variance: Floats,
    out_lasting: Floats,
    out_before: Floats,
    out_after: Floats,
    out_deviation: Floats,
) -> None:
    """Walk over the samples; x, cov, cross and lasting are left before the one that follows."""
    one, two = before[..., None], after[..., None]
    noise = one @ one.swapaxes(2, 3) + two @ two.swapaxes(2, 3)
    known = ~np.isnan(h)
    for k in range(len(h)):
        out_before[k] = x
        if known[k]:
            own, now = c[k], direct[k]
            seen = cov @ own + cross * now[:, None]  # covariance of the error and the residual
            crossed = cross @ own + now
            variance = np.maximum(seen @ own + crossed * now, 0.0)  # rounding
            off = lasting @ own + now
            residual = h[k] + own @ x
            if circular:
                residual -= 2 * np.pi * np.round(residual / (2 * np.pi))
            out_residual[k], out_variance[k], out_lasting[k] = residual, variance, off
            total = variance.sum()
            gain = seen.sum(axis=0) / total if total > 0 else np.zeros(len(x))
            x -= gain * residual
            lasting -= np.outer(off, gain)
            cross -= np.outer(crossed, gain)
            less = seen[:, :, None] * gain
            cov += variance[:, None, None] * np.outer(gain, gain) - less - less.swapaxes(1, 2)
        np.clip(x, low, high, out=x)
        out_after[k] = x
        out_deviation[k] = np.sqrt(np.maximum(np.diagonal(cov.sum(axis=0)), 0.0))
        go = step[k]
        x[:] = np.clip(go @ x + push[k], low, high)
        mixed = (cross @ go.T)[:, :, None] * before[k][:, None, :]
        cov[:] = go @ cov @ go.T + mixed + mixed.swapaxes(1, 2) + noise[k]
        lasting[:] = lasting @ go.T + before[k] + after[k]
        cross[:] = after[k]


def walk_scalars(
    step: Floats,
    push: Floats,
    before: Floats,
    after: Floats,
    c: Floats,
    h: Floats,
    direct: Floats,
    x: Floats,
    cov: Floats,
    cross: Floats,
    lasting: Floats,
    low: Floats,
    high: Floats,
    circular: bool,
    out_residual: Floats,
    out_variance: Floats,
    out_lasting: Floats,
    out_before: Floats,
    out_after: Floats,
    out_deviation: Floats,
) -> None:
    """Do as `walk`, number by number: for machine code."""
    n, sources = len(x), len(cross)
    seen = np.zeros((sources, n))  # covariance of the state's error and the residual
    gain, moved = np.zeros(n), np.zeros(n)
    half = np.zeros((n, n))
    for k in range(len(h)):
        for i in range(n):
            out_before[k, i] = x[i]
        if not np.isnan(h[k]):
            residual = h[k]
            for i in range(n):
                residual += c[k, i] * x[i]
                gain[i] = 0.0
            if circular:
                residual -= 2 * np.pi * np.round(residual / (2 * np.pi))
            out_residual[k] = residual
            total = 0.0
            for s in range(sources):
                variance, off, crossed = direct[k, s] ** 2, direct[k, s], 0.0
                for i in range(n):
                    own = cross[s, i] * direct[k, s]
                    for j in range(n):
                        own += cov[s, i, j] * c[k, j]
                    seen[s, i] = own
                    gain[i] += own
                    variance += c[k, i] * (own + cross[s, i] * direct[k, s])
                    off += c[k, i] * lasting[s, i]
                out_variance[k, s] = max(variance, 0.0)  # rounding
                out_lasting[k, s] = off
                total += out_variance[k, s]
            for i in range(n):
                gain[i] = gain[i] / total if total > 0 else 0.0
                x[i] -= gain[i] * residual
            for s in range(sources):
                crossed = direct[k, s]
                for i in range(n):
                    crossed += c[k, i] * cross[s, i]
                for i in range(n):
                    lasting[s, i] -= gain[i] * out_lasting[k, s]
                    cross[s, i] -= gain[i] * crossed
                    for j in range(n):
                        cov[s, i, j] += (
                            gain[i] * gain[j] * out_variance[k, s]
                            - seen[s, i] * gain[j]
                            - gain[i] * seen[s, j]
                        )
        for i in range(n):
            x[i] = min(max(x[i], low[i]), high[i])
            out_after[k, i] = x[i]
            total = 0.0
            for s in range(sources):
                total += cov[s, i, i]
            out_deviation[k, i] = np.sqrt(max(total, 0.0))
        for i in range(n):
            total = push[k, i]
            for j in range(n):
                total += step[k, i, j] * out_after[k, j]
            x[i] = min(max(total, low[i]), high[i])
        for s in range(sources):
            for i in range(n):
                moved[i], off = 0.0, before[k, s, i] + after[k, s, i]
                for j in range(n):
                    moved[i] += step[k, i, j] * cross[s, j]
                    off += step[k, i, j] * lasting[s, j]
                    total = 0.0
                    for q in range(n):
                        total += step[k, i, q] * cov[s, q, j]
                    half[i, j] = total
                gain[i] = off
            for i in range(n):
                lasting[s, i] = gain[i]
                cross[s, i] = after[k, s, i]
                for j in range(n):
                    total = before[k, s, i] * before[k, s, j] + after[k, s, i] * after[k, s, j]
                    total += moved[i] * before[k, s, j] + before[k, s, i] * moved[j]
                    for q in range(n):
                        total += half[i, q] * step[k, j, q]
                    cov[s, i, j] = total


@cache
def _machine_code() -> Callable[..., None]:
    try:
        import numba
    except ImportError:  # not installed, or not for this numpy
        return walk
    try:
        return numba.njit(cache=True, nogil=True)(walk_scalars)  # type: ignore[no-any-return]
    except RuntimeError:  # no folder to keep it in
        return numba.njit(nogil=True)(walk_scalars)  # type: ignore[no-any-return]
