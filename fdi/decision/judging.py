"""Which residuals are beyond given bounds, and which of these triggers are alarms?

|residual - centre| beyond the tolerance plus a number of standard deviations that the stated
accuracies predict at that very sample, widened by what the calm part shows, is a trigger; one that
persists is an alarm, and the stronger it is the sooner. What is small but lasts shows in the
trailing mean, whose threshold is what means of that length reach in this flight; noise of zero mean
shows in the scatter (``scatter``), held against that of the flight's beginning.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision.alarms import QUIET, TRIGGERED, UNKNOWN, Alarms, Use
from fdi.decision.bounds import Bounds, lasting_mean, normalised, over_spread
from fdi.decision.noise import trailing_mean
from fdi.decision.recipes import PredictedSpread
from fdi.decision.scatter import differences, samples_of, scatter
from fdi.model.evaluate import Floats
from fdi.residuals import Residuals
from fdi.windows import runs_of

SOONER: Final = ((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))
"""(strength, share of the persistence that is enough beyond it)."""
BEGUN: Final = 0.5
"""Share of a mean beyond its threshold that marks where it began."""
MOST_ANGLE: Final = np.pi / 2
"""rad; an angle that may be off by more is not judged: one that has nothing to do with what it is
held against would pass in half of all cases."""


def judge(
    residuals: Residuals,
    bounds: Bounds,
    recipe: PredictedSpread,
    use: Use,
    scale: float = 1.0,
) -> Alarms:
    """Return the alarms of residuals held against the bounds of a flight.

    Parameters
    ----------
    residuals : Residuals
    bounds : Bounds
        Of the same flight; the residuals may be others than those it was learned from.
    recipe : PredictedSpread
    use : Use
    scale : float
        Of the thresholds of noise; what the model states itself is not scaled.
    """
    rate_hz = residuals.signals.rate_hz
    told = bounds.told
    off, size = told.strayed(residuals.values)
    scales = np.where(told.stated, 1.0, scale)[:, None]
    threshold = _told(bounds.tolerance + scales * bounds.noise, told.circular)
    beyond = np.sign(off) * np.maximum(np.abs(off) - bounds.tolerance, 0.0)
    ratio = normalised(off, bounds.tolerance, bounds.spread, bounds.settled)
    count = recipe.mean_samples(rate_hz)
    mean = lasting_mean(ratio, count) * bounds.mean_spread
    mean_threshold = _told(scales * bounds.mean_bound, told.circular)
    state = states(size, threshold)
    state[told.unfit] = UNKNOWN
    mean[told.unfit] = np.nan
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        fast = np.where(state == UNKNOWN, np.nan, size / threshold)
        slow = np.abs(mean) / mean_threshold
    # without a stated spread nothing says how much beyond a threshold is much
    graded = np.where(bounds.spread > 0, fast, np.minimum(fast, SOONER[1][0]))
    sudden, known_sudden = _sudden(graded, state, recipe.alarm_samples(rate_hz))
    lasting, known_lasting = _lasting(beyond, slow, mean, count)
    relative, scattered = _scatter(off, bounds, rate_hz)
    most = recipe.scatter_most or np.inf
    wild = scattered / most
    noisy, known_noisy = _lasting(relative, wild, scattered, samples_of(rate_hz))
    lasting, known_lasting = lasting | noisy, known_lasting | known_noisy
    state[lasting & (state == QUIET)] = TRIGGERED
    strength = np.fmax(np.fmax(fast, slow), wild)
    strength = np.where(state == TRIGGERED, np.minimum(strength, 1e6), strength)
    return frozen(
        residuals,
        use,
        threshold=threshold,
        centre=told.centre.copy(),
        state=state,
        alarm=sudden | lasting,
        strength=strength,
        certain=known_sudden | known_lasting,
        delay_s=residuals.delay_s.copy(),
        unfit=told.unfit.copy(),
        mean=mean,
        mean_threshold=mean_threshold,
        stray=told.stray.copy(),
        scatter=scattered,
        scatter_most=most,
        scale=scale,
    )


def _told(threshold: Floats, circular: NDArray[np.bool_]) -> Floats:
    """Return thresholds, NaN where an angle within them tells nothing."""
    with np.errstate(invalid="ignore"):
        return np.where(circular[:, None] & (threshold > MOST_ANGLE), np.nan, threshold)


def _scatter(off: Floats, bounds: Bounds, rate_hz: float) -> tuple[Floats, Floats]:
    """Return the scatter of the residuals that are judged by it over what it was at first."""
    relative, mean = (np.full(off.shape, np.nan) for _ in range(2))
    rows = np.flatnonzero(np.isfinite(bounds.told.level) & ~bounds.told.unfit)
    sizes = differences(over_spread(off[rows], bounds.spread[rows]))
    relative[rows], mean[rows] = scatter(sizes, bounds.told.level[rows], rate_hz)
    return relative, mean


def _sudden(
    strength: NDArray[np.float64], state: NDArray[np.int8], least: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the triggers that persist, and from where on that is certain."""
    unknown = state == UNKNOWN
    alarm, certain = np.zeros(state.shape, bool), np.zeros(state.shape, bool)
    for over, count in enough(least):
        for row, own in enumerate(strength > over):
            found, sure = persistent(own, unknown[row], count)
            alarm[row] |= found
            certain[row] |= sure
    return alarm, certain


