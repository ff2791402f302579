"""How large is a battery's internal resistance, by one flight?

In: voltage and current of a battery. Out: by how many volts the voltage sinks per ampere, with its
standard error. What a cell gives without load sinks slowly while it is emptied, so voltage and
current are taken off their straight lines in each block of the flight; what is left of the one is
compared with what is left of the other. Seconds are averaged before: within one the voltage lags
the current, and the two are not sampled at one moment. This is the resistance that a load of
seconds feels, larger than what a meter shows at 1 kHz.

How well it is known follows from how the blocks differ, not from the scatter of the seconds, which
err alike. A current that hardly changes tells nothing, and gives no value; nor does a voltage that
stands still, which is a monitor's or a simulator's own, and no battery's.

References
----------
Liang and Zeger, Biometrika 73, 1986 (standard errors from independent groups). Fuller, Measurement
Error Models, 1987, section 1.1 (noise of the current makes the slope too small).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from fdi.grid import uniform
from fdi.telemetry.message import Floats
from fdi.trends.blocks import LEAST, Mean, block_edges, block_means, widening

SECOND: Final = 1.0
CLEAR: Final = 10.0
"""Variance of the current's changes over that of its noise: less makes the slope a tenth too small
and more. Chosen; how many flights 5 and 20 leave: docs/batch.md."""
STILL: Final = 1e-6
"""V: less is rounding."""
LEAST_SECONDS: Final = 5
"""Of a block, for a straight line and something left of it."""


def resistance(
    t: Floats, voltage: Floats, current: Floats, start: float, end: float
) -> Mean | None:
    """Return the resistance of a battery, ohm; None where the flight does not tell it.

    Parameters
    ----------
    t, voltage, current : (n,) float
        s, V, A; NaN where unknown.
    start, end : float
        s, of the stretch that counts.

    Examples
    --------
    >>> t = np.arange(0.0, 120.0, 0.1)
    >>> load = 20.0 + 5.0 * np.sin(t / 3.0)
    >>> found = resistance(t, 16.0 - 0.002 * t - 0.03 * load, load, 0.0, 120.0)
    >>> round(found.value, 4), found.std < 1e-4
    (0.03, True)
    >>> resistance(t, 16.0 - 0.002 * t, np.full(1200, 20.0), 0.0, 120.0) is None
    True
    """
    edges = block_edges(start, end)
    seconds = uniform(start, end, SECOND, records=t.size)
    if not len(edges) or len(seconds) < 2:
        return None
    means = block_means(t, np.array([voltage, current]), np.append(seconds, seconds[-1] + SECOND))
    middle = seconds + SECOND / 2
    common, leading, following = [], [], 0.0
    for low, high in pairwise(edges):
        inside = (middle >= low) & (middle < high) & np.isfinite(means).all(axis=0)
        if inside.sum() >= LEAST_SECONDS:
            volts, amperes = (_off_line(middle[inside], row[inside]) for row in means)
            common.append(float(volts @ amperes))
            leading.append(float(amperes @ amperes))
            following += float(volts @ volts)
    total = sum(leading)
    noise = _noise(t, current, start, end) * sum(map(bool, leading)) * len(middle) / len(edges)
    if len(common) < LEAST or not total > CLEAR * noise or following < STILL**2 * len(seconds):
        return None
    value = -sum(common) / total
    left = [c + value * i for c, i in zip(common, leading, strict=True)]
    count = len(left)
    error = np.sqrt(sum(v * v for v in left) * count / (count - 1)) / total
    return Mean(value, float(error * widening(count)))


def _off_line(t: Floats, values: Floats) -> Floats:
    """Return what is left of values off their straight line."""
    about = t - t.mean()
    off: Floats = values - values.mean()
    left: Floats = off - about * (about @ off) / (about @ about)
    return left


def _noise(t: Floats, values: Floats, start: float, end: float) -> float:
    """Return the variance of a second's mean by the records' noise, from their second differences.

    A load that changes from record to record counts as noise, too: then too little is claimed.
    """
    inside = (t >= start) & (t < end) & np.isfinite(values)
    own = values[inside]
    if len(own) < 4:
        return np.inf
    white = float(np.mean(np.diff(own, 2) ** 2)) / 6.0
    per_second = len(own) / max(end - start, SECOND)
    return white / max(per_second, 1.0)
