"""What is looked at when a set-up is checked? One table.

In: a log. Out: all `Check`s, in the order of the table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

from fdi.errors import LogError
from fdi.methods.setup.agreement import check_agreement
from fdi.methods.setup.battery import check_battery
from fdi.methods.setup.compass import check_compasses
from fdi.methods.setup.field import (
    check_declination,
    check_interference,
    check_offsets,
    check_strength,
)
from fdi.methods.setup.heading import check_heading
from fdi.methods.setup.motors import check_motors
from fdi.methods.setup.mounting import check_mounting
from fdi.methods.setup.oscillation import check_oscillation
from fdi.methods.setup.surfaces import check_surfaces
from fdi.methods.setup.thrust import check_thrust
from fdi.methods.setup.values import Check
from fdi.methods.setup.vibration import check_vibration
from fdi.methods.setup.witnesses import decided
from fdi.telemetry import Log

CHECKS: Final[tuple[Callable[[Log], Iterator[Check]], ...]] = (
    check_motors,
    check_surfaces,
    check_mounting,
    check_compasses,
    check_agreement,
    check_heading,
    check_declination,
    check_strength,
    check_offsets,
    check_interference,
    check_vibration,
    check_oscillation,
    check_thrust,
    check_battery,
)

_NEEDED: Final = ("ATTITUDE", "RAW_IMU", "SERVO_OUTPUT_RAW")
"""One of these at least."""


def check_setup(log: Log) -> tuple[Check, ...]:
    """Return what a log shows of how its vehicle was set up.

    Parameters
    ----------
    log : Log
        A flight, or a take-off that failed.

    Raises
    ------
    LogError
        The log holds no message that any check looks at.
    """
    if not any(key in log for key in _NEEDED):
        raise LogError(
            "holds nothing that tells of a set-up",
            where=log.name,
            hint=f"needed: {', '.join(_NEEDED)}",
        )
    flown = _as_flown(log)
    return decided(tuple(check for look in CHECKS for check in look(flown)))


def _as_flown(log: Log) -> Log:
    """Return a log with the parameters with which it first left the ground.

    Whoever calibrates on the field does so with the recorder on.
    """
    first = next((flight.airborne[0] for flight in log.flights if flight.flew), log.span[0])
    changed = {one.name: one.new for one in log.parameter_changes if one.t <= first}
    return replace(log, parameters={**log.parameters, **changed}) if changed else log
