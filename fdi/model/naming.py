"""What does a person call a component, and where on the airframe does it sit?

In: a component's key, the components of its model, a log. Out: words ("Motor 2 (rear left)"). The
place follows from what this very log says of the frame (`fdi.telemetry.motors`); where it says
nothing, there is no place. Motors are counted as the autopilot does, whatever output drives them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from math import atan2, degrees, floor
from typing import Final

from fdi.model.parts import Component
from fdi.telemetry import Log
from fdi.telemetry.motors import motors_of

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
_HALF_A_SECTOR: Final = 0.25  # quarter turns


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
    found = _MOTOR.fullmatch(component)
    if found is None:
        return ""
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    motor = next((one for one in motors if one.number == int(found[1])), None)
    if motor is None or not (motor.roll or motor.pitch):  # in the middle, as a single rotor
        return ""
    # Frames are wider than long, or longer than wide: front and rear count by the extent.
    return sector(degrees(atan2(-motor.roll, motor.pitch)))


def sector(angle: float) -> str:
    """Return the direction of an angle from the nose, degrees, clockwise from above, in words.

    Examples
    --------
    >>> sector(-135), sector(30), sector(180), sector(-20)
    ('rear left', 'front right', 'rear', 'front')

    Half way between two directions, as on an octocopter, it is the one that names both.

    >>> sector(22.5), sector(67.5), sector(-22.5), sector(-157.5)
    ('front right', 'front right', 'front left', 'rear left')
    """
    turns = round(angle, 3) / 90
    straight = floor(turns + 0.5)
    within = abs(turns - straight) < _HALF_A_SECTOR
    return _SECTORS[(2 * straight if within else 2 * floor(turns) + 1) % 8]
