"""By how much may the linear equations be off at a moment, though nothing is wrong?

In: measured states and commanded inputs. Out: for each of the twelve equations a bound of its
error, per second. Four things are left out by the equations of ``model.py``: what is not linear in
tilt, thrust and rates, which the nonlinear equations tell exactly; how much thrust and torque a
command gives, and how late; the air, that is drag and wind; and what happens between two records.

Through the observer's own low pass these are what a residual may reach; a fault is told from them
by being larger, or by being there where they are not. A motor that gives nothing of a torque that
is asked for leaves a residual of the whole torque, so any share of it below 1 tells it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.methods.observer.model import derivatives, linear_model
from fdi.methods.observer.states import ANGLES, PSI, RATES, VELOCITY
from fdi.methods.observer.vehicle import Vehicle
from fdi.telemetry.message import Floats

TORQUE: Final = 0.6
"""Share of a commanded torque by which it may be off: inertias and arms of a vehicle that the log
does not tell are known to a factor of two and a half, and motors take their time."""
THRUST: Final = 0.3
"""Share of a commanded change of thrust: a hover tells its scale, the curve, the battery and the
climb what is left."""
DRAG: Final = 0.5
"""1/s, by the vehicle's speed: level at 20 m/s a multicopter leans by 45 degrees (g/20)."""
DAMPING: Final = 1.5
"""1/s, by the rate of turning: the inflow of rotors and the air brake a turn within a second."""
BETWEEN: Final = 0.5
"""Share of the change from a record to the next by which what lies between them is off the line."""
LAG_S: Final = 0.1
"""How late motors and propellers do what they are told."""


def doubt(vehicle: Vehicle, y: Floats, u: Floats) -> Floats:
    """Return a bound of the error of each equation, (12,), per second.

    Parameters
    ----------
    vehicle : Vehicle
    y : (12,) float
        As measured; what is not known is taken as 0.
    u : (4,) float
    """
    y = np.nan_to_num(y)
    a, b = linear_model(vehicle, float(y[PSI]))
    found: Floats = np.abs(derivatives(vehicle, y, u) - a @ y - b @ u)
    found[RATES] += TORQUE * np.abs(u[1:]) / vehicle.inertia
    found[RATES] += DAMPING * np.abs(y[RATES])
    tilt = float(np.abs(y[ANGLES][:2]).max())
    found[VELOCITY] += DRAG * np.abs(y[VELOCITY])
    found[VELOCITY] += THRUST * abs(float(u[0])) / vehicle.mass * np.array([tilt, tilt, 1.0])
    return found


def between(
    vehicle: Vehicle, y: Floats, change: Floats, change_u: Floats, *, span: float, late: float
) -> Floats:
    """Return how far equations may be off because of what lies between two records, (12,).

    Parameters
    ----------
    vehicle : Vehicle
    y : (12,) float
        At the first of them.
    change, change_u : (12,) and (4,) float
        Of states and inputs to the second; what is not known is taken as 0.
    span : float
        s, between them.
    late : float
        s, how far outputs may be apart in time.
    """
    a, b = linear_model(vehicle, float(y[PSI]))
    states = (BETWEEN + late / span) * np.abs(a) @ np.abs(np.nan_to_num(change))
    return np.asarray(states + (BETWEEN + LAG_S / span) * np.abs(b) @ np.abs(change_u))
