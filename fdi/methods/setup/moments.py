"""How do the body rates answer to what drives the vehicle, interval by interval?

In: body rates and inputs (thrusts of motors, deflections of surfaces) at their own records. Out:
`Intervals`: over each the change of the rates, the mean of the delayed inputs and of the rates. By
Euler's equations without their gyroscopic terms the change of a rate, per second, is the moment of
the inputs over the inertia, less a damping that is proportional to the rate.

`explain` asks how well inputs that act in given directions explain the changes: one gain and one
damping for each axis, neither below zero, because a frame that does not answer at all is one thing
and a frame that answers backwards another; backwards is a direction of its own.

The trap for a maintainer: autopilots answer disturbances. A gust that turns the vehicle to the
right makes the controller push to the left *within the same interval* when records are far apart,
and the vehicle then seems to answer backwards. So no single interval length decides, and no single
delay (`LENGTHS`, `DELAYS_S`): see ``judge.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.setup.records import Series, Stretch
from fdi.telemetry.message import Floats

DELAYS_S: Final = (0.0, 0.02, 0.05, 0.1)
"""From a record of an output to its effect, s: filters of the gyroscopes, records out of step."""
LAGS_S: Final = (0.0, 0.05, 0.12, 0.26)
"""Time constants of motors and propellers, s: small racers to slow heavy lifters."""
LENGTHS: Final = (1, 2, 4)
"""Lengths of intervals, in periods of the slower record."""
_LEAST: Final = 6
"""Intervals: a gain, a damping, a delay and a lag are found from them."""
_GAP: Final = 2.5  # periods without a record
_MEMORY: Final = 6  # time constants after which a lag has forgotten all but 0.2 %
_STEP_S: Final = 0.02  # of the integrals over the inputs


@dataclass(frozen=True, slots=True, eq=False)
class Intervals:
    """Intervals of one length, with one delay and lag.

    Attributes
    ----------
    t : (n,) float
        Where they begin, s.
    change : (3, n) float
        Of roll, pitch and yaw rate per second, rad/s2.
    inputs : (m, n) float
        Means of the delayed inputs.
    rate : (3, n) float
        Mean rates, rad/s.
    has_trim : bool
        Whether a constant moment is allowed for; not in a take-off that failed, where a command
        that stays at its limit could not be told from it.
    """

    t: Floats
    change: Floats
    inputs: Floats
    rate: Floats
    has_trim: bool


def intervals(
    rates: Series,
    inputs: Series,
    parts: tuple[Stretch, ...],
    *,
    delay: float,
    lag: float,
    times: int,
) -> Intervals | None:
    """Return the intervals within stretches, None where there are hardly any."""
    length = times * max(rates.period, inputs.period)
    made = [
        found
        for part in parts
        if (found := _of(rates, inputs, part, length, delay, lag)) is not None
    ]
    if not made or sum(one[0].size for one in made) < _LEAST:
        return None
    t, change, mean, rate = (np.concatenate(each, axis=-1) for each in zip(*made, strict=True))
    return Intervals(t, change, mean, rate, not any(part.is_start for part in parts))


def _of(
    rates: Series, inputs: Series, part: Stretch, length: float, delay: float, lag: float
) -> tuple[Floats, Floats, Floats, Floats] | None:
    start = max(part.start, rates.t[0], inputs.t[0] + delay)
    end = min(part.end, rates.t[-1], inputs.t[-1])
    if end - start < 3 * length:
        return None
    step = min(_STEP_S, rates.period, inputs.period)
    fine = np.arange(start, end, step)
    edges = np.arange(start, end, length)
    at = np.minimum(np.searchsorted(fine, edges), fine.size - 1)
    acts = _lagged(_sampled(inputs, fine - delay), step, lag)
    mean = _means(acts, at)
    rate = _means(_sampled(rates, fine), at)
    around = min(length / 2, rates.period * max(1, round(length / rates.period / 2)))
    change = np.diff(_averaged(rates, edges, around), axis=1) / length
    whole = ~(_has_gap(rates, edges) | _has_gap(inputs, edges))
    return edges[:-1][whole], change[:, whole], mean[:, whole], rate[:, whole]


def _sampled(known: Series, t: Floats) -> Floats:
    return np.array([np.interp(t, known.t, row) for row in known.values])


def _lagged(values: Floats, step: float, lag: float) -> Floats:
    """Return values after a first-order lag, s, settled at their first."""
    if not lag:
        return values
    kernel = np.exp(-step / lag * np.arange(int(_MEMORY * lag / step) + 1))
    kernel /= kernel.sum()
    before = np.repeat(values[:, :1], kernel.size - 1, axis=1)
    whole = np.concatenate([before, values], axis=1)
    return np.array([np.convolve(row, kernel, mode="valid") for row in whole])


def _means(values: Floats, at: NDArray[np.intp]) -> Floats:
    total = np.cumsum(values, axis=1)
    return np.diff(total[:, at], axis=1) / np.maximum(np.diff(at), 1)


def _averaged(rates: Series, t: Floats, width: float) -> Floats:
    """Return rates at times, as the mean of the records of a width around, else between two."""
    first, last = (np.searchsorted(rates.t, t + half) for half in (-width / 2, width / 2))
    count = last - first
    total = np.insert(np.cumsum(rates.values, axis=1), 0, 0.0, axis=1)
    mean = (total[:, last] - total[:, first]) / np.maximum(count, 1)
    return np.where(count > 1, mean, _sampled(rates, t))


def _has_gap(known: Series, edges: Floats) -> NDArray[np.bool_]:
    """Return which intervals hold a time without records, or reach into one, (n - 1,) bool."""
    wide = np.insert(np.cumsum(np.diff(known.t) > _GAP * known.period), 0, 0)
    first = np.maximum(np.searchsorted(known.t, edges[:-1], side="right") - 1, 0)
    last = np.minimum(np.searchsorted(known.t, edges[1:]), known.t.size - 1)
    return np.asarray(wide[last] > wide[first])


def explain(found: Intervals, directions: Floats) -> tuple[Floats, Floats]:
    """Return what is left of the changes, and the gains, for inputs that act in given directions.

    Parameters
    ----------
    found : Intervals
    directions : (h, 3, m) float
        What each input does to roll, pitch and yaw, for h hypotheses.

    Returns
    -------
    left : (h, 3) float
        Share of the sum of squares that is not explained, 0 to 1 for each axis.
    gains : (h, 3) float
        rad/s2 for an input of 1, not below zero.
    """
    left, gains = np.empty(directions.shape[:2]), np.empty(directions.shape[:2])
    for axis in range(3):
        y, w, u = found.change[axis], -found.rate[axis], found.inputs
        if found.has_trim:
            y, w, u = y - y.mean(), w - w.mean(), u - u.mean(axis=1, keepdims=True)
        row = directions[:, axis]
        uu = np.einsum("hi,ij,hj->h", row, u @ u.T, row)
        uy, uw = row @ (u @ y), row @ (u @ w)
        left[:, axis], gains[:, axis] = _two(uu, uw, uy, w @ w, w @ y, y @ y)
    return left, gains


def _two(
    uu: Floats, uw: Floats, uy: Floats, ww: float, wy: float, yy: float
) -> tuple[Floats, Floats]:
    """Return the least squares of two regressors with coefficients not below zero, in shares."""
    tiny = np.finfo(float).tiny
    by_damping = max(wy, 0.0) ** 2 / (ww + tiny)
    alone = np.maximum(uy, 0.0) ** 2 / (uu + tiny)
    det = uu * ww - uw**2
    is_regular = det > 1e-9 * uu * ww + tiny
    safe = np.where(is_regular, det, 1.0)
    gain, damping = (uy * ww - uw * wy) / safe, (uu * wy - uw * uy) / safe
    inside = is_regular & (gain >= 0) & (damping >= 0)
    both = np.where(inside, gain * uy + damping * wy, -1.0)
    best = np.maximum(np.maximum(both, alone), by_damping)
    found = np.where(both >= best, gain, np.where(alone >= best, uy / (uu + tiny), 0.0))
    return np.clip(1.0 - best / (yy + tiny), 1e-12, 1.0), np.maximum(found, 0.0)
