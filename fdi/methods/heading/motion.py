"""What did sensors and estimator record of one flight, as a cross-check of headings needs it?

In: a log. Out: a `Ride`: inertial records in the air with the attitude beside them, and the fixes
of the receiver at their own times. What the log does not hold is NaN or None, and said why.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError, UsageError
from fdi.grid import uniform
from fdi.methods.heading.geodesy import metres_per_radian, wrap
from fdi.methods.setup.records import Series, attitude, series
from fdi.model.world import world_value
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.impact import OVER_S
from fdi.telemetry.message import Floats
from fdi.windows import runs_of

Bools = NDArray[np.bool_]
Spans = tuple[tuple[float, float], ...]
"""From when to when, s."""

GAP: Final = 3.0
GAP_S: Final = 1.0
"""Periods and seconds without a record, beyond both of which nothing is carried over: as where
signals are sampled."""
SILENT: Final = 10.0
SILENT_S: Final = 5.0
"""Periods and seconds without a record, beyond both of which a source has fallen silent: a link
that loses a third of its frames loses ten in a row once in 60,000 (choice)."""
REFERENCE_S: Final = 20.0
"""The beginning of a flight, settled, by which its own noise is told: as the estimator's levels."""
FIX_LATE_S: Final = 0.1
"""By which a receiver's position and velocity may be of different moments."""
FIX_3D: Final = 3
SATELLITES: Final = 4
SCALE_HEIGHT: Final = 8434.0  # m, of the standard atmosphere at 288 K
SLOWEST_S: Final = 0.75
"""Records further apart than this cannot be integrated: a vehicle turns there and back between."""
_DIP: Final = np.radians(65.0)  # where the log tells no place: that of the middle latitudes
_RATES: Final = ("xgyro", "ygyro", "zgyro")
_OTHERS: Final = ("SCALED_IMU2", "SCALED_IMU3")
_FORCE: Final = ("xacc", "yacc", "zacc")
_FIELD: Final = ("xmag", "ymag", "zmag")


@dataclass(frozen=True, slots=True, eq=False)
class Fixes:
    """The receiver's fixes, each once: ``t`` on the log's clock, ``at`` by the receiver, s."""

    t: Floats
    at: Floats
    lat: Floats
    lon: Floats
    north: Floats
    east: Floats
    height: Floats

    @property
    def period(self) -> float:
        """The usual time between two fixes, s."""
        return float(np.median(np.diff(self.t)))

    def position(self) -> Floats:
        """Return metres north and east of the first fix, (2, n)."""
        per = metres_per_radian(self.lat[0])
        return np.array([(self.lat - self.lat[0]) * per[0], wrap(self.lon - self.lon[0]) * per[1]])


@dataclass(frozen=True, slots=True, eq=False)
class Ride:
    """One flight.

    Attributes
    ----------
    t : (n,) float
        s, of the inertial records in the air.
    rates, force : (3, n) float
        rad/s and m/s2, body axes.
    field : (3, n) float or None
        T; None where the log has no compass.
    angles : (3, n) float or None
        The estimator's roll, pitch and yaw (unwrapped), rad.
    fixes : Fixes or None
    wind : (2, n) float or None
        Velocity of the air, north and east, m/s, by the estimator.
    air : (float, float)
        s, from when to when.
    cycle : float
        s, period of the slowest source: a verdict each.
    coarse : float
        s, half of what the estimator's attitudes are further apart than the inertial records.
    declination, dip : float
        Of the Earth's field, rad.
    strength : float
        Of the Earth's field, T; NaN where the log tells no place.
    absent : Mapping[str, str]
        Why a block has no records, by its name.
    lost : Mapping[str, tuple of (float, float)]
        s, by block: when in the air one that had told something told nothing, and inertial records
        went on. A receiver tells by itself that it has no fix; else silence has to last.
    climbed : (n,) float
        m, height by the barometer above that of the first record; NaN where it is not known.
    other_rates : tuple of (3, n) float
        rad/s, of the other gyroscopes on board; NaN where they are not known.
    """

    t: Floats
    rates: Floats
    force: Floats
    field: Floats | None
    angles: Floats | None
    fixes: Fixes | None
    wind: Floats | None
    air: tuple[float, float]
    flight: int
    cycle: float
    coarse: float
    declination: float
    dip: float
    strength: float
    has_wings: bool
    absent: dict[str, str]
    lost: dict[str, Spans]
    climbed: Floats
    other_rates: tuple[Floats, ...] = ()

    @property
    def period(self) -> float:
        """The usual time between two inertial records, s."""
        return float(np.median(np.diff(self.t)))

    def grid(self, window: float) -> Floats:
        """Return when there is a verdict: every cycle, from a window, s, after take-off on."""
        return uniform(self.air[0] + window, self.air[1], self.cycle, records=self.t.size)

    @property
    def reference(self) -> tuple[float, float]:
        """From when to when, s, the flight's own noise is taken."""
        start = self.air[0] + SETTLING_S
        return start, start + REFERENCE_S


