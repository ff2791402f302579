"""What is the mean of a quantity over a flight, and how well is it known?

In: a column and a stretch of time. Out: the mean with its standard error by the method of batch
means: samples that follow each other err alike, so the stretch is cut into blocks, and the scatter
of the blocks' means says how well their mean is known. Blocks are ten seconds or more, for which
gusts and manoeuvres last (``fdi.residuals.regress.CORRELATED_S``); few blocks are widened by
Student's t until two deviations hold 95 %.

References
----------
Law, Simulation Modeling and Analysis, 2015, section 9.5.3 (batch means).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from fdi.residuals.regress import CORRELATED_S
from fdi.telemetry.message import Floats

LEAST: Final = 3
"""Blocks: two tell their scatter to a factor of ten at best."""
MOST: Final = 40
"""Blocks; more are not told better, and longer ones are more independent."""
KNOWN_SHARE: Final = 0.5
"""Of the records that a block of this stretch usually has."""
TWO_SIGMA: Final = 0.975


class Mean(NamedTuple):
    """A mean and its standard error."""

    value: float
    std: float


def block_edges(start: float, end: float) -> Floats:
    """Return where blocks begin and end, (b + 1,) s; empty where there is no room for enough.

    Examples
    --------
    >>> block_edges(0.0, 39.0).tolist(), block_edges(0.0, 29.0).tolist()
    ([0.0, 13.0, 26.0, 39.0], [])
    """
    count = min(int((end - start) / CORRELATED_S), MOST)
    return np.linspace(start, end, count + 1) if count >= LEAST else np.zeros(0)


def block_means(t: Floats, values: Floats, edges: Floats) -> Floats:
    """Return the means of columns (k, n) in blocks, (k, b); NaN where too little of one is known.

    A record counts where all columns are known.
    """
    count = max(len(edges) - 1, 0)
    known = np.isfinite(values).all(axis=0)
    place = np.searchsorted(edges, t[known], side="right") - 1
    inside = (place >= 0) & (place < count)
    place = place[inside]
    number = np.bincount(place, minlength=count).astype(float)
    sums = np.array([np.bincount(place, row[known][inside], count) for row in values])
    usual = np.median(number[number > 0]) if number.any() else 0.0
    number[number < max(KNOWN_SHARE * usual, 1.0)] = np.nan
    means: Floats = sums.reshape(len(values), count) / number
    return means


def mean_of(blocks: Floats) -> Mean | None:
    """Return the mean of blocks (b,); None where too few are known."""
    known = blocks[np.isfinite(blocks)]
    if len(known) < LEAST:
        return None
    error = float(known.std(ddof=1)) / np.sqrt(len(known))
    return Mean(float(known.mean()), float(error * widening(len(known))))


def widening(count: int) -> float:
    """Return by how much the error of ``count`` blocks is widened for two of it to hold 95 %."""
    from scipy.special import stdtrit

    return float(stdtrit(count - 1, TWO_SIGMA)) / 2.0
