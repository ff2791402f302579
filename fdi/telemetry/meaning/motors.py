"""Which motor does every output of a multicopter drive, or of an aeroplane that rotors lift?

In: a log's messages and parameters. Out: the message ``MOTORS``: ``motor_1`` to ``motor_n``, the
output *of that motor* as a share of its range, so that a model needs to know neither the wiring nor
the autopilot. An output of 0 is unknown. What the log does not tell is left out: a motor that two
outputs drive or none, all of them where the range is none (`unwired` says so).

==========  ========================================================================================
autopilot   which output drives a motor, and its range
==========  ========================================================================================
ArduPilot   ``SERVOn_FUNCTION`` (before 3.5 ``RCn_FUNCTION``) 33 to 40 and 82 to 85: motors 1 to 12.
            ``MOT_PWM_MIN`` and ``_MAX``, where 0 is not set the stick's ``RC3_MIN`` and ``_MAX``;
            digital ones (``MOT_PWM_TYPE`` 4 to 7) 1000 to 2000 us. Of an aeroplane that rotors lift
            ``Q_M_PWM_MIN``, ``_MAX``, ``_TYPE``, before 4.1 ``Q_THR_MIN_PWM`` and ``_MAX_``
PX4         ``actuator_motors`` where it is logged, which ``SERVO_OUTPUT_RAW`` then says as 1000 us
            stopped and 2000 us full; else ``PWM_MAIN_FUNCn``, ``PWM_AUX_FUNCn``, ``HIL_ACT_FUNCn``
            101 to 112. ``PWM_MAIN_MINn``, ``PWM_MAIN_MIN``, ``PWM_MIN`` (-1 and 0 are not set)
else        1000 to 2000 us, and wherever the above is not in the log or a simulation flies
==========  ========================================================================================

A motor of a multicopter that no function names is on the output of its own number, unless that one
does something else: autopilots do so by themselves, and a log may hold some of the parameters only.
Only functions as first downloaded count: to change one in flight is a way to stop an output.

Sources: ArduPilot SRV_Channel.h (k_motor1 ...), AP_MotorsMulticopter::get_pwm_output_min and
update_throttle_range; PX4 output_functions.yaml (Motor1 is 101), pwm_out's module.yaml.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import isfinite, nan
from typing import Final, NamedTuple

from fdi.telemetry.meaning.rotors import rotors
from fdi.telemetry.message import Column, Message
from fdi.telemetry.motors import lifting
from fdi.units import Conversion

MOTORS: Final = "MOTORS"
_SERVOS: Final = "SERVO_OUTPUT_RAW"
_BY_MOTOR: Final = "actuator_motors"
_SECOND: Final = "actuator_outputs[1]"
_OUTPUTS: Final = range(1, 17)
_USUAL_US: Final = (1000.0, 2000.0)
_AUX: Final = "PWM_AUX_FUNC{}"
_HIL: Final = "HIL_ACT_FUNC{}"
_FUNCTIONS: Final = {
    "ardupilot": ("SERVO{}_FUNCTION", "RC{}_FUNCTION"),
    "px4": ("PWM_MAIN_FUNC{}", _AUX, _HIL),
}
_NUMBERS: Final[Mapping[str, Mapping[float, int]]] = {
    "ardupilot": {33.0 + i: 1 + i for i in range(8)} | {82.0 + i: 9 + i for i in range(4)},
    "px4": {101.0 + i: 1 + i for i in range(12)},
}
_ENDS: Final = ("MIN", "MAX")
_UNSET: Final = {"ardupilot": (0.0,), "px4": (0.0, -1.0)}
_DIGITAL: Final = (4.0, 5.0, 6.0, 7.0)  # MOT_PWM_TYPE: DShot150 to DShot1200

Messages = Mapping[str, Message]
Parameters = Mapping[str, float]


class Wiring(NamedTuple):
    """Which outputs drive which motor.

    Attributes
    ----------
    pattern : str
        Of the parameters that say so, "" where none does.
    outputs : Mapping[int, tuple of int]
        By motor: one, or several, or none.
    """

    pattern: str
    outputs: Mapping[int, tuple[int, ...]]


def with_motors(
    messages: Messages, parameters: Parameters, autopilot: str, vehicle: str
) -> dict[str, Message]:
    """Return the messages with ``MOTORS``, where the vehicle is one of motors and they are known.

    And with ``ROTOR_1`` to ``ROTOR_n``, where their controllers tell how fast they turn.

    Parameters
    ----------
    messages : Mapping[str, Message]
        By key, in MAVLink's words.
    parameters : Mapping[str, float]
        As first downloaded.
    autopilot, vehicle : str
        As in `Log`.
    """
    known = dict(messages)
    if not lifting(parameters, autopilot, vehicle) or MOTORS in known:
        return known
    wiring = wiring_of(messages, parameters, autopilot, vehicle)
    turning = {each.name: each for each in rotors(messages, wiring.outputs)}
    given = _given(messages, parameters, autopilot, wiring)
    made = {**turning, MOTORS: given} if given is not None else turning
    return dict(sorted({**known, **made}.items()))


def _given(
    messages: Messages, parameters: Parameters, autopilot: str, wiring: Wiring
) -> Message | None:
    """Return what every motor is given, None where no output of one is known."""
    base, field = messages.get(_SERVOS), "servo{}_raw"
    if base is None:
        return None
    if wiring.pattern == _AUX and _SECOND in messages:
        base, field = messages[_SECOND], "output[{}]"
    first = 1 if base.name == _SERVOS else 0
    columns: dict[str, Column] = {}
    for motor, outputs in wiring.outputs.items():
        if len(outputs) != 1:
            continue
        column = base.columns.get(field.format(outputs[0] - 1 + first))
        low, high = range_of(messages, parameters, autopilot, wiring.pattern, outputs[0])
        if column is not None and low < high:
            columns[f"motor_{motor}"] = _share(column, low, high)
    told = base.made_from or base.key
    made = replace(base, name=MOTORS, instance=None, columns=columns, made_from=told, _cache={})
    return made if columns else None


def unwired(
    messages: Messages, parameters: Parameters, autopilot: str, vehicle: str
) -> Iterator[str]:
    """Yield a sentence for all that keeps motors out of ``MOTORS``, and for what is assumed.

    Examples
    --------
    >>> told = {"SERVO1_FUNCTION": 33.0, "SERVO5_FUNCTION": 33.0}
    >>> next(unwired({}, told, "ardupilot", "quad"))
    'SERVO1_FUNCTION and SERVO5_FUNCTION are both motor 1: nothing is said of what it is given'
    """
    if not lifting(parameters, autopilot, vehicle):
        if vehicle == "vtol":
            yield "the log does not say where four motors lift this vehicle: none of them is judged"
        return
    wiring = wiring_of(messages, parameters, autopilot, vehicle)
    for motor, outputs in wiring.outputs.items():
        if len(outputs) > 1:
            names = " and ".join(map(wiring.pattern.format, outputs))
            how = "both" if len(outputs) == 2 else "all"
            yield f"{names} are {how} motor {motor}: nothing is said of what it is given"
        elif not outputs:
            yield f"no output is motor {motor}: nothing is said of what it is given"
    driven = sorted({each[0] for each in wiring.outputs.values() if len(each) == 1}) or [1]
    for output in driven:
        low, high = range_of(messages, parameters, autopilot, wiring.pattern, output)
        if not low < high:
            yield (
                f"output {output} drives its motor from {low:g} to {high:g} us, which is no range: "
                "nothing is said of what it is given"
            )
    asked = _range_names(messages, parameters, autopilot, wiring.pattern, driven[0])
    ends = zip(_ENDS, _USUAL_US, strict=True)
    assumed = [
        f"{asked[0].format(end)} {usual:g} us"
        for end, usual in ends
        if asked and not any(name.format(end) in parameters for name in asked)
    ]
    if assumed:
        yield f"not in this log, so assumed: {', '.join(assumed)}"


def wiring_of(messages: Messages, parameters: Parameters, autopilot: str, vehicle: str) -> Wiring:
    """Return which outputs drive the motors of a vehicle."""
    motors = range(1, lifting(parameters, autopilot, vehicle) + 1)
    own = Wiring("", {motor: (motor,) for motor in motors})
    if autopilot == "px4" and _BY_MOTOR in messages:
        return own
    if vehicle == "vtol":  # its first outputs may as well be surfaces
        own = Wiring("", dict.fromkeys(motors, ()))
    numbers = _NUMBERS.get(autopilot, {})
    for pattern in _patterns(parameters, autopilot):
        told = {n: parameters.get(pattern.format(n), 0.0) for n in _OUTPUTS}
        if not any(function in numbers for function in told.values()):
            continue
        drives: dict[int, tuple[int, ...]] = {}
        for motor in motors:
            outputs = tuple(n for n in _OUTPUTS if numbers.get(told[n]) == motor)
            drives[motor] = outputs or ((motor,) if not told[motor] else ())
        return Wiring(pattern, drives)
    return own


def range_of(
    messages: Messages, parameters: Parameters, autopilot: str, pattern: str, output: int
) -> tuple[float, float]:
    """Return which pulse widths of an output are no power and all of it, us."""
    low, high = _USUAL_US
    for name in reversed(_range_names(messages, parameters, autopilot, pattern, output)):
        ends = (parameters.get(name.format(end), nan) for end in _ENDS)
        low, high = (
            told if isfinite(told) and told not in _UNSET[autopilot] else end
            for told, end in zip(ends, (low, high), strict=True)
        )
    return low, high


def _range_names(
    messages: Messages, parameters: Parameters, autopilot: str, pattern: str, output: int
) -> tuple[str, ...]:
    """Return how the parameters are called that tell the range, those that count first."""
    if autopilot == "ardupilot" and parameters.get("Q_ENABLE"):
        digital = parameters.get("Q_M_PWM_TYPE") in _DIGITAL
        return () if digital else ("Q_M_PWM_{}", "Q_THR_{}_PWM")
    if autopilot == "ardupilot" and parameters.get("MOT_PWM_TYPE") not in _DIGITAL:
        return ("MOT_PWM_{}", "RC3_{}")
    simulated = _BY_MOTOR in messages or parameters.get("SYS_HITL") or pattern == _HIL
    if autopilot != "px4" or simulated:
        return ()
    bank = "PWM_AUX_{}" if pattern == _AUX else "PWM_MAIN_{}"
    return (f"{bank}{output}", bank, "PWM_{}")


def _patterns(parameters: Parameters, autopilot: str) -> tuple[str, ...]:
    """Return how the parameters are called that say what outputs do, those that count first."""
    names = _FUNCTIONS.get(autopilot, ())
    return names[::-1] if autopilot == "px4" and parameters.get("SYS_HITL") else names


def _share(column: Column, low: float, high: float) -> Column:
    """Return an output as a share of its range; 0 is unknown."""
    own = column.conversion
    share = Conversion("", own.scale / (high - low), (own.offset - low) / (high - low))
    return column._replace(conversion=share, invalid=(*column.invalid, 0.0))
