"""How can a sensor be turned against the vehicle, and how is an attitude a matrix?

In: angles. Out: rotation matrices from body (forward, right, down) to north, east, down; MAVLink's
``MAV_SENSOR_ORIENTATION`` (the ``ROTATION`` of ArduPilot's and PX4's parameters) as matrices that
take a reading from the sensor's axes to the vehicle's. The table is the dialect's own; its custom
entry has no angles.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from fdi.telemetry.dialect import orientation_names
from fdi.telemetry.message import Floats

_ANGLE: Final = re.compile(r"(ROLL|PITCH|YAW)_(\d+)")


class Rotation(NamedTuple):
    """``name`` as in MAVLink (``ROLL_180_YAW_90``, ``NONE``), ``matrix`` (3, 3) sensor to body."""

    name: str
    matrix: Floats


def to_earth(roll: Floats, pitch: Floats, yaw: Floats) -> Floats:
    """Return matrices, (n, 3, 3), that take body axes to north, east, down.

    Examples
    --------
    >>> to_earth(0.0, 0.0, np.pi / 2)[:, 0].round(9) + 0.0
    array([0., 1., 0.])
    """
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return np.moveaxis(
        np.array([[np.asarray(x, float) for x in row] for row in rows]), (0, 1), (-2, -1)
    )


@cache
def sensor_rotations() -> tuple[Rotation, ...]:
    """Return all orientations that MAVLink knows, not turned first, each once."""
    found: list[Rotation] = []
    for number, matrix in rotation_numbers().items():
        if not any(np.allclose(matrix, known.matrix, atol=1e-9) for known in found):
            found.append(Rotation(orientation_names()[number], matrix))
    return tuple(found)


@cache
def rotation_numbers() -> Mapping[int, Floats]:
    """Return all orientations by their number in MAVLink, which parameters hold, (3, 3) each."""
    found: dict[int, Floats] = {}
    for number, name in enumerate(orientation_names()):
        angles = {axis: np.radians(float(size)) for axis, size in _ANGLE.findall(name)}
        if angles or name == "NONE":
            matrix = to_earth(*(angles.get(axis, 0.0) for axis in ("ROLL", "PITCH", "YAW")))
            matrix.flags.writeable = False
            found[number] = matrix
    return MappingProxyType(found)