def ride_of(log: Log, flight: int | None = None) -> Ride:
    """Return what a log recorded of a flight, by default of the last one that flew.

    Raises
    ------
    LogError
        There is no flight, or records are too far apart.
    UsageError
        There is no such flight.
    """
    number, air = _when(log, flight)
    inertial = series(log, "RAW_IMU", (*_RATES, *_FORCE), in_units=True)
    if inertial is None:
        raise LogError("holds no gyroscopes and accelerometers in known units", where=log.name)
    inertial = _part(inertial, air)
    if inertial.t.size < 2 or inertial.period > SLOWEST_S:
        apart = f"{inertial.period:.1f} s apart" if inertial.t.size > 1 else "not there in the air"
        raise LogError(
            f"inertial records are {apart}: turns between them cannot be seen",
            where=log.name,
            hint=f"a cross-check of headings takes one every {SLOWEST_S:g} s at least",
        )
    absent: dict[str, str] = {}
    t = inertial.t
    field, silent = _field(log, t, absent)
    known = attitude(log)
    if known is None:
        absent["estimator"] = "the log holds no attitude"
    fixes, without = _fixes(log, t, air, absent)
    periods = [inertial.period]
    periods += [known.period] if known is not None else []
    periods += [fixes.period] if fixes is not None else []
    declination, dip, strength = (
        world_value(f"magnetic_{x}", log) for x in ("declination", "inclination", "strength")
    )
    return Ride(
        t,
        inertial.values[:3],
        inertial.values[3:],
        field,
        None if known is None else _unwrapped(known, t),
        fixes,
        _wind(log, t),
        air,
        number,
        max(periods),
        0.0 if known is None else max(known.period - inertial.period, 0.0) / 2,
        declination or 0.0,
        _DIP if dip is None else dip,
        np.nan if strength is None else strength,
        log.vehicle in ("plane", "vtol") and not log.frame,
        absent,
        {"satellite": without, "magnetometer": silent},
        _climbed(log, t),
        tuple(_other_rates(log, t)),
    )


def _other_rates(log: Log, t: Floats) -> Iterator[Floats]:
    """Yield what the other gyroscopes read at these times, (3, n) rad/s each."""
    for key in _OTHERS:
        read = series(log, key, _RATES, in_units=True)
        if read is not None and read.t.size > 1:
            found = np.stack([np.interp(t, read.t, row) for row in read.values])
            found[:, gap_between(read.t, t, t)] = np.nan
            yield found


def _when(log: Log, flight: int | None) -> tuple[int, tuple[float, float]]:
    if flight is not None and not 0 <= flight < len(log.flights):
        raise UsageError(
            f"{log.name} has no flight {flight + 1}", hint=f"it has {len(log.flights)}"
        )
    flew = [i for i, one in enumerate(log.flights) if one.flew]
    if flight is None and not flew:
        raise LogError("shows no flight", where=log.name)
    number = flew[-1] if flight is None else flight
    start, end = in_air(log.flights[number])
    over = [e.overturned for e in log.ends if e.flight == number and e.overturned is not None]
    return number, (start, min([end, *(t + OVER_S for t in over)]))


def _part(whole: Series, air: tuple[float, float]) -> Series:
    inside = (whole.t >= air[0]) & (whole.t <= air[1])
    return Series(whole.t[inside], whole.values[:, inside])


def _unwrapped(known: Series, t: Floats) -> Floats:
    found = np.array([np.interp(t, known.t, np.unwrap(row)) for row in known.values])
    found[:, gap_between(known.t, t, t)] = np.nan
    return found


def _field(log: Log, t: Floats, absent: dict[str, str]) -> tuple[Floats | None, Spans]:
    """Return what compasses read, and when one that had told something fell silent."""
    found = series(log, "RAW_IMU", _FIELD)
    if found is None or not np.any(np.ptp(found.values, axis=1)):
        absent["magnetometer"] = "the log holds no readings of a compass"
        return None, ()
    field = np.array([np.interp(t, found.t, row) for row in found.values])
    field[:, gap_between(found.t, t, t)] = np.nan
    return field, silences(t, found.t[(found.t >= t[0]) & (found.t <= t[-1])])


