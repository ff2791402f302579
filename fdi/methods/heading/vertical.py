"""Do receiver, barometer and specific force climb alike?

In: a `Ride` and the ends of windows. Out: three `Pair`s of kind ``height``. What is compared is by
how much each bends within a window: height now, less twice that of half a window ago, plus that of
a window ago. For specific force that is an integral from rest to rest, so no speed has to be known
to begin with. A height that is off by a constant, or drifts at a constant rate, does not bend.

A deviation adds, as variances, how a receiver's height wanders, what a barometer is good for and
what speed makes it read, an accelerometer's bias, what lies between records, and a receiver's
delay.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.methods.heading.forces import BIAS, LEANS
from fdi.methods.heading.increments import WANDERS, WINDOW_S, Pair, bent, integral, pair_of
from fdi.methods.heading.motion import FIX_LATE_S, Fixes, Ride, gap_between
from fdi.methods.heading.tilt import G
from fdi.methods.setup.rotations import to_earth
from fdi.telemetry.message import Floats

HALF_S: Final = WINDOW_S / 2
STEEPER: Final = 2.0
"""Of a receiver's horizontal wandering: no satellite is below it (usual ratio of the dilutions)."""
BAROMETER: Final = 1.0  # m, as in the models
PRESSED: Final = 0.3
"""Share of the dynamic pressure that a static port may read (choice; half of it inside a shell)."""


def height_pairs(ride: Ride, grid: Floats) -> tuple[Pair, ...]:
    """Return receiver-barometer, receiver-force, barometer-force; none without a receiver."""
    if ride.fixes is None or ride.angles is None:
        return ()
    fixes = ride.fixes
    # at the last fix before the end of the window: nothing is taken from the one after
    at = np.maximum(np.searchsorted(fixes.t, grid, side="right") - 1, 0)
    when = fixes.t[at]
    gap = gap_between(fixes.t, when - WINDOW_S, when) | (grid - when > WINDOW_S)
    gap |= gap_between(ride.t, when - WINDOW_S, when)
    receiver, barometer = _bend(fixes.t, fixes.height, when), _bend(ride.t, ride.climbed, when)
    speed, height, missed = _by_force(ride)
    force = _bend(ride.t, height, when)
    for own in (receiver, force):
        own[gap] = np.nan
    sped = np.interp(when, ride.t, speed) - np.interp(when - WINDOW_S, ride.t, speed)
    by_receiver = np.sqrt((STEEPER * WANDERS) ** 2 * WINDOW_S + (FIX_LATE_S * sped) ** 2)
    by_barometer = np.hypot(BAROMETER, PRESSED * _bend(fixes.t, _thrown(fixes), when))
    lost = np.interp(when, ride.t, missed) - np.interp(when - WINDOW_S, ride.t, missed)
    # a velocity that walks at random bends the height by a triangle: a third of the square
    by_force = np.hypot(np.hypot(BIAS, LEANS * G) * HALF_S**2, np.sqrt(lost * HALF_S**2 / 3))
    return (
        pair_of(
            ride, grid, "fixes-barometer", receiver - barometer,
            np.hypot(by_receiver, by_barometer), "height",
        ),
        pair_of(
            ride, grid, "fixes-force", receiver - force,
            np.hypot(by_receiver, by_force), "height",
        ),
        pair_of(
            ride, grid, "barometer-force", barometer - force,
            np.hypot(by_barometer, by_force), "height",
        ),
    )  # fmt: skip


def _bend(t: Floats, height: Floats, when: Floats) -> Floats:
    """Return by how much a height, m, bends in the window before a time."""
    now, middle, then = (np.interp(when - back * HALF_S, t, height) for back in (0, 1, 2))
    return np.asarray(now - 2 * middle + then)


def _by_force(ride: Ride) -> tuple[Floats, Floats, Floats]:
    """Return speed and height upwards by specific force, m/s and m, and the variance missed."""
    assert ride.angles is not None
    turn = to_earth(*np.nan_to_num(ride.angles))
    pull = -np.einsum("nj,jn->n", turn[:, 2], ride.force) - G
    pull[~np.isfinite(ride.angles).all(axis=0)] = np.nan
    speed = integral(ride.t, pull)
    unknown = np.where(np.isfinite(pull), 0.0, np.nan)
    return speed, integral(ride.t, speed) + unknown, bent(ride.t, np.nan_to_num(pull))


def _thrown(fixes: Fixes) -> Floats:
    """Return the height, m, that a speed over ground is worth."""
    return np.asarray((fixes.north**2 + fixes.east**2) / (2 * G))
