"""What does a flight tell of its vehicle: thrust by a hover, torques by its turns?

In: rows of a log and what is known of the vehicle. Out: the `Vehicle` with the thrust of its motors
from the calm part of the flight, where they carry the weight, and, where change of body rates is
explained by commanded torques to three quarters, with the inertia that this takes; else the inertia
stays as stated. Mass and arm are not told by telemetry: as only ratios to them enter, a wrong one
changes no residual.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.grid import uniform
from fdi.methods.observer.records import Rows
from fdi.methods.observer.states import ANGLES, RATES, VELOCITY
from fdi.methods.observer.vehicle import GRAVITY, Vehicle, mixing
from fdi.methods.setup.moments import explain, intervals
from fdi.methods.setup.records import Series, Stretch
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import Motor
from fdi.windows import runs_of

HOVER_S: Final = 1.0
"""A hover is calm for so long: four time constants of the observer."""
CALM_S: Final = 20.0
"""From the first hover on calm rows tell thrust, centres and noise, as the policies' reference."""
BLOCK_S: Final = 20.0
"""Turns are judged over so long: a fault that lasts is constant there, and no part of them."""
EXPLAINED: Final = 0.75
"""Share of the change of a body rate from which on its torque counts as told."""
_LEVEL: Final = np.radians(25.0)  # a hover in strong wind
_STEADY: Final = 0.5  # m/s, climb
_SLOW: Final = 1.0  # m/s, over ground
_STILL: Final = 0.1  # rad/s


def calm_mask(rows: Rows, air: tuple[float, float]) -> tuple[NDArray[np.bool_], bool]:
    """Return the calm rows of a flight's beginning, (n,) bool, and whether it hovers at all.

    Where it does not, they are the first in the air that are known.
    """
    known = np.isfinite(rows.y).all(axis=0) & np.isfinite(rows.thrust).all(axis=0)
    flying = known & (rows.t >= air[0] + SETTLING_S) & (rows.t < air[1])
    speed = np.hypot(*rows.y[VELOCITY][:2])
    with np.errstate(invalid="ignore"):
        calm = flying & (np.abs(rows.y[ANGLES][:2]).max(axis=0) < _LEVEL)
        calm &= (np.abs(rows.y[VELOCITY][2]) < _STEADY) & (speed < _SLOW)
        calm &= np.abs(rows.y[RATES]).max(axis=0) < _STILL
    hovers = [a for a, b in runs_of(calm) if _lasts(rows, a, b - 1)]
    chosen = calm if hovers else flying
    if not chosen.any():
        return chosen, False
    start = float(rows.t[hovers[0] if hovers else int(np.argmax(chosen))])
    return chosen & (rows.t >= start) & (rows.t < start + CALM_S), bool(hovers)


def _lasts(rows: Rows, first: int, last: int) -> bool:
    return bool(rows.t[last] - rows.t[first] >= HOVER_S)


def fitted(
    vehicle: Vehicle,
    rows: Rows,
    calm: NDArray[np.bool_],
    air: tuple[float, float],
    *,
    turns: bool,
) -> tuple[Vehicle, tuple[str, ...]]:
    """Return a vehicle with what a flight tells, and on which axes its turns told.

    Parameters
    ----------
    vehicle : Vehicle
    rows : Rows
    calm : (n,) bool
    air : (float, float)
        s, in the air.
    turns : bool
        Inertias may be taken from the flight's turns.

    Raises
    ------
    LogError
        The motors are below their range in calm flight.
    """
    if vehicle.thrust_max is None:
        total = float(np.median(rows.thrust[:, calm].sum(axis=0)))
        if not total > 0:
            raise LogError("the motors' outputs in calm flight are below their range")
        vehicle = replace(vehicle, thrust_max=vehicle.mass * GRAVITY / total)
    gains = _gains(rows, air) if turns else np.full(3, np.nan)
    levers = np.abs(mixing(vehicle, rows.motors)[1:]).max(axis=1) * (vehicle.thrust_max or 0.0)
    told = np.isfinite(gains)
    inertia = np.where(told, levers / np.where(told, gains, 1.0), vehicle.inertia)
    axes = tuple(name for name, known in zip(("roll", "pitch", "yaw"), told, strict=True) if known)
    return replace(vehicle, inertia=tuple(inertia.tolist())), axes


def _gains(rows: Rows, air: tuple[float, float]) -> Floats:
    """Return rad/s2 for the largest thrust of a motor with a factor of 1, (3,), NaN if not told."""
    known = np.isfinite(rows.y[RATES]).all(axis=0) & np.isfinite(rows.thrust).all(axis=0)
    rates = Series(rows.t[known], rows.y[RATES][:, known])
    inputs = Series(rows.t[known], rows.thrust[:, known])
    end = max(air[1] - BLOCK_S / 2, air[0] + 1.0)
    edges = uniform(air[0], end, BLOCK_S, records=rows.t.size)
    blocks = [Stretch(a, b) for a, b in zip(edges, [*edges[1:], air[1]], strict=True)]
    found = np.array([_gains_in(rates, inputs, one, rows.motors) for one in blocks])
    told = np.isfinite(found).any(axis=0)
    gains = np.full(3, np.nan)
    gains[told] = np.nanmedian(found[:, told], axis=0)
    return gains


def _gains_in(rates: Series, inputs: Series, part: Stretch, motors: tuple[Motor, ...]) -> Floats:
    factors = np.array([[m.roll, m.pitch, m.yaw] for m in motors]).T
    factors /= np.maximum(np.abs(factors).max(axis=1, keepdims=True), np.finfo(float).tiny)
    best, gains = np.ones(3), np.full(3, np.nan)
    for _, found in intervals(rates, inputs, (part,)):
        left, gain = (one[0] for one in explain(found, factors[None]))
        better = (left < best) & (gain > 0)
        best, gains = np.where(better, left, best), np.where(better, gain, gains)
    return np.where(best < 1 - EXPLAINED, gains, np.nan)


def inputs_of(vehicle: Vehicle, rows: Rows) -> Floats:
    """Return thrust less weight, N, and torques, N m, as commanded, (4, n)."""
    u = mixing(vehicle, rows.motors) @ rows.thrust * (vehicle.thrust_max or np.nan)
    u[0] -= vehicle.mass * GRAVITY
    return np.asarray(u)
