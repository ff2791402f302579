"""By what angle does a vehicle turn against the moment that its motors are asked for?

In: rates and what the motors are given. Out: the angle at a stretch. The harder a controller acts
on motors in a wrong order, on one that gives no thrust, or from a board that is turned, the faster
the vehicle turns; a healthy one is stopped within a fraction of a turn, and one that the ground
tips over lies on its back after half of one.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from fdi.methods.setup.arrangements import directions_of
from fdi.methods.setup.records import Series
from fdi.telemetry.events import Flight
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import Motor
from fdi.windows import runs_of

HALF_A_TURN: Final = np.pi
LEFT_S: Final = 3.0
"""After take-off: by then most whose motors act otherwise have turned over; others fly a while."""
APART_S: Final = 0.3
"""Records further apart do not show how far it turned."""
_LATE_S: Final = 0.05
"""By which thrust follows an output; none or twice as much changes no answer."""
_ASKED: Final = 0.1
"""Of the largest moment, half of the motors at full and the others at none: asked in earnest."""
_TURNS: Final = 1.0  # rad/s: slower, a gyroscope's offset adds up while a vehicle stands


class Against(NamedTuple):
    """An angle, rad, turned at a stretch from ``since``, s, on."""

    angle: float
    since: float


class LiftOff(NamedTuple):
    """Rates and moments asked for, (3, n) each, at times, (n,) s, till a vehicle has lifted off."""

    t: Floats
    rates: Floats
    moments: Floats


def lift_off(rates: Series, moments: Floats, shares: Series, flight: Flight) -> LiftOff:
    """Return what a flight holds from when its rotors begin to turn to soon after take-off.

    Of one that never left the ground all of it.
    """
    end = min(flight.airborne[0] + LEFT_S, flight.end) if flight.flew else flight.end
    runs = (shares.values > 0).any(axis=0) & (shares.t >= flight.start)
    start = shares.t[np.argmax(runs)] if runs.any() else np.inf
    some = (rates.t >= start) & (rates.t < end)  # the next flight may begin there
    return LiftOff(rates.t[some], rates.values[:, some], moments[:, some])


def asked_moments(t: Floats, thrusts: Series, motors: tuple[Motor, ...]) -> Floats:
    """Return the moments about each axis, (3, n), that motors are asked for, of the largest."""
    directions = directions_of(motors)
    own = np.array([np.interp(t - _LATE_S, thrusts.t, row) for row in thrusts.values])
    largest = np.abs(directions).sum(axis=1, keepdims=True) / 2
    return np.asarray(directions @ own / np.where(largest, largest, 1.0))


def turned_against(seen: LiftOff) -> Against:
    """Return the largest angle turned at a stretch, about roll or pitch, against what is asked for.

    A stretch ends where the rate falls below 1 rad/s or changes its sign, or records are missing.

    Examples
    --------
    >>> t, rates = np.arange(0.0, 1.0, 0.1), np.full((3, 10), 4.0)
    >>> round(turned_against(LiftOff(t, rates, np.full((3, 10), -0.5))).angle, 1)
    3.6
    >>> turned_against(LiftOff(t, rates, np.full((3, 10), 0.5))).angle
    0.0
    """
    most, steps = Against(0.0, np.nan), np.diff(seen.t)
    for rate, moment in zip(seen.rates[:2], seen.moments[:2], strict=True):
        turns = np.abs(rate) > _TURNS
        is_against = (rate * moment < 0) & (np.abs(moment) > _ASKED)
        angle = np.where(is_against[1:], np.abs(rate[1:]) * steps, 0.0)
        goes_on = turns[1:] & turns[:-1] & (rate[1:] * rate[:-1] > 0) & (steps <= 2 * APART_S)
        for low, high in runs_of(goes_on):
            found = Against(float(angle[low:high].sum()), float(seen.t[low]))
            most = max(most, found, key=lambda one: one.angle)
    return most
