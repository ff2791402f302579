"""How small would the scale of the thresholds have to be for a residual to alarm?

In: residuals and bounds. Out: per sample the scale below which ``judging.judge`` has an alarm that
is certain there; for any number of flights at once. One pass tells for all scales.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fdi.decision.bounds import Bounds, lasting_mean, normalised
from fdi.decision.judging import enough
from fdi.decision.recipes import PredictedSpread
from fdi.model.evaluate import Floats


def critical_scales(
    off: Floats,
    row: int,
    bounds: Bounds,
    known: NDArray[np.bool_],
    recipe: PredictedSpread,
    rate_hz: float,
) -> Floats:
    """Return the scale below which a residual is in alarm, (k, n); -inf where at no scale.

    Parameters
    ----------
    off : (k, n) float
        One residual off its centre, of k flights.
    row : int
        Which residual it is.
    bounds : Bounds
    known : (n,) bool
        Where it is judged.
    recipe : PredictedSpread
    rate_hz : float
    """
    result = np.full(off.shape, -np.inf)
    size, tolerance, noise = np.abs(off[:, known]), bounds.tolerance[row], bounds.noise[row, known]
    sudden = np.full(size.shape, -np.inf)
    for over, count in enough(recipe.alarm_samples(rate_hz)):
        if size.shape[1] >= count:
            lasting = least_of(_scale(size / over, tolerance[known], noise), count)
            sudden[:, count - 1 :] = np.maximum(sudden[:, count - 1 :], lasting)
    result[:, known] = sudden
    if np.isfinite(bounds.mean_bound[row]).any():
        given = np.where(known, off, np.nan)
        ratio = normalised(given, tolerance, bounds.spread[row], bounds.settled)
        mean = lasting_mean(ratio, recipe.mean_samples(rate_hz))
        with np.errstate(divide="ignore", invalid="ignore"):
            slow = np.abs(mean) * bounds.mean_spread[row] / bounds.mean_bound[row]
        result = np.fmax(result, np.where(known, slow, np.nan))
    return result


def _scale(size: Floats, tolerance: Floats, noise: Floats) -> Floats:
    """Return the scale at which a size is at its threshold, -inf where noise has none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        scale: Floats = np.where(noise > 0, (size - tolerance) / noise, -np.inf)
    return scale


def least_of(values: Floats, count: int) -> Floats:
    """Return the least of every ``count`` successive columns, (k, n - count + 1)."""
    width, least = 1, values
    while 2 * width <= count:
        least = np.minimum(least[:, width:], least[:, :-width])
        width *= 2
    if width < count:
        more = count - width
        least = np.minimum(least[:, more:], least[:, :-more])
    return least
