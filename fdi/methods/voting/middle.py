"""Which unit of a sensor departs from the middle of all?

In: a log and one of its flights. Out: of every unit how far it is off the mid value of all, in the
sensor's SI unit, at the records of the first unit: the mid-value rule of redundant flight controls
(of an even number the lower middle value). A unit that jumps to its limit (hard-over) and one that
drifts away (slow-over) leave the middle where it was, so the other units stay beside it: of three
the one that departs is known. Of two it is not; what compares these is the models' own.

Each unit's zero is that of the beginning of the flight; what was there then shows nowhere. What
wrong scales, alignments and moments make of a manoeuvre is taken off, and as much as a unit shakes.
Who repeats another unit, or is whichever one the autopilot selects, has no vote: two votes of one
unit would outvote a third.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.estimator.ratios import LEVEL_S, trailing_mean
from fdi.methods.heading.twins import ALIKE, LATE, LOOP_S
from fdi.telemetry import Log
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.message import Floats, Message

LEAST: Final = 3
"""So many units have a middle that one of them cannot move."""
SELECTED: Final = frozenset({"sensor_combined", "vehicle_air_data"})
"""PX4's topics that hold whichever unit it selects."""
INERTIAL: Final = (("RAW_IMU", "SCALED_IMU"), ("SCALED_IMU2",), ("SCALED_IMU3",))
PRESSURES: Final = (("SCALED_PRESSURE",), ("SCALED_PRESSURE2",), ("SCALED_PRESSURE3",))


class Sensor(NamedTuple):
    """A sensor of which a vehicle may carry several units.

    Attributes
    ----------
    name : str
        The component.
    unit : str
    sources : tuple of tuple of str
        Of each unit the messages that may hold it, the first one there counts.
    fields : tuple of str
        The axes.
    alike : float
        By which share of a change two healthy units may differ.
    """

    name: str
    unit: str
    sources: tuple[tuple[str, ...], ...]
    fields: tuple[str, ...]
    alike: float


# a compass is calibrated to a sphere: 9 of 400 mGauss an axis (models/shared/compass.yaml) are 2 %
SENSORS: Final = (
    Sensor("gyroscope", "rad/s", INERTIAL, ("xgyro", "ygyro", "zgyro"), ALIKE),
    Sensor("accelerometer", "m/s^2", INERTIAL, ("xacc", "yacc", "zacc"), ALIKE),
    Sensor("compass", "T", INERTIAL, ("xmag", "ymag", "zmag"), ALIKE),
    Sensor("barometer", "Pa", PRESSURES, ("press_abs",), 0.0),
)


def mid_value(values: Floats) -> Floats:
    """Return the middle of values (units, ...), of an even number the lower one of both.

    It is unknown, NaN, where a unit is.

    Examples
    --------
    >>> mid_value(np.array([[1.0, 1.0], [2.0, np.nan], [9.0, 3.0]]))
    array([ 2., nan])
    >>> float(mid_value(np.array([1.0, 4.0, 2.0, 9.0])))
    2.0
    """
    ordered = np.sort(values, axis=0)[(len(values) - 1) // 2]
    found: Floats = np.where(np.isnan(values).any(axis=0), np.nan, ordered)[()]
    return found


def departures(log: Log, sensor: Sensor, air: tuple[float, float]) -> tuple[Floats, Floats] | None:
    """Return times in the air, (n,) s, and how far each unit is off the middle, (units, n).

    None where fewer than three units can be compared.
    """
    units = list(_units(log, sensor))
    if len(units) < LEAST:
        return None
    first = units[0]
    t = first.t[(first.t >= air[0]) & (first.t <= air[1])]
    if t.size < 3:
        return None
    known, late = zip(*(_at(unit, sensor, t) for unit in units), strict=True)
    values = np.array(known)
    start = t[0] + SETTLING_S
    begins = (t >= start) & (t < start + LEVEL_S) & np.isfinite(values).all(axis=(0, 1))
    if not begins.any() or _is_repeated(values[..., begins]):
        return None
    zero = np.median((values - mid_value(values))[..., begins], axis=2)
    own = values - zero[..., None]
    middle = mid_value(own)
    off = np.array([_beyond_shaking(t, unit) for unit in own - middle])
    changed = middle - np.median(middle[:, begins], axis=1)[:, None]
    steps = np.abs(np.diff(middle, axis=1)) / np.diff(t)
    faster = np.maximum(np.pad(steps, ((0, 0), (0, 1))), np.pad(steps, ((0, 0), (1, 0))))
    apart = np.max(late, axis=0) + LOOP_S
    allowed = trailing_mean(t, _length([*(sensor.alike * changed), *(faster * apart)]))
    told = np.maximum(off - allowed, 0.0)
    return t, np.where(t >= start, told, np.nan)


def _beyond_shaking(t: Floats, off: Floats) -> Floats:
    """Return how far the mean of some axes, (axes, n), is off by more than they scatter, (n,).

    A unit that shakes by itself, or against its stops, has a mean that is wrong by up to as much.
    """
    mean = np.array([trailing_mean(t, axis) for axis in off])
    square = trailing_mean(t, np.square(off).sum(axis=0)) - np.square(mean).sum(axis=0)
    return np.asarray(_length([*mean]) - np.sqrt(np.maximum(square, 0.0)))


def _units(log: Log, sensor: Sensor) -> Iterator[Message]:
    for names in sensor.sources:
        for name in names:
            message = log.messages.get(name)
            if (
                message is not None
                and message.made_from not in SELECTED
                and len(message) > 1
                and all(field in message for field in sensor.fields)
                and any(message.si(field).any() for field in sensor.fields)
            ):
                yield message
                break


def _at(unit: Message, sensor: Sensor, t: Floats) -> tuple[Floats, Floats]:
    """Return a unit's axes at some times, (axes, n), and how far its next record is, (n,) s.

    Both are unknown where that is far.
    """
    after = np.clip(np.searchsorted(unit.t, t), 1, len(unit) - 1)
    late = np.minimum(np.abs(unit.t[after] - t), np.abs(unit.t[after - 1] - t))
    late[late > LATE * max(np.median(np.diff(t)), np.median(np.diff(unit.t)))] = np.nan
    values = np.array([unit.si(field) for field in sensor.fields])
    at = np.array([np.interp(t, unit.t, axis) for axis in values])
    return np.where(np.isfinite(late), at, np.nan), late


def _is_repeated(values: Floats) -> bool:
    """Return whether two units, (units, axes, n), say the very same most of the time."""
    return any(
        float((one == other).all(axis=0).mean()) > 0.5 for one, other in combinations(values, 2)
    )


def _length(axes: Sequence[Floats]) -> Floats:
    found: Floats = np.sqrt(np.sum(np.square(axes), axis=0))
    return found
