"""Is a compass calibrated, told the right declination, and far enough from the motors' current?

In: a log. Out: a `Check` for each of these.

================  ==================================================================================
declination       ``COMPASS_DEC`` or ``EKF2_MAG_DECL`` where it is used, against the World Magnetic
                  Model at the place of the flight
strength          of the field against what ArduPilot arms with
offsets           ``COMPASS_OFS_X``, ``_Y``, ``_Z`` (``OFS2``, ``OFS3``) against the largest that
                  ArduPilot accepts: ``COMPASS_OFFS_MAX``, by default 1800 mgauss; before there was
                  that parameter 600 (AP_Compass.h, COMPASS_OFFSETS_MAX, up to Copter 3.4)
interference      how far readings move with the battery's current, per ampere, beside the turning
                  of the vehicle; at the largest current in flight against the Earth's field. Above
                  30 % is a grey zone, above 60 % bad, says ArduPilot of its compassmot
================  ==================================================================================
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from fdi.methods.setup.compass import (
    COMPASSES,
    FIELDS,
    STRONGEST_T,
    WEAKEST_T,
    as_used,
    compass_readings,
    earth_field,
    in_flight,
    use_parameter,
)
from fdi.methods.setup.interval import Interval, Mask, by_parts, in_percent, numbers_of
from fdi.methods.setup.orientation import place_of
from fdi.methods.setup.records import Series, attitude, series, stretches, within
from fdi.methods.setup.turned import FITS
from fdi.methods.setup.values import Check, Setting, Verdict
from fdi.model.world import world_value
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

_DECLINATION_OFF: Final = np.radians(10.0)
_STANDS_IN: Final = (
    "so much that it may stand in for the orientation of a compass that is mounted turned; to set "
    "one of both alone would turn the heading by as much"
)
_LARGEST_MG: Final = (600.0, 1800.0)
"""Where the log does not tell it: of old firmware and of new."""
_GREY: Final = 0.3
_BAD: Final = 0.6
_SURE: Final = 5.0  # standard errors
_LEAST: Final = 50  # readings
_SWING_A: Final = 3.0  # between the smallest and the largest current, for anything to show


def check_declination(log: Log) -> Iterator[Check]:
    """Yield whether the declination that is set is that of the place."""
    name = "declination"
    told = _declination(log)
    place = world_value("magnetic_declination", log)
    if told is None:
        return
    if place is None:
        yield Check(name, "not known", "the log tells no place")
        return
    off = (told - place + np.pi) % (2 * np.pi) - np.pi
    here, there = np.degrees(told), np.degrees(place)
    words = f"set to {here:.1f} degrees, the place has {there:.1f}"
    verdict: Verdict = "wrong" if abs(off) > _DECLINATION_OFF else "in order"
    numbers = {"set_deg": float(here), "place_deg": float(there)}
    if abs(off) > FITS:
        yield Check(name, "not known", f"{words}: {_STANDS_IN}", numbers, strikes=True)
        return
    why = f"The place has {there:.1f} degrees, and {here:.1f} are used"
    settings = _by_the_place(log, why) if verdict == "wrong" else ()
    yield Check(name, verdict, words, numbers, settings)


def _by_the_place(log: Log, why: str) -> tuple[Setting, ...]:
    """Return the parameter by which an autopilot takes the declination from its own table."""
    if log.autopilot == "ardupilot":
        return (Setting("COMPASS_AUTODEC", log.parameters.get("COMPASS_AUTODEC"), 1.0, why),)
    kind = log.parameters["EKF2_DECL_TYPE"]
    return (Setting("EKF2_DECL_TYPE", kind, float(int(kind) | 1), why),)


def _declination(log: Log) -> float | None:
    """Return the declination that the autopilot uses all along, rad, or None.

    ArduPilot overwrites it at the first fix, and so does PX4 unless it is told not to.
    """
    if log.autopilot == "ardupilot" and log.parameters.get("COMPASS_AUTODEC") == 0:
        return log.parameters.get("COMPASS_DEC")
    kind = log.parameters.get("EKF2_DECL_TYPE")
    if log.autopilot == "px4" and kind is not None and not int(kind) & 1:
        degrees = log.parameters.get("EKF2_MAG_DECL")
        return None if degrees is None else float(np.radians(degrees))
    return None


def check_strength(log: Log) -> Iterator[Check]:
    """Yield whether a compass reads a field that may be the Earth's."""
    for number, key in enumerate(COMPASSES, 1):
        records = series(log, key, FIELDS, in_units=True)
        if records is None:
            continue
        name, flying = f"field at compass {number}", within(records.t, stretches(log))
        if not np.any(np.ptp(records.values, axis=1)):
            # telemetry sends nothing but 0 of a compass that is not there
            if log.parameters.get(use_parameter(number)):
                yield _constant(f"readings of compass {number}", records)
        elif flying.sum() >= _LEAST:
            yield as_used(_strength(name, log, records, flying), log, number)


def _constant(name: str, records: Series) -> Check:
    told = ", ".join(f"{1e7 * axis[0]:.0f}" for axis in records.values)
    words = f"it measures nothing: each of its {records.t.size} records is {told} mgauss"
    return Check(name, "wrong", words)


