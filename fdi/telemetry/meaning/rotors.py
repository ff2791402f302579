"""How fast does every motor turn, as its controller says?

In: a log's messages, and which output drives which motor. Out: a message ``ROTOR_n`` for motor n,
with ``rpm``, and with ``current`` where that is measured, at what its own controller reports: the
message ends where the controller falls silent. In a DataFlash log every controller has its own
records. Elsewhere one record tells of several, and repeats or sets to zero what is not reported
anew. A controller that never says that anything turns has no sensor, and no message.

==========  ========================================================================================
autopilot   which controller drives a motor
==========  ========================================================================================
ArduPilot   the one of its output: ``ESC[Instance]`` counts from 0, ``ESC_TELEMETRY_1_TO_4.rpm[0]``
            is that of output 1 (AP_ESC_Telem)
PX4         ``esc_status.esc[i].actuator_function`` 101 to 112, else the one of its own number
==========  ========================================================================================

What is reported anew: PX4 stamps each controller's report (``esc[i].timestamp``). ArduPilot counts
the reports of each (``count[0]``, with which no rate by bidirectional DShot is counted), and sends
a rate of 0 for a controller that it has not heard of for a second (AP_ESC_Telem::get_rpm).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.message import Message
from fdi.telemetry.motors import MOST

_ROTOR: Final = "ROTOR_{}"
ROTORS: Final = tuple(_ROTOR.format(motor) for motor in range(1, MOST + 1))
"""The messages of all motors that there may be."""
_OWN: Final = "ESC"
_TOLD: Final = ("ESC_TELEMETRY_1_TO_4", "ESC_TELEMETRY_5_TO_8", "ESC_TELEMETRY_9_TO_12")
_STATUS: Final = "esc_status"
_FUNCTION: Final = "esc[{}].actuator_function"
_STAMP: Final = "esc[{}].timestamp"
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
    place = (number - 1) % 4
    own = messages.get(_OWN if number == 1 else f"{_OWN}[{number - 1}]")
    told = messages.get(_TOLD[(number - 1) // 4]) if number <= 4 * len(_TOLD) else None
    for message, rate, current in (
        (own, "RPM", "Curr"),
        (told, f"rpm[{place}]", f"current[{place}]"),
    ):
        if message is None or rate not in message:
            continue
        columns = {"rpm": message.columns[rate]}
        if current in message and (message.si(current) != 0).any():
            columns["current"] = message.columns[current]
        rows = slice(None) if message is own else _reported(messages, message, number)
        return Message(
            _ROTOR.format(motor),
            None,
            message.t[rows],
            message.stamp,
            message.kept[rows],
            columns,
            made_from=message.made_from or message.key,
        )
    return None


def _reported(messages: Messages, told: Message, number: int) -> NDArray[np.bool_]:
    """Return in which records, (n,), a controller's rate is what it has reported."""
    status, stamp = messages.get(_STATUS), _STAMP.format(number - 1)
    if status is not None and stamp in status:
        return np.asarray(np.diff(status.si(stamp), prepend=np.nan) != 0)
    place = (number - 1) % 4
    turns = told.si(f"rpm[{place}]") != 0
    counted = f"count[{place}]"
    reports = told.si(counted) if counted in told else np.zeros(turns.size)
    last = np.maximum.accumulate(np.where(turns, np.arange(turns.size), -1))
    is_new = (reports > 0) & (reports != reports[last])
    counts = bool((reports != reports[:1]).any())
    return np.asarray(turns | is_new | (last < 0) | (not counts))


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
