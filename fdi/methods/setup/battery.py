"""Does the battery run down in flight, by what its autopilot itself calls low?

In: a log. Out: one `Check`, none where the autopilot has no limit or the log no voltage. The limits
are the vehicle's own: ``BATT_CRT_VOLT``, ``BATT_LOW_VOLT`` (ArduPilot; 0 sets none; before 4.0
``FS_BATT_VOLTAGE``, before 3.1 ``LOW_VOLT``), which act after ``BATT_LOW_TIMER`` seconds; of PX4,
which weighs the voltage by load and cells itself, what it makes of that: ``BAT_CRIT_THR``,
``BAT_LOW_THR`` of the charge. An empty battery is no mistake of the set-up, so nothing is wrong
here: it strikes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.setup.records import Series, Stretch, series, stretches, within
from fdi.methods.setup.values import Check
from fdi.telemetry import Log
from fdi.windows import runs_of

NAME: Final = "battery"
_VOLTS: Final = ("BATT_CRT_VOLT", "FS_BATT_VOLTAGE", "BATT_LOW_VOLT", "LOW_VOLT")
_SHARES: Final = ("BAT_CRIT_THR", "BAT_LOW_THR")
_ACTIONS: Final = {
    "BATT_CRT_VOLT": "BATT_FS_CRT_ACT",
    "BATT_LOW_VOLT": "BATT_FS_LOW_ACT",
    "FS_BATT_VOLTAGE": "FS_BATT_ENABLE",
    "BAT_CRIT_THR": "COM_LOW_BAT_ACT",
    "BAT_LOW_THR": "COM_LOW_BAT_ACT",
}
"""What an autopilot then does; 0 is nothing."""
_TIMER_S: Final = 10.0
"""BATT_LOW_TIMER, by default."""


class _Limit(NamedTuple):
    """What is limited, by which parameter, to what; ``scale`` and ``unit`` for a reader."""

    known: Series
    parameter: str
    least: float
    scale: float
    unit: str


def check_battery(log: Log) -> Iterator[Check]:
    """Yield whether the battery was below its autopilot's own limits in the air."""
    flights = tuple(part for part in stretches(log) if not part.is_start)
    found = [one for limit in _limits(log) if (one := _below(log, limit, flights)) is not None]
    if found:
        yield next((one for one in found if one.strikes), found[0])


def _limits(log: Log) -> Iterator[_Limit]:
    """Yield what the autopilot limits, the worst first."""
    volts = series(log, "SYS_STATUS", ("voltage_battery",))
    charge = series(log, "BATTERY_STATUS", ("battery_remaining",), in_units=True)
    told = (
        (volts, _VOLTS, "ardupilot", 1.0, "V"),
        (charge, _SHARES, "px4", 100.0, "% of its charge"),
    )
    for known, names, autopilot, scale, unit in told:
        for name in names:
            least = log.parameters.get(name, 0.0)
            if known is not None and autopilot == log.autopilot and least > 0:
                yield _Limit(known, name, least, scale, unit)


def _below(log: Log, limit: _Limit, flights: tuple[Stretch, ...]) -> Check | None:
    """Return for how long it is below a limit in the air, None where it is not recorded there."""
    t, (values,) = limit.known
    flying = within(t, flights)
    if not flying.any():
        return None
    last, scale, unit = float(values[flying][-1]), limit.scale, limit.unit
    digits = 1 if unit == "V" else 0
    own = f"{limit.parameter} is {scale * limit.least:.{digits}f} {unit}"
    numbers = {"limit": limit.least, "lowest": float(values[flying].min()), "last": last}
    long = log.parameters.get("BATT_LOW_TIMER", _TIMER_S)
    for start, stop in runs_of(flying & (values < limit.least)):
        for_s = float(t[stop - 1] - t[start])
        if for_s >= long:
            ends = "" if np.any(flying[stop:]) else ", to the end of the flight"
            text = (
                f"for {for_s:.0f} s from {t[start]:.0f} s of the log on{ends} it is below what the "
                f"autopilot calls low ({own}), and at {scale * last:.{digits}f} {unit} at the end"
            )
            action = _ACTIONS.get(limit.parameter, "")
            if log.parameters.get(action) == 0:
                text += f"; no action is set for it ({action} is 0)"
            return Check(NAME, "not known", text, {**numbers, "below_s": for_s}, strikes=True)
    text = f"it never stays below what the autopilot calls low ({own})"
    return Check(NAME, "in order", text, numbers)
