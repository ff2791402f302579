"""What heading do a compass, a course over ground and a camera give?

Angles are rad, clockwise from true north.
"""

from __future__ import annotations

import numpy as np

from fdi.methods.heading.geodesy import Angle, wrap
from fdi.methods.setup.rotations import to_earth
from fdi.telemetry.message import Floats


def levelled(field: Floats, roll: Floats, pitch: Floats) -> Floats:
    """Return a field (3, n) turned into the level frame: ahead, to the right, down."""
    turn = to_earth(roll, pitch, np.zeros_like(roll))
    return np.asarray(np.einsum("nij,jn->in", turn, field))


def compass_heading(field: Floats, roll: Floats, pitch: Floats, declination: float) -> Floats:
    """Return the true heading, (n,), by a compass in body axes (3, n); the unit cancels."""
    ahead, right, _ = levelled(field, roll, pitch)
    return wrap(np.arctan2(-right, ahead) + declination)


def heading_of_course(
    north: Angle, east: Angle, wind_north: Angle, wind_east: Angle, sideslip: Angle
) -> Floats:
    """Return where the nose points, by velocity over ground and of the air, m/s.

    ``sideslip`` is positive where the air comes from the right.
    """
    through = np.arctan2(np.asarray(east) - wind_east, np.asarray(north) - wind_north)
    return wrap(through - sideslip)


def image_rotation(before: Floats, after: Floats) -> float:
    """Return by how much the line through two points, (2, 2) x and y, turned in a picture.

    A camera that looks down, x to the right and y down, turned by the negative of it.
    """
    lines = [points[1] - points[0] for points in (np.asarray(before), np.asarray(after))]
    one, other = (np.arctan2(line[1], line[0]) for line in lines)
    return float(wrap(other - one))
