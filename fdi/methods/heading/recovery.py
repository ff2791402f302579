"""What would a failed block have said? Its replacement, each sample with a deviation.

In: a log, a flight's cross-check, which block and since when it is not to be believed. Out: a
`Recovery`: columns on the times of the inertial records, that end where they are of no use.

================  ==================================================================================
satellite         position by dead reckoning (``reckoning.py``), geodetic; the height stays that of
                  the last fix and the barometer's change
magnetometer      heading by course where it is the surer one, else by yaw rate from the last good
accelerometer     roll and pitch by gyroscopes from the last good angles
angular_rate      roll and pitch by accelerometers, rates by their differences, yaw rate by compass
================  ==================================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from fdi.errors import LogError, UsageError
from fdi.grid import uniform
from fdi.methods.heading.check import HeadingCheck
from fdi.methods.heading.compute import compass_heading
from fdi.methods.heading.geodesy import Place, geocentric, geodetic, wrap
from fdi.methods.heading.increments import DEVIATION, LEFT, STATED, TAU_S, WINDOW_S, integral
from fdi.methods.heading.motion import Fixes, Ride, gap_between
from fdi.methods.heading.reckoning import tracks
from fdi.methods.heading.sources import BIAS
from fdi.methods.heading.tilt import G, accelerometer_tilt, angle_rates, complementary
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

USEFUL_M: Final = 100.0
"""A position that is less certain is none: beyond a visual search (choice)."""
USEFUL_HEADING: Final = np.radians(45.0)
USEFUL_TILT: Final = np.radians(10.0)
LEARNS_S: Final = 20.0
"""Of the last good time, by which a gyroscope's bias is told."""
_HEIGHT: Final = 3.0  # m, of a barometer over minutes


@dataclass(frozen=True, slots=True, eq=False)
class Recovery:
    """A block's replacement.

    Attributes
    ----------
    block : str
    start : float
        s, of the last good record.
    end : float
        s, of the last sample that is of use.
    ended : str
        Why it ends there.
    t : (n,) float, s
    method : tuple of str
        By sample, what it is made of.
    columns : Mapping[str, (n,) float]
        By name with its unit; deviations begin with ``sigma_``.
    """

    block: str
    start: float
    end: float
    ended: str
    t: Floats
    method: tuple[str, ...]
    columns: Mapping[str, Floats]


def recover(log: Log, check: HeadingCheck, block: str = "", since: float | None = None) -> Recovery:
    """Return what replaces a block, by default the one named first.

    Parameters
    ----------
    log : Log
    check : HeadingCheck
        Of the flight.
    block : str
        ``satellite``, ``magnetometer``, ``accelerometer`` or ``angular_rate``.
    since : float, optional
        s; when it is good for the last time. By default a window before it is named, as increments
        over the window had still agreed at its beginning; of one that falls silent, when it does.

    Raises
    ------
    UsageError
        No block was named and none is given, or it has no replacement.
    LogError
        The log holds nothing to replace it with.
    """
    if not block:
        block, since = _failed(check)
    ways = _WAYS.get(block)
    if ways is None:
        raise UsageError(f"{block} has no replacement", hint=f"there are {', '.join(_WAYS)}")
    start = check.ride.air[0] if since is None else since
    if not check.ride.t[0] < start < check.ride.t[-1]:
        raise UsageError(
            f"{start:.1f} s is not in the air",
            where=log.name,
            hint=f"it flies from {check.ride.t[0]:.1f} to {check.ride.t[-1]:.1f} s",
        )
    return ways(log, check, start)


def _failed(check: HeadingCheck) -> tuple[str, float]:
    """Return the block that failed first, and when it was good for the last time, s."""
    first = check.accused
    if first is None:
        raise UsageError(
            "no block was named: there is nothing to recover",
            hint="assume a failure with --assume satellite@120",
        )
    lost = check.ride.lost.get(first.block, ())
    silent = [low for low, high in lost if low <= first.start <= high]
    return first.block, silent[0] if silent else max(first.start - WINDOW_S, check.ride.t[1])


