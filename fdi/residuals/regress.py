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
from numpy.typing import NDArray

from fdi.model.evaluate import Floats
from fdi.windows import centred_sum

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
        What is left over, of which samples closer than ``CORRELATED_S`` count once, and what the
        noise of the leaders takes from the slope; infinite where they show nothing but noise.

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
    known = np.isfinite(np.sum([*followers, *leaders], axis=0))
    half = max(1, round(window_s / (2 * step)))
    number = centred_sum(known.astype(float), half)
    enough = number >= LEAST_KNOWN * (2 * half + 1)
    share = np.divide(1.0, number, where=enough, out=np.full(len(known), np.nan))
    leading, common, following, noise = (np.zeros(len(known)) for _ in range(4))
    for follower, leader, own in zip(followers, leaders, noises, strict=True):
        y, x = _centred(follower, known), _centred(leader, known)
        mean_y, mean_x = share * centred_sum(y, half), share * centred_sum(x, half)
        leading += share * centred_sum(x * x, half) - mean_x**2
        common += share * centred_sum(x * y, half) - mean_x * mean_y
        following += share * centred_sum(y * y, half) - mean_y**2
        noise += share * centred_sum(np.where(known, own**2, 0.0), half)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(leading > 0, common / leading, np.nan)
        left = np.maximum(following - value * common, 0.0)
        scatter = np.sqrt(left / leading / max(1.0, window_s / CORRELATED_S))
        lost = value * noise / np.maximum(leading - noise, 0.0)
        return value, np.hypot(scatter, lost)


def _centred(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """Return the known samples about their median, so that sums of squares stay exact, else 0."""
    middle = np.median(values[known]) if known.any() else 0.0
    return np.where(known, values - middle, 0.0)
