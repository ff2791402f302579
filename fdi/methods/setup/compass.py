"""Is a compass turned, mirrored, disturbed by the motors?

In: a log. Out: a `Check` for each compass. The Earth's field does not move: what a compass reads,
put into earth axes by the attitude, is one vector, which the World Magnetic Model knows where the
log tells the place. For each of MAVLink's orientations, and for each axis reversed, that vector and
the compass' own constant field (hard iron, the calibration's leftover) are found by least squares;
what counts is by what angle the readings then miss the Earth's field. Before that, whether one is
turned about the vertical is asked of the gyroscopes, which no wrong heading misleads (`turned.py`).

A copter that turns level sees only a circle of the field: its downward part then is the Earth's
rather than the vehicle's, which is true of a compass that was calibrated (`_OWN`).

The trap for a maintainer: the heading in a log usually comes from that compass. One that is turned
about the vertical agrees with it; `heading.py` asks the receiver instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.setup.interval import Interval, by_parts, in_degrees, numbers_of
from fdi.methods.setup.orientation import orientation_of, turned_by
from fdi.methods.setup.records import Series, attitude, series, spins, stretches, within
from fdi.methods.setup.rotations import Rotation, sensor_rotations, to_earth
from fdi.methods.setup.turned import FITS, turned_about_the_vertical
from fdi.methods.setup.values import Check, Setting
from fdi.model.world import world_value
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

COMPASSES: Final = ("RAW_IMU", "SCALED_IMU2", "SCALED_IMU3")
FIELDS: Final = ("xmag", "ymag", "zmag")
MISSES: Final = "miss_as_set_deg"
"""Of the numbers of a compass' check, by what angle its readings miss the Earth's field."""
TURNED: Final = "turned_deg"
"""Likewise, by what angle the gyroscopes say that it is turned."""
ATTITUDE: Final = ("estimator",)
"""Who tells how the readings lie in earth axes: what a check rests on that its error would show."""
_WELL: Final = np.radians(10.0)
"""Another orientation fits: nine in ten compasses that are in order miss by less than 8 degrees."""
_HALF: Final = 0.5
"""Another orientation misses the field by less than this share of what the one set does."""
_APART: Final = np.radians(10.0)
"""By how much better the best orientation fits than all that are told from it."""
_SHOWS: Final = np.radians(5.0)
"""By how much worse every other orientation fits where the one set is in order."""
_MOST_OWN: Final = 0.3
"""More than this share of the Earth's field is no calibrated compass' own."""
_OWN: Final = 0.1
"""A calibrated compass' own field against the Earth's; enters where nothing shows it."""
_NOISE: Final = 0.05
_FEW: Final = 30
_MOST: Final = 3000
"""Readings, evenly thinned from more: neighbours say the same."""
WEAKEST_T: Final = 185e-7
STRONGEST_T: Final = 875e-7
"""Of the fields with which ArduPilot arms (AP_Arming, AP_COMPASS_MAGFIELD_MIN and _MAX)."""


class Fit(NamedTuple):
    """An orientation, and by what angles (n,), rad, readings miss the Earth's field with it."""

    rotation: Rotation
    misses: Floats

    @property
    def miss(self) -> float:
        """The root of their mean square."""
        return _root_mean_square(self.misses)