def _position(log: Log, check: HeadingCheck, start: float) -> Recovery:
    ride = check.ride
    fixes = None if ride.fixes is None else _until(ride.fixes, start)
    if fixes is None:
        raise LogError("holds no good fix to start from", where=log.name)
    # from the last fix on: until the start a vehicle that accelerates is elsewhere and faster
    found = tracks(log, ride, fixes, float(fixes.t[-1]))
    if not found:
        raise LogError(
            "holds nothing to reckon a position with",
            where=log.name,
            hint="it takes an attitude, and optical flow, airspeed or a few seconds before",
        )
    rows = ride.t > start
    sigmas = np.array([np.where(np.isnan(one.sigma), np.inf, one.sigma)[rows] for one in found])
    best = np.argmin(sigmas, axis=0)
    pick = np.arange(best.size)
    north, east = (
        np.array([getattr(one, name)[rows] for one in found])[best, pick]
        for name in ("north", "east")
    )
    off, doubt = _astray(check, fixes, start)
    north, east = north - off[0], east - off[1]
    origin = Place(fixes.lat[-1], fixes.lon[-1], fixes.height[-1])
    up = _climb(ride, start)[rows]
    place = geodetic(geocentric(north, east, up, origin))
    columns = {
        "lat_deg": np.degrees(place.lat),
        "lon_deg": np.degrees(place.lon),
        "height_m": np.asarray(place.height),
        "north_m": north,
        "east_m": east,
        "sigma_m": np.hypot(sigmas[best, pick], doubt),
        "sigma_height_m": np.full(best.size, _HEIGHT),
    }
    names = tuple(found[i].method for i in best)
    return _ended("satellite", start, ride.t[rows], names, columns, ("sigma_m", USEFUL_M))


def _astray(check: HeadingCheck, fixes: Fixes, start: float) -> tuple[Floats, float]:
    """Return by how much the last fix is off those of a window, m, and how far all may be.

    By the receiver's own velocity they tell of one place: their median leaves out a jump. A drift
    that a longer window shows is older than the start, and all of them are off.
    """
    ways = np.array([integral(fixes.at, speed) for speed in (fixes.north, fixes.east)])
    lately = (fixes.position() - ways)[:, fixes.t > fixes.t[-1] - WINDOW_S]
    off = lately[:, -1] - np.median(lately, axis=1)
    rows = (check.t > start - WINDOW_S) & (check.t <= start)
    left = [one.off[rows] for one in check.pairs if one.kind == "position"]
    known = [own[np.isfinite(own)] for own in left]
    # of either axis, as a deviation is
    doubt = max((float(np.median(own)) for own in known if own.size), default=0.0) / np.sqrt(2)
    return off, float(doubt)


def _until(fixes: Fixes, start: float) -> Fixes | None:
    good = fixes.t <= start
    if good.sum() < 2:
        return None
    names = ("t", "at", "lat", "lon", "north", "east", "height")
    return replace(fixes, **{name: getattr(fixes, name)[good] for name in names})


def _climb(ride: Ride, start: float) -> Floats:
    """Return the height gained since a moment, m, by the barometer; 0 where nobody tells it."""
    known = np.isfinite(ride.climbed)
    if not known.any():
        return np.zeros(ride.t.size)
    gained = np.interp(ride.t, ride.t[known], ride.climbed[known])
    return np.asarray(gained - np.interp(start, ride.t, gained))


def _heading(log: Log, check: HeadingCheck, start: float) -> Recovery:
    ride, course = check.ride, check.sources["course"]
    rows = ride.t > start
    rate = angle_rates(*_tilt(ride), ride.rates)[2]
    known = ride.angles[2] if ride.angles is not None else check.sources["compass"].heading
    moved = _propagated(ride, rate, known, start)
    lost = np.cumsum(~np.isfinite(rate) & rows) > 0  # no turn is told without an attitude
    sigmas = np.array(
        [
            np.where(lost, np.inf, moved.sigma)[rows],
            np.where(np.isnan(course.sigma), np.inf, course.sigma)[rows],
        ]
    )
    best = np.argmin(sigmas, axis=0)
    pick = np.arange(best.size)
    heading = np.array([moved.angle[rows], course.heading[rows]])[best, pick]
    columns = {
        "heading_deg": np.degrees(wrap(heading)),
        "sigma_heading_deg": np.degrees(sigmas[best, pick]),
    }
    names = tuple(("yaw rate", "course")[i] for i in best)
    limit = ("sigma_heading_deg", float(np.degrees(USEFUL_HEADING)))
    return _ended("magnetometer", start, ride.t[rows], names, columns, limit)


