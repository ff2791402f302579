"""What is known of the world at the place and day of a flight?

In: a quantity's name and a log. Out: its value, or None where the log tells neither place nor day.
The magnetic field is the World Magnetic Model (pygeomag, offline), at the median position of the
receiver and the day of the clock.
"""

from __future__ import annotations

from datetime import datetime
from typing import Final

import numpy as np

from fdi.telemetry import Log

POSITIONS: Final = ("GPS_RAW_INT", "GLOBAL_POSITION_INT")
FIRST_YEAR: Final = 2010
"""The oldest model that pygeomag carries starts here; an older clock was never set."""


def world_value(name: str, log: Log) -> float | None:
    """Return ``magnetic_declination``, rad east, or ``magnetic_strength``, T, or None."""
    place = _place(log)
    day = log.clock.utc(0.0)
    if place is None or day is None:
        return None
    moment = datetime.fromisoformat(day.replace("Z", "+00:00"))
    year = moment.year + (moment.timetuple().tm_yday - 1) / 365.25
    if year < FIRST_YEAR:
        return None
    from pygeomag import GeoMag

    # Each model holds for five years; beyond the newest the field drifts by 0.1 degrees a year.
    first = min(int(year // 5 * 5), 2025)
    model = GeoMag(coefficients_file=f"wmm/WMM_{first}.COF")
    result = model.calculate(
        glat=place[0], glon=place[1], alt=0.0, time=min(max(year, first), first + 4.99)
    )
    if name == "magnetic_declination":
        return float(np.radians(result.d))
    return float(result.f) * 1e-9


def _place(log: Log) -> tuple[float, float] | None:
    """Return latitude and longitude, deg, medians over the flight."""
    for message in POSITIONS:
        if message not in log or not {"lat", "lon"} <= set(log[message].fields):
            continue
        lat, lon = log[message].si("lat"), log[message].si("lon")
        known = np.isfinite(lat) & np.isfinite(lon) & ((lat != 0) | (lon != 0))
        if known.any():
            return float(np.degrees(np.median(lat[known]))), float(
                np.degrees(np.median(lon[known]))
            )
    return None