def check_compasses(log: Log) -> Iterator[Check]:
    """Yield for each compass of a log whether it is turned."""
    known, model = attitude(log), earth_field(log)
    found = all_readings(log)
    if not any(series(log, key, FIELDS) for key in COMPASSES):
        yield Check("compass", "not known", "the log holds no readings of a compass")
    for number, readings in found.items():
        name = f"compass {number}"
        if known is None:
            yield Check(name, "not known", "the log holds no attitude")
        elif model is None:
            yield Check(name, "not known", "the log tells no place, and so not where north is")
        else:
            turn, field = in_flight(log, readings, known)
            some = slice(None, None, -(-len(field) // _MOST) or 1)
            told_by = orientation_of(log, number)
            angle = turned_about_the_vertical(log, readings, model)
            turned = None if angle is None else _turned(name, angle, told_by)
            one = turned or _one(name, turn.values[some], field[some], model, told_by)
            yield as_used(one, log, number)


def is_used(log: Log, number: int) -> bool:
    """Return whether the autopilot uses a compass, 1 for the first, as far as parameters say.

    ArduPilot's ``COMPASS_USE``, ``COMPASS_USE2``, ``COMPASS_USE3``.
    """
    return log.parameters.get(use_parameter(number)) != 0


def use_parameter(number: int) -> str:
    """Return ArduPilot's parameter that says whether a compass is used, 1 for the first."""
    return f"COMPASS_USE{number if number > 1 else ''}"


def as_used(check: Check, log: Log, number: int) -> Check:
    """Return a check of a compass as it matters: one not in use is neither right nor wrong."""
    if is_used(log, number):
        return check
    text = f"{check.text} (the autopilot does not use it)"
    return replace(check, verdict="not known", text=text, strikes=False, rests_on=())


def earth_field(log: Log) -> Floats | None:
    """Return the Earth's field at the place of the flight, (3,) T, north, east, down; or None."""
    parts = ("magnetic_declination", "magnetic_inclination", "magnetic_strength")
    told = [world_value(part, log) for part in parts]
    if any(one is None for one in told):
        return None
    declination, inclination, strength = (float(one or 0.0) for one in told)
    flat = np.cos(inclination)
    east = np.array([np.cos(declination) * flat, np.sin(declination) * flat, np.sin(inclination)])
    return np.asarray(strength * east)


def all_readings(log: Log) -> dict[int, Series]:
    """Return what each compass that says something reads, by its number, 1 for the first."""
    told = ((number, compass_readings(log, key)) for number, key in enumerate(COMPASSES, 1))
    return {number: readings for number, readings in told if readings is not None}


def compass_readings(log: Log, key: str, *, in_units: bool = False) -> Series | None:
    """Return what a compass reads, (3, n) T; None for one that is not there or says nothing.

    Of a log that states no unit counts, whose direction tells as much; not ``in_units``.
    """
    found = series(log, key, FIELDS, in_units=in_units)
    return found if found is not None and np.any(np.ptp(found.values, axis=1)) else None


def in_flight(
    log: Log, readings: Series, known: Series, start: float = -np.inf, end: float = np.inf
) -> tuple[Series, Floats]:
    """Return attitudes (n, 3, 3), earth axes to body axes, and readings (n, 3), T, in flight.

    Not while the vehicle spins.
    """
    inside = within(readings.t, stretches(log)) & ~spins(log, readings.t)
    inside &= (readings.t >= max(known.t[0], start)) & (readings.t <= min(known.t[-1], end))
    t = readings.t[inside]
    angles = (np.interp(t, known.t, np.unwrap(row)) for row in known.values)
    return Series(t, np.transpose(to_earth(*angles), (0, 2, 1))), readings.values[:, inside].T


def _turned(name: str, angle: Interval, told_by: Setting | None) -> Check | None:
    """Return that a compass is turned about the vertical, or None where that is not sure."""
    least, most = sorted((abs(angle.least), abs(angle.most)))
    if angle.least * angle.most <= 0 or least <= FITS:
        return None
    if len({round(one / (2 * FITS)) for one in (least, most)}) > 1:
        return None  # by how many times 45 degrees, which mountings are apart, it does not tell
    off = Interval(abs(angle.value), least, most)
    side = "right" if angle.value > 0 else "left"
    nearest = f"YAW_{round(angle.value / (2 * FITS)) % 8 * 45}"
    text = (
        f"it is turned by {in_degrees(off)} to the {side} of how it is told to be mounted "
        f"({nearest}), by gyroscopes, gravity and the Earth's field"
    )
    numbers = numbers_of(TURNED, angle, float(np.degrees(1)))
    needed = next((one for one in sensor_rotations() if one.name == nearest), None)
    why = f"Its readings need a turn of {np.degrees(off.value):.0f} degrees to the {side}"
    settings = () if needed is None else turned_by(needed, told_by, why)
    return Check(name, "wrong", text, numbers, settings)


def _one(name: str, turn: Floats, field: Floats, model: Floats, told_by: Setting | None) -> Check:
    if len(field) < _FEW:
        return Check(name, "not known", "the log holds too few readings in flight")
    strength = float(np.median(np.linalg.norm(field, axis=1)))
    if not WEAKEST_T <= strength <= STRONGEST_T:
        said = f"it reads {strength * 1e7:.0f} mgauss, which is no field of the Earth"
        return Check(name, "not known", said)
    ways = (*sensor_rotations(), *_reversed())
    fits = sorted((_fit(turn, field, model, way) for way in ways), key=lambda fit: fit.miss)
    told = next(fit for fit in fits if fit.rotation.name == "NONE")
    best = fits[0]
    far = (fit for fit in fits if _is_told_apart(fit.rotation, best.rotation))
    rival = next(far, best)
    off = by_parts(lambda some: _root_mean_square(told.misses[some]), len(field), 0.0)
    with_best, with_next = (float(np.degrees(fit.miss)) for fit in (best, rival))
    numbers = {
        **numbers_of(MISSES, off, float(np.degrees(1))),
        "miss_best_deg": with_best,
        "miss_next_deg": with_next,
        "field_mgauss": strength * 1e7,
    }
    as_set = f"readings are {in_degrees(off)} off the Earth's field"
    if off.most < FITS:
        far = (fit for fit in fits if _is_told_apart(fit.rotation, told.rotation))
        return _fits_as_set(name, as_set, told, next(far), numbers)
    if off.value < FITS:
        return Check(name, "not known", f"{as_set}, which would be too many from 22.5 on", numbers)
    how = best.rotation.name
    if best.miss < min(_HALF * told.miss, _WELL) and rival.miss - best.miss > _APART:
        better = f"{as_set}, and {with_best:.0f} with {how} beside the orientation set"
        now = in_degrees(off)
        why = f"Readings are then {with_best:.0f} degrees off the Earth's field, now {now}"
        settings = turned_by(best.rotation, told_by, why)
        if off.least > FITS:
            # an attitude whose heading another compass has turned would show the same
            rests_on = ATTITUDE if _about_the_vertical(best.rotation) else ()
            text = f"it is turned: {better}"
            return Check(name, "wrong", text, numbers, settings, rests_on=rests_on)
        return Check(name, "not known", f"it may be turned: {better}", numbers, strikes=True)
    open_to = f"with {how} {with_best:.0f}, with {rival.rotation.name} {with_next:.0f}"
    text = f"{as_set}, and no one orientation stands out ({open_to})"
    strikes = bool(off.least > FITS)
    return Check(name, "not known", text, numbers, strikes=strikes, rests_on=ATTITUDE)


def _fits_as_set(name: str, as_set: str, told: Fit, rival: Fit, numbers: dict[str, float]) -> Check:
    """Return in order only where the readings would have shown another orientation."""
    numbers["miss_next_deg"] = float(np.degrees(rival.miss))
    if rival.miss - told.miss > _SHOWS:
        return Check(name, "in order", as_set, numbers)
    also = f"{rival.rotation.name} would fit with {np.degrees(rival.miss):.0f}"
    return Check(name, "not known", f"{as_set}, but {also}: the vehicle turns too little", numbers)


def _reversed() -> tuple[Rotation, ...]:
    """Return what no mounting makes, but a wrong driver or scale does: one axis reversed."""
    return tuple(
        Rotation(f"the {axis} axis reversed", np.diag(np.where(np.arange(3) == i, -1.0, 1.0)))
        for i, axis in enumerate("xyz")
    )


def _about_the_vertical(rotation: Rotation) -> bool:
    turn = rotation.matrix
    return bool(turn[2, 2] > 1 - 1e-6 and np.linalg.det(turn) > 0)


def _is_told_apart(one: Rotation, other: Rotation) -> bool:
    """Return whether some reading is put by more than 30 degrees elsewhere by the other one."""
    return bool(np.linalg.norm(one.matrix - other.matrix, 2) > 2 * np.sin(np.radians(15.0)))


def _fit(turn: Floats, field: Floats, model: Floats, rotation: Rotation) -> Fit:
    """Return by what angle readings, put into another orientation, miss the Earth's field.

    body = turn @ earth + own, by least squares; own is held small where nothing shows it.
    """
    body = field @ rotation.matrix.T
    count = len(body)
    crossed = turn.sum(axis=0)
    held = (count + (_NOISE / _OWN) ** 2 * count) * np.eye(3)
    left = np.block([[count * np.eye(3), crossed.T], [crossed, held]])
    right = np.concatenate([np.einsum("nij,ni->j", turn, body), body.sum(axis=0)])
    own = np.linalg.lstsq(left, right, rcond=None)[0][3:]
    own *= min(
        1.0, _MOST_OWN * float(np.linalg.norm(model)) / max(float(np.linalg.norm(own)), 1e-12)
    )
    seen, expected = body - own, turn @ model
    sizes = np.linalg.norm(seen, axis=1) * np.linalg.norm(expected, axis=1)
    cosine = (seen * expected).sum(axis=1) / np.maximum(sizes, np.finfo(float).tiny)
    return Fit(rotation, np.arccos(np.clip(cosine, -1.0, 1.0)))


def _root_mean_square(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