class _Propagated(NamedTuple):
    """An angle by its rate, its deviation, rad, and the drift taken off, rad/s."""

    angle: Floats
    sigma: Floats
    drift: float


def _propagated(ride: Ride, rate: Floats, known: Floats, start: float) -> _Propagated:
    """Return an angle by its rate since a moment, less the bias that shows before, and its sigma.

    The bias is as uncertain as an angle's change over the time that it is learnt from, and as it
    changes from window to window. Nothing before or after a gap counts.
    """
    own = np.nan_to_num(rate)
    steps = np.diff(ride.t)
    whole = np.insert(np.cumsum((own[1:] + own[:-1]) / 2 * steps), 0, 0.0)
    missed = np.insert(np.cumsum((np.diff(own) * steps) ** 2 / 2), 0, 0.0)
    before = (ride.t > start - LEARNS_S) & (ride.t <= start) & np.isfinite(known)
    before &= ~gap_between(ride.t, ride.t, np.full(ride.t.size, start))
    if before.sum() < 3:
        raise LogError(f"no angle is known before {start:.1f} s: nothing to start from")
    t = ride.t[before] - start
    drift = np.unwrap(known[before]) - whole[before]
    slope, first = np.polyfit(t, drift, 1) if np.ptp(t) > WINDOW_S else (0.0, drift[-1])
    since = np.maximum(ride.t - start, 0.0)
    scatter = float(np.std(drift - slope * t - first))
    # from where it is now, not from the line: what records missed has added up
    lately = (drift - slope * t)[t >= t[-1] - TAU_S]
    first = float(lately.mean())
    learnt = max(float(np.ptp(t)), WINDOW_S)
    # of a line through points that wander as slowly as it is long, or as it wanders itself
    of_slope = np.hypot(BIAS, max(np.sqrt(12) * scatter / learnt, _wanders(t, drift)))
    sampled = own * ride.period / 2  # an angle and its rate may be half a record apart
    walked = np.maximum(missed - np.interp(start, ride.t, missed), 0.0)
    spread = DEVIATION**2 + lately.var() + (of_slope * since) ** 2 + walked + sampled**2
    spread[gap_between(ride.t, np.full(ride.t.size, start), ride.t)] = np.inf
    return _Propagated(whole + first + slope * (ride.t - start), np.sqrt(spread), float(slope))


def _wanders(t: Floats, drift: Floats) -> float:
    """Return the deviation of a drift's slope from window to window, rad/s; 0 of too few."""
    ends = uniform(t[-1], t[0] - 1e-9, -WINDOW_S, records=t.size)[::-1]
    slopes = np.diff(np.interp(ends, t, drift)) / WINDOW_S
    return float(slopes.std(ddof=1)) if slopes.size > 1 else 0.0


def _tilt(ride: Ride) -> tuple[Floats, Floats]:
    if ride.angles is not None:
        return ride.angles[0], ride.angles[1]
    return accelerometer_tilt(ride.force)


