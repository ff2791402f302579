"""Does the vehicle shake more than its estimator bears, from the beginning on?

In: a log. Out: one `Check`, none where the autopilot records no level. The levels are its own:
ArduPilot's ``VIBE`` of each axis, PX4's ``accel_vibration_metric`` of all (since 1.12, in m/s^2).
What they may be is what those who made them say: ArduPilot's wiki calls up to 30 m/s^2 acceptable
and 60 nearly always bad for height and position ("Measuring Vibration"), PX4's Flight Review draws
green up to 4.9 and red from 9.8. An accelerometer that clips reads less than there is: none should.

That it has grown in flight is for the tests of the model.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.setup.interval import by_parts, in_words, numbers_of
from fdi.methods.setup.records import Series, series, spins, stretches, within
from fdi.methods.setup.values import Check, Verdict
from fdi.telemetry import Log

NAME: Final = "vibration"
_AXES: Final = {
    "vibration_x": "along the nose",
    "vibration_y": "to the side",
    "vibration_z": "up and down",
}
_CLIPS: Final = tuple(f"clipping_{number}" for number in range(3))
_FEW: Final = 10  # records in the air


class _Bounds(NamedTuple):
    """m/s^2: up to ``fine`` nothing is said, from ``bad`` on it is."""

    fine: float
    bad: float
    who: str


_ARDUPILOT: Final = _Bounds(30.0, 60.0, "ArduPilot calls up to 30 acceptable, 60 nearly always bad")
_PX4: Final = _Bounds(4.9, 9.8, "PX4's Flight Review calls up to 4.9 fine, from 9.8 on bad")


def check_vibration(log: Log) -> Iterator[Check]:
    """Yield how much the vehicle shakes in the air."""
    levels = [
        (where, found)
        for field, where in _AXES.items()
        if (found := series(log, "VIBRATION", (field,), in_units=True)) is not None
    ]
    own = series(log, "vehicle_imu_status", ("accel_vibration_metric", "accel_raw_rate_hz"))
    if own is not None:
        levels, bounds = [("on all axes together", own)], _PX4
    elif levels and log.autopilot == "ardupilot":
        bounds = _ARDUPILOT
    else:
        return
    told = [(where, rows) for where, found in levels if (rows := _in_flight(log, found)).size]
    if not told:
        yield Check(NAME, "not known", "the log holds too few levels in flight")
        return
    where, rows = max(told, key=lambda one: float(np.median(one[1])))
    usual = by_parts(lambda some: float(np.median(rows[some])), rows.size, 0.0)
    most = float(rows.max())
    clips = _clipped(log)
    words = (
        f"{in_words(usual, ' m/s2', digits=1)} {where} in the median, {most:.0f} at most; "
        f"{bounds.who}"
    )
    if clips:
        words += f"; accelerometers clipped {clips} times in the air"
    numbers = {**numbers_of("level_m_s2", usual), "most_m_s2": most, "clipped": float(clips)}
    verdict: Verdict = "not known"
    if usual.least > bounds.bad:
        verdict = "wrong"
    elif usual.most < bounds.fine and not clips:
        verdict = "in order"
    yield Check(NAME, verdict, words, numbers, strikes=usual.value > bounds.fine)


def _in_flight(log: Log, found: Series) -> np.ndarray:
    """Return the levels, (n,), while it flies as it should."""
    flies = _flies(log, found)
    return found.values[0][flies] if flies.sum() >= _FEW else np.empty(0)


def _flies(log: Log, found: Series) -> np.ndarray:
    return within(found.t, stretches(log)) & ~spins(log, found.t)


def _clipped(log: Log) -> int:
    """Return how often accelerometers clipped while it flew as it should, all units together."""
    count = 0.0
    for field in _CLIPS:
        found = series(log, "VIBRATION", (field,))
        if found is None:
            continue
        more = np.diff(found.values[0], prepend=found.values[0][:1])
        count += float(more[_flies(log, found) & (more > 0)].sum())
    return int(count)
