"""Where is a vehicle whose receiver failed? Dead reckoning from the last good fix.

In: a `Ride`, its log, and when the receiver was good for the last time. Out: `Track`s, metres north
and east of that fix with a deviation each.

================  ==================================================================================
optical           velocity over ground by a camera, turned by the heading
airspeed          along the heading, and a wind that goes on walking as it did so far
inertial          specific force turned by the attitude, less what it was off before the failure
================  ==================================================================================

What the last good seconds show of a method (`_LEARNS_S`) sets its bias and, with stated accuracies
as the least, its deviation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.heading.motion import Fixes, Ride, gap_between
from fdi.methods.heading.tilt import G
from fdi.methods.setup.records import series
from fdi.methods.setup.rotations import to_earth
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

HEADING: Final = np.radians(2.0)
"""Of a healthy heading, one sigma."""
_LEARNS_S: Final = 30.0
_BLOCK_S: Final = 5.0
"""Means over so long show how what is taken as constant wanders."""
_FIX: Final = 0.5  # m, of a fix against the one before
_SPEED: Final = 0.1  # m/s, of a receiver, averaged
_LATE: Final = 0.2
"""s, by which a fix is older than its record: what is reckoned does not lag."""
_FLOW: Final = 0.1
"""Of a velocity by optical flow, share."""
_AIRSPEED: Final = 0.3  # m/s
_WIND: Final = 0.5
"""m/s, by which the calmest wind changes within `_LEARNS_S`."""
_TILT: Final = np.radians(0.2)
"""Of an attitude after its error before the failure was taken off."""
_FLIES: Final = 5.0  # m/s; below, an airspeed sensor tells little
_FRESH: Final = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A way since the last good fix.

    Attributes
    ----------
    method : str
    north, east : (n,) float
        m, on the times asked for; NaN where it is not known.
    sigma : (n,) float
        Root of the variances' sum over north and east divided by two: of either, m.
    """

    method: str
    north: Floats
    east: Floats
    sigma: Floats


def tracks(log: Log, ride: Ride, fixes: Fixes, start: float) -> tuple[Track, ...]:
    """Return the ways since a moment by every method that the log has records for.

    Parameters
    ----------
    log : Log
    ride : Ride
    fixes : Fixes
        Those that are good, the last one at ``start`` or before.
    start : float
        s.
    """
    found = (
        _optical(log, ride, start),
        _airspeed(log, ride, fixes, start),
        _inertial(ride, fixes, start),
    )
    return tuple(one for one in found if one is not None)


def _since(ride: Ride, start: float) -> Floats:
    return np.asarray(np.maximum(ride.t - start, 0.0))


def _way(t: Floats, speed: Floats, start: float) -> Floats:
    """Return the integral of a speed since a moment."""
    known = np.nan_to_num(speed)
    whole = np.insert(np.cumsum((known[1:] + known[:-1]) / 2 * np.diff(t)), 0, 0.0)
    return np.asarray(whole - np.interp(start, t, whole))


def _optical(log: Log, ride: Ride, start: float) -> Track | None:
    found = series(log, "OPTICAL_FLOW", ("flow_comp_m_x", "flow_comp_m_y"))
    if found is None or ride.angles is None or not np.any(found.values):
        return None
    t, yaw = ride.t, ride.angles[2]
    ahead, right = (np.interp(t, found.t, row) for row in found.values)
    north = ahead * np.cos(yaw) - right * np.sin(yaw)
    east = ahead * np.sin(yaw) + right * np.cos(yaw)
    length = _way(t, np.hypot(ahead, right), start)
    sigma = np.sqrt(_FIX**2 + (length * np.hypot(HEADING, _FLOW)) ** 2)
    ways = (_way(t, north, start), _way(t, east, start))
    return _track(ride, "optical", start, ways, sigma, found.t)


def _airspeed(log: Log, ride: Ride, fixes: Fixes, start: float) -> Track | None:
    """Return the way by a sensor of airspeed; what an autopilot makes up without one is none."""
    found = next((s for key, f in (("AIRSPEED", "airspeed"), ("ARSP", "Airspeed"),
                                   ("airspeed", "true_airspeed_m_s"))
                  if (s := series(log, key, (f,))) is not None), None)  # fmt: skip
    if found is None or ride.angles is None or not ride.has_wings:
        return None
    t, yaw = ride.t, ride.angles[2]
    speed = np.interp(t, found.t, found.values[0])
    before = (t <= start) & (t >= ride.air[0]) & (speed > _FLIES)
    through = np.array([speed * np.cos(yaw), speed * np.sin(yaw)])
    over = np.array([np.interp(t, fixes.t, row) for row in (fixes.north, fixes.east)])
    before &= np.isfinite(over + through).all(axis=0)
    if (before & (t > start - _LEARNS_S)).sum() < _FRESH:
        return None
    wind = _wind_at(t[before], (over - through)[:, before])
    since = _since(ride, start)
    length = _way(t, speed, start)
    spread = (
        _FIX**2
        + (length * HEADING) ** 2
        + wind.variance * since**2
        + wind.walks * since**3 / 3
        + (_AIRSPEED * since) ** 2
        + _lag(through + wind.mean[:, None], t, start) ** 2
    )
    ways = [_way(t, row + w, start) for row, w in zip(through, wind.mean, strict=True)]
    return _track(ride, "airspeed", start, (ways[0], ways[1]), np.sqrt(spread), found.t)


class _Wind(NamedTuple):
    """A wind that walks at random: north and east now, m/s, their variance, and its growth.

    ``walks`` is in m^2/s^3.
    """

    mean: Floats
    variance: float
    walks: float


