"""Which records of a log are the observer's outputs and inputs, and at which times?

In: a log. Out: `Rows`: states as measured and thrusts as commanded, at the times of ATTITUDE;
other messages run linearly between two records that are not further apart than a gap. Outputs come
from the autopilot's estimator, or from sensors: position and horizontal velocity of the satellite
receiver (which tells no vertical one in MAVLink), rates of the gyroscopes as recorded, angles of
the estimator, as nobody else has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.methods.observer.observer import GAP_S
from fdi.methods.observer.states import ANGLES, POSITION, RATES, STATES, VELOCITY
from fdi.methods.setup.motors import motor_thrusts
from fdi.methods.setup.records import Series, series
from fdi.telemetry import Log
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import ROTORS, Motor, motors_of, names_frame

FROM: Final[dict[str, tuple[str, ...]]] = {
    "estimator": STATES,
    "sensors": tuple(name for name in STATES if name != "vz"),
}
"""Where outputs may come from, and which there are."""
LATE_S: Final[dict[str, float]] = {"estimator": 0.0, "sensors": 0.2}
"""How far outputs may be apart in time: a receiver is that late (its usual EK3 and EKF2 delay)."""
SLOWEST_S: Final = 0.5
"""Records further apart than this: the observer forgets an error within 0.25 s."""
_ATTITUDE: Final = ("rollspeed", "pitchspeed", "yawspeed", "roll", "pitch", "yaw")
_LOCAL: Final = ("x", "y", "z", "vx", "vy", "vz")
_RECEIVER: Final = ("lat", "lon", "alt", "vel", "cog")
_GYROSCOPE: Final = ("xgyro", "ygyro", "zgyro")


class LackingError(LogError):
    """The log lacks something that a live link may still bring: a frame's parameters, a message."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What an observer is given.

    Attributes
    ----------
    t : (n,) float
        s of the log's clock.
    y : (12, n) float
        States; NaN where unknown. Yaw is not unwrapped.
    thrust : (m, n) float
        Of every motor, as a share of its largest, as commanded.
    motors : tuple of Motor
    source : str
        ``estimator`` or ``sensors``.
    """

    t: Floats
    y: Floats
    thrust: Floats
    motors: tuple[Motor, ...]
    source: str


def rows_of(log: Log, source: str = "estimator") -> Rows:
    """Return the records of a log.

    Raises
    ------
    LogError
        The vehicle is no multicopter, the log does not tell its frame, or lacks attitude, outputs
        of motors or what else is needed, or has them too seldom.
    """
    motors = _motors(log)
    attitude = _needed(log, "ATTITUDE", _ATTITUDE, "attitude")
    thrusts = motor_thrusts(log, motors)
    if thrusts is None:
        raise LackingError("does not hold what every motor is given", where=log.name)
    local = _needed(log, "LOCAL_POSITION_NED", _LOCAL, "local position and velocity")
    used = {"ATTITUDE": attitude, "the motors": thrusts, "LOCAL_POSITION_NED": local}
    y = np.full((len(STATES), attitude.t.size), np.nan)
    y[RATES], y[ANGLES] = attitude.values[:3], attitude.values[3:]
    y[:6] = at_times(local, attitude.t)
    if source == "sensors":
        receiver = _needed(log, "GPS_RAW_INT", _RECEIVER, "positions and velocities of a receiver")
        gyroscope = _needed(log, "RAW_IMU", _GYROSCOPE, "rates of a gyroscope")
        used |= {"GPS_RAW_INT": receiver, "RAW_IMU": gyroscope}
        y[POSITION], y[VELOCITY][:2] = np.split(at_times(_north_east(receiver), attitude.t), [3])
        y[RATES] = at_times(gyroscope, attitude.t)
    for name, own in used.items():
        if own.period > SLOWEST_S:
            raise LogError(
                f"has a record of {name} every {own.period:.1f} s, and an observer forgets within "
                "0.25 s: nothing is left to compare",
                where=log.name,
                hint=f"record at {1 / SLOWEST_S:.0f} Hz or more",
            )
    return Rows(attitude.t, y, at_times(thrusts, attitude.t), motors, source)


def multicopter(vehicle: str, where: str) -> None:
    """Refuse a vehicle that is no multicopter.

    Raises
    ------
    LogError
        It is another one.
    """
    if vehicle not in (*ROTORS, "other"):
        raise LogError(
            f"is of a {vehicle}, and the observer's equations are a multicopter's", where=where
        )


def _motors(log: Log) -> tuple[Motor, ...]:
    multicopter(log.vehicle, log.name)
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    if not motors or not np.isfinite([m.yaw for m in motors]).all():
        told = (
            "names a frame whose motors are"
            if names_frame(log.parameters, log.autopilot)
            else ("tells no frame, so that its motors are")
        )
        raise LackingError(f"{told} not known to stand somewhere and turn some way", where=log.name)
    return motors


def _needed(log: Log, key: str, fields: tuple[str, ...], what: str) -> Series:
    found = series(log, key, fields)
    if found is None:
        raise LackingError(
            f"holds no {what}, which the observer needs", where=log.name, hint=f"looked for {key}"
        )
    return found


def at_times(known: Series, t: Floats) -> Floats:
    """Return values at times, (k, n), NaN in gaps, before the first and after the last record."""
    found = np.array([np.interp(t, known.t, row, np.nan, np.nan) for row in known.values])
    after = np.clip(np.searchsorted(known.t, t), 1, known.t.size - 1)
    found[:, known.t[after] - known.t[after - 1] > GAP_S] = np.nan
    return found


def _north_east(receiver: Series) -> Series:
    """Return positions from the first fix on, m NED, and horizontal velocities, m/s."""
    from pymap3d import geodetic2ned

    lat, lon, alt, speed, course = receiver.values
    place = geodetic2ned(lat, lon, alt, lat[0], lon[0], alt[0], deg=False)
    moving = np.array([speed * np.cos(course), speed * np.sin(course)])
    return Series(receiver.t, np.concatenate([np.array(place), moving]))
