"""What is known of the world at the place and day of a flight?

In: a quantity's name and a log. Out: its value, or None where the log tells no place. The magnetic
field is the World Magnetic Model (pygeomag, offline), at the median position of the receiver and
the day of the clock. Where the clock was never set the middle of the years stands for the day that
those models hold for: away from the poles the field turns by up to 0.2 degrees a year and changes
by up to 100 nT, a constant well within what a healthy compass may be off (``offset``).
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from functools import lru_cache
from typing import Any, Final

import numpy as np

from fdi.telemetry import Log

POSITIONS: Final = ("GPS_RAW_INT", "GLOBAL_POSITION_INT")
ANY_YEAR: Final = 2020.0
"""The middle of 2010 to 2030, which the models that pygeomag carries hold for."""
FIRST_YEAR: Final = 2010
"""The oldest model that pygeomag carries starts here; an older clock was never set."""


def world_value(name: str, log: Log) -> float | None:
    """Return a quantity of the Earth's field, or None.

    ``magnetic_declination``, rad east; ``magnetic_inclination``, rad down;
    ``magnetic_strength`` and its horizontal part ``magnetic_horizontal``, T.
    """
    place = _place(log)
    if place is None:
        return None
    result = _field(*place, _year(log) or ANY_YEAR)
    if name == "magnetic_declination":
        return float(np.radians(result.d))
    if name == "magnetic_inclination":
        return float(np.radians(result.i))
    return float(result.h if name == "magnetic_horizontal" else result.f) * 1e-9


@lru_cache(maxsize=100)  # asked for three times a look at a system
def _field(lat: float, lon: float, year: float) -> Any:
    """Return what the model of its time says of the field at a place, deg."""
    from pygeomag import GeoMag

    # Each model holds for five years; beyond the newest the field drifts by 0.1 degrees a year.
    first = min(int(year // 5 * 5), 2025)
    model = GeoMag(coefficients_file=f"wmm/WMM_{first}.COF")
    return model.calculate(glat=lat, glon=lon, alt=0.0, time=min(max(year, first), first + 4.99))


def undated(log: Log) -> Iterator[str]:
    """Yield what is assumed of the magnetic field where the log tells a place and no day."""
    if _year(log) is None and _place(log) is not None:
        yield (
            "this log does not say when it was made: the magnetic field is taken to be that of "
            f"{ANY_YEAR:.0f}, within 2 degrees and 1 uT"
        )


def _year(log: Log) -> float | None:
    """Return the year and its part that has passed, None where the clock was never set."""
    day = log.clock.utc(0.0)
    if day is None:
        return None
    moment = datetime.fromisoformat(day.replace("Z", "+00:00"))
    year = moment.year + (moment.timetuple().tm_yday - 1) / 365.25
    return year if year >= FIRST_YEAR else None


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
