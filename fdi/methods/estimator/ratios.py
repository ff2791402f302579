"""How large are the test ratios, each against its own level in the flight?

In: cores, and when the flight is in the air. Out: by quantity a `Ratio`: its level, how far the
mean over 4 s rose above it, from when to when it stood beyond what healthy flights show, from when
to when measurements were rejected (above 1).

The level is the median over the first 20 s in the air and not below 0.02: what is smaller is
quantisation. A fault that is there from take-off is therefore part of the level. Ratios are read as
logged, none is computed from an innovation: the gate that divides them changes with what is fused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.records import Core
from fdi.methods.estimator.spans import Span, spans_of, within

Floats = NDArray[np.float64]

LEVEL_S: Final = 20.0
"""In the air, over which a ratio's own level is taken."""
LEAST_LEVEL: Final = 0.02
"""Two steps of what ArduPilot logs in hundredths: below, a level is quantisation."""
MEAN_S: Final = 4.0
"""Of the mean: over this, a single rejected measurement is no rise."""
HEALTHY: Final[Mapping[str, float]] = {
    "velocity": 1.9,
    "horizontal position": 3.1,
    "height": 2.0,
    "compass": 2.4,
    "airspeed": 3.5,
}
"""Largest mean over 4 s against the own level on more than 80 healthy flights (airspeed: gusts)."""
MARGIN: Final = 1.3
"""Above the healthy ones: with it none of those flights shows a rise."""
REJECTED: Final = 1.0
"""A root ratio above this is an innovation beyond its gate."""


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
    limit : float
        What ``excess`` does not reach on healthy flights.
    rises : tuple of (from, to), s
        In the air, where ``excess`` is above the limit.
    rejected : tuple of (from, to), s
        From arming to disarming, where the ratio is above 1.
    """

    quantity: str
    channel: str
    t: Floats
    value: Floats
    level: float | None
    excess: Floats
    limit: float
    rises: tuple[Span, ...]
    rejected: tuple[Span, ...]

    @property
    def peak(self) -> float | None:
        """The largest ratio, None where none is known."""
        return float(np.nanmax(self.value)) if np.isfinite(self.value).any() else None


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
    limit = HEALTHY[quantity] * MARGIN
    level = own_level(t, value, air)
    excess = np.full(t.size, np.nan) if level is None else trailing_mean(t, value, MEAN_S) / level
    in_air = (t >= air[0] + MEAN_S) & (t <= air[1])
    with np.errstate(invalid="ignore"):
        rises = spans_of(t, (excess > limit) & in_air)
        rejected = spans_of(t, (value > REJECTED))
    return Ratio(quantity, channel, t, value, level, excess, limit, rises, within(rejected, armed))


def own_level(t: Floats, value: Floats, air: Span) -> float | None:
    """Return the median over the first 20 s in the air, not below 0.02; None where unknown."""
    first = value[(t >= air[0]) & (t <= min(air[0] + LEVEL_S, air[1]))]
    first = first[np.isfinite(first)]
    return max(float(np.median(first)), LEAST_LEVEL) if first.size >= 3 else None


def trailing_mean(t: Floats, value: Floats, width: float) -> Floats:
    """Return at each record the mean of what is known of the last ``width`` s, NaN without any."""
    known = np.isfinite(value)
    total = np.concatenate(([0.0], np.cumsum(np.where(known, value, 0.0))))
    count = np.concatenate(([0], np.cumsum(known)))
    first = np.searchsorted(t, t - width, side="right")
    last = np.arange(1, t.size + 1)
    number = count[last] - count[first]
    mean = np.full(t.size, np.nan)
    np.divide(total[last] - total[first], number, out=mean, where=number > 0)
    return mean


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