def silences(t: Floats, records: Floats) -> Spans:
    """Return when after a record none came for long, though what came at ``t`` went on, s."""
    if records.size < 2:
        return ()
    last = np.append(records[1:], t[-1])
    limit = max(SILENT_S, SILENT * float(np.median(np.diff(records))))
    return tuple(
        (float(low), float(high))
        for low, high in zip(records, last, strict=True)
        if high - low > limit and not _stops(t, low, high)
    )


def _stops(t: Floats, low: float, high: float) -> bool:
    """Return whether what came at ``t`` stops as well between two moments."""
    inside = t[(t > low) & (t < high)]
    widest = np.diff(np.concatenate([[low], inside, [high]])).max()
    return bool(widest > max(GAP_S, GAP * float(np.median(np.diff(t)))))


def _climbed(log: Log, t: Floats) -> Floats:
    """Return the height by the barometer; in the standard atmosphere a layer is 8434 m thick."""
    found = series(log, "SCALED_PRESSURE", ("press_abs",))
    if found is None or not np.all(found.values > 0):
        return np.full(t.size, np.nan)
    height = -SCALE_HEIGHT * np.log(found.values[0] / found.values[0, 0])
    climbed = np.interp(t, found.t, height)
    climbed[gap_between(found.t, t, t)] = np.nan
    return np.asarray(climbed)


def _fixes(
    log: Log, inertial: Floats, air: tuple[float, float], absent: dict[str, str]
) -> tuple[Fixes | None, Spans]:
    """Return the fixes that count, and when in the air there were none after there had been."""
    fields = ("lat", "lon", "vel", "cog", "alt")
    message = log.messages.get("GPS_RAW_INT")
    if message is None or any(name not in message for name in (*fields, "fix_type")):
        absent["satellite"] = "the log holds no fixes with speed and course"
        return None, ()
    t = message.t
    lat, lon, speed, course, height = (message.si(name) for name in fields)
    good = (message.si("fix_type") >= FIX_3D) & np.isfinite(lat) & np.isfinite(lon)
    if "satellites_visible" in message:
        good &= ~(message.si("satellites_visible") < SATELLITES)
    inside = (t >= air[0]) & (t <= air[1])
    had = np.cumsum(good[inside]) > 0
    lost = _spans(t[inside], had & ~good[inside])
    lost = tuple(sorted((*lost, *silences(inertial, t[inside]))))
    good &= inside & np.isfinite(speed) & np.isfinite(course)
    at = message.si("time_usec") if "time_usec" in message else t
    if not np.all(np.diff(at[good]) >= 0):
        at = t
    rows = np.flatnonzero(good)
    rows = rows[np.diff(at[rows], prepend=-np.inf) > 0]
    if rows.size < 2:
        absent["satellite"] = "the receiver has no fix in the air"
        return None, lost
    north, east = speed[rows] * np.cos(course[rows]), speed[rows] * np.sin(course[rows])
    return Fixes(t[rows], at[rows], lat[rows], lon[rows], north, east, height[rows]), lost


def _spans(t: Floats, holds: Bools) -> Spans:
    return tuple((float(t[a]), float(t[b - 1])) for a, b in runs_of(holds))


def _wind(log: Log, t: Floats) -> Floats | None:
    """Return the velocity of the air, (2, n); ArduPilot's WIND tells where it comes from."""
    found = series(log, "WIND", ("direction", "speed"))
    if found is not None:
        direction, speed = found.values
        towards = np.array([-speed * np.cos(direction), -speed * np.sin(direction)])
        return np.array([np.interp(t, found.t, row) for row in towards])
    for key, fields in (("XKF2", ("VWN", "VWE")), ("wind", ("windspeed_north", "windspeed_east"))):
        found = series(log, key, fields)
        if found is not None and np.any(found.values):
            return np.array([np.interp(t, found.t, row) for row in found.values])
    return None


def gap_between(records: Floats, first: Floats, last: Floats) -> Bools:
    """Return which stretches from ``first`` to ``last``, s, hold a gap or leave the records."""
    if records.size < 2:
        return np.ones(first.size, np.bool_)
    widths = np.diff(records)
    count = np.insert(np.cumsum(widths > max(GAP_S, GAP * np.median(widths))), 0, 0)
    low = np.searchsorted(records, first, side="right") - 1
    high = np.searchsorted(records, last)
    outside = (low < 0) | (high >= records.size)
    low, high = np.maximum(low, 0), np.minimum(high, records.size - 1)
    return np.asarray(outside | (count[high] > count[low]))
