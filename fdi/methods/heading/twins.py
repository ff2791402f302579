"""Do the gyroscopes of two inertial units shake alike?

In: a log and one of its flights. Out: how much more they differ than at the beginning of the
flight, dB (20 log10: 12 dB are fourfold), at the first unit's records. It is a mean square, so that
noise without a mean shows as a bias does. Two units are never quite aligned, nor of one scale, nor
read at one moment: what that makes of a turn counts to the level.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.methods.estimator.ratios import LEVEL_S, trailing_mean
from fdi.telemetry import Log
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.message import Floats

FIRST: Final = "RAW_IMU"
SECOND: Final = "SCALED_IMU2"
AXES: Final = ("xgyro", "ygyro", "zgyro")
QUIET: Final = 2e-3
"""rad/s; telemetry tells rates in thousandths."""
ALIKE: Final = 0.02
"""Of a turn, by which two units may differ: scale and alignment (data sheets: 1 to 3 %)."""
LOOP_S: Final = 1 / 400
"""s; a loop of the autopilot, within which two units that are recorded together were read."""
LATE: Final = 0.2
"""Of the first unit's period within which the second one must be read."""


def twins_growth(log: Log, air: tuple[float, float]) -> tuple[Floats, Floats] | None:
    """Return times in the air, (n,) s, and the growth, (n,) dB; None without a second unit."""
    units = [log.messages.get(name) for name in (FIRST, SECOND)]
    if any(one is None or any(axis not in one for axis in AXES) for one in units):
        return None
    first, second = (one for one in units if one is not None)
    inside = (first.t >= air[0]) & (first.t <= air[1])
    t = first.t[inside]
    if t.size < 3 or len(second) < 3:
        return None
    own = np.array([first.si(axis)[inside] for axis in AXES])
    other = np.array([np.interp(t, second.t, second.si(axis)) for axis in AXES])
    after = np.clip(np.searchsorted(second.t, t), 1, len(second) - 1)
    late = np.minimum(np.abs(second.t[after] - t), np.abs(second.t[after - 1] - t))
    late[late > LATE * np.median(np.diff(t))] = np.nan
    start = t[0] + SETTLING_S
    begins = (t >= start) & (t < start + LEVEL_S) & np.isfinite(late)
    if not begins.any():
        return None
    off = own - other
    off = off - np.nanmedian(off[:, begins], axis=1)[:, None]
    square = np.where(np.isfinite(late), (off**2).sum(axis=0), np.nan)
    # what both show is a turn: one that shakes alone does not widen what it is allowed
    turn = np.minimum(np.abs(own), np.abs(other))
    steps = np.minimum(*(np.abs(np.diff(each, axis=1)) for each in (own, other))) / np.diff(t)
    faster = np.maximum(np.pad(steps, ((0, 0), (0, 1))), np.pad(steps, ((0, 0), (1, 0))))
    apart = np.nan_to_num(late) + LOOP_S
    allowed = ((ALIKE * turn) ** 2 + (faster * apart) ** 2).sum(axis=0)
    mean, turned = trailing_mean(t, square), trailing_mean(t, allowed)
    level = max(float(np.nanmedian(mean[begins])), QUIET**2)
    return t, 10.0 * np.log10(np.maximum(mean, (QUIET / 100) ** 2) / (level + turned))
