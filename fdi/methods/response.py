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
- ``thrown``: for how long, s, in the air, its motors have gone from one end to the other and back.
  What swings less is a fact (``setup/oscillation.py``): many a sound vehicle does for a while
- ``rolled_against``, ``pitched_against``: the largest angle, rad, by which a plane has rolled or
  pitched at a stretch, in the last seconds, against what its ailerons or its elevator are meant to
  do
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.methods.columns import Columns, Method
from fdi.methods.setup.against import APART_S, LiftOff, asked_moments, turned_against
from fdi.methods.setup.motors import lacking, lift_offs, motor_thrusts
from fdi.methods.setup.oscillation import APART_S as SWINGS_S
from fdi.methods.setup.oscillation import swung, thrown
from fdi.methods.setup.records import Series, body_rates
from fdi.methods.setup.surfaces import meant, turned_against_surface
from fdi.telemetry import Log
from fdi.telemetry.events import Flight
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import ROTORS, motors_of
from fdi.windows import largest_between

UNITS: Final = {"turned_against": "rad", "swinging": "s", "thrown": "s"}
WINGED: Final = {"rolled_against": "rad", "pitched_against": "rad"}
_SURFACES: Final = ("aileron", "elevator")
_KEPT_S: Final = 3.0  # so long an angle counts: a stretch is over where the vehicle turns back


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
    moments = asked_moments(rates.t, thrusts, motors)
    parts = [
        _columns_of(
            seen, _flown(rates, moments, flight), may_swing=not flight.flew and slowest <= SWINGS_S
        )
        for seen, flight in zip(lift_offs(log, rates, thrusts, motors), log.flights, strict=True)
    ]
    if not parts:
        return "the vehicle was never armed"
    t = np.concatenate([own.t for own in parts])
    values = np.concatenate([own.values for own in parts], axis=1)
    return Columns(t, dict(zip(UNITS, values, strict=True)), "MOTORS", UNITS)


RESPONSE: Final = Method("response", response_columns)


def _on_wings(log: Log) -> Columns | str | None:
    """Return by how much a plane turns against its surfaces, or why that is not known.

    None where the log does not tell what they are given, which `fdi check` says.
    """
    rates = body_rates(log)
    asked = {s: found for s in _SURFACES if not isinstance(found := meant(log, s), str)}
    if rates is None or not asked:
        return None
    slowest = max(rates.period, *(one.period for one in asked.values()))
    if slowest > APART_S:
        return f"records are {slowest:.1f} s apart, too far to see how the vehicle turns"
    count = 1 + round(_KEPT_S / rates.period)
    columns, last = {}, np.arange(rates.t.size)  # each record and those before
    for name, surface in zip(WINGED, _SURFACES, strict=True):
        angle = np.full(rates.t.size, np.nan)
        if surface in asked:
            angle = turned_against_surface(surface, rates, asked[surface])
        columns[name] = largest_between(angle, np.maximum(last - count + 1, 0), last)
    return Columns(rates.t, columns, "OUTPUTS", WINGED)


def _flown(rates: Series, moments: Floats, flight: Flight) -> LiftOff:
    """Return what a flight holds in the air."""
    low, high = flight.airborne if flight.flew else (flight.end, flight.end)
    some = (rates.t >= low) & (rates.t < high)
    return LiftOff(rates.t[some], rates.values[:, some], moments[:, some])


def _columns_of(seen: LiftOff, flown: LiftOff, *, may_swing: bool) -> Series:
    """Return the columns, (3, n), of a flight; nan where they are not asked."""
    t = np.union1d(seen.t, flown.t)
    columns = np.full((len(UNITS), t.size), np.nan)
    early, late = np.isin(t, seen.t), np.isin(t, flown.t)
    columns[0, early] = turned_against(seen).angle
    if may_swing:
        axes = zip(seen.rates, seen.moments, strict=True)
        columns[1, early] = np.max([swung(seen.t, *axis) for axis in axes], axis=0)
    # about yaw motors do so little that a turn of the nose asks all of them
    columns[2, late] = np.max([thrown(flown.t, moment) for moment in flown.moments[:2]], axis=0)
    return Series(t, columns)
