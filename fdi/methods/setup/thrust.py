"""Has a multicopter thrust to spare?

In: a log. Out: two `Check`s. In a hover the motors carry the weight; what share of their largest
thrust that takes, by the curve that is set, is the weight over the thrust. Below 1.5 a gust or a
turn leaves nothing to recover with: ArduPilot learns a hover thrust of at most 0.6875, a ratio of
1.45 (AP_MotorsMulticopter.h, AP_MOTORS_THST_HOVER_MAX), and calls 0.2 to 0.6 usual (wiki, "Setting
Hover Throttle"). A motor at the end of its range controls nothing more.

PX4 does not say how a motor's thrust grows with its output unless ``THR_MDL_FAC`` is set: between
straight (the ratio that is told) and by the square (more).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.setup.motors import motor_thrusts
from fdi.methods.setup.records import attitude, series, stretches, within
from fdi.methods.setup.values import Check, Verdict
from fdi.telemetry import Log
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import ROTORS, Motor

LEAST: Final = 1.5
_LEVEL: Final = np.radians(15.0)
_STEADY: Final = 0.5  # m/s, climb
_FEW: Final = 20
_FULL: Final = 0.98  # of the largest thrust
_OFTEN: Final = 0.05  # of the time in the air


def check_thrust(log: Log) -> Iterator[Check]:
    """Yield the thrust to weight, and how long motors are at their limit."""
    if log.vehicle not in ROTORS:
        return
    count = ROTORS[log.vehicle]
    thrusts = motor_thrusts(log, tuple(Motor(n, 0.0, 0.0, 0.0) for n in range(1, count + 1)))
    flights = tuple(part for part in stretches(log) if not part.is_start)
    if thrusts is None or not flights:
        lacks = "a flight" if thrusts is not None else "what every motor is given"
        yield Check("thrust to weight", "not known", f"the log does not hold {lacks}")
        return
    flying = within(thrusts.t, flights)
    hovering = flying & _hovers(log, thrusts.t)
    if hovering.sum() < _FEW:
        yield Check(
            "thrust to weight", "not known", "the vehicle does not hover level and steadily"
        )
    else:
        yield _ratio(log, float(np.median(thrusts.values[:, hovering].mean(axis=0))))
    if flying.sum() >= 2 * _FEW:
        yield _limits(np.any(thrusts.values[:, flying] >= _FULL, axis=0))


def _limits(full: NDArray[np.bool_]) -> Check:
    """Return whether a motor is at its limit all along: in the poorer half of the flight as well.

    One that fails in flight drives the others there from then on, which is no matter of set-up.
    """
    halves = np.array_split(full, 2)
    share, least = float(full.mean()), min(float(half.mean()) for half in halves)
    verdict: Verdict = "wrong" if least > _OFTEN else "in order"
    words = f"in {100 * share:.1f} % of the time in the air a motor is at its upper limit"
    late = "" if verdict == "wrong" or share <= _OFTEN else ", but not all along"
    return Check("motor limits", verdict, words + late, {"share": share, "share_least": least})


def _hovers(log: Log, t: Floats) -> NDArray[np.bool_]:
    """Return when the vehicle is level and neither climbs nor sinks, (n,) bool."""
    known, climb = attitude(log), series(log, "VFR_HUD", ("climb",))
    level = np.zeros(t.size, np.bool_)
    if known is not None:
        tilt = np.hypot(*known.values[:2])
        level = np.interp(t, known.t, tilt) < _LEVEL
    if climb is not None:
        level &= np.abs(np.interp(t, climb.t, climb.values[0])) < _STEADY
    return level


def _ratio(log: Log, hover: float) -> Check:
    name = "thrust to weight"
    if hover <= 0:
        return Check(name, "not known", "the motors' outputs in a hover are below their range")
    straight = log.autopilot != "ardupilot" and not log.parameters.get("THR_MDL_FAC")
    low, high = 1 / hover, 1 / (hover**2 if straight else hover)
    numbers = {"hover_thrust": hover, "ratio_least": low, "ratio_most": high}
    told = f"{low:.1f}" if not straight else f"{low:.1f} to {high:.1f}, by the motors' curve"
    of_what = "range" if straight else "thrust"
    words = f"{told}: a hover takes {100 * hover:.0f} % of the motors' {of_what}"
    verdict: Verdict = "wrong" if high < LEAST else "in order" if low >= LEAST else "not known"
    return Check(name, verdict, words, numbers)
