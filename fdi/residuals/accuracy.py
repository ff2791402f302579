"""How accurate does a sensor say that it is, and how far is it believed?

In: the accuracy that a channel's own message reports, sample by sample, and the one that the model
states. Out: the standard deviation that counts. The reported one counts where it is the worse one,
within bounds. It does not lower the stated one: a receiver tells what it knows of its own noise,
but not what is alike for minutes (the ionosphere, reflections), nor what the relation leaves out; a
real flight is known whose altitude is 8 m off for a minute while 2 m are reported. It does not rise
without end: a sensor that fails often says so, and its own word must not excuse it. What it says at
the beginning of the flight is taken, and may grow by a factor; a limit of the model names the
sensor that says itself that it is bad.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.model.evaluate import Floats
from fdi.model.system import System
from fdi.telemetry import Channel, Signals

MOST: Final = 4.0
"""Of the stated accuracy, at the beginning: as far as the calm part may widen a spread."""
WORSE: Final = 2.0
"""By so much an accuracy may grow against the beginning."""


BEGINNING_S: Final = 20.0
"""The beginning of a flight: so many seconds in the air."""


@dataclass(frozen=True, slots=True)
class Told:
    """What a channel's accuracy came to over a flight, in the unit of its variable.

    Attributes
    ----------
    stated : float
        By the model.
    reported : float
        By the log, the median in the air.
    used : float
        The median of what counts.
    worst : float
        The largest that was reported in the air.
    bounded : float
        Share of the samples at which more is reported than counts.
    """

    channel: Channel
    unit: str
    stated: float
    reported: float
    used: float
    worst: float
    bounded: float


def believed(reported: Floats, stated: float, beginning: slice) -> Floats:
    """Return the accuracy that counts, sample by sample.

    Parameters
    ----------
    reported : (n,) float
        NaN where the log has none.
    stated : float
    beginning : slice
        The first seconds in the air.

    Examples
    --------
    >>> believed(np.array([0.2, 1.0, 9.0, np.nan]), 1.0, slice(1, 2)).tolist()
    [1.0, 1.0, 2.0, 1.0]
    """
    calm = reported[beginning]
    calm = calm[np.isfinite(calm)]
    level = float(np.median(calm)) if len(calm) else stated
    level = min(max(level, stated), MOST * stated)
    kept = np.clip(reported, stated, WORSE * level)
    return np.where(np.isfinite(reported), kept, stated)


def beginning_of(signals: Signals) -> slice:
    """Return the samples of the first seconds in the air."""
    first = int(np.argmax(signals.state.airborne)) if len(signals.t) else 0
    return slice(first, first + max(1, round(BEGINNING_S * signals.rate_hz)))


def reported_accuracies(system: System, signals: Signals) -> tuple[Told, ...]:
    """Return what the accuracies that the log reports came to in the air, channel by channel.

    Of a log that never flies, all along.
    """
    flying = np.asarray(signals.state.airborne, dtype=bool)
    flying = flying if flying.any() else np.ones(len(signals.t), dtype=bool)
    result = []
    for measurement in (equation.measurement for equation in system.equations):
        if measurement is None or measurement.accuracy is None or not measurement.tells_itself:
            continue
        reported = signals.accuracy.get(measurement.channel)
        if reported is None or not np.isfinite(reported[flying]).any():
            continue
        own = reported[flying]
        known = np.isfinite(own)
        stated = measurement.accuracy
        used = believed(reported, stated, beginning_of(signals))[flying][known]
        result.append(
            Told(
                measurement.channel,
                system.variables[measurement.variable].unit,
                stated,
                float(np.median(own[known])),
                float(np.median(used)),
                float(own[known].max()),
                float((own[known] > used).mean()),
            )
        )
    return tuple(result)
