"""Which headings does a log tell, each with its deviation, or why it is absent?

In: a log and its `Ride`. Out: a `Source` for each, on the ride's times; rad clockwise from true
north. A source that is absent is not faulty, and one that is too uncertain to be of use is absent.

================  ==================================================================================
compass           levelled by accelerometers; by gyroscopes (``compass_gyro``)
course            loxodrome from fix to fix, less wind and sideslip; above a speed alone
receiver_yaw      two aerials: GPS_RAW_INT.yaw
optical           a camera: VISION_POSITION_ESTIMATE.yaw
gyroscope         integrated yaw rate, from the compass' median at the beginning
estimator         the autopilot's own
yaw_estimator     PX4's yaw_estimator_status, ArduPilot's XKY0: no compass in it
================  ==================================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.methods.heading.compute import compass_heading, heading_of_course, levelled
from fdi.methods.heading.geodesy import loxodrome_course, wrap
from fdi.methods.heading.increments import DEVIATION, STATED, TAU_S
from fdi.methods.heading.motion import Fixes, Ride, gap_between
from fdi.methods.heading.tilt import G, accelerometer_tilt, angle_rates, complementary
from fdi.methods.setup.records import series
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

USEFUL: Final = np.radians(45.0)
"""A heading that is less certain is none."""
SURE: Final = np.radians(5.0)
"""The course counts where receiver and speed make it at least so certain."""
FIX_M: Final = 0.3
"""Of a fix against the one before, m."""
APART_M: Final = 20 * FIX_M
"""From fix to fix for a course: atan(sqrt(2) / 20) = 4 degrees."""
OLDEST_S: Final = 3.0
"""Of the first of the two fixes."""
SPEED: Final = 0.3  # m/s, of a receiver
WIND: Final = 1.0  # m/s, of an estimator's wind
BREEZE: Final = 5.0  # m/s, of one that nobody tells: a gentle or fresh breeze
SIDESLIP: Final = np.radians(5.0)  # of a vehicle with wings
DRAG: Final = 0.3  # m/s2: bias of accelerometers, by which rotor drag is told
TURNS: Final = np.radians(20.0)  # rad/s; beyond, a course lags
WEAK: Final = 0.1
"""Share of the field that must be horizontal for a compass to tell anything."""
GYRO_TAU_S: Final = 60.0
QUIET: Final = 0.05
"""Of gravity, by which specific force may differ where gyroscopes are aligned anew."""
BIAS: Final = np.radians(0.05)  # rad/s, what the beginning leaves of a gyroscope's
_LOGGED: Final = (
    ("receiver_yaw", "GPS_RAW_INT", "yaw", None, np.radians(2.0)),
    ("optical", "VISION_POSITION_ESTIMATE", "yaw", None, np.radians(5.0)),
    ("yaw_estimator", "yaw_estimator_status", "yaw_composite", "yaw_variance", np.radians(5.0)),
    ("yaw_estimator", "XKY0", "YC", "YCS", np.radians(5.0)),
)
"""Name, message, field, field of its deviation or variance, and the least deviation, rad."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """One heading.

    Attributes
    ----------
    name : str
    heading, sigma : (n,) float
        rad, on the ride's times; NaN where it is absent.
    absent : str
        Why it is absent throughout; "" where it is not.
    """

    name: str
    heading: Floats
    sigma: Floats
    absent: str = ""


def sources_of(log: Log, ride: Ride) -> dict[str, Source]:
    """Return all headings that a log may tell, by name."""
    compass, compass_gyro = _compasses(ride)
    found = [compass, compass_gyro, _course(ride), _gyroscope(ride, compass), _estimator(ride)]
    found += [_logged(log, ride, *row) for row in _LOGGED[:2]]
    own = [_logged(log, ride, *row) for row in _LOGGED[2:]]
    found.append(next((one for one in own if not one.absent), own[0]))
    return {one.name: one for one in found}


def _absent(ride: Ride, name: str, why: str) -> Source:
    unknown = np.full(ride.t.size, np.nan)
    return Source(name, unknown, unknown, why)


def _source(ride: Ride, name: str, heading: Floats, sigma: Floats, why: str) -> Source:
    """Return a source where it is of use, and why it is nowhere."""
    known = np.isfinite(heading) & (sigma < USEFUL)
    if not known.any():
        return _absent(ride, name, why)
    return Source(name, np.where(known, wrap(heading), np.nan), np.where(known, sigma, np.nan))


def _compasses(ride: Ride) -> tuple[Source, Source]:
    if ride.field is None:
        why = ride.absent["magnetometer"]
        return _absent(ride, "compass", why), _absent(ride, "compass_gyro", why)
    roll, pitch = accelerometer_tilt(ride.force)
    steps = np.diff(ride.t, prepend=ride.t[:1])
    off = np.abs(np.linalg.norm(ride.force, axis=0) - G)
    quiet = off < QUIET * G
    by_force = complementary(ride.t, ride.rates, roll, pitch, np.exp(-steps / TAU_S))
    held = np.where(quiet, np.exp(-steps / GYRO_TAU_S), 1.0)
    by_gyro = complementary(ride.t, ride.rates, roll, pitch, held)
    leans = np.hypot(STATED["accelerometer"], np.arctan(_pull(ride) / G))
    drifts = np.hypot(STATED["accelerometer"], BIAS * GYRO_TAU_S)
    dip = abs(np.tan(ride.dip))
    return (
        _levelled(ride, "compass", by_force, dip * leans),
        _levelled(ride, "compass_gyro", by_gyro, np.full(ride.t.size, dip * drifts)),
    )


def _levelled(ride: Ride, name: str, tilt: Floats, doubt: Floats) -> Source:
    assert ride.field is not None
    flat = levelled(ride.field, tilt[0], tilt[1])
    heading = compass_heading(ride.field, tilt[0], tilt[1], ride.declination)
    strong = np.hypot(flat[0], flat[1]) > WEAK * np.linalg.norm(ride.field, axis=0)
    sigma = np.sqrt(DEVIATION**2 + STATED["compass"] ** 2 + doubt**2)
    return _source(ride, name, np.where(strong, heading, np.nan), sigma, "the field is too steep")


def _pull(ride: Ride) -> Floats:
    """Return the horizontal acceleration, m/s2, by the receiver; 0 where nobody tells it."""
    if ride.fixes is None:
        return np.zeros(ride.t.size)
    fixes, t = ride.fixes, ride.t
    moved = [
        np.interp(t, fixes.t, row) - np.interp(t - TAU_S, fixes.t, row)
        for row in (fixes.north, fixes.east)
    ]
    return np.asarray(np.hypot(*moved) / TAU_S)


def _course(ride: Ride) -> Source:
    name = "course"
    if ride.fixes is None:
        return _absent(ride, name, ride.absent["satellite"])
    fixes, t = ride.fixes, ride.t
    course, speed = _loxodromes(fixes)
    at = np.maximum(np.searchsorted(fixes.t, t, side="right") - 1, 0)
    north, east = speed[at] * np.cos(course[at]), speed[at] * np.sin(course[at])
    wind = np.zeros((2, t.size)) if ride.wind is None else ride.wind
    through = np.hypot(north - wind[0], east - wind[1])
    slip, doubt = _sideslip(ride)
    heading = heading_of_course(north, east, wind[0], wind[1], slip)
    blown = WIND if ride.wind is not None else BREEZE
    # as far as the air may be known: a wind that nobody tells is a fresh breeze
    of_speed = SPEED / np.maximum(np.minimum(speed[at], through), 1e-3)
    sigma = np.sqrt(
        of_speed**2 + np.arctan2(blown, through) ** 2 + doubt**2 + (FIX_M * 1.41 / APART_M) ** 2
    )
    turning = np.abs(angle_rates(*_tilt(ride), ride.rates)[2]) > TURNS
    bad = turning | (of_speed > SURE) | gap_between(fixes.t, t, t)
    fastest = float(np.hypot(fixes.north, fixes.east).max())
    why = f"it is nowhere so fast and straight that its course tells it ({fastest:.1f} m/s at most)"
    return _source(ride, name, np.where(bad, np.nan, heading), sigma, why)


def _loxodromes(fixes: Fixes) -> tuple[Floats, Floats]:
    """Return course and speed from the last fix that is far enough back, (n,) each."""
    north, east = fixes.position()
    course, speed = np.full(fixes.t.size, np.nan), np.full(fixes.t.size, np.nan)
    back = 1
    most = int(OLDEST_S / max(fixes.period, 1e-3)) + 1
    while back <= min(most, fixes.t.size - 1):
        far = np.hypot(north[back:] - north[:-back], east[back:] - east[:-back])
        age = fixes.at[back:] - fixes.at[:-back]
        rows = np.flatnonzero((far >= APART_M) & (age <= OLDEST_S) & np.isnan(course[back:]))
        ends = rows + back
        course[ends] = loxodrome_course(
            fixes.lat[rows], fixes.lon[rows], fixes.lat[ends], fixes.lon[ends]
        )
        speed[ends] = far[rows] / age[rows]
        back += 1
    return course, speed


def _sideslip(ride: Ride) -> tuple[Floats, Floats]:
    """Return where the air comes from, rad right of the nose, and its deviation.

    Wings are flown straight into it. Rotors drag: in steady flight specific force points away from
    where they go (derived, not tried by anybody we know of).
    """
    if ride.has_wings:
        return np.zeros(ride.t.size), np.full(ride.t.size, SIDESLIP)
    ahead, right = ride.force[0], ride.force[1]
    return np.arctan2(-right, -ahead), np.arctan2(DRAG, np.hypot(ahead, right))


def _tilt(ride: Ride) -> tuple[Floats, Floats]:
    if ride.angles is not None:
        return ride.angles[0], ride.angles[1]
    return accelerometer_tilt(ride.force)


def _gyroscope(ride: Ride, compass: Source) -> Source:
    name = "gyroscope"
    rate = np.nan_to_num(angle_rates(*_tilt(ride), ride.rates)[2])
    way = np.insert(np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(ride.t)), 0, 0.0)
    low, high = ride.reference
    first = (ride.t >= low) & (ride.t <= high) & np.isfinite(compass.heading)
    if not first.any():
        return _absent(ride, name, "no compass at the beginning to start from")
    off = np.exp(1j * (compass.heading[first] - way[first])).mean()
    start = ride.t[first].mean()
    sigma = np.hypot(DEVIATION, BIAS * np.abs(ride.t - start))
    heading = np.where(gap_between(ride.t, np.full(ride.t.size, low), ride.t), np.nan, 0.0) + (
        way + np.angle(off)
    )
    return _source(ride, name, heading, sigma, "its records have gaps")


def _estimator(ride: Ride) -> Source:
    if ride.angles is None:
        return _absent(ride, "estimator", ride.absent["estimator"])
    sigma = np.full(ride.t.size, np.hypot(DEVIATION, STATED["estimator"]))
    return _source(ride, "estimator", ride.angles[2], sigma, "the log holds no attitude in the air")


def _logged(
    log: Log, ride: Ride, name: str, key: str, field: str, spread: str | None, least: float
) -> Source:
    fields = (field,) if spread is None else (field, spread)
    found = series(log, key, fields)
    if found is None or not np.any(found.values[0]):
        return _absent(ride, name, f"the log holds no {key}.{field}")
    t = ride.t
    heading = np.interp(t, found.t, np.unwrap(found.values[0]))
    sigma = np.full(t.size, least)
    if spread is not None:
        told = np.interp(t, found.t, found.values[1])
        sigma = np.maximum(np.sqrt(told) if spread.endswith("variance") else told, least)
    heading[gap_between(found.t, t, t)] = np.nan
    return _source(ride, name, heading, sigma, f"{key}.{field} is not certain enough to be of use")
