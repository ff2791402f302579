"""Which records of a log does a check of the set-up look at, and over which stretches?

In: a log. Out: columns at the records' own times, without gaps filled: what is sampled at 25 Hz is
not thinned to the rate of the slowest message, and nothing is made up between records.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from fdi.telemetry import Log
from fdi.telemetry.impact import OVER_S
from fdi.telemetry.message import Floats

FEW: Final = 10
"""Records, fewer of which tell nothing."""
_RATES: Final = (
    ("ATTITUDE", ("rollspeed", "pitchspeed", "yawspeed")),
    ("RAW_IMU", ("xgyro", "ygyro", "zgyro")),
)
_FASTER: Final = 1.2
_TIPPED: Final = np.radians(80.0)
_TURNS: Final = 0.3  # rad/s, more than a vehicle on its legs
_STANDS_S: Final = 1.0
SHORT_S: Final = 5.0
"""In the air for less than that is a take-off that failed: what precedes it counts as well."""


SPINS: Final = 3.5
"""rad/s, about any axis. A sensor 0.3 m off the axis reads g sin(22.5 deg) more from then on, and
records 0.1 s apart in time differ by 22.5 degrees: nothing of a set-up shows in a spin."""


class Series(NamedTuple):
    """Times (n,) s, ascending, and values (k, n), all of them known."""

    t: Floats
    values: Floats

    @property
    def period(self) -> float:
        """The usual time between two records, s."""
        return float(np.median(np.diff(self.t)))


class Stretch(NamedTuple):
    """From when to when, s; ``is_start``: a take-off that failed, partly on the ground."""

    start: float
    end: float
    is_start: bool = False


def series(log: Log, key: str, fields: tuple[str, ...], *, in_units: bool = False) -> Series | None:
    """Return fields of a message where all of them are known; None where there are hardly any.

    ``in_units``: only where the log states a unit of every field. Raw readings of sensors have none
    in telemetry that does not say by which autopilot.
    """
    message = log.messages.get(key)
    if message is None or any(name not in message for name in fields):
        return None
    if in_units and not all(message.unit(name) for name in fields):
        return None
    values = np.array([message.si(name) for name in fields])
    known = np.isfinite(values).all(axis=0)
    if known.sum() < FEW:
        return None
    return Series(message.t[known], values[:, known])


def body_rates(log: Log) -> Series | None:
    """Return roll, pitch and yaw rate, (3, n) rad/s, from the message that has them most often."""
    best: Series | None = None
    for key, fields in _RATES:
        found = series(log, key, fields, in_units=True)
        if found is not None and (best is None or best.period > _FASTER * found.period):
            best = found
    return best


def attitude(log: Log) -> Series | None:
    """Return roll, pitch and yaw, (3, n) rad; yaw is not unwrapped."""
    return series(log, "ATTITUDE", ("roll", "pitch", "yaw"))


def stretches(log: Log) -> tuple[Stretch, ...]:
    """Return when the vehicle flies upright, flight by flight; failed take-offs where none flew."""
    found = []
    for number, flight in enumerate(log.flights):
        start, end = flight.airborne
        over = [e.overturned for e in log.ends if e.flight == number and e.overturned is not None]
        last = min([end, *(t + OVER_S for t in over)])
        if last - start >= SHORT_S:
            found.append(Stretch(start, last))
        else:
            found.append(_failed_start(log, flight.start, flight.end))
    if not found and log.span[1] > log.span[0]:
        found.append(_failed_start(log, *log.span))
    found = [one for one in found if one.end > one.start]
    return tuple(one for one in found if not one.is_start) or tuple(found)


def _failed_start(log: Log, start: float, end: float) -> Stretch:
    """Return a short flight or none at all, while it turns: till it lies on its side.

    Before, the ground holds it, and what the motors do has no effect.
    """
    turned = body_rates(log)
    if turned is not None:
        # a gyroscope that is off shows as much at rest: the vehicle stands as it is armed
        first = (turned.t >= start) & (turned.t < start + _STANDS_S)
        rest = np.median(turned.values[:, first], axis=1) if first.any() else np.zeros(3)
        away = np.abs(turned.values - rest[:, None]).max(axis=0)
        fast = turned.t[(away > _TURNS) & (turned.t >= start)]
        start = max(start, *(fast[:1] - 2 * turned.period).tolist()) if fast.size else end
    known = attitude(log)
    if known is not None:
        roll, pitch, _ = known.values
        tipped = np.maximum(np.abs(roll), np.abs(pitch)) > _TIPPED
        after = known.t[tipped & (known.t >= start)]
        end = min([end, *after[:1].tolist()])
    return Stretch(start, end, is_start=True)


def spins(log: Log, t: Floats, most: float = SPINS) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return when the vehicle turns faster than ``most``, rad/s, (n,) bool.

    By default as it does after a failure, and not as it is flown.
    """
    known = body_rates(log)
    if known is None:
        return np.zeros(t.size, np.bool_)
    return np.asarray(np.interp(t, known.t, np.linalg.norm(known.values, axis=0)) > most)


def within(t: Floats, parts: tuple[Stretch, ...]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which times lie in one of the stretches, (n,) bool."""
    inside = np.zeros(t.size, np.bool_)
    for part in parts:
        inside |= (t >= part.start) & (t <= part.end)
    return inside
