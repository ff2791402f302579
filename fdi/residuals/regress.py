"""By what factor does one quantity follow another, over a while, whatever constant lies between?

In: pairs of columns on a regular grid. Out: the least-squares slope of each sample's window and its
standard error. Several pairs share one slope and have a constant each: the velocity over ground
against the velocity through the air, north and east, have the scale of the airspeed in common and
the wind as constants, so that every turn calibrates the airspeed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from fdi.model.evaluate import Floats

LEAST_KNOWN: Final = 0.5
"""Share of the window; at the ends of a flight part of it is missing."""
CORRELATED_S: Final = 10.0
"""What disturbs such a fit, like turbulence, lasts this long: samples closer together count once.
Chosen: gusts of 200 m (MIL-F-8785C, low altitude) at 20 m/s."""


def slope(
    followers: Sequence[Floats],
    leaders: Sequence[Floats],
    noises: Sequence[Floats],
    step: float,
    window_s: float,
) -> tuple[Floats, Floats]:
    """Return the slope of the followers over the leaders and its standard error.

    Parameters
    ----------
    followers, leaders : sequence of (n,) float
        Pairs, of one unit each; a sample of which any is NaN counts in no window.
    noises : sequence of (n,) float
        Standard deviation of each leader.
    step : float
        s, of the grid.
    window_s : float
        s, centred on the sample.

    Returns
    -------
    slope : (n,) float
        In the unit of the followers per that of the leaders.
    error : (n,) float
        What is left over, of which samples closer than ``CORRELATED_S`` count once, and the
        share of the slope that the noise of the leaders takes away.

    References
    ----------
    W. A. Fuller, Measurement Error Models (1987), section 1.1: noise of the leaders reduces the
    slope by the share that it has in their variance.

    Examples
    --------
    >>> turning = np.linspace(0, 12, 241)
    >>> air = [20 * np.cos(turning), 20 * np.sin(turning)]
    >>> ground = [1.2 * air[0] + 5.0, 1.2 * air[1] - 3.0]
    >>> value, error = slope(ground, air, [np.ones(241)] * 2, 0.25, 30.0)
    >>> round(float(value[120]), 3), round(float(error[120]), 3)
    (1.2, 0.006)
    """
    count = len(step_known := np.isfinite(np.sum([*followers, *leaders], axis=0)))
    half = max(1, round(window_s / (2 * step)))
    number = _windowed(step_known.astype(float), half)
    below, along, left, noise = (np.zeros(count) for _ in range(4))
    for follower, leader, own in zip(followers, leaders, noises, strict=True):
        y, x, variance = (np.where(step_known, part, 0.0) for part in (follower, leader, own**2))
        y, x = (part - part.sum() / max(1, step_known.sum()) * step_known for part in (y, x))
        mean_y, mean_x = _windowed(y, half) / number, _windowed(x, half) / number
        below += _windowed(x * x, half) / number - mean_x**2
        along += _windowed(x * y, half) / number - mean_x * mean_y
        left += _windowed(y * y, half) / number - mean_y**2
        noise += _windowed(np.nan_to_num(variance), half) / number
    enough = (number >= LEAST_KNOWN * (2 * half + 1)) & (below > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(enough, along / below, np.nan)
        apart = max(1.0, window_s / CORRELATED_S)
        scatter = np.maximum(left - value * along, 0.0) / below / apart
        error = np.hypot(np.sqrt(scatter), value * noise / below)
    return value, error


def _windowed(values: Floats, half: int) -> Floats:
    """Return the sum over the samples at most ``half`` away."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    places = np.arange(len(values))
    above = np.minimum(places + half + 1, len(values))
    sums: Floats = total[above] - total[np.maximum(places - half, 0)]
    return sums
