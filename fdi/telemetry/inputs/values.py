"""What is known of an input of the tests, and when does the vehicle move?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.shown import Shown
from fdi.telemetry.meaning.sources import wrap
from fdi.telemetry.message import Floats, Message

TURNS: Final = 0.05
"""rad/s: who turns faster is not at rest; ten times the noise of a gyroscope, and less than a
hover's own unrest."""
LIES: Final = 0.002
"""rad/s, of the rates within a second: what stands on the ground scatters by a gyroscope's noise,
0.0003 to 0.001, and what flies in calm air by ten times as much."""
FEW_A_SECOND: Final = 4
LEAST: Final = 20
"""Records; fewer tell nothing of an input."""
_RATES: Final = ("rollspeed", "pitchspeed", "yawspeed")
_GYROSCOPE: Final = ("xgyro", "ygyro", "zgyro")
_ANGLES: Final = ("roll", "pitch", "yaw")
_ACCELEROMETERS: Final = ("RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "HIGHRES_IMU")
AXES: Final = ("xacc", "yacc", "zacc")

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Input(Shown):
    """One command, demand or state that tests read, and whether this log bears it out.

    Attributes
    ----------
    name : str
        For a person: ``outputs to the motors``.
    channels : tuple of str
        Its channels, ``MOTORS.motor_1``.
    believed : bool or None
        None: the log does not tell; it is used then.
    why : str
        What was measured, a clause for a person.
    left_out : float
        Which share of its records is not used although the rest is believed.
    """

    name: str
    channels: tuple[str, ...]
    believed: bool | None
    why: str
    left_out: float = 0.0

    @property
    def drives(self) -> bool:
        """Whether it is what moves the vehicle."""
        return self.channels[0].startswith("MOTORS.")

    @property
    def levels(self) -> bool:
        """Whether it is the attitude by which the vehicle is levelled."""
        return self.channels[0].startswith("ATTITUDE.")


class Judged(NamedTuple):
    """An input, and which raw records of which of its fields are not believed, (m,) bool each."""

    input: Input
    unbelieved: Mapping[tuple[str, str], Mask]


def judged(
    name: str,
    message: Message,
    fields: tuple[str, ...],
    believed: bool | None,
    why: str,
    out: Mask | None = None,
) -> Judged:
    """Return an input of some fields of a message; ``out`` are its records, (n,), not used."""
    rows = np.full(message.stamp.size, believed is False)
    if out is not None:
        rows[message.kept[out]] = True
    left = 0.0 if out is None or believed is False or not out.size else float(out.mean())
    told = tuple(f"{message.key}.{field}" for field in fields)
    masks = {(message.key, field): rows for field in fields} if rows.any() else {}
    return Judged(Input(name, told, believed, why, left), masks)


def while_armed(t: Floats, armed: Floats) -> Mask:
    """Return which times, (n,), lie in one of the stretches, (k, 2), in which it is armed."""
    on = np.zeros(t.size, np.bool_)
    for low, high in armed:
        on |= (t >= low) & (t <= high)
    return on


def turning(messages: Mapping[str, Message], t: Floats) -> Floats:
    """Return how fast the vehicle turns at times t, (n,) rad/s; NaN where the log does not tell.

    By the rates that the autopilot tells, by its gyroscope's, or by how its attitude changes.
    """
    attitude, inertial = messages.get("ATTITUDE"), messages.get("RAW_IMU")
    for message, fields in ((attitude, _RATES), (inertial, _GYROSCOPE)):
        own, rates = _together(message, fields)
        if own.size:
            rate: Floats = np.linalg.norm(rates - _at_rest(own, rates)[:, None], axis=0)
            return np.interp(t, own, rate)
    own, angles = _together(attitude, _ANGLES)
    return np.interp(t, own[1:], _turned(own, angles)) if own.size else np.full(t.size, np.nan)


def _together(message: Message | None, fields: tuple[str, ...]) -> tuple[Floats, Floats]:
    """Return the times, (n,) s, at which all the fields are known, and these, (3, n); else none."""
    nothing = np.empty(0), np.empty((len(fields), 0))
    if message is None or not all(name in message for name in fields):
        return nothing
    if fields == _GYROSCOPE and message.unit(fields[0]) != "rad/s":
        return nothing  # raw counts
    values = np.array([message.si(name) for name in fields])
    known = np.isfinite(values).all(axis=0)
    return (message.t[known], values[:, known]) if known.sum() > 1 else nothing


def _turned(t: Floats, angles: Floats) -> Floats:
    """Return how fast roll, pitch and yaw, (3, n) rad, turn a body from record to record, rad/s."""
    roll, pitch, yaw = wrap(np.diff(angles))
    nose, steps = (angles[1, 1:] + angles[1, :-1]) / 2, np.diff(t)
    # of rates about the axes of a 3-2-1 sequence, of which roll's and yaw's are not at right angles
    squares = roll**2 + pitch**2 + yaw**2 - 2 * roll * yaw * np.sin(nose)
    angle = np.sqrt(np.maximum(squares, 0.0))
    rate: Floats = np.divide(angle, steps, out=np.zeros(steps.size), where=steps > 0)
    return rate


def _at_rest(t: Floats, rates: Floats) -> Floats:
    """Return what rates (3, n) read where nothing turns, (3,): in the calmest second of the log.

    Zero where no second is as calm as a thing that lies, or that rate is more than an offset.
    """
    second = np.floor(t)
    first = np.flatnonzero(np.diff(second, prepend=-np.inf))
    count = np.diff(np.append(first, t.size))
    mean = np.add.reduceat(rates, first, axis=1) / count
    spread = np.add.reduceat(rates**2, first, axis=1) / count - mean**2
    unrest = np.sqrt(np.maximum(spread, 0.0).sum(axis=0))
    unrest[count < FEW_A_SECOND] = np.inf
    calmest = int(np.argmin(unrest))
    offset = mean[:, calmest]
    is_offset = unrest[calmest] <= LIES and np.linalg.norm(offset) <= TURNS
    return np.asarray(offset if is_offset else np.zeros(3))


def accelerometers(messages: Mapping[str, Message]) -> list[Message]:
    """Return the messages of accelerometers, none twice."""
    found: dict[str, Message] = {}
    for name in _ACCELEROMETERS:
        message = messages.get(name)
        if message is None or not len(message) or not all(axis in message for axis in AXES):
            continue
        if message.unit("xacc") != "m/s^2":
            continue
        found.setdefault(message.made_from or name, message)  # the same records, another name
    return list(found.values())


def first_half(moving: Mask) -> Mask:
    """Return the first half of the records in which it moves: what fails later is no property."""
    rows = np.flatnonzero(moving)
    found = np.zeros(moving.size, np.bool_)
    found[rows[: (rows.size + 1) // 2]] = True
    return found
