"""Is the motor that a model calls motor 3 the one on output 3?

The models take output n for motor n, as autopilots do unless somebody tells them otherwise. In: the
log's parameters as first downloaded, which say what each output drives. A function that was changed
while the log was recorded says nothing about the wiring: it is a way to stop an output.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

_FUNCTION: Final = re.compile(r"(?:SERVO|RC)([0-9]{1,2})_FUNCTION")
# SRV_Channel::Aux_servo_function_t: k_motor1 .. k_motor8, k_motor9 .. k_motor12
_MOTORS: Final[dict[float, int]] = {
    **{33 + i: 1 + i for i in range(8)},
    **{82 + i: 9 + i for i in range(4)},
}


def moved_motors(parameters: Mapping[str, float]) -> dict[int, int]:
    """Return the motors that are not on the output of their own number, and on which they are.

    Parameters
    ----------
    parameters : Mapping[str, float]
        ArduPilot's, as first downloaded.

    Examples
    --------
    >>> moved_motors({"SERVO1_FUNCTION": 34, "SERVO2_FUNCTION": 33, "SERVO3_FUNCTION": 35})
    {1: 2, 2: 1}
    """
    found: dict[int, int] = {}
    for name, value in parameters.items():
        output, motor = _FUNCTION.fullmatch(name), _MOTORS.get(value)
        if output and motor is not None and int(output[1]) != motor:
            found[motor] = int(output[1])
    return dict(sorted(found.items()))
