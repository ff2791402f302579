"""What are the linear equations of a multicopter about a hover at a heading?

In: a `Vehicle` and a heading. Out: A (12, 12) and B (12, 4) of dx/dt = A x + B u in NED and FRD,
with x as in ``states.py`` and u = (thrust less weight, torques). Tilt accelerates: in words,
dv_xy/dt = R(psi) g (-theta, phi) - (k_t/m) v.

`derivatives` are the nonlinear equations: they tell by how much the linear ones err in a manoeuvre.

The trap for a maintainer: the published A has its columns shifted and rows of 11 entries, its B 13
rows, its heading 90 in a function that takes radians. This is the corrected one.
"""

from __future__ import annotations

import numpy as np

from fdi.methods.observer.states import ANGLES, INPUTS, RATES, STATES, VELOCITY
from fdi.methods.observer.vehicle import GRAVITY, Vehicle
from fdi.telemetry.message import Floats


def linear_model(vehicle: Vehicle, heading: float) -> tuple[Floats, Floats]:
    """Return A (12, 12) and B (12, 4) about a hover.

    Parameters
    ----------
    vehicle : Vehicle
    heading : float
        rad, from north clockwise.
    """
    c, n, g = np.cos(heading), np.sin(heading), GRAVITY
    a, b = np.zeros((len(STATES), len(STATES))), np.zeros((len(STATES), len(INPUTS)))
    at = {name: i for i, name in enumerate(STATES)}
    for place, speed in zip("xyz", ("vx", "vy", "vz"), strict=True):
        a[at[place], at[speed]] = 1.0
        a[at[speed], at[speed]] = -vehicle.drag / vehicle.mass
    a[at["vx"], [at["phi"], at["theta"]]] = -g * n, -g * c
    a[at["vy"], [at["phi"], at["theta"]]] = g * c, -g * n
    b[at["vz"], 0] = -1.0 / vehicle.mass
    for axis, (rate, angle) in enumerate(zip("pqr", ("phi", "theta", "psi"), strict=True)):
        a[at[rate], at[rate]] = -vehicle.rotational_drag / vehicle.inertia[axis]
        a[at[angle], at[rate]] = 1.0
        b[at[rate], 1 + axis] = 1.0 / vehicle.inertia[axis]
    return a, b


def derivatives(vehicle: Vehicle, x: Floats, u: Floats) -> Floats:
    """Return dx/dt, like x, by the nonlinear equations.

    Parameters
    ----------
    vehicle : Vehicle
    x : (12,) or (12, n) float
    u : (4,) or (4, n) float
        Thrust less weight, N, and torques, N m.
    """
    m, g = vehicle.mass, GRAVITY
    phi, theta, psi = x[ANGLES]
    p, q, r = x[RATES]
    i_x, i_y, i_z = vehicle.inertia
    force = u[0] + m * g
    turn = q * np.sin(phi) + r * np.cos(phi)
    tilt_x = np.cos(psi) * np.sin(theta) * np.cos(phi) + np.sin(psi) * np.sin(phi)
    tilt_y = np.sin(psi) * np.sin(theta) * np.cos(phi) - np.cos(psi) * np.sin(phi)
    vx, vy, vz = x[VELOCITY]
    return np.stack(
        [
            vx,
            vy,
            vz,
            -force / m * tilt_x - vehicle.drag / m * vx,
            -force / m * tilt_y - vehicle.drag / m * vy,
            -force / m * np.cos(phi) * np.cos(theta) + g - vehicle.drag / m * vz,
            (u[1] - vehicle.rotational_drag * p - (i_z - i_y) * q * r) / i_x,
            (u[2] - vehicle.rotational_drag * q - (i_x - i_z) * p * r) / i_y,
            (u[3] - vehicle.rotational_drag * r - (i_y - i_x) * p * q) / i_z,
            p + turn * np.tan(theta),
            q * np.cos(phi) - r * np.sin(phi),
            turn / np.cos(theta),
        ]
    )
