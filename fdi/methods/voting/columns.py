"""Whom of three or more units of a sensor do the others outvote?

In: a log. Out: `Columns`, at the records of the first inertial unit, or of the first barometer
without one: ``gyroscope_3`` is how far the third gyroscope is off the middle of all
A log with fewer units has no such columns, and nothing is amiss with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fdi.methods.columns import Columns, Method
from fdi.methods.voting.middle import SENSORS, departures
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air
from fdi.telemetry.message import Floats

UNITS: Final[Mapping[str, str]] = {
    f"{sensor.name}_{number}": sensor.unit
    for sensor in SENSORS
    for number in range(1, len(sensor.sources) + 1)
}
"""Of every column; all of a sensor with fewer units are unknown."""


def voting_columns(log: Log) -> Columns | None:
    """Return how far every unit is off the middle of all; None where no sensor has three units."""
    found: dict[str, list[tuple[Floats, Floats]]] = {}
    sources: list[str] = []
    for sensor in SENSORS:
        for flight in log.flights:
            told = departures(log, sensor, in_air(flight)) if flight.flew else None
            if told is None:
                continue
            t, off = told
            sources.append(next(name for name in sensor.sources[0] if name in log))
            for number, own in enumerate(off, 1):
                found.setdefault(f"{sensor.name}_{number}", []).append((t, own))
    if not found:
        return None
    t = np.unique(np.concatenate([t for t, _ in next(iter(found.values()))]))
    values = {name: _on(t, found.get(name, ())) for name in UNITS}
    return Columns(t, values, sources[0], UNITS)


VOTING: Final = Method("voting", voting_columns)


def _on(t: Floats, parts: Sequence[tuple[Floats, Floats]]) -> Floats:
    """Return the latest value of each flight at some times, (n,); NaN outside of it."""
    values = np.full(t.size, np.nan)
    for own, off in parts:
        inside = (t >= own[0]) & (t <= own[-1])
        values[inside] = off[np.searchsorted(own, t[inside], side="right") - 1]
    return values
