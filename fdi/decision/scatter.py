"""Has a residual begun to scatter? Noise of zero mean that neither a sample nor a long mean shows.

In: residuals over their predicted spread. Out: the scatter of the last seconds over what it was at
first. It is the mean size of second differences, which no step, drift or slow movement enlarges for
longer than it takes; each is clipped, so that one manoeuvre within the window does not decide.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision.noise import trailing_mean
from fdi.model.evaluate import Floats

SCATTER_S: Final = 15.0
"""Longer than most manoeuvres last."""
LEAST: Final = 0.03
"""Of the predicted spread; less scatter than this is rounding."""
CLIP: Final = 10.0
"""Times what it was at first; more in one sample counts as much."""
KNOWN_SHARE: Final = 0.7
"""Of the samples of a window."""
ENOUGH: Final = 8
"""Fewer differences tell no level."""


def differences(ratio: Floats) -> Floats:
    """Return the size of the second differences of residuals, of the variance of white noise.

    Parameters
    ----------
    ratio : (r, n) float
        Residuals over their predicted spread; NaN is unknown.

    Returns
    -------
    (r, n) float
        NaN where one of three successive samples is unknown.

    Examples
    --------
    >>> differences(np.array([[0.0, 1.0, 2.0, 6.0]])).round(3).tolist()
    [[nan, nan, 0.0, 1.225]]
    """
    found = np.full(ratio.shape, np.nan)
    found[:, 2:] = np.abs(ratio[:, 2:] - 2 * ratio[:, 1:-1] + ratio[:, :-2]) / np.sqrt(6.0)
    return found


def levels(sizes: Floats, reference: NDArray[np.bool_]) -> Floats:
    """Return the usual size of differences in a stretch, (r,); NaN where too few tell."""
    found = np.full(len(sizes), np.nan)
    for row, own in enumerate(sizes[:, reference]):
        known = own[np.isfinite(own)]
        if len(known) >= ENOUGH:
            # no median: where a channel is slower than the grid half of the differences are none
            found[row] = max(float(known.mean()), LEAST)
    return found


def scatter(sizes: Floats, level: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    """Return sizes over their level, clipped, and their mean over the last `SCATTER_S`.

    Parameters
    ----------
    sizes : (r, n) float
    level : (r,) float
    rate_hz : float

    Returns
    -------
    relative, mean : (r, n) float
        NaN where too little is known.
    """
    relative = np.minimum(sizes / level[:, None], CLIP)
    count = samples_of(rate_hz)
    return relative, trailing_mean(relative, count, round(KNOWN_SHARE * count))


def samples_of(rate_hz: float) -> int:
    """Return how many samples a window has."""
    return max(ENOUGH, round(SCATTER_S * rate_hz))
