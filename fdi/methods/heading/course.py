"""Does a vehicle on wings turn as its course does?

In: a `Ride` and the ends of windows. Out: `Pair`s of kind ``heading``: compass and gyroscope
against each other, and both against the direction of the receiver's velocity through the air. Wings
are flown straight into the air, so that nose and course turn alike; the wind is the same at both
ends of a window. With it the receiver is the third who knows the heading, and no estimator is in
it: one that follows a wrong gyroscope makes compass and receiver look wrong together.

The deviation adds, as variances, the receiver's velocity and a gust from the side at both ends,
what the receiver's latency makes of a turn, and what a wind that is known badly does to the
direction while the vehicle turns.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.methods.heading.increments import (
    STATED,
    Pair,
    Turn,
    around,
    change,
    turned_apart,
    turns,
)
from fdi.methods.heading.motion import FIX_LATE_S, Ride, gap_between
from fdi.methods.heading.sources import BREEZE, WIND
from fdi.methods.heading.tilt import angle_rates
from fdi.telemetry.message import Floats

COURSE_S: Final = 20.0
"""A gust disturbs a long window no more than a short one, and a gyroscope goes on drifting: as long
as positions are held against velocities (``gps_position_strays``). With 5 s drifts show later."""
GUST: Final = 0.7
"""m/s, one sigma of light turbulence: a tenth of a wind of 15 knots (MIL-F-8785C, 3.7.2)."""
SURE: Final = np.radians(20.0)
"""A course that is less certain at one of its ends tells no heading."""


def course_pairs(ride: Ride, grid: Floats) -> tuple[Pair, Pair, Pair] | None:
    """Return compass-gyroscope, compass-course, gyroscope-course over `COURSE_S`.

    None where the vehicle has no wings, or nothing tells a course.

    Parameters
    ----------
    ride : Ride
    grid : (m,) float
        Ends of windows, s.
    """
    if not ride.has_wings or ride.fixes is None or ride.angles is None:
        return None
    turned = {**turns(ride, grid, COURSE_S), "course": _course(ride, grid)}
    return (
        turned_apart(ride, grid, "compass-gyroscope", turned),
        turned_apart(ride, grid, "compass-course", turned),
        turned_apart(ride, grid, "gyroscope-course", turned),
    )


def _course(ride: Ride, grid: Floats) -> Turn:
    """Return how far the velocity through the air turned; NaN where it is too slow to tell."""
    assert ride.fixes is not None
    assert ride.angles is not None
    fixes, before = ride.fixes, grid - COURSE_S
    wind = np.zeros((2, fixes.t.size))
    if ride.wind is not None:
        wind = np.array([np.interp(fixes.t, ride.t, row) for row in ride.wind])
    north, east = fixes.north - wind[0], fixes.east - wind[1]
    direction = np.unwrap(np.arctan2(east, north))
    by = change(fixes.t, direction, grid, before)
    by[gap_between(fixes.t, before, grid)] = np.nan
    through = np.maximum(np.hypot(north, east), 1e-3)
    speeds = [np.interp(when, fixes.t, through) for when in (grid, before)]
    own = [np.hypot(STATED["doppler"], GUST) / speed for speed in speeds]
    by[np.maximum(*own) > SURE] = np.nan
    late = FIX_LATE_S * np.abs(angle_rates(ride.angles[0], ride.angles[1], ride.rates)[2])
    ends = [around(ride, np.nan_to_num(late), when) for when in (grid, before)]
    blown = (WIND if ride.wind is not None else BREEZE) / np.minimum(*speeds)
    swing = 2 * blown * np.abs(np.sin(np.nan_to_num(by) / 2))
    return Turn(by, np.sqrt(sum(one**2 for one in (*own, *ends, swing))))
