"""Do the accelerometers feel what the receiver's velocity does?

In: a `Ride` and the ends of windows. Out: a `Pair` of kind ``velocity``: specific force, turned
into earth axes by the estimator's attitude and integrated over a window with gravity, less the
change of the receiver's velocity in it; horizontal, m/s.

An accelerometer that is wrong shows in it by itself until the estimator leans to make it fit, and
then whenever the vehicle turns; a gyroscope that is wrong leans and turns the estimator; a compass
that is wrong turns it; a receiver whose velocity is wrong is the other side. What neither compass
nor gyroscope can make is told apart (`beyond_turns`): an estimator that heads elsewhere turns a
change of velocity and leaves its length, and how far it leans wrongly the field tells, which
gyroscopes turned elsewhere.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.methods.heading.increments import (
    STATED,
    WINDOW_S,
    Pair,
    around,
    bent,
    change,
    integral,
    pair_of,
)
from fdi.methods.heading.motion import FIX_LATE_S, Ride, gap_between
from fdi.methods.heading.tilt import G
from fdi.methods.setup.rotations import to_earth
from fdi.telemetry.message import Floats

BIAS: Final = 0.1
"""m/s2, of a calibrated accelerometer, one sigma."""
LEANS: Final = np.radians(0.5)
"""Of an estimator's tilt, one sigma."""


def force_pair(ride: Ride, grid: Floats, *, any_heading: bool = False) -> Pair | None:
    """Return specific force against the receiver's velocity; None where one of them is absent.

    Parameters
    ----------
    ride : Ride
    grid : (m,) float
        Ends of windows, s.
    any_heading : bool
        Whether only the lengths of the two changes are compared, as the estimator's heading turns
        both components alike.

    Notes
    -----
    The deviation adds, as variances, bias and tilt over the window, the receiver's velocity at both
    ends and its latency, and what lies between records (`bent`).
    """
    if ride.fixes is None or ride.angles is None:
        return None
    t, fixes, before = ride.t, ride.fixes, grid - WINDOW_S
    known = np.isfinite(ride.angles).all(axis=0)
    angles = np.where(known, ride.angles, 0.0)
    felt = np.einsum("nij,jn->in", to_earth(*angles), ride.force)[:2]
    sped = [change(t, integral(t, own), grid, before) for own in felt]
    moved = [change(fixes.t, own, grid, before) for own in (fixes.north, fixes.east)]
    apart = np.hypot(sped[0] - moved[0], sped[1] - moved[1])
    if any_heading:
        apart = np.abs(np.hypot(*sped) - np.hypot(*moved))
    lost = change(t, np.cumsum(~known), grid, before) > 0
    gap = gap_between(t, before, grid) | gap_between(fixes.t, before, grid)
    apart[lost | gap] = np.nan
    missed = change(t, np.sum([bent(t, own) for own in felt], axis=0), grid, before)
    late = FIX_LATE_S * np.hypot(*felt)
    sigma = np.sqrt(
        ((LEANS * G) ** 2 + BIAS**2) * WINDOW_S**2
        + 2 * STATED["doppler"] ** 2
        + np.maximum(missed, 0.0)
        + around(ride, late, grid) ** 2
        + around(ride, late, before) ** 2
        + change(t, _bent(ride), grid, before)
    )
    return pair_of(ride, grid, "accelerometer-receiver", apart, sigma, "velocity")


def beyond_turns(forces: Pair, turned: Pair) -> Pair:
    """Return what of a pair of velocities is more than a wrong lean makes of gravity.

    Parameters
    ----------
    forces : Pair
        At any heading.
    turned : Pair
        The angle by which the field misses where gyroscopes turned it; unknown takes nothing off.
    """
    made = G * WINDOW_S * np.nan_to_num(np.abs(turned.off))
    left = np.maximum(forces.off - made, 0.0)
    return Pair(forces.name, forces.kind, left, forces.sigma)


def _bent(ride: Ride) -> Floats:
    """Return the running variance, (m/s)2, by attitudes on the line between two recorded ones."""
    faster = np.abs(np.gradient(ride.rates[:2], ride.t, axis=1)).max(axis=0)
    off = faster * (ride.period + 2 * ride.coarse) ** 2 / 8
    return np.asarray(np.cumsum((off * G * ride.period) ** 2))
