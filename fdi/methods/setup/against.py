"""By what angle does a vehicle turn against the moment that its motors or surfaces are asked for?

In: rates and what the motors or surfaces are given. Out: the angle at a stretch. The harder a
controller acts on motors in a wrong order, on one that gives no thrust, on a surface whose servo
turns the other way, or from a board that is turned, the faster the vehicle turns; a healthy one is
stopped within a fraction of a turn, and one that the ground tips over lies on its back after half
of one.
"""

from __future__ import annotations

from collections.abc import Iterator
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
"""Of the largest moment, half of the motors at full and the others at none, or a surface at the end
of its throw: asked in earnest."""
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
    most = Against(0.0, np.nan)
    for rate, moment in zip(seen.rates[:2], seen.moments[:2], strict=True):
        for low, angles in _at_a_stretch(seen.t, rate, moment):
            found = Against(float(angles[-1]), float(seen.t[low]))
            most = max(most, found, key=lambda one: one.angle)
    return most


def angle_against(t: Floats, rate: Floats, moment: Floats) -> Floats:
    """Return the angle turned so far at a stretch about an axis against what is asked for, rad.

    Parameters
    ----------
    t, rate, moment : (n,) float
        s, rad/s, and what is asked for, of the largest.

    Examples
    --------
    >>> t = np.arange(0.0, 0.5, 0.1)
    >>> angle_against(t, np.full(5, 4.0), np.full(5, -0.5)).round(1)
    array([0. , 0.4, 0.8, 1.2, 1.6])
    """
    found = np.zeros(t.size)
    for low, angles in _at_a_stretch(t, rate, moment):
        found[low + 1 : low + 1 + angles.size] = angles
    return found


def _at_a_stretch(t: Floats, rate: Floats, moment: Floats) -> Iterator[tuple[int, Floats]]:
    """Yield the record before each stretch and the angle so far at each of its records."""
    steps, turns = np.diff(t), np.abs(rate) > _TURNS
    is_against = (rate * moment < 0) & (np.abs(moment) > _ASKED)
    angle = np.where(is_against[1:], np.abs(rate[1:]) * steps, 0.0)
    goes_on = turns[1:] & turns[:-1] & (rate[1:] * rate[:-1] > 0) & (steps <= 2 * APART_S)
    for low, high in runs_of(goes_on):
        yield low, np.cumsum(angle[low:high])
