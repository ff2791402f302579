"""How large are the test ratios, each against its own level in the flight?

In: cores, and when the flight is in the air. Out: by quantity a `Ratio`: its level, how far the
mean over 4 s rose above it, from when to when it stood beyond what healthy flights show, from when
to when measurements were rejected (above 1).

The level is the median over the first 20 s in the air, not below 0.05 of the gate and not above a
quarter: a small fault that is there from take-off is therefore part of it. Ratios are read as
logged, none is computed from an innovation: the gate that divides them changes with what is fused.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.records import Core
from fdi.methods.estimator.spans import Span, largest, spans_of, within
from fdi.windows import sums_between

Floats = NDArray[np.float64]

LEVEL_S: Final = 20.0
"""In the air, over which a ratio's own level is taken."""
LEAST_RECORDS: Final = 4
"""Of these 20 s; fewer tell no level."""
LEAST_LEVEL: Final = 0.05
"""Of the gate; a level below is as good as none, and a growth over it says little."""
_TIE_S: Final = 1e-6
"""A record of just so long ago is out, however its time was rounded."""
MEAN_S: Final = 4.0
"""Of the mean: over this, a single rejected measurement is no rise."""
GROWN: Final = 4.0
"""Times its own level is a rise: chosen, and the same as ``growth_most``, 12 dB, of the model
``shared/estimator.yaml``. Of 105 flights without a fault one compass goes beyond, all but the
compass of one that ends in a fall, and the airspeed of three in gusts."""
REJECTED: Final = 1.0
"""A root ratio above this is an innovation beyond its gate."""
MOST_LEVEL: Final = REJECTED / GROWN
"""Of the gate; where the beginning of a flight is beyond, something is wrong already, and what is
rejected has always grown."""


@dataclass(frozen=True, slots=True, eq=False)
class Ratio:
    """One quantity's test ratio in the flight.

    Attributes
    ----------
    quantity, channel : str
    t, value : (n,) float
        s; root of the test ratio, NaN unknown or not used.
    level : float or None
        Its own level; None where too little is known of the first 20 s in the air.
    excess : (n,) float
        Mean over 4 s against the level, NaN unknown.
    peak : float or None
        The largest ratio from arming to disarming.
    peak_excess : float or None
        The largest ``excess`` in the air, from 4 s after take-off on.
    rises : tuple of (from, to), s
        In the air, where ``excess`` is above `GROWN`.
    rejected : tuple of (from, to), s
        From arming to disarming, where the ratio is above 1.
    """

    quantity: str
    channel: str
    t: Floats
    value: Floats
    level: float | None
    excess: Floats
    peak: float | None
    peak_excess: float | None
    rises: tuple[Span, ...]
    rejected: tuple[Span, ...]


def ratios_of(core: Core, air: Span, armed: Span) -> tuple[Ratio, ...]:
    """Return the ratios of a core.

    Parameters
    ----------
    core : Core
    air, armed : (from, to), s
        In the air; from arming to disarming.
    """
    return tuple(
        _ratio(quantity, core.channels[quantity], core.t, value, air, armed)
        for quantity, value in core.ratios.items()
    )


def _ratio(quantity: str, channel: str, t: Floats, value: Floats, air: Span, armed: Span) -> Ratio:
    level = own_level(t, value, air)
    excess = np.full(t.size, np.nan) if level is None else trailing_mean(t, value) / level
    judged = air[0] + MEAN_S, air[1]
    in_air = (t >= judged[0]) & (t <= judged[1])
    with np.errstate(invalid="ignore"):
        rises = spans_of(t, (excess > GROWN) & in_air)
        rejected = spans_of(t, (value > REJECTED))
    return Ratio(
        quantity,
        channel,
        t,
        value,
        level,
        excess,
        largest(t, value, armed),
        largest(t, excess, judged),
        rises,
        within(rejected, armed),
    )


def own_level(t: Floats, value: Floats, air: Span) -> float | None:
    """Return the median over the first 20 s in the air, 0.05 to 0.25; None where unknown."""
    first = value[(t >= air[0]) & (t <= min(air[0] + LEVEL_S, air[1]))]
    first = first[np.isfinite(first)]
    if first.size < LEAST_RECORDS:
        return None
    return float(np.clip(np.median(first), LEAST_LEVEL, MOST_LEVEL))


def trailing_mean(t: Floats, value: Floats) -> Floats:
    """Return at each record the mean of what is known of the last 4 s, NaN without any."""
    first = np.searchsorted(t, t - MEAN_S + _TIE_S, side="right")
    last = np.arange(1, t.size + 1)
    known = np.isfinite(value)
    total = sums_between(np.where(known, value, 0.0), first, last)
    number = sums_between(known.astype(np.float64), first, last)
    return np.where(number > 0, total / np.maximum(number, 1.0), np.nan)


def combined_ratio(velocity: Floats, position: Floats, height: Floats, *, squared: bool) -> Floats:
    """Return what the autopilot's selector compares cores by.

    Parameters
    ----------
    velocity, position, height : (n,) float
        Root ratios as logged.
    squared : bool
        ArduPilot's EKF3: max((v^2 + p^2)/2, h^2). Otherwise PX4's: max((v + p)/2, h), where a ratio
        that is not finite, or not above 0, counts as 1.
    """
    ratios = np.array([velocity, position, height], np.float64)
    if squared:
        ratios = ratios * ratios
    else:
        with np.errstate(invalid="ignore"):
            ratios[~(np.isfinite(ratios) & (ratios > 0.0))] = 1.0
    made: Floats = np.maximum(0.5 * (ratios[0] + ratios[1]), ratios[2])
    return made
