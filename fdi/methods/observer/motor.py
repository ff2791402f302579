"""Which motor gives less than it is asked for, by the signs of the rates' residuals?

In: alarms, residuals off their centres, the motors of the frame. Out: `WeakMotor`s. What a motor
fails to give is missing from all three torques at once: residuals of roll, pitch and yaw rate point
against its own row of the frame. A motor is named while the yaw's and a tilting rate's residual are
in alarm together, where the yaw's sign is its own and, of those of that sign, it stands nearest to
where roll and pitch point, by less than half the way to a neighbour on a frame of six. Where no
motor fits, none is named: a torque from elsewhere looks like that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.observer.limits import LASTS_S, Alarm
from fdi.methods.observer.states import RATES
from fdi.methods.observer.vehicle import Vehicle, mixing
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import Motor

NEAR: Final = float(np.cos(np.radians(30.0)))


class WeakMotor(NamedTuple):
    """A motor that gives too little: its number, from when to when, s."""

    number: int
    start: float
    end: float


def weak_motors(
    alarms: Sequence[Alarm], t: Floats, off: Floats, vehicle: Vehicle, motors: Sequence[Motor]
) -> tuple[WeakMotor, ...]:
    """Return the motors that residuals of rates name, by time.

    Parameters
    ----------
    alarms : sequence of Alarm
    t : (n,) float
    off : (13, n) float
    vehicle : Vehicle
        Its inertias make torques of residuals.
    motors : sequence of Motor
    """
    turning = [a for a in alarms if a.residual == "r"]
    found: list[WeakMotor] = []
    for tilting in (a for a in alarms if a.residual in ("p", "q")):
        named: dict[int, WeakMotor] = {}
        for one in turning:
            start, end = max(one.start, tilting.start), min(one.end, tilting.end)
            if end - start < LASTS_S:
                continue
            inside = (t >= start) & (t <= end)
            torque = np.nanmean(off[RATES][:, inside], axis=1) * vehicle.inertia
            number = motor_of(torque, vehicle, motors)
            if number is not None:
                since = named[number].start if number in named else start
                named[number] = WeakMotor(number, since, end)
        found.extend(named.values())
    return _merged(found)


def _merged(found: Sequence[WeakMotor]) -> tuple[WeakMotor, ...]:
    """Return spans of the same motor that overlap as one, by time."""
    merged: list[WeakMotor] = []
    for one in sorted(found):
        last = merged[-1] if merged else None
        if last is not None and last.number == one.number and one.start <= last.end:
            merged[-1] = last._replace(end=max(last.end, one.end))
        else:
            merged.append(one)
    return tuple(sorted(merged, key=lambda w: (w.start, w.number)))


def motor_of(torque: Floats, vehicle: Vehicle, motors: Sequence[Motor]) -> int | None:
    """Return the number of the motor whose missing thrust leaves a torque, (3,); None if none."""
    rows = -mixing(vehicle, motors)[1:]
    same_way = np.sign(rows[2]) == np.sign(torque[2])
    size = np.hypot(*rows[:2]) * np.hypot(*torque[:2])
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.where(same_way & (size > 0), (torque[:2] @ rows[:2]) / size, -1.0)
    best = int(np.argmax(cosine))
    return motors[best].number if cosine[best] > NEAR else None
