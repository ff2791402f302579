"""Where did the vehicle fly? Its way over ground in metres from where it began.

In: a log. Out: plain values: east, north and height over time. The position is the estimator's
where the log holds it, or else the receiver's, which the page says.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.report.page.columns import packed
from fdi.telemetry import Log

Floats = NDArray[np.float64]

EARTH: Final = 6_371_000.0
"""m, mean radius: a plane tangent to a sphere is 0.3 % wrong, which no eye sees."""
MOST: Final = 3000
FARTHEST: Final = 1e6
"""m from the median; farther is damage."""
_SOURCES: Final = (
    ("GLOBAL_POSITION_INT", "lat", "lon", "relative_alt", "the estimator's position"),
    ("GPS_RAW_INT", "lat", "lon", "alt", "the satellite receiver's position"),
)


class Track(NamedTuple):
    """The way: t (n,) s; east, north, height (n,) m from the first position; what shows it."""

    t: Floats
    east: Floats
    north: Floats
    height: Floats
    told: str


def track(log: Log) -> Track | None:
    """Return the way over ground, None where the log does not tell it."""
    for source, lat, lon, height, told in _SOURCES:
        if source not in log or not {lat, lon} <= set(log[source].fields):
            continue
        message = log[source]
        latitude, longitude = message.si(lat), message.si(lon)
        up = message.si(height) if height in message else np.zeros(len(message))
        known = np.isfinite(latitude) & np.isfinite(longitude)
        known &= (latitude != 0.0) | (longitude != 0.0)
        if known.sum() < 2:
            continue
        t, up = message.t[known], up[known]
        latitude, longitude = latitude[known], longitude[known]
        north = EARTH * (latitude - np.median(latitude))
        east = EARTH * (longitude - np.median(longitude)) * np.cos(np.median(latitude))
        near = np.hypot(north, east) < FARTHEST
        if near.sum() < 2:
            continue
        t, north, east, up = t[near], north[near], east[near], up[near]
        if not (np.ptp(north) > 1.0 or np.ptp(east) > 1.0 or np.ptp(np.nan_to_num(up)) > 1.0):
            continue
        every = -(-len(t) // MOST)
        # the last one is where it ended
        shown = np.union1d(np.arange(len(t))[::every], [len(t) - 1])
        first = up[np.isfinite(up)][:1]
        zero = float(first[0]) if height == "alt" and first.size else 0.0
        return Track(
            t[shown], (east - east[0])[shown], (north - north[0])[shown], up[shown] - zero, told
        )
    return None


def track_json(way: Track | None) -> dict[str, Any] | None:
    """Return the way as plain values."""
    if way is None:
        return None
    return {
        "n": len(way.t),
        "t": packed(way.t),
        "e": packed(np.round(way.east, 2)),
        "h": packed(np.round(way.height, 2)),
        "m": packed(np.round(way.north, 2)),
        "told": way.told,
    }
