"""How fast does every motor turn, as its controller says?

In: a log's messages, and which output drives which motor. Out: a message ``ROTOR_n`` for motor n,
with ``rpm`` at the records of its own controller: in a DataFlash log every controller has its own,
which end where it falls silent. A controller that never says that anything turns has no sensor, and
no message.

==========  ========================================================================================
autopilot   which controller drives a motor
==========  ========================================================================================
ArduPilot   the one of its output: ``ESC[Instance]`` counts from 0, ``ESC_TELEMETRY_1_TO_4.rpm[0]``
            is that of output 1 (AP_ESC_Telem)
PX4         ``esc_status.esc[i].actuator_function`` 101 to 112, else the one of its own number
==========  ========================================================================================
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from fdi.telemetry.message import Message
from fdi.telemetry.motors import MOST

_ROTOR: Final = "ROTOR_{}"
ROTORS: Final = tuple(_ROTOR.format(motor) for motor in range(1, MOST + 1))
"""The messages of all motors that there may be."""
_OWN: Final = "ESC"
_TOLD: Final = ("ESC_TELEMETRY_1_TO_4", "ESC_TELEMETRY_5_TO_8", "ESC_TELEMETRY_9_TO_12")
_STATUS: Final = "esc_status"
_FUNCTION: Final = "esc[{}].actuator_function"
_MOTOR_1: Final = 101
_CONTROLLERS: Final = 8  # in a record of esc_status

Messages = Mapping[str, Message]


def rotors(messages: Messages, outputs: Mapping[int, tuple[int, ...]]) -> Iterator[Message]:
    """Yield the messages of the motors whose controllers say how fast they turn.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    outputs : Mapping[int, tuple of int]
        Those that drive each motor; none is told of one that has several.
    """
    named = _named(messages)
    for motor, driven_by in outputs.items():
        if named or len(driven_by) == 1:
            number = named.get(motor, 0) if named else driven_by[0]
            made = _rotor(messages, motor, number)
            if made is not None and (made.si("rpm") != 0).any():
                yield made


def _rotor(messages: Messages, motor: int, number: int) -> Message | None:
    """Return the message of a motor that a controller drives, counted from 1."""
    if not number:
        return None
    own = messages.get(_OWN if number == 1 else f"{_OWN}[{number - 1}]")
    told = messages.get(_TOLD[(number - 1) // 4]) if number <= 4 * len(_TOLD) else None
    for message, field in ((own, "RPM"), (told, f"rpm[{(number - 1) % 4}]")):
        if message is not None and field in message:
            name, key = _ROTOR.format(motor), message.made_from or message.key
            columns = {"rpm": message.columns[field]}
            return Message(
                name, None, message.t, message.stamp, message.kept, columns, made_from=key
            )
    return None


def _named(messages: Messages) -> dict[int, int]:
    """Return which controller drives each motor, where a log says so itself."""
    status, found = messages.get(_STATUS), dict[int, int]()
    if status is None:
        return found
    for place in range(_CONTROLLERS):
        if _FUNCTION.format(place) in status and len(status):
            motor = int(np.median(status.raw(_FUNCTION.format(place)))) - _MOTOR_1 + 1
            if motor >= 1:
                found.setdefault(motor, place + 1)
    return found
