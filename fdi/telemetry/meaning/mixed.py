"""What is a surface asked for that does the work of two?

In: outputs under the name of the surface that they drive, and what the parameters say of their
sense and throw. Out: what was mixed into them, aileron, elevator or rudder, each as half the sum
or the difference of the two sides.

===========  =======================================================================================
surfaces     what they are asked for
===========  =======================================================================================
elevons      left: elevator less aileron, right: elevator plus aileron
V-tail       left: elevator plus rudder, right: elevator less rudder
flaperons    aileron and flap. ArduPilot up to 4.4 gives both sides the same aileron and opposite
             flaps, later ones the other way round: what moves more of sum and difference is the
             aileron
===========  =======================================================================================

Sources: ArduPilot ArduPlane/servos.cpp (channel_function_mixer, flaperon_update); PX4
control_allocator/module.yaml (CA_SV_CSn_TYPE: 5 to 8, and the effectiveness that they begin with).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from fdi.telemetry.message import Column, Floats, Message
from fdi.units import Conversion

_MIXES: Final = {
    ("elevon_left", "elevon_right"): (("elevator", 1, 1), ("aileron", -1, 1)),
    ("vtail_left", "vtail_right"): (("elevator", 1, 1), ("rudder", 1, -1)),
    ("flaperon_left", "flaperon_right"): (("aileron", 1, 0),),  # 0: as it moves
}
MIXED: Final = frozenset(name for pair in _MIXES for name in pair)
"""Surfaces that do the work of two."""

Parameters = Mapping[str, float]


def share_of(parameters: Parameters, autopilot: str, output: int, throw: float) -> Conversion:
    """Return how a pulse width is to be read as a share of the throw, in the autopilot's sense.

    Examples
    --------
    >>> share_of({"SERVO2_REVERSED": 1.0}, "ardupilot", 2, 400.0).scale
    -0.0025
    """
    middle, sign = 1500.0, 1.0
    if autopilot == "px4":
        is_reversed = bool(int(parameters.get("PWM_MAIN_REV", 0.0)) >> (output - 1) & 1)
    else:
        low, high = (parameters.get(f"SERVO{output}_{end}", np.nan) for end in ("MIN", "MAX"))
        throw = (high - low) / 2 if high > low else throw
        middle = parameters.get(f"SERVO{output}_TRIM", middle)
        is_reversed = parameters.get(f"SERVO{output}_REVERSED") == 1
    sign = -1.0 if is_reversed else 1.0
    return Conversion("", sign / throw, -sign * middle / throw)


def unmixed(base: Message, found: Mapping[str, Column]) -> Iterator[tuple[str, Column]]:
    """Yield what the two sides of a mixed surface were asked for; one side alone tells nothing."""
    for pair, parts in _MIXES.items():
        if not all(name in found for name in pair):
            continue
        sides = Message(base.name, None, base.t, base.stamp, base.kept, found, base.key)
        for name, left, right in parts:

            def load(
                pair: tuple[str, str] = pair, left: int = left, right: int = right,
                sides: Message = sides,
            ) -> Floats:  # fmt: skip
                one, other = (sides.si_of_records(name) for name in pair)
                sign = right or _alike(one, other)
                made: Floats = (left * one + sign * other) / 2
                return made

            yield name, Column(load, Conversion(""))


def _alike(one: Floats, other: Floats) -> int:
    """Return 1 where two outputs move together, -1 where they move against each other."""
    known = np.isfinite(one) & np.isfinite(other)
    spreads = [float(np.std(one[known] + s * other[known])) if known.any() else 0 for s in (1, -1)]
    return 1 if spreads[0] >= spreads[1] else -1