def _wind_at(t: Floats, seen: Floats) -> _Wind:
    """Return the wind after the last of the records, (2, n) m/s, by what they show so far.

    A random walk seen through errors that come and go: means over `_BLOCK_S` differ, over a time T,
    by the walk's growth in T and twice the errors' variance, a line over T. The filter's steady
    state remembers for the time in which the walk grows to the errors (Bar-Shalom, Li and
    Kirubarajan 2001, section 5.2.5, in the limit of steady sampling).
    """
    which = ((t - t[0]) / _BLOCK_S).astype(int)
    last = which[-1] + 1
    means = np.array([seen[:, which == i].mean(axis=1) for i in range(last) if (which == i).any()])
    lags = np.arange(1, min(len(means) - 1, round(_LEARNS_S / _BLOCK_S)) + 1)
    least = _WIND**2 / _LEARNS_S
    walks, errors = least, _WIND**2
    if lags.size > 1:
        apart = [float(np.mean((means[lag:] - means[:-lag]) ** 2)) for lag in lags]
        slope, first = np.polyfit(lags * _BLOCK_S, apart, 1, w=np.sqrt(len(means) - lags))
        walks, errors = max(float(slope), least), max(float(first) / 2, _WIND**2)
    memory = np.sqrt(errors * _BLOCK_S / walks)
    weight = np.exp(np.maximum((t - t[-1]) / memory, -700.0))
    variance = float(np.sqrt(errors * _BLOCK_S * walks))
    return _Wind(np.average(seen, axis=1, weights=weight), variance, walks)


def _inertial(ride: Ride, fixes: Fixes, start: float) -> Track | None:
    if ride.angles is None:
        return None
    t, angles = ride.t, ride.angles
    turn = to_earth(*np.nan_to_num(angles))
    level = to_earth(np.zeros(t.size), np.zeros(t.size), np.nan_to_num(angles[2]))
    pull = np.einsum("nij,jn->in", turn, ride.force) + np.array([[0.0], [0.0], [G]])
    before = (t > start - _LEARNS_S) & (t <= start)
    first = float(t[before][0]) if before.any() else start
    learnt = start - first
    if learnt < _BLOCK_S:
        return None
    # what the receiver's velocity shows to be off, in the axes of the level vehicle: an attitude's
    # error and an accelerometer's bias turn with it
    off = np.einsum("nji,jn->in", level, _missing(ride, fixes, pull))
    bias, wanders = off[:2, before].mean(axis=1), _wander(t[before], off[:2, before])
    turned = np.einsum("nij,j->in", level[:, :, :2], bias)
    pull = pull[:2] + turned[:2]
    since = _since(ride, start)
    missed = np.diff(pull, axis=1) * np.diff(t)
    walk = np.mean(missed[:, before[1:]] ** 2) / 2 / max(ride.period, 1e-3)
    slow = max(_TILT * G, wanders)
    spread = _FIX**2 + (_SPEED * since) ** 2 + (slow * since**2 / 2) ** 2 + walk * since**3 / 3
    begun = [float(np.interp(start, fixes.t, speed)) for speed in (fixes.north, fixes.east)]
    speeds = np.array([v + _way(t, row, start) for v, row in zip(begun, pull, strict=True)])
    # the speed to begin with is late, too
    early = np.hypot(*(np.interp(start, t, row) for row in pull))
    spread += _lag(speeds, t, start) ** 2 + (_LATE * early * since) ** 2
    ways = [_way(t, row, start) for row in speeds]
    return _track(ride, "inertial", start, (ways[0], ways[1]), np.sqrt(spread), t)


def _lag(speeds: Floats, t: Floats, start: float) -> Floats:
    """Return by how much, m, a receiver that is late would differ, by how the velocity changed."""
    return np.asarray(_LATE * np.hypot(*(row - np.interp(start, t, row) for row in speeds)))


def _missing(ride: Ride, fixes: Fixes, pull: Floats) -> Floats:
    """Return the acceleration, (3, n), by the receiver less that by the accelerometers.

    Both as means over `_BLOCK_S` before each record; no receiver tells the third.
    """
    t = ride.t
    found = np.zeros((3, t.size))
    low = np.maximum(t - _BLOCK_S, t[0])
    span = np.maximum(t - low, ride.period)
    for axis, speed in enumerate((fixes.north, fixes.east)):
        gained = np.interp(t, fixes.t, speed) - np.interp(low, fixes.t, speed)
        whole = _way(t, pull[axis], t[0])
        found[axis] = (gained - (whole - np.interp(low, t, whole))) / span
    return found


def _wander(t: Floats, values: Floats) -> float:
    """Return the deviation of means over `_BLOCK_S`, of the larger row."""
    which = ((t - t[0]) / _BLOCK_S).astype(int)
    means = [values[:, which == i].mean(axis=1) for i in range(which[-1] + 1) if (which == i).any()]
    return float(np.std(means, axis=0, ddof=1).max()) if len(means) > 2 else 0.0


def _track(
    ride: Ride,
    method: str,
    start: float,
    ways: tuple[Floats, Floats],
    sigma: Floats,
    records: Floats,
) -> Track:
    """Return a track that ends where its records do, or have a gap: nothing goes across one."""
    gap = gap_between(records, np.full(ride.t.size, start), ride.t)
    if ride.angles is not None:
        lost = ~np.isfinite(ride.angles).all(axis=0)
        gap |= np.cumsum(lost & (ride.t > start)) > 0
    north, east, spread = (np.where(gap, np.nan, each) for each in (*ways, sigma))
    return Track(method, north, east, spread)
