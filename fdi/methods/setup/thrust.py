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

from fdi.methods.setup.interval import (
    Interval,
    by_parts,
    in_percent,
    in_words,
    numbers_of,
    of_time,
    verdict_of,
)
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
_LAST_S: Final = 10.0  # before the end in the air
_ALONE: Final = 0.9  # of that time, for which one motor alone accounts


def check_thrust(log: Log) -> Iterator[Check]:
    """Yield the thrust to weight, and how long motors are at their limit."""
    if log.vehicle not in ROTORS:
        return
    count = ROTORS[log.vehicle]
    if log.autopilot == "ardupilot" and not any(name.startswith("MOT_") for name in log.parameters):
        lacks = "the log does not hold by which curve the motors are driven"
        yield Check("thrust to weight", "not known", lacks)
        return
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
        shares = thrusts.values[:, hovering].mean(axis=0)
        yield _ratio(log, by_parts(lambda some: float(shares[some].mean()), shares.size))
    if flying.sum() >= 2 * _FEW:
        yield _limits(thrusts.t[flying], thrusts.values[:, flying] >= _FULL)


def _limits(t: Floats, full: NDArray[np.bool_]) -> Check:
    """Return how long a motor is at its limit, (m, n) by motor and record.

    A set-up lacks thrust in the poorer half of the flight as well; one that fails in flight, or a
    battery that runs down, drives the motors there from then on.
    """
    some = np.asarray(full.any(axis=0))
    found = of_time(some)
    halves = [of_time(half) for half in np.array_split(some, 2)]
    often = np.flatnonzero(full.mean(axis=1) >= _ALONE * found.value)
    who = f"motor {often[0] + 1}" if often.size == 1 and found.value else "a motor"
    share = in_percent(found)
    words = f"in {share} of the time in the air {who} is at its upper limit"
    verdict: Verdict = verdict_of(found, fine=_OFTEN, bad=_OFTEN)
    if verdict == "wrong" and min(half.least for half in halves) <= _OFTEN:
        verdict = "not known"
        if min(half.value for half in halves) <= _OFTEN:
            words += f", but not all along: most of it after {np.median(t[some]):.0f} s of the log"
    last = some[t >= t[-1] - _LAST_S]
    if found.value > _OFTEN and last.mean() > 0.5:
        words += f", and in {100 * last.mean():.0f} % of the last {_LAST_S:.0f} s of it"
    numbers = {
        **numbers_of("share", found),
        "share_of_last_10_s": float(last.mean()),
        "share_of_poorer_half": min(half.value for half in halves),
    }
    return Check(
        "motor limits",
        verdict,
        words,
        numbers,
        strikes=found.value > _OFTEN,
        rests_on=(*(f"motor_{number}" for number in range(1, len(full) + 1)), "battery"),
    )


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


def _ratio(log: Log, hover: Interval) -> Check:
    name = "thrust to weight"
    if hover.least <= 0:
        return Check(name, "not known", "the motors' outputs in a hover are below their range")
    straight = log.autopilot != "ardupilot" and not log.parameters.get("THR_MDL_FAC")
    least, low, most = (1 / hover.most, 1 / hover.value, 1 / hover.least)
    if straight:
        low, most = 1 / hover.value**2, most**2
    numbers = {
        **numbers_of("hover_thrust", hover),
        "ratio_least": least,
        "ratio_most": most,
    }
    told = in_words(Interval(low, least, most), "", digits=1)
    if straight:
        told = f"{least:.1f} to {most:.1f}, by the motors' curve"
    of_what = "range" if straight else "thrust"
    words = f"{told}: a hover takes {in_percent(hover)} of the motors' {of_what}"
    verdict: Verdict = "wrong" if most < LEAST else "in order" if least >= LEAST else "not known"
    return Check(name, verdict, words, numbers, strikes=low < LEAST)
