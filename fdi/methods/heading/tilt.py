"""How does a vehicle lean, by its accelerometers and by its gyroscopes?

Body axes are forward, right, down; what an accelerometer reads is specific force, at rest and level
(0, 0, -g). Roll and pitch are rad. Accelerometers do not see the heading: there is no yaw here.

The trap for a maintainer: body rates are not the rates of roll and pitch (`angle_rates`), and at
rest alone is the specific force the vertical. A multicopter's is its thrust, whatever the tilt.
"""

from __future__ import annotations

from math import cos, sin, tan
from typing import Final

import numpy as np

from fdi.telemetry.message import Floats

G: Final = 9.80665
_STEEP: Final = np.radians(85.0)
"""Beyond, roll is no longer told from heading: the tangent of the pitch is held."""


def accelerometer_tilt(force: Floats) -> tuple[Floats, Floats]:
    """Return roll and pitch, (n,) each, by specific force (3, n), m/s2."""
    x, y, z = force
    return np.arctan2(-y, -z), np.arctan2(x, np.hypot(y, z))


def angle_rates(roll: Floats, pitch: Floats, rates: Floats) -> Floats:
    """Return how fast roll, pitch and heading change, (3, n) rad/s, by body rates (3, n)."""
    p, q, r = rates
    about = q * np.sin(roll) + r * np.cos(roll)
    held = np.clip(pitch, -_STEEP, _STEEP)
    return np.array(
        [p + about * np.tan(held), q * np.cos(roll) - r * np.sin(roll), about / np.cos(held)]
    )


def complementary(t: Floats, rates: Floats, roll: Floats, pitch: Floats, k: Floats) -> Floats:
    """Return roll and pitch, (2, n), by gyroscopes that accelerometers hold.

    ``angle = k (angle before + mean rate * dt) + (1 - k) angle by accelerometer``, from the first
    accelerometer angle on.

    Parameters
    ----------
    t : (n,) float
        s.
    rates : (3, n) float
        Body rates, rad/s.
    roll, pitch : (n,) float
        By accelerometer; where one is NaN the gyroscope goes on alone.
    k : (n,) float
        How far the gyroscope is believed, 0 to 1; ``exp(-dt / tau)`` for a time constant.

    Notes
    -----
    Non-linear from sample to sample, hence a loop: 2 us each.
    """
    own = np.where(np.isfinite(roll) & np.isfinite(pitch), k, 1.0).tolist()
    seen = np.nan_to_num(np.array([roll, pitch])).T.tolist()
    dt = np.diff(t, prepend=t[:1]).tolist()
    body = rates.T.tolist()
    found = np.empty((t.size, 2))
    angles = _first(roll, pitch)
    for i, (share, (by_roll, by_pitch), step) in enumerate(zip(own, seen, dt, strict=True)):
        if i:
            before, now = _change(*angles, *body[i - 1]), _change(*angles, *body[i])
            moved = [a + (b + c) / 2 * step for a, b, c in zip(angles, before, now, strict=True)]
            angles = (
                share * moved[0] + (1 - share) * by_roll,
                share * moved[1] + (1 - share) * by_pitch,
            )
        found[i] = angles
    return found.T


def _first(roll: Floats, pitch: Floats) -> tuple[float, float]:
    known = np.flatnonzero(np.isfinite(roll) & np.isfinite(pitch))
    return (float(roll[known[0]]), float(pitch[known[0]])) if known.size else (0.0, 0.0)


def _change(roll: float, pitch: float, p: float, q: float, r: float) -> tuple[float, float]:
    """Return what `angle_rates` does for one sample: thirty times faster than arrays of one."""
    held = min(max(pitch, -float(_STEEP)), float(_STEEP))
    return (
        p + (q * sin(roll) + r * cos(roll)) * tan(held),
        q * cos(roll) - r * sin(roll),
    )
