"""Whom do headings, tilts and forces point to that do not fit each other?

In: a log. Out: `Columns`, a record a cycle of the slowest source, in deviations of what is compared
(twins in dB). A column is how far a sensor is off both others beyond what these are off each
other, over 5 s: the odd one out of three as a number, not as a verdict, so that the same bounds
and the same likelihood judge it as any test.

- ``compass_alone``: heading against gyroscope and estimator, where the field against gyroscopes,
  and against gravity where that is known, says so too: what levels a compass alone accuses none
- ``compass_against_gravity``: the field against gravity and against gyroscopes, no estimator in it
- ``gyroscope_alone``: heading against compass and estimator, confirmed by the field
- ``gyroscope_against_gravity``: turns against gravity and against the field
- ``gyroscope_against_course``: on wings, turns against compass and course through the air, no
  estimator in it (``course.py``). Neither of these two is accused so: a compass may deviate on
  another heading, and a vehicle that slips flies where its nose does not point
- ``forces``: specific force against the receiver's velocity (``forces.py``)
- ``forces_beyond_turns``: the same at any heading, less what gyroscopes make of gravity that the
  field contradicts
- ``twins``: the gyroscopes of two units against each other (``twins.py``)
- ``compass_turned``: the angle, rad, by which a compass in use is turned about the vertical at
  least (``setup/turned.py``), from the log's first second on: a mount does not change
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.grid import uniform
from fdi.methods.columns import Columns, Method
from fdi.methods.heading.course import course_pairs
from fdi.methods.heading.forces import beyond_turns, force_pair
from fdi.methods.heading.increments import WINDOW_S, Pair, heading_pairs, sensor_pairs
from fdi.methods.heading.motion import Ride, ride_of
from fdi.methods.heading.twins import twins_growth
from fdi.methods.setup.compass import COMPASSES, compass_readings, earth_field, is_used
from fdi.methods.setup.turned import turned_about_the_vertical
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

SOURCE: Final = "RAW_IMU"
TWINS: Final = "twins"
TURNED: Final = "compass_turned"
UNITS: Final = {TWINS: "dB", TURNED: "rad"}
FIELDS: Final = (
    "compass_alone",
    "compass_against_gravity",
    "gyroscope_alone",
    "gyroscope_against_gravity",
    "gyroscope_against_course",
    "forces",
    "forces_beyond_turns",
    TWINS,
    TURNED,
)
_BEFORE_S: Final = 1.0


def heading_columns(log: Log) -> Columns | str:
    """Return who is the odd one out over a log, or why that cannot be told."""
    parts, why = [], "no flight is long enough"
    for number, flight in enumerate(log.flights):
        if not flight.flew:
            continue
        try:
            ride = ride_of(log, number)
            grid = ride.grid(WINDOW_S)
        except LogError as error:
            own = error.message.startswith("inertial records")
            why = f"the log's {error.message}" if own else f"the log {error.message}"
            continue
        if grid.size:
            parts.append((grid, _of_ride(log, ride, grid)))
    if not parts:
        return why
    before = uniform(log.span[0], parts[0][0][0], _BEFORE_S, records=log[SOURCE].t.size)
    parts.insert(0, (before, {name: np.full(before.size, np.nan) for name in FIELDS}))
    t = np.concatenate([grid for grid, _ in parts])
    values = {name: np.concatenate([own[name] for _, own in parts]) for name in FIELDS}
    values[TURNED] = np.full(t.size, compass_turned(log))
    if not any(np.isfinite(own).any() for own in values.values()):
        return "no two of its sensors can be compared"
    return Columns(t, values, SOURCE, UNITS)


HEADING: Final = Method("heading", heading_columns)


def compass_turned(log: Log) -> float:
    """Return by what angle, rad, one of the compasses in use is turned at least; NaN if unknown."""
    model = earth_field(log)
    if model is None:
        return np.nan
    sizes = []
    for number, key in enumerate(COMPASSES, 1):
        readings = compass_readings(log, key) if is_used(log, number) else None
        angle = None if readings is None else turned_about_the_vertical(log, readings, model)
        if angle is not None:
            sizes.append(max(angle.least, -angle.most, 0.0))
    return max(sizes, default=np.nan)


def _of_ride(log: Log, ride: Ride, grid: Floats) -> Mapping[str, Floats]:
    turned, leant = heading_pairs(ride, grid), sensor_pairs(ride, grid)
    by_name = {pair.name: _far(pair) for pair in (*turned, *leant)}
    compass_gyro, compass_estimator = by_name["compass-gyroscope"], by_name["compass-estimator"]
    gyro_estimator, field = by_name["gyroscope-estimator"], by_name["gyroscope-compass"]
    gyro_gravity, field_gravity = (
        by_name["accelerometer-gyroscope"],
        by_name["accelerometer-compass"],
    )
    confirmed = np.fmin(field, field_gravity)
    found = {
        "compass_alone": _odd((compass_gyro, compass_estimator, confirmed), gyro_estimator),
        "compass_against_gravity": _odd((field_gravity, field), gyro_gravity),
        "gyroscope_alone": _odd((compass_gyro, gyro_estimator, field), compass_estimator),
        "gyroscope_against_gravity": _odd((gyro_gravity, field), field_gravity),
        TWINS: _twins(log, ride, grid),
    }
    courses = course_pairs(ride, grid)
    if courses is not None:
        compass_gyro, compass_course, gyro_course = (_far(pair) for pair in courses)
        found["gyroscope_against_course"] = _odd((compass_gyro, gyro_course), compass_course)
    forces = force_pair(ride, grid)
    lengths = force_pair(ride, grid, any_heading=True)
    if forces is not None and lengths is not None:
        found["forces"] = _far(forces)
        if np.isfinite(leant[2].off).any():
            found["forces_beyond_turns"] = _far(beyond_turns(lengths, leant[2]))
    unknown = np.full(grid.size, np.nan)
    return {name: found.get(name, unknown) for name in FIELDS}


def _far(pair: Pair) -> Floats:
    return np.asarray(np.abs(pair.off) / pair.sigma)


def _odd(off: Sequence[Floats], agree: Floats) -> Floats:
    """Return by how much all of some pairs are further off than one that is to agree, above 0."""
    least: Floats = np.min(off, axis=0)  # unknown where one of them is
    return np.maximum(least - agree, 0.0)


def _twins(log: Log, ride: Ride, grid: Floats) -> Floats:
    found = twins_growth(log, ride.air)
    if found is None:
        return np.full(grid.size, np.nan)
    t, growth = found
    at = np.searchsorted(t, grid, side="right") - 1
    return np.where(at >= 0, growth[np.maximum(at, 0)], np.nan)
