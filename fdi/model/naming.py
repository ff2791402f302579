"""What does a person call a component, and where on the airframe does it sit?

In: a component's key, the components of its model, a log. Out: words ("Motor 2 (rear left)"). The
place follows from what this very log says of the frame; where it says nothing, there is no place.
``frames.json`` holds the angles of the motors, with their sources.

The trap for a maintainer: the models take output n for motor n. Where the log tells that another
motor is on that output, the place is that motor's.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from importlib.resources import files
from math import atan2, degrees, floor
from typing import Any, Final

from fdi.model.outputs import moved_motors
from fdi.model.parts import Component
from fdi.telemetry import Log

_MOTOR: Final = re.compile(r"motor_([0-9]{1,2})")
_SECTORS: Final = (
    "front",
    "front right",
    "right",
    "rear right",
    "rear",
    "rear left",
    "left",
    "front left",
)
_QUAD, _HEXA = 1.0, 2.0  # FRAME_CLASS
_PX4_MOTOR: Final = 100  # PWM_MAIN_FUNCn: 101 is motor 1


def component_words(component: str, components: Mapping[str, Component]) -> str:
    """Return what a person calls a component, with its place where that is known.

    Examples
    --------
    >>> gps, motor = Component("gps", title="GPS receiver"), Component("motor_2", place="rear left")
    >>> known = {"gps": gps, "motor_2": motor}
    >>> component_words("gps", known), component_words("motor_2", known)
    ('GPS receiver', 'Motor 2 (rear left)')
    """
    known = components.get(component)
    words = known.title if known and known.title else component.replace("_", " ").strip()
    place = known.place if known else ""
    return words[:1].upper() + words[1:] + (f" ({place})" if place else "")


def placed(components: Mapping[str, Component], log: Log | None) -> dict[str, Component]:
    """Return components with their places on the airframe of a log."""
    if log is None:
        return dict(components)
    return {name: replace(one, place=place_of(name, log)) for name, one in components.items()}


def inside(words: str) -> str:
    """Return a name as it stands inside a sentence; an abbreviation keeps its capitals.

    Examples
    --------
    >>> inside("Radio control"), inside("GPS receiver")
    ('radio control', 'GPS receiver')
    """
    return words if words[:2].isupper() else words[:1].lower() + words[1:]


def place_of(component: str, log: Log) -> str:
    """Return where a motor sits on the airframe of a log, "" where the log does not tell."""
    motor = _MOTOR.fullmatch(component)
    if motor is None:
        return ""
    if log.autopilot == "px4":
        number = int(motor[1])
        if "actuator_motors" not in log:  # by motor; where it is logged, the models read that
            number = _px4_motor(number, log.parameters)
        angle = _px4_angle(number, log.parameters)
    elif log.autopilot == "ardupilot":
        number = _ardupilot_motor(int(motor[1]), log.parameters)
        angle = _listed(_ardupilot_angles(log.vehicle, log.parameters), number)
    else:
        angle = None
    return "" if angle is None else sector(angle)


def sector(angle: float) -> str:
    """Return the direction of an angle from the nose, degrees, clockwise from above, in words.

    Examples
    --------
    >>> sector(-135), sector(30), sector(180), sector(-20)
    ('rear left', 'front right', 'rear', 'front')
    """
    return _SECTORS[floor((angle + 22.5) / 45) % 8]


def _ardupilot_motor(output: int, parameters: Mapping[str, float]) -> int:
    """Return the motor on an output, 0 where another one's was put there or nobody says."""
    moved = moved_motors(parameters)
    there = [motor for motor, place in moved.items() if place == output]
    return there[0] if there else 0 if output in moved else output


def _ardupilot_angles(vehicle: str, parameters: Mapping[str, float]) -> Sequence[float]:
    """Return the angles of the motors; without FRAME_CLASS the vehicle's type tells how many."""
    table = _frames()["ardupilot"]
    kind = parameters.get("FRAME_CLASS", {"quad": _QUAD, "hexa": _HEXA}.get(vehicle, 0.0))
    order = parameters.get("FRAME_TYPE", parameters.get("FRAME"))
    name = {_QUAD: "quad", _HEXA: "hexa"}.get(kind)
    if name is None or order is None:
        return ()
    found: Sequence[float] = table[name].get(f"{order:.0f}", ())
    return found


def _px4_motor(output: int, parameters: Mapping[str, float]) -> int:
    """Return the motor on an output, by the output's function where it is a motor's."""
    function = round(parameters.get(f"PWM_MAIN_FUNC{output}", 0.0)) - _PX4_MOTOR
    return function if 1 <= function <= 12 else output


def _px4_angle(motor: int, parameters: Mapping[str, float]) -> float | None:
    """Return the angle of a motor, by the positions of the rotors or the kind of airframe."""
    positions = _positions(parameters)
    if positions:
        # Frames are wider than long, or longer than wide: front and rear count by the extent.
        length, width = (max(abs(p[axis]) for p in positions) or 1.0 for axis in (0, 1))
        if not 1 <= motor <= len(positions):
            return None
        forward, right = positions[motor - 1]
        if not (forward or right):  # in the middle, as a single rotor
            return None
        return degrees(atan2(right / width, forward / length))
    start = parameters.get("SYS_AUTOSTART", 0.0)
    for row in _frames()["px4"]:
        if row["from"] <= start <= row["to"]:
            return _listed(row["angles"], motor)
    return None


def _positions(parameters: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return how far forward and right of the middle the rotors are, m, as far as all are told."""
    count = round(parameters.get("CA_ROTOR_COUNT", 0.0))
    names = [(f"CA_ROTOR{n}_PX", f"CA_ROTOR{n}_PY") for n in range(count)]
    if not all(x in parameters and y in parameters for x, y in names):
        return []
    return [(parameters[x], parameters[y]) for x, y in names]


def _listed(angles: Sequence[float], motor: int) -> float | None:
    return angles[motor - 1] if 1 <= motor <= len(angles) else None


@lru_cache
def _frames() -> Any:
    return json.loads(files("fdi.model").joinpath("frames.json").read_text("utf-8"))
