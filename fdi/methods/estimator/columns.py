"""Whom do the complaints of the autopilot's own estimator point to?

In: a log with the estimator's test ratios (``EKF_STATUS_REPORT``, the same in all formats: how far
a measurement is from what the filter expected, as a share of what it accepts). Out: `Columns` of
two kinds, in decibels (20 log10 of a factor: 12 dB are fourfold; what a filter complains of spreads
by factors). The growth of each ratio: its mean over a few seconds over its own level at the
beginning of the flight. And contrasts between them, because the filter is a set of equations, and
which of its parts complain is a signature:

- a receiver that is wrong in position shows there, and not in velocity; a wrong accelerometer is
  integrated once before it is a wrong velocity and twice before it is a wrong position;
- a wrong gyroscope turns the attitude: heading and, by the tilted gravity, velocity complain within
  seconds, while a wrong compass or accelerometer takes much longer to spoil the other one;
- a compass or a barometer that is wrong by itself moves its own ratio only.

A contrast is a growth less the largest of those that must be quiet, so that a fault which raises
both does not move it; what two begin to complain of together is the smaller of their growths, less
what either had before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fdi.methods.columns import Columns, Method
from fdi.methods.estimator.ratios import MOST_LEVEL, own_level, trailing_mean
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air
from fdi.telemetry.message import Floats, Message

SOURCE: Final = "EKF_STATUS_REPORT"
RATIOS: Final[Mapping[str, str]] = {
    "velocity": "velocity_variance",
    "position": "pos_horiz_variance",
    "height": "pos_vert_variance",
    "compass": "compass_variance",
}
"""By what they test; MAVLink calls them variances, and they are roots of test ratios."""
STILL: Final = 1e-3
"""Of what is accepted; a mean below counts as this."""
TOGETHER_S: Final = 10.0
"""What two complain of within this time they complain of together: several times that of a mean."""
UNIT: Final = "dB"


def estimator_columns(log: Log) -> Columns | str:
    """Return the estimator's complaints over a log, or why there are none."""
    if SOURCE not in log:
        return "the log has no test ratios of the autopilot's estimator"
    message = log[SOURCE]
    growth = {name: _growth(log, message, field) for name, field in RATIOS.items()}
    if not any(np.isfinite(own).any() for own in growth.values()):
        return "no test ratio of the autopilot's estimator is known and above 0 in a flight"
    ratios = {f"{name}_ratio": own for name, own in growth.items()}
    values = ratios | _contrasts(message.t, growth)
    return Columns(message.t, values, SOURCE, dict.fromkeys(values, UNIT))


ESTIMATOR: Final = Method("estimator", estimator_columns)


def _growth(log: Log, message: Message, field: str) -> Floats:
    """Return a ratio's mean over its level in that flight, dB; NaN on the ground."""
    result = np.full(len(message), np.nan)
    if field not in message:
        return result
    t, ratio = message.t, message.si(field)
    mean = trailing_mean(t, ratio)
    for flight in log.flights:
        air = in_air(flight)
        flying = (t >= air[0]) & (t <= air[1])
        # where the beginning tells no level, only what is rejected has grown
        level = own_level(t, ratio, air) or MOST_LEVEL
        # a ratio that is zero throughout belongs to a sensor that the filter does not use
        if np.nanmax(ratio[flying], initial=0.0) > 0:
            result[flying] = 20.0 * np.log10(np.maximum(mean[flying], STILL) / level)
    return result


def _contrasts(t: Floats, growth: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return how much more some parts of the filter complain than others do, dB."""

    def without(name: str, *quiet: str) -> Floats:
        return growth[name] - _largest([growth[other] for other in quiet])

    before = np.searchsorted(t, t - TOGETHER_S, side="right") - 1
    both = [growth[name] for name in ("velocity", "compass")]
    earlier = [np.where(before >= 0, own[before], np.nan) for own in both]
    return {
        "position_without_velocity": without("position", "velocity"),
        "height_without_velocity": without("height", "velocity"),
        "compass_without_motion": without("compass", "velocity", "position"),
        "velocity_with_compass": np.minimum(*both) - _largest(earlier),
    }


def _largest(growths: Sequence[Floats]) -> Floats:
    """Return the largest growth; what is unknown or below its level is no more than quiet."""
    found: Floats = np.max([np.maximum(np.nan_to_num(own), 0.0) for own in growths], axis=0)
    return found