def _lasting(
    beyond: NDArray[np.float64],
    strength: NDArray[np.float64],
    mean: NDArray[np.float64],
    count: int,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where a mean is beyond its threshold, from beginning to end, and where certainly."""
    with np.errstate(invalid="ignore"):
        over = strength > 1.0
    alarm, certain = np.zeros(over.shape, bool), np.zeros(over.shape, bool)
    for row in np.flatnonzero(over.any(axis=1)):
        for start, stop in runs_of(over[row]):
            # half of what the mean has reached, seen over a short while, bounds it on both sides
            low = max(0, start - 2 * count)
            side = np.sign(mean[row, start]) * beyond[row, low:stop]
            short = trailing_mean(side[None], max(1, count // 6), 1)[0]
            is_there = short > BEGUN * abs(mean[row, start])
            before = np.flatnonzero(~is_there[: start - low + 1])
            first = low + (int(before[-1]) + 1 if len(before) else 0)
            there = np.flatnonzero(is_there[start - low :])
            last = int(start + there[-1] if len(there) else start)
            alarm[row, min(first, last) : last + 1] = True
            certain[row, start : last + 1] = True
    return alarm, certain


def enough(least: int) -> list[tuple[float, int]]:
    """Return beyond which strength so many triggers in a row are enough, by that of ``least``.

    Examples
    --------
    >>> enough(6)
    [(1.0, 6), (2.0, 3), (4.0, 2)]
    """
    return [(over, max(2, round(share * least))) for over, share in SOONER]


def states(size: NDArray[np.float64], threshold: NDArray[np.float64]) -> NDArray[np.int8]:
    """Return triggered, quiet or unknown, (r, n), of sizes against their thresholds."""
    unknown = ~np.isfinite(size) | ~np.isfinite(threshold)
    state = np.where(size > threshold, TRIGGERED, QUIET)
    return np.where(unknown, UNKNOWN, state).astype(np.int8)


def persistent(
    triggered: NDArray[np.bool_], unknown: NDArray[np.bool_], least: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the triggers that belong to a run of at least ``least``, and those that complete one.

    Parameters
    ----------
    triggered, unknown : (n,) bool
        An unknown sample neither ends a run nor counts for it.
    least : int

    Examples
    --------
    >>> on = np.array([1, 1, 0, 1, 1, 1, 1], bool)
    >>> run, complete = persistent(on, np.zeros(7, bool), 3)
    >>> run.astype(int).tolist(), complete.astype(int).tolist()
    ([0, 0, 0, 1, 1, 1, 1], [0, 0, 0, 0, 0, 1, 1])
    """
    known = np.flatnonzero(~unknown)
    result, complete = np.zeros(len(triggered), bool), np.zeros(len(triggered), bool)
    for start, end in runs_of(triggered[known]):
        if end - start >= least:
            result[known[start] : known[end - 1] + 1] = True
            complete[known[start + least - 1] : known[end - 1] + 1] = True
    return result, complete


def frozen(residuals: Residuals, use: Use, **parts: Any) -> Alarms:
    """Return alarms whose arrays nobody writes to any more."""
    for part in parts.values():
        if isinstance(part, np.ndarray):
            part.flags.writeable = False
    return Alarms(residuals, use, **parts)