def _tilt_by_gyroscopes(log: Log, check: HeadingCheck, start: float) -> Recovery:
    ride = check.ride
    rows = ride.t > start
    rates = angle_rates(*_tilt(ride), ride.rates)
    found = [_propagated(ride, rates[i], own, start) for i, own in enumerate(_tilt(ride))]
    # the estimator's own tilt is made of the accelerometer that failed: from there on without it
    t = ride.t[rows]
    begun = np.full((2, t.size), np.nan)
    begun[:, 0] = [one.angle[rows][0] for one in found]
    alone = complementary(t, ride.rates[:, rows], begun[0], begun[1], np.ones(t.size))
    tilt = [own + one.drift * (t - t[0]) for own, one in zip(alone, found, strict=True)]
    columns = {
        "roll_deg": np.degrees(wrap(tilt[0])),
        "pitch_deg": np.degrees(wrap(tilt[1])),
        "sigma_tilt_deg": np.degrees(np.maximum(found[0].sigma, found[1].sigma)[rows]),
    }
    names = ("gyroscopes",) * int(rows.sum())
    limit = ("sigma_tilt_deg", float(np.degrees(USEFUL_TILT)))
    return _ended("accelerometer", start, ride.t[rows], names, columns, limit)


def _tilt_by_accelerometers(log: Log, check: HeadingCheck, start: float) -> Recovery:
    ride = check.ride
    rows = ride.t > start
    roll, pitch = accelerometer_tilt(_smoothed(ride.force, ride.period))
    pull = _pull(ride)
    sigma = np.sqrt(STATED["accelerometer"] ** 2 + np.arctan(pull / G) ** 2 + (LEFT * roll) ** 2)
    # the source `compass` is levelled with the gyroscopes that failed
    assert ride.field is not None
    yaw = np.unwrap(np.nan_to_num(compass_heading(ride.field, roll, pitch, ride.declination)))
    columns = {
        "roll_deg": np.degrees(roll[rows]),
        "pitch_deg": np.degrees(pitch[rows]),
        "roll_rate_deg_s": np.degrees(np.gradient(roll, ride.t)[rows]),
        "pitch_rate_deg_s": np.degrees(np.gradient(pitch, ride.t)[rows]),
        "yaw_rate_deg_s": np.degrees(np.gradient(yaw, ride.t)[rows]),
        "sigma_tilt_deg": np.degrees(sigma[rows]),
    }
    names = ("accelerometers and compass",) * int(rows.sum())
    limit = ("sigma_tilt_deg", np.inf)
    return _ended("angular_rate", start, ride.t[rows], names, columns, limit)


def _smoothed(force: Floats, period: float) -> Floats:
    """Return the mean of the last seconds, (3, n); a damaged clock gives any period."""
    count = min(max(round(TAU_S / 2 / period), 1), force.shape[1])
    kernel = np.ones(count) / count
    return np.array([np.convolve(row, kernel)[: row.size] for row in force])


def _pull(ride: Ride) -> Floats:
    """Return the horizontal acceleration, m/s2; a tilt's own where no receiver tells it."""
    if ride.fixes is None:
        return np.asarray(np.abs(np.linalg.norm(ride.force, axis=0) - G))
    rows = (ride.fixes.north, ride.fixes.east)
    speed = [np.interp(ride.t, ride.fixes.t, row) for row in rows]
    return np.asarray(np.hypot(*(np.gradient(row, ride.t) for row in speed)))


def _ended(
    block: str,
    start: float,
    t: Floats,
    method: tuple[str, ...],
    columns: dict[str, Floats],
    limit: tuple[str, float],
) -> Recovery:
    """Return a recovery up to where its deviation goes beyond what is of use."""
    sigma = columns[limit[0]]
    beyond = np.flatnonzero(~(sigma <= limit[1]))
    last = int(beyond[0]) if beyond.size else t.size
    why = "the flight ends"
    if last < t.size:
        is_known = np.isfinite(sigma[last])
        why = f"{limit[0]} goes beyond {limit[1]:g}" if is_known else "its records have a gap"
    if not last:
        raise LogError(f"nothing replaces the {block} from {start:.1f} s on: {why}")
    kept = {name: values[:last] for name, values in columns.items()}
    return Recovery(block, start, float(t[last - 1]), why, t[:last], method[:last], kept)


_WAYS: Final[dict[str, Callable[[Log, HeadingCheck, float], Recovery]]] = {
    "satellite": _position,
    "magnetometer": _heading,
    "accelerometer": _tilt_by_gyroscopes,
    "angular_rate": _tilt_by_accelerometers,
}
REPLACED: Final = tuple(_WAYS)
