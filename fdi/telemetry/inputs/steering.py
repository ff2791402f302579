"""Does the autopilot move anything?

In: the pulses that its outputs are given, and how fast the vehicle turns. Out: nothing, or that its
demands, its throttle and its outputs are nobody's. An autopilot that is on board as a recorder (of
an aerobatic plane that a pilot flies by another receiver, say) goes on demanding an attitude and
computing a throttle. An output that drives something is given pulses all the time in the air; a
vehicle that turns while none of them is given any is steered by somebody else.

Of ArduPilot alone: its record of the outputs holds all of them. PX4's may be those of another
board, of which none is wired.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from fdi.telemetry.inputs.values import LEAST, TURNS, Judged, judged, turning, while_armed
from fdi.telemetry.message import Floats, Message

_SERVOS: Final = "SERVO_OUTPUT_RAW"
STEERS: Final = {"NAV_CONTROLLER_OUTPUT": None, "VFR_HUD": ("throttle",), "OUTPUTS": None}
"""What it would have the vehicle do; None: all fields."""


def judge_pulses(messages: Mapping[str, Message], armed: Floats) -> Iterator[Judged]:
    """Yield that what the autopilot demands is nobody's, where it moves nothing.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    armed : (k, 2) float
        From when to when, s.
    """
    servos = [m for m in messages.values() if m.name == _SERVOS and len(m) >= LEAST]
    if not servos or any(m.has_known(field) for m in servos for field in m.fields):
        return
    t = servos[0].t
    moving = while_armed(t, armed) & (turning(messages, t) > TURNS)
    if moving.sum() < LEAST:
        return
    why = "no output is given a pulse while the vehicle turns: somebody else steers it"
    yield from steered_by_others(messages, why)


def steered_by_others(messages: Mapping[str, Message], why: str) -> Iterator[Judged]:
    """Yield that what the autopilot would have the vehicle do is nobody's."""
    for key, fields in STEERS.items():
        message = messages.get(key)
        held = () if message is None else tuple(fields or message.fields)
        if message is not None and held:
            told = tuple(field for field in held if field in message)
            yield judged("demands, throttle and surfaces", message, told, False, why)
