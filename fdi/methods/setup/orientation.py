"""By which parameter is a compass told how it is mounted, and what should that be?

In: a log, or the rotation that its readings still need. Out: a `Setting`. A reading in a log has
been turned by the orientation that is set, so that the right one is what it still needs after that
one. ArduPilot numbers the parameters by the order in which it found the compasses, and the readings
by their priority (COMPASS_PRIO1_ID, since 4.1), and it leaves the parameter of one on its own board
alone: that one turns with AHRS_ORIENTATION. PX4 numbers by its calibrations, of which only a single
one is surely that of these readings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fdi.methods.setup.rotations import Rotation, rotation_numbers
from fdi.methods.setup.values import Setting
from fdi.telemetry import Log

_MOST = 3


def orientation_of(log: Log, number: int) -> Setting | None:
    """Return the parameter that orients a compass, 1 for the first; None where it is not known."""
    parameters = log.parameters
    if log.autopilot == "ardupilot":
        place = _found_as(parameters, number)
        name = "COMPASS_ORIENT" if place == 1 else f"COMPASS_ORIENT{place}"
        external = "COMPASS_EXTERNAL" if place == 1 else f"COMPASS_EXTERN{place}"
        if not parameters.get(external):
            return None
        return _setting(name, parameters)
    if log.autopilot == "px4":
        known = [n for n in range(_MOST + 1) if parameters.get(f"CAL_MAG{n}_ID")]
        return _setting(f"CAL_MAG{known[0]}_ROT", parameters) if len(known) == 1 else None
    return None


def turned_by(rotation: Rotation, told_by: Setting | None, why: str) -> tuple[Setting, ...]:
    """Return how a compass should be told to be mounted whose readings need a further rotation.

    Nothing where no parameter tells, or no orientation that has a number makes it.
    """
    if told_by is None or told_by.now is None:
        return ()
    numbers = rotation_numbers()
    now = numbers.get(int(told_by.now))
    if now is None:
        return ()
    needed = rotation.matrix @ now
    for number, matrix in numbers.items():
        if np.allclose(matrix, needed, atol=1e-6):
            return (replace(told_by, suggested=float(number), why=why),)
    return ()


def place_of(parameters: Mapping[str, float], found: int) -> int:
    """Return the number by which a log knows the compass that ArduPilot found as which, from 1."""
    numbers = (n for n in range(1, _MOST + 1) if _found_as(parameters, n) == found)
    return next(numbers, found)


def _setting(name: str, parameters: Mapping[str, float]) -> Setting | None:
    return Setting(name, parameters[name]) if name in parameters else None


def _found_as(parameters: Mapping[str, float], number: int) -> int:
    """Return as which compass ArduPilot found the one of a priority, both from 1."""
    own = parameters.get(f"COMPASS_PRIO{number}_ID")
    if not own:
        return number
    for place in range(1, _MOST + 1):
        if parameters.get(f"COMPASS_DEV_ID{'' if place == 1 else place}") == own:
            return place
    return number
