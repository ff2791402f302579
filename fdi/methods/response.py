"""Does a vehicle turn as its motors or ailerons are asked to, from the first moment on?

In: a log. Out: `Columns` at the records of the body rates. Nothing is learned and nothing needs a
calm beginning: a vehicle that turns over as it leaves the ground has none.

- ``turned_against``: the largest angle, rad, by which it turned about roll or pitch against what
  its motors were asked for (``setup/against.py``), up to a few seconds after take-off. It stands
  there from when the rotors begin to turn: what is mounted wrongly was so before it showed. Later
  on the tests of the motors see it
- ``swinging``: for how long, s, a vehicle that never left the ground has swung about an axis, and
  its motors with it. On legs that give, a healthy one may swing as well until it lifts off, so one
  that flew is not asked
- ``rolled_against``: the largest angle, rad, by which a plane has rolled at a stretch, in the last
  seconds, against what its ailerons are meant to do
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import maximum_filter1d

from fdi.methods.columns import Columns, Method
from fdi.methods.setup.against import APART_S, LiftOff, turned_against
from fdi.methods.setup.motors import lacking, lift_offs, motor_thrusts
from fdi.methods.setup.records import Series, body_rates
from fdi.methods.setup.surfaces import meant, rolled_against
from fdi.telemetry import Log
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import ROTORS, motors_of
from fdi.windows import runs_of

UNITS: Final = {"turned_against": "rad", "swinging": "s"}
WINGED: Final = {"rolled_against": "rad"}
_KEPT_S: Final = 3.0  # so long an angle counts: a stretch is over where the vehicle turns back
_SWING_S: Final = 0.5  # over which a swing is taken: of 2 Hz and more, no person's hand
_SWING_APART_S: Final = 0.15  # records further apart show no such swing
_SWINGS: Final = 0.2  # rad/s, root mean square: rotors shake a vehicle that stands by 0.03 to 0.08
_DRIVEN: Final = (
    0.05  # of the largest moment; with half of it a low hover at 3.5 % of throttle swings, too
)


def response_columns(log: Log) -> Columns | str | None:
    """Return how a vehicle turns against motors or ailerons, or why that is not known."""
    if log.vehicle in ("plane", "vtol"):
        return _on_wings(log)
    if log.vehicle not in ROTORS:
        return None
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    lacks = lacking(log, motors)
    rates, thrusts = body_rates(log), motor_thrusts(log, motors)
    if lacks or rates is None or thrusts is None:
        return lacks
    slowest = max(rates.period, thrusts.period)
    if slowest > APART_S:
        return f"records are {slowest:.1f} s apart, too far to see how the vehicle turns"
    parts = [
        _columns_of(seen, may_swing=not flight.flew and slowest <= _SWING_APART_S)
        for seen, flight in zip(lift_offs(log, rates, thrusts, motors), log.flights, strict=True)
    ]
    if not parts:
        return "the vehicle was never armed"
    t = np.concatenate([own.t for own in parts])
    values = np.concatenate([own.values for own in parts], axis=1)
    return Columns(t, dict(zip(UNITS, values, strict=True)), "MOTORS", UNITS)


RESPONSE: Final = Method("response", response_columns)


def _on_wings(log: Log) -> Columns | str | None:
    """Return by how much a plane rolls against its ailerons, or why that is not known.

    None where the log does not tell what they are given, which `fdi check` says.
    """
    rates, asked = body_rates(log), meant(log, "aileron")
    if rates is None or isinstance(asked, str):
        return None
    slowest = max(rates.period, asked.period)
    if slowest > APART_S:
        return f"records are {slowest:.1f} s apart, too far to see how the vehicle rolls"
    angle = rolled_against(rates, asked)
    count = 1 + round(_KEPT_S / rates.period)
    kept = maximum_filter1d(angle, count, origin=(count - 1) // 2)  # this one and those before
    return Columns(rates.t, {"rolled_against": kept}, "OUTPUTS", WINGED)


def _columns_of(seen: LiftOff, *, may_swing: bool) -> Series:
    """Return both columns, (2, n), of a flight; the second unknown where that is not asked."""
    against = np.full(seen.t.size, turned_against(seen).angle)
    swung = np.full(seen.t.size, np.nan)
    if may_swing:
        axes = zip(seen.rates, seen.moments, strict=True)
        swung = np.max([_swung(seen.t, *axis) for axis in axes], axis=0)
    return Series(seen.t, np.array([against, swung]))


def _swung(t: Floats, rate: Floats, moment: Floats) -> Floats:
    """Return for how long, s, a vehicle has swung about an axis, 0 where it does not, (n,)."""
    swings = (_scatter(t, rate) > _SWINGS) & (_scatter(t, moment) > _DRIVEN)
    lasted = np.zeros(t.size)
    for low, high in runs_of(swings):
        lasted[low:high] = t[low:high] - t[low]
    return lasted


def _scatter(t: Floats, values: Floats) -> Floats:
    """Return the root mean square about the mean of half a second around, (n,)."""
    return np.sqrt(_around(t, (values - _around(t, values)) ** 2))


def _around(t: Floats, values: Floats) -> Floats:
    total = np.insert(np.cumsum(values), 0, 0.0)
    low = np.searchsorted(t, t - _SWING_S / 2)
    high = np.searchsorted(t, t + _SWING_S / 2, side="right")
    return np.asarray((total[high] - total[low]) / (high - low))
