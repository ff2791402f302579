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

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.grid import uniform
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
_LEAST_STEP_S: Final = 0.001
"""A twentieth of the shortest delay: a finer one tells nothing, and a damaged clock gives any."""


@dataclass(frozen=True, slots=True, eq=False)
class Intervals:
    """Intervals of one length, with one delay and lag.

    Attributes
    ----------
    t : (n,) float
        Where they begin, s.
    change : (a, n) float
        Of the rates about a axes per second, rad/s2.
    inputs : (m, n) float
        Means of the delayed inputs.
    rate : (a, n) float
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


class _Cut(NamedTuple):
    """A stretch cut into intervals of one length: what no delay and no lag changes.

    ``at`` are the edges on the fine grid, ``whole`` the intervals without a gap.
    """

    at: NDArray[np.intp]
    whole: NDArray[np.bool_]
    t: Floats
    change: Floats
    rate: Floats


def intervals(
    rates: Series, inputs: Series, parts: tuple[Stretch, ...]
) -> Iterator[tuple[int, Intervals]]:
    """Yield the length in periods and the intervals within stretches, for every delay and lag.

    A length is left out where there are hardly any. What lengths, delays or lags have in common is
    computed once; one set is held at a time.
    """
    step = max(min(_STEP_S, rates.period, inputs.period), _LEAST_STEP_S)
    grids = tuple(_grid(rates, inputs, part, step) for part in parts)
    has_trim = not any(part.is_start for part in parts)
    # a flip is over within a few records of the outputs: those between are taken to be on the way
    period = max(rates.period, inputs.period if has_trim else 0.0, _LEAST_STEP_S)
    cuts = {times: _cuts(rates, inputs, grids, times * period) for times in LENGTHS}
    for delay in DELAYS_S:
        given = [_sampled(inputs, fine - delay) for fine in grids]
        for lag in LAGS_S:
            acts = [_summed(_lagged(each, step, lag)) for each in given]
            for times, each in cuts.items():
                if sum(cut.t.size for cut in each.values()) < _LEAST:
                    continue
                mean = [_means(acts[part], cut.at)[:, cut.whole] for part, cut in each.items()]
                yield (
                    times,
                    Intervals(
                        np.concatenate([cut.t for cut in each.values()]),
                        np.concatenate([cut.change for cut in each.values()], axis=1),
                        np.concatenate(mean, axis=1),
                        np.concatenate([cut.rate for cut in each.values()], axis=1),
                        has_trim,
                    ),
                )


def _grid(rates: Series, inputs: Series, part: Stretch, step: float) -> Floats:
    start = max(part.start, rates.t[0], inputs.t[0] + DELAYS_S[-1])
    records = rates.t.size + inputs.t.size
    return uniform(start, min(part.end, rates.t[-1], inputs.t[-1]), step, records=records)


def _cuts(
    rates: Series, inputs: Series, grids: tuple[Floats, ...], length: float
) -> dict[int, _Cut]:
    """Return the stretches that hold three intervals of a length, s, at least, by their number."""
    return {
        number: _cut(rates, inputs, fine, length)
        for number, fine in enumerate(grids)
        if fine.size and fine[-1] - fine[0] >= 3 * length
    }


def _cut(rates: Series, inputs: Series, fine: Floats, length: float) -> _Cut:
    edges = uniform(fine[0], fine[-1], length, records=rates.t.size + inputs.t.size)
    at = np.minimum(np.searchsorted(fine, edges), fine.size - 1)
    around = min(length / 2, rates.period * max(1, round(length / rates.period / 2)))
    change = np.diff(_averaged(rates, edges, around), axis=1) / length
    whole = ~(_has_gap(rates, edges) | _has_gap(inputs, edges))
    rate = _means(_summed(_sampled(rates, fine)), at)
    return _Cut(at, whole, edges[:-1][whole], change[:, whole], rate[:, whole])


def _sampled(known: Series, t: Floats) -> Floats:
    return np.array([np.interp(t, known.t, row) for row in known.values])


def _lagged(values: Floats, step: float, lag: float) -> Floats:
    """Return values after a first-order lag, s, settled at their first."""
    if not lag or not values.size:
        return values
    kernel = np.exp(-step / lag * np.arange(int(_MEMORY * lag / step) + 1))
    kernel /= kernel.sum()
    before = np.repeat(values[:, :1], kernel.size - 1, axis=1)
    whole = np.concatenate([before, values], axis=1)
    return np.array([np.convolve(row, kernel, mode="valid") for row in whole])


def _summed(values: Floats) -> Floats:
    return np.asarray(np.cumsum(values, axis=1))


def _means(total: Floats, at: NDArray[np.intp]) -> Floats:
    """Return the means between samples, of values that are summed up."""
    return np.asarray(np.diff(total[:, at], axis=1) / np.maximum(np.diff(at), 1))


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
    directions : (h, a, m) float
        What each input does about each axis, for h hypotheses.

    Returns
    -------
    left : (h, a) float
        Share of the sum of squares that is not explained, 0 to 1 for each axis.
    gains : (h, a) float
        rad/s2 for an input of 1, not below zero.
    """
    y, w, u = found.change, -found.rate, found.inputs
    if found.has_trim:
        y, w, u = (row - row.mean(axis=1, keepdims=True) for row in (y, w, u))
    uu = ((directions @ (u @ u.T)) * directions).sum(axis=2)
    uy, uw = ((directions * (row @ u.T)).sum(axis=2) for row in (y, w))
    ww, wy, yy = (w * w).sum(axis=1), (w * y).sum(axis=1), (y * y).sum(axis=1)
    return _two(uu, uw, uy, ww, wy, yy)


def _two(
    uu: Floats, uw: Floats, uy: Floats, ww: Floats, wy: Floats, yy: Floats
) -> tuple[Floats, Floats]:
    """Return the least squares of two regressors with coefficients not below zero, in shares.

    ``uu``, ``uw``, ``uy`` (h, a) are products with the input, ``ww``, ``wy``, ``yy`` (a,) without.
    """
    tiny = np.finfo(float).tiny
    by_damping = np.maximum(wy, 0.0) ** 2 / (ww + tiny)
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
