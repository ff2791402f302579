"""Where on the ellipsoid does a course lead, and where is a place so far from another?

Angles are rad, lengths m, the ellipsoid is WGS-84. Arguments are numbers or arrays.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from fdi.telemetry.message import Floats

A: Final = 6378137.0
"""Semi-major axis, m."""
F: Final = 1 / 298.257223563
B: Final = A * (1 - F)
E2: Final = F * (2 - F)
"""First eccentricity, squared."""
E2_SECOND: Final = (A * A - B * B) / (B * B)

Angle = Floats | float


class Place(NamedTuple):
    """Latitude and longitude, rad, and height above the ellipsoid, m."""

    lat: Angle
    lon: Angle
    height: Angle


def wrap(angle: Angle) -> Floats:
    """Return angles in [-pi, pi)."""
    return np.asarray((np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi)


def isometric_latitude(lat: Angle) -> Floats:
    """Return the latitude by which a Mercator chart is drawn (Snyder 1987, eq. 15-1)."""
    e = np.sqrt(E2)
    sine = e * np.sin(lat)
    return np.asarray(
        np.log(np.tan(np.pi / 4 + np.asarray(lat) / 2) * ((1 - sine) / (1 + sine)) ** (e / 2))
    )


def loxodrome_course(lat1: Angle, lon1: Angle, lat2: Angle, lon2: Angle) -> Floats:
    """Return the constant course from one place to another, rad clockwise from north.

    Not for poles, nor for comparing legs of more than a few kilometres with a heading.
    """
    north = isometric_latitude(lat2) - isometric_latitude(lat1)
    return np.asarray(np.arctan2(wrap(np.asarray(lon2) - np.asarray(lon1)), north))


def metres_per_radian(lat: Angle, height: Angle = 0.0) -> tuple[Floats, Floats]:
    """Return how many metres north a radian of latitude is, and east one of longitude."""
    sine2 = np.sin(lat) ** 2
    meridian = A * (1 - E2) / (1 - E2 * sine2) ** 1.5
    return np.asarray(meridian + height), np.asarray((_normal(lat) + height) * np.cos(lat))


def _normal(lat: Angle) -> Floats:
    return np.asarray(A / np.sqrt(1 - E2 * np.sin(lat) ** 2))


def geocentric(north: Angle, east: Angle, up: Angle, origin: Place) -> Floats:
    """Return x, y, z (3, ...), m from the Earth's centre, of a place seen from an origin."""
    lat, lon, height = (np.asarray(each, np.float64) for each in origin)
    normal = _normal(lat)
    south, along = -np.asarray(north), np.asarray(up) + normal + height
    x = south * np.sin(lat) + along * np.cos(lat)
    z = -south * np.cos(lat) + along * np.sin(lat)
    return np.array(
        [
            x * np.cos(lon) - np.asarray(east) * np.sin(lon),
            x * np.sin(lon) + np.asarray(east) * np.cos(lon),
            z - E2 * normal * np.sin(lat),
        ]
    )


def geodetic(xyz: Floats) -> Place:
    """Return the place of x, y, z (3, ...), m from the Earth's centre (Bowring 1976).

    One step after the starting value: 1e-11 degrees and 1e-6 m from -400 to 20,000 m.
    """
    x, y, z = np.asarray(xyz, np.float64)
    flat = np.hypot(x, y)
    rho = np.hypot(flat, z)
    lat = np.arctan2(z * (1 + E2_SECOND * B / rho), flat)
    reduced = np.arctan2((1 - F) * np.sin(lat), np.cos(lat))
    lat = np.arctan2(z + E2_SECOND * B * np.sin(reduced) ** 3, flat - E2 * A * np.cos(reduced) ** 3)
    normal, sine, cosine = _normal(lat), np.sin(lat), np.cos(lat)
    is_low = np.abs(lat) < np.pi / 4
    by_flat = flat / np.where(is_low, cosine, 1.0) - normal
    by_z = z / np.where(is_low, 1.0, sine) - normal * (1 - E2)
    return Place(lat, np.arctan2(y, x), np.where(is_low, by_flat, by_z))
