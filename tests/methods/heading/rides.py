"""Logs of a vehicle that turns and leans, and edits of their records."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from fdi.telemetry import Log, read
from fdi.telemetry.message import Column
from fdi.units import Conversion

from ..setup.sensors import Ride, write

FAILS = 30.0
METRE = 1 / 6.371e6
Edit = Callable[[np.ndarray, np.ndarray], np.ndarray]


def altered(log: Log, key: str, **edits: Edit) -> Log:
    """Return a log with other values, SI, of some fields: functions of time and values."""
    message = log[key]
    columns = dict(message.columns)
    t = np.interp(np.arange(message.stamp.size), message.kept, message.t)
    for name, edit in edits.items():
        own = edit(t, message.si_of_records(name))
        unit = message.unit(name)
        columns[name] = Column(load=lambda own=own: np.array(own), conversion=Conversion(unit))
    return log.with_message(replace(message, columns=columns, _cache={}))


def later(size: float) -> Edit:
    return lambda t, own: own + np.where(t >= FAILS, size, 0.0)


def flown(path: Path, ride: Ride | None = None) -> Log:
    """Return the log of a ride."""
    return read(write(path, ride or Ride()))