def _strength(name: str, log: Log, records: Series, flying: Mask) -> Check:
    sizes = 1e7 * np.linalg.norm(records.values, axis=0)
    low, high = 1e7 * WEAKEST_T, 1e7 * STRONGEST_T
    own = sizes[flying]
    reads = by_parts(lambda some: float(np.median(own[some])), own.size, 0.0)
    numbers = numbers_of("field_mgauss", reads)
    words = f"in flight it reads {reads.value:.0f} mgauss"
    stands = records.t < min(part.start for part in stretches(log))
    if stands.sum() >= _LEAST:
        before = float(np.median(sizes[stands]))
        words += f", before it {before:.0f}"
        numbers["before_mgauss"] = before
    if low <= reads.least and reads.most <= high:
        return Check(name, "in order", words, numbers)
    words += f", and ArduPilot arms with {low:.0f} to {high:.0f}"
    sure = reads.most < low or reads.least > high
    return Check(name, "wrong" if sure else "not known", words, numbers, strikes=True)


def check_offsets(log: Log) -> Iterator[Check]:
    """Yield whether the offsets of a compass are larger than its autopilot accepts."""
    for number, mark in enumerate(("", "2", "3"), 1):
        found = [log.parameters.get(f"COMPASS_OFS{mark}_{axis}") for axis in "XYZ"]
        if any(one is None for one in found) or not any(found):
            continue
        size = float(np.linalg.norm([float(one or 0.0) for one in found]))
        told = log.parameters.get("COMPASS_OFFS_MAX", 0.0)
        least, most = (told, told) if told > 0 else _LARGEST_MG
        old = "" if least == most else f" ({least:.0f} by firmware before Copter 3.5)"
        words = f"{size:.0f} mgauss, accepted up to {most:.0f}{old}"
        name = f"offsets of compass {place_of(log.parameters, number)}"
        verdict: Verdict = "wrong" if size > most else "in order" if size <= least else "not known"
        yield Check(name, verdict, words, {"offset_mgauss": size, "largest_mgauss": most})


def check_interference(log: Log) -> Iterator[Check]:
    """Yield whether the current of the motors moves what a compass reads."""
    current = series(log, "BATTERY_STATUS", ("current_battery",))
    known, model = attitude(log), earth_field(log)
    for number, key in enumerate(COMPASSES, 1):
        readings = compass_readings(log, key, in_units=True)
        if readings is None:
            continue
        name = f"interference at compass {number}"
        if current is None or np.ptp(current.values) < _SWING_A:
            yield Check(name, "not known", "the log holds no current of the battery that changes")
        elif known is None or model is None:
            yield Check(name, "not known", "the log holds no attitude, or tells no place")
        else:
            strength = float(np.linalg.norm(model))
            found = _interference(name, log, readings, known, current, strength)
            yield as_used(found, log, number)


def _interference(
    name: str, log: Log, readings: Series, known: Series, current: Series, strength: float
) -> Check:
    turn, body = in_flight(log, readings, known, *current.t[[0, -1]])
    amperes = np.interp(turn.t, current.t, current.values[0])
    low, high = np.percentile(amperes, (5, 95)) if amperes.size >= _LEAST else (0.0, 0.0)
    if high - low < _SWING_A:
        said = f"the current changes by {high - low:.1f} A in flight, too little to show it"
        return Check(name, "not known", said)
    size, error = _per_ampere(turn.values, body, amperes)
    # what is added to the Earth's field cannot be more than both are seen to be together
    bound = (float(np.linalg.norm(body, axis=1).max()) + strength) / strength
    share, least, most = (
        min(max(x, 0.0) * high / strength, bound)
        for x in (size, size - _SURE * error, size + _SURE * error)
    )
    numbers = {
        "mgauss_per_ampere": size * 1e7,
        "standard_error": error * 1e7,
        **numbers_of("share_of_field", Interval(share, least, most)),
    }
    words = (
        f"{size * 1e7:.1f} mgauss per ampere (standard error {error * 1e7:.1f}), "
        f"at {high:.0f} A {in_percent(Interval(share, least, most))} of the Earth's field"
    )
    verdict: Verdict = "wrong" if least > _BAD else "in order" if most < _GREY else "not known"
    unsure = "" if verdict != "not known" else ": a grey zone, or too uncertain"
    return Check(name, verdict, words + unsure, numbers, strikes=bool(share > _BAD))


def _per_ampere(turn: Floats, body: Floats, amperes: Floats) -> tuple[float, float]:
    """Return how far readings move per ampere, T/A, and its standard error.

    body = turn @ earth + own + moved * amperes, by least squares; the error counts residuals as
    often as they are independent by their own autocorrelation.
    """
    count = len(body)
    eye = np.broadcast_to(np.eye(3), (count, 3, 3))
    change = (amperes - amperes.mean())[:, None, None] * eye
    x = np.concatenate([turn, eye, change], axis=2).reshape(3 * count, 9)
    y = body.reshape(-1)
    solved = np.linalg.lstsq(x, y, rcond=None)[0]
    rest = (y - x @ solved).reshape(count, 3)
    follows = float(np.clip((rest[1:] * rest[:-1]).sum() / (rest**2).sum(), 0.0, 0.99))
    variance = (rest**2).sum() / (3 * count - 9) * (1 + follows) / (1 - follows)
    spread = variance * np.diag(np.linalg.pinv(x.T @ x))[6:]
    return float(np.linalg.norm(solved[6:])), float(np.sqrt(spread.sum()))
