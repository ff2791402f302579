"""What is known of an input of the tests, and when does the vehicle move?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.shown import Shown
from fdi.telemetry.message import Floats, Message

TURNS: Final = 0.05
"""rad/s: who turns faster is not at rest; ten times the noise of a gyroscope, and less than a
hover's own unrest."""
LEAST: Final = 20
"""Records; fewer tell nothing of an input."""
_RATES: Final = ("rollspeed", "pitchspeed", "yawspeed")
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


def turning(messages: Mapping[str, Message], t: Floats) -> Floats:
    """Return how fast the vehicle turns at times t, (n,) rad/s; NaN where the log does not tell."""
    attitude = messages.get("ATTITUDE")
    if attitude is None or len(attitude) < 2 or not all(name in attitude for name in _RATES):
        return np.full(t.size, np.nan)
    rate = np.sqrt(sum(attitude.si(name) ** 2 for name in _RATES))
    known = np.isfinite(rate)
    if known.sum() < 2:
        return np.full(t.size, np.nan)
    return np.interp(t, attitude.t[known], rate[known])


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
