"""What does a flight tell of its vehicle: thrust by a hover, torques by its turns?

In: rows of a log and what is known of the vehicle. Out: the `Vehicle` with the thrust of its motors
from the calm part of the flight, where they carry the weight, and, where change of body rates is
explained by commanded torques to more than half, with the inertia that this takes; else the inertia
stays as stated. Mass and arm are not told by telemetry: as only ratios to them enter, a wrong one
changes no residual.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.methods.observer.records import Rows
from fdi.methods.observer.states import ANGLES, RATES, VELOCITY
from fdi.methods.observer.vehicle import GRAVITY, Vehicle, mixing
from fdi.methods.setup.moments import DELAYS_S, LAGS_S, LENGTHS, explain, intervals
from fdi.methods.setup.records import Series, Stretch
from fdi.telemetry.airtime import SETTLING_S
from fdi.telemetry.message import Floats

CALM_S: Final = 20.0
"""Of calm flight that tell thrust, centres and noise."""
LEAST_CALM_S: Final = 5.0
EXPLAINED: Final = 0.5
"""Share of the change of a body rate from which on its torque counts as told."""
_LEVEL: Final = np.radians(25.0)  # a hover in strong wind
_STEADY: Final = 0.5  # m/s, climb
_SLOW: Final = 1.0  # m/s, over ground
_STILL: Final = 0.1  # rad/s


def calm_mask(rows: Rows, air: tuple[float, float]) -> tuple[NDArray[np.bool_], bool]:
    """Return the first calm rows of a flight, (n,) bool, and whether it had such at all.

    Where it has not, they are the first in the air that are known.
    """
    known = np.isfinite(rows.y).all(axis=0) & np.isfinite(rows.thrust).all(axis=0)
    flying = known & (rows.t >= air[0] + SETTLING_S) & (rows.t < air[1])
    speed = np.hypot(*rows.y[VELOCITY][:2])
    with np.errstate(invalid="ignore"):
        calm = flying & (np.abs(rows.y[ANGLES][:2]).max(axis=0) < _LEVEL)
        calm &= (np.abs(rows.y[VELOCITY][2]) < _STEADY) & (speed < _SLOW)
        calm &= np.abs(rows.y[RATES]).max(axis=0) < _STILL
    period = float(np.median(np.diff(rows.t)))
    is_calm = bool(calm.sum() * period >= LEAST_CALM_S)
    chosen = np.flatnonzero(calm if is_calm else flying)[: round(CALM_S / period)]
    mask = np.zeros(rows.t.size, np.bool_)
    mask[chosen] = True
    return mask, is_calm


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
    factors = np.array(
        [[getattr(m, axis) for m in rows.motors] for axis in ("roll", "pitch", "yaw")]
    )
    factors /= np.maximum(np.abs(factors).max(axis=1, keepdims=True), np.finfo(float).tiny)
    best, gains = np.ones(3), np.full(3, np.nan)
    for times in LENGTHS:
        for delay in DELAYS_S:
            for lag in LAGS_S:
                part = (Stretch(*air),)
                found = intervals(rates, inputs, part, delay=delay, lag=lag, times=times)
                if found is None:
                    continue
                left, gain = (one[0] for one in explain(found, factors[None]))
                better = (left < best) & (gain > 0)
                best, gains = np.where(better, left, best), np.where(better, gain, gains)
    return np.where(best < 1 - EXPLAINED, gains, np.nan)


def inputs_of(vehicle: Vehicle, rows: Rows) -> Floats:
    """Return thrust less weight, N, and torques, N m, as commanded, (4, n)."""
    u = mixing(vehicle, rows.motors) @ rows.thrust * (vehicle.thrust_max or np.nan)
    u[0] -= vehicle.mass * GRAVITY
    return np.asarray(u)
