"""Which of several arrangements do the body rates speak for, and beyond doubt?

In: rates, inputs, stretches, arrangements of which the first is the vehicle as set. Out: a
`Judgement`. Gaussian residuals of unknown size on each axis; their number is the number that would
be independent, by their own autocorrelation. All arrangements have as many parameters (a gain, a
damping, a trim for each axis, a delay and a lag for all), so that their likelihoods compare as the
Bayesian information criterion does; the prior of each comes on top.

The vehicle as set is given up only where another arrangement is likelier at every interval length
and in both halves of the time by `CERTAIN`, where it explains a good share of the motion on every
axis that it arranges otherwise, and where it does so better than a controller's own answer to
gusts could make it seem: that answer shows at one length and not at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.setup.arrangements import Arrangement
from fdi.methods.setup.moments import LENGTHS, Intervals, explain, intervals
from fdi.methods.setup.records import Series, Stretch
from fdi.telemetry.message import Floats

CERTAIN: Final = 12.0
"""Difference of log likelihoods: 1 to 160,000, over the thousand ways that are compared."""
_LONG: Final = 40
"""Intervals below which only the shortest are judged: a take-off that failed."""
_HALVES: Final = 80
"""Intervals below which a stretch is too short to be judged by halves."""


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """How arrangements compare.

    Attributes
    ----------
    best : int
        The likeliest.
    ahead : (h,) float
        By how much its log likelihood is above each, at the interval length where that is least.
    ahead_of_told : float
        The same against the first arrangement, in the half of the time where it is least.
    explained : (h, a) float
        Share of the change of the rate about each axis that each explains, 0 to 1, at best.
    misfit : (h,) float
        How far each is from the measured effects of the inputs, in standard errors (root mean
        square over effects and axes); about 1 where it is right.
    count : int
        Intervals of the shortest length.
    independent : (a,) float
        As how many independent ones they count, at the length where these are fewest.
    turning : (a,) float
        Standard deviation of the rates, rad/s.
    """

    best: int
    ahead: Floats
    ahead_of_told: float
    explained: Floats
    misfit: Floats
    count: int
    independent: Floats
    turning: Floats


def judge(
    rates: Series,
    inputs: Series,
    parts: tuple[Stretch, ...],
    ways: tuple[Arrangement, ...],
) -> Judgement | None:
    """Return how arrangements compare, None where there are hardly any records.

    Rates and directions are of as many axes, a, as are to be looked at.
    """
    directions = np.array([way.directions for way in ways])
    prior = np.array([way.prior for way in ways])
    fits: dict[int, list[_Fit]] = {times: [] for times in LENGTHS}
    first: Intervals | None = None
    for times, found in intervals(rates, inputs, parts):
        if times == LENGTHS[0] or found.t.size >= _LONG:
            first = found if first is None else first
            fits[times].append(_fit(found, directions))
    if first is None:
        return None
    likely, halves, explained, misfit = [], [], [], []
    for each in filter(None, fits.values()):
        at = np.argmax([fit.likelihood for fit in each], axis=0), np.arange(len(ways))
        likely.append(np.array([fit.likelihood for fit in each])[at] + prior)
        explained.append(1 - np.array([fit.left for fit in each])[at])
        misfit.append(np.array([fit.misfit for fit in each])[at])
        halves += [np.max(half, axis=0) for half in zip(*(f.halves for f in each), strict=True)]
    best = int(np.argmax(np.mean(likely, axis=0)))
    ahead = np.min([each[best] - each for each in likely], axis=0)
    by_half = min(float(each[best] - each[0]) for each in halves)
    every = [fit for each in fits.values() for fit in each]
    return Judgement(
        best,
        ahead,
        by_half,
        np.max(explained, axis=0),
        misfit[0],
        first.t.size,
        np.min([fit.independent for fit in every], axis=0),
        first.rate.std(axis=1),
    )


class _Fit(NamedTuple):
    """How arrangements fit one set of intervals; ``halves``: likelihoods by half of the time."""

    likelihood: Floats
    left: Floats
    misfit: Floats
    independent: Floats
    halves: tuple[Floats, Floats]


def _fit(found: Intervals, directions: Floats) -> _Fit:
    left, _ = explain(found, directions)
    free, count = _freely(found)
    likelihood = _likelihood(left, count)
    effects = found.inputs.shape[0] - 1
    surplus = count * (left - free) / free / max(effects, 1)
    misfit = np.sqrt(np.maximum(surplus.mean(axis=1), 0.0))
    if found.t.size < _HALVES:
        return _Fit(likelihood, left, misfit, count, (likelihood, likelihood))
    middle = found.t.size // 2
    halves = (_part(found, slice(None, middle)), _part(found, slice(middle, None)))
    early, late = (_likelihood(explain(half, directions)[0], count / 2) for half in halves)
    return _Fit(likelihood, left, misfit, count, (early, late))


def _likelihood(left: Floats, count: Floats) -> Floats:
    return np.asarray(-0.5 * (np.log(left) * count).sum(axis=1))


def _freely(found: Intervals) -> tuple[Floats, Floats]:
    """Return what is left, (a,), with every effect free, and how many intervals are independent."""
    left, count = np.empty(len(found.change)), np.empty(len(found.change))
    rows = (found.change, found.inputs, found.rate)
    if found.has_trim:
        rows = tuple(each - each.mean(axis=1, keepdims=True) for each in rows)
    for axis, y in enumerate(rows[0]):
        x = np.vstack([rows[1], rows[2][axis]])
        # by the few normal equations: intervals are many, and what they are divided by is alike
        rest = y - np.linalg.lstsq(x @ x.T, x @ y, rcond=None)[0] @ x
        spread, size = y @ y, rest @ rest
        left[axis] = np.clip(size / spread, 1e-12, 1.0) if spread else 1.0
        follows = np.clip(rest[1:] @ rest[:-1] / size, 0.0, 0.95) if size else 0.0
        count[axis] = max(y.size - len(x) - found.has_trim, 1) * (1 - follows) / (1 + follows)
    return left, count


def _part(found: Intervals, rows: slice) -> Intervals:
    return Intervals(
        found.t[rows],
        found.change[:, rows],
        found.inputs[:, rows],
        found.rate[:, rows],
        found.has_trim,
    )
