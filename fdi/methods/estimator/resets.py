"""When did the estimator reset a part of its state, so that it jumped?

In: a log and its cores. Out: `Reset`s. PX4 counts its resets by state (``reset_count_*`` of a core,
``*_reset_counter`` of the output); ArduPilot logs the last shift of position (OFN, OFE).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.methods.estimator.records import Core
from fdi.methods.estimator.spans import Span
from fdi.telemetry import Log, Message

_OUTPUTS: Final = ("vehicle_local_position", "vehicle_global_position", "vehicle_attitude")
_STATES: Final = {
    "reset_count_vel_ne": "horizontal velocity",
    "reset_count_vel_d": "vertical velocity",
    "reset_count_pos_ne": "horizontal position",
    "reset_count_pod_d": "height",
    "reset_count_quat": "attitude",
    "xy_reset_counter": "horizontal position",
    "z_reset_counter": "height",
    "vxy_reset_counter": "horizontal velocity",
    "vz_reset_counter": "vertical velocity",
    "heading_reset_counter": "heading",
    "lat_lon_reset_counter": "horizontal position",
    "alt_reset_counter": "height",
    "quat_reset_counter": "attitude",
}
_SHIFTS: Final = ("OFN", "OFE", "EFE")
"""m, north and east; EKF1 calls the second EFE."""


@dataclass(frozen=True, slots=True)
class Reset:
    """The estimator's state jumped. ``core`` None: its output, whichever core flew."""

    t: float
    core: int | None
    state: str
    source: str


def resets_of(log: Log, cores: Sequence[Core], armed: Span) -> tuple[Reset, ...]:
    """Return the resets from arming to disarming, in the order of time."""
    found: list[Reset] = []
    for core in cores:
        found.extend(_counted(log[core.source], core.number))
        found.extend(_shifted(log[core.source], core.number))
    for key in _OUTPUTS:
        if key in log:
            found.extend(_counted(log[key], None))
    flown = [reset for reset in found if armed[0] <= reset.t <= armed[1]]
    return tuple(sorted(flown, key=lambda one: (one.t, one.source)))


def _counted(message: Message, core: int | None) -> Iterator[Reset]:
    for field, state in _STATES.items():
        if field in message:
            values = message.si(field)
            for row in (np.flatnonzero(np.diff(values) != 0) + 1).tolist():
                if np.isfinite(values[row - 1 : row + 1]).all():
                    yield Reset(float(message.t[row]), core, state, f"{message.key}.{field}")


def _shifted(message: Message, core: int) -> Iterator[Reset]:
    fields = [name for name in _SHIFTS if name in message]
    if not fields:
        return
    moved = np.any([np.diff(message.si(name)) != 0 for name in fields], axis=0)
    for row in (np.flatnonzero(moved) + 1).tolist():
        source = f"{message.key}.{'/'.join(fields)}"
        yield Reset(float(message.t[row]), core, "horizontal position", source)
