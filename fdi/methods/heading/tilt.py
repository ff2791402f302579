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
UPRIGHT: Final = np.radians(60.0)
"""Pitched further, an attitude that is off by a degree turns roll and heading by two and more."""


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


def turned_by(t: Floats, rates: Floats) -> Floats:
    """Return matrices, (n, 3, 3), from body axes to those of the first record, by gyroscopes.

    Mean rate of two records over the time between them, as a rotation vector; a product from record
    to record, hence a loop.
    """
    between = (rates[:, 1:] + rates[:, :-1]) / 2 * np.diff(t)
    size = np.linalg.norm(between, axis=0)
    scale = np.sinc(size / (2 * np.pi)) / 2
    steps = np.array([np.cos(size / 2), *(between * scale)]).T.tolist()
    found = np.empty((t.size, 4))
    w, x, y, z = found[0] = (1.0, 0.0, 0.0, 0.0)
    for i, (a, b, c, d) in enumerate(steps, 1):
        w, x, y, z = found[i] = (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        )
    w, x, y, z = (found / np.linalg.norm(found, axis=1, keepdims=True)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
