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
machine code (``kalman_compiled.py``) takes over where there are many samples.

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
    """

    residual: Floats
    variance: Floats
    lasting: Floats
    before: Floats
    after: Floats
    deviation: Floats


def follow(
    along: Along, start: State, low: Floats, high: Floats, *, circular: bool, fast: bool
) -> tuple[Filtered, State]:
    """Return what an observer says along a linear model, and the state before what follows.

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
    state = State(*(np.array(part, dtype=np.float64) for part in start))
    told = Filtered(*(np.full(shape, np.nan) for shape in ((m,), (m, s), (m, s), *(3 * ((m, n),)))))
    kernel: Callable[..., None] = _machine_code() if fast else walk
    inputs = Along(*(np.ascontiguousarray(part, dtype=np.float64) for part in along))
    kernel(inputs, state, low, high, circular, told)
    return told, state


def walk(
    along: Along, state: State, low: Floats, high: Floats, circular: bool, told: Filtered
) -> None:
    """Walk over the samples; the state is left before the one that follows."""
    x, cov, cross, lasting = state
    one, two = along.before[..., None], along.after[..., None]
    noise = one @ one.swapaxes(2, 3) + two @ two.swapaxes(2, 3)
    known = ~np.isnan(along.h)
    for k in range(len(along.h)):
        told.before[k] = x
        if known[k]:
            own, now = along.c[k], along.direct[k]
            seen = cov @ own + cross * now[:, None]  # covariance of the error and the residual
            crossed = cross @ own + now
            variance = np.maximum(seen @ own + crossed * now, 0.0)  # rounding
            off = lasting @ own + now
            residual = along.h[k] + own @ x
            if circular:
                residual -= 2 * np.pi * np.round(residual / (2 * np.pi))
            told.residual[k], told.variance[k], told.lasting[k] = residual, variance, off
            total = variance.sum()
            gain = seen.sum(axis=0) / total if total > 0 else np.zeros(len(x))
            x -= gain * residual
            lasting -= np.outer(off, gain)
            cross -= np.outer(crossed, gain)
            less = seen[:, :, None] * gain
            cov += variance[:, None, None] * np.outer(gain, gain) - less - less.swapaxes(1, 2)
        np.clip(x, low, high, out=x)
        told.after[k] = x
        told.deviation[k] = np.sqrt(np.maximum(np.diagonal(cov.sum(axis=0)), 0.0))
        go = along.step[k]
        x[:] = np.clip(go @ x + along.push[k], low, high)
        mixed = (cross @ go.T)[:, :, None] * along.before[k][:, None, :]
        cov[:] = go @ cov @ go.T + mixed + mixed.swapaxes(1, 2) + noise[k]
        lasting[:] = lasting @ go.T + along.before[k] + along.after[k]
        cross[:] = along.after[k]


@cache
def _machine_code() -> Callable[..., None]:
    try:
        from fdi.residuals.kalman_compiled import walk as compiled
    except ImportError:  # numba is not installed, or not for this numpy
        return walk
    return compiled
