"""How does a residual behave while nothing is wrong? Its centre and spread in the calm part.

In: a residual's column with its predicted spread and what a constant offset may amount to. Out: the
constant to take off, and the factor by which the stated spread is off. The centre is the
median over a reference stretch, the first seconds in the air, and never more than the offset that
the model allows: a fault since boot stays visible beyond it. The factor comes from the calm part:
the flight is cut into blocks, each block has its own spread, and the median block counts, so that a
fault in less than half of the flight does not hide itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats
from fdi.windows import trailing_sum

GAUSSIAN_90: float = 1.645
"""90 % of a standard normal variable lie within this many standard deviations."""


def centres(values: Floats, allowance: Floats, reference: NDArray[np.bool_]) -> Floats:
    """Return the constant offset of every residual, within what the model allows.

    Parameters
    ----------
    values, allowance : (r, n) float
    reference : (n,) bool

    Returns
    -------
    (r,) float
    """
    result = np.zeros(len(values))
    for row, own in enumerate(values):
        known = own[reference & np.isfinite(own)]
        bound = np.nanmax(allowance[row]) if np.isfinite(allowance[row]).any() else 0.0
        if len(known) and bound > 0:
            result[row] = np.clip(np.median(known), -bound, bound)
    return result


def spread_factors(
    deviations: Floats,
    spread: Floats,
    calm: NDArray[np.bool_],
    block: int,
) -> Floats:
    """Return by which factor the stated spread of every residual is off, NaN where nothing tells.

    Parameters
    ----------
    deviations : (r, n) float
        What is left of the residual beyond its centre and tolerance, not negative.
    spread : (r, n) float
        Predicted; where it is 0 the residual has no stated spread.
    calm : (n,) or (r, n) bool
    block : int
        Samples in a block.
    """
    result = np.full(len(deviations), np.nan)
    usable = calm & np.isfinite(deviations) & (spread > 0)
    for row, (own, known) in enumerate(zip(deviations, usable, strict=True)):
        if known.sum() < 2 * block:
            continue
        ratio = own[known] / spread[row][known]
        cut = len(ratio) // block * block
        levels = np.quantile(ratio[:cut].reshape(-1, block), 0.9, axis=1)
        result[row] = np.median(levels) / GAUSSIAN_90
    return result


def trailing_mean(values: Floats, count: int, least_known: int) -> Floats:
    """Return the mean of the last ``count`` samples of every row, NaN where too few are known.

    Parameters
    ----------
    values : (r, n) float
        NaN is unknown.
    count, least_known : int

    Examples
    --------
    >>> trailing_mean(np.array([[1.0, 3.0, np.nan, 5.0]]), 2, 1)[0].tolist()
    [nan, 2.0, 3.0, 5.0]
    """
    known = np.isfinite(values)
    result = np.full(values.shape, np.nan)
    total = trailing_sum(np.where(known, values, 0.0), count)
    number = np.cumsum(known, axis=1)
    number[:, count:] -= number[:, :-count].copy()
    enough = number >= least_known
    enough[:, : count - 1] = False
    result[enough] = total[enough] / number[enough]
    return result
