"""Whom do the complaints of the autopilot's own estimator point to?

In: a log with the estimator's test ratios (``EKF_STATUS_REPORT``, the same in all formats: how far
a measurement is from what the filter expected, as a share of what it accepts). Out: `Columns` of
two kinds, in decibels (20 log10 of a factor: 12 dB are fourfold; what a filter complains of spreads
by factors). The growth of each ratio: its mean over a few seconds over its own level at the
beginning of the flight. And contrasts between them, because the filter is a set of equations, and
which of its parts complain is a signature:

- a receiver that is wrong in position shows there, and not in velocity; a wrong accelerometer is
  integrated once before it is a wrong velocity and twice before it is a wrong position;
- a wrong gyroscope turns the attitude: heading and, by the tilted gravity, velocity both complain;
- a compass or a barometer that is wrong by itself moves its own ratio only.

A contrast is a growth less the largest of those that must be quiet, so that a fault which raises
both does not move it; what two complain of in common is the smaller of their growths.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from fdi.methods.columns import Columns, Method
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air
from fdi.telemetry.message import Floats, Message
from fdi.windows import sums_between

SOURCE: Final = "EKF_STATUS_REPORT"
RATIOS: Final[Mapping[str, str]] = {
    "velocity": "velocity_variance",
    "position": "pos_horiz_variance",
    "height": "pos_vert_variance",
    "compass": "compass_variance",
}
"""By what they test; MAVLink calls them variances, and they are roots of test ratios."""
MEAN_S: Final = 4.0
"""A mean over so long: several records where they come once a second."""
LEVEL_S: Final = 20.0
"""Its level is the median of so long after take-off: what the decision takes constants from."""
LEAST_RECORDS: Final = 4
"""Fewer tell no level."""
FLOOR: Final = 0.05
"""Of what is accepted; a level below is as good as none, and a growth over it says little."""
STILL: Final = 1e-3
"""Of what is accepted; a mean below counts as this."""
UNIT: Final = "dB"


def estimator_columns(log: Log) -> Columns | str:
    """Return the estimator's complaints over a log, or why there are none."""
    if SOURCE not in log:
        return "the log has no test ratios of the autopilot's estimator"
    message = log[SOURCE]
    growth = {name: _growth(log, message, field) for name, field in RATIOS.items()}
    if not any(np.isfinite(own).any() for own in growth.values()):
        return "no test ratio of the autopilot's estimator is known and moves in the air"
    ratios = {f"{name}_ratio": own for name, own in growth.items()}
    values = ratios | _contrasts(growth)
    return Columns(message.t, values, SOURCE, dict.fromkeys(values, UNIT))


ESTIMATOR: Final = Method("estimator", estimator_columns)


def _growth(log: Log, message: Message, field: str) -> Floats:
    """Return a ratio's mean over its level in that flight, dB; NaN on the ground."""
    result = np.full(len(message), np.nan)
    if field not in message:
        return result
    t, ratio = message.t, message.si(field)
    mean = _trailing_mean(t, ratio)
    for flight in log.flights:
        start, end = in_air(flight)
        flying = (t >= start) & (t <= end)
        known = ratio[flying & (t <= start + LEVEL_S)]
        known = known[np.isfinite(known)]
        # a ratio that is zero throughout belongs to a sensor that the filter does not use
        if len(known) >= LEAST_RECORDS and np.nanmax(ratio[flying]) > 0:
            level = max(float(np.median(known)), FLOOR)
            result[flying] = 20.0 * np.log10(np.maximum(mean[flying], STILL) / level)
    return result


def _trailing_mean(t: Floats, values: Floats) -> Floats:
    """Return the mean of the known values of the last `MEAN_S` at every record."""
    first = np.searchsorted(t, t - MEAN_S, side="right")
    last = np.arange(1, len(t) + 1)
    known = np.isfinite(values)
    total = sums_between(np.where(known, values, 0.0), first, last)
    number = sums_between(known.astype(float), first, last)
    return np.where(number > 0, total / np.maximum(number, 1.0), np.nan)


def _contrasts(growth: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return how much more some parts of the filter complain than others do."""

    def without(name: str, *quiet: str) -> Floats:
        # what is unknown or below its level is no more than quiet
        others = [np.maximum(np.nan_to_num(growth[other]), 0.0) for other in quiet]
        own: Floats = growth[name] - np.max(others, axis=0)
        return own

    return {
        "position_without_velocity": without("position", "velocity"),
        "height_without_velocity": without("height", "velocity"),
        "compass_without_motion": without("compass", "velocity", "position"),
        "velocity_with_compass": np.minimum(growth["velocity"], growth["compass"]),
    }
