"""Which value has a parameter of a model with this log, and what of it was assumed?

In: the parameters of an airframe and a log. Out: their values, and sentences for what the log does
not hold. A source is a parameter of the log; those of one quantity are asked in their order
(``log:`` in a model file). What means "not set" there (often 0 or -1) is passed over. Where no
source says anything, the model's own value holds; where it has none, the parameter is unknown,
NaN, and with it whatever needs it: a limit that the vehicle did not set is no test. Where the
motors stand is told by the frame (``frame:``); a value counts only where the log names none, not
where it names one that is not known. What is to be identified (``identify:``) is known to its prior
and that one's width until then, or to what earlier flights of the vehicle told (`with_learned`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import isnan, nan

from fdi.errors import ModelError
from fdi.model.expression import Expression, symbols
from fdi.model.parts import Equation, Measurement, Parameter, Source
from fdi.model.system import Estimate, ParameterValue, System
from fdi.model.world import world_value
from fdi.telemetry import Log
from fdi.telemetry.meaning import MOTORS
from fdi.telemetry.motors import motors_of, names_frame


def value_of(parameter: Parameter, log: Log | None) -> ParameterValue:
    """Return the value that a parameter has with a log."""
    for source in _asked(parameter, log):
        assert log is not None
        told = log.parameters.get(source.name)
        if told is not None and told not in source.unset:
            return ParameterValue(told * source.scale, parameter.unit, "log")
    if parameter.world and log:
        # A default would be wrong nearly everywhere: what the place and day do not tell is unknown.
        world = world_value(parameter.world, log)
        return ParameterValue(nan if world is None else world, parameter.unit, "log")
    if parameter.frame and log:
        told_by_frame = _of_frame(parameter.frame, log)
        if not isnan(told_by_frame) or parameter.value is None or _names_frame(log):
            return ParameterValue(told_by_frame, parameter.unit, "log")
    own = nan if parameter.value is None else parameter.value
    if parameter.bounds is None:
        return ParameterValue(own, parameter.unit, "default")
    value = ParameterValue(own, parameter.unit, "default", None, parameter.bounds, parameter.zero)
    return replace(value, std=value.width)


def with_learned(system: System, learned: Mapping[str, Estimate], *, where: str = "") -> System:
    """Return a system that knows of its parameters what earlier flights told.

    Parameters
    ----------
    system : System
    learned : mapping of str to Estimate
        By parameter.
    where : str
        Who says so, for errors.

    Raises
    ------
    ModelError
        The model identifies no such parameter, or a value is not within its bounds.
    """
    if not learned:
        return system
    own = {n: p for n, p in system.parameters.items() if p.bounds is not None}
    problems, found = [], dict[str, ParameterValue]()
    for name, told in learned.items():
        if name not in own:
            known = f"identifies {', '.join(own)}" if own else "identifies none"
            problems.append(f"no parameter {name!r} to identify in {system.name}, which {known}")
            continue
        low, high = own[name].bounds or (nan, nan)
        if low <= told.value <= high:
            found[name] = replace(
                own[name], value=told.value, std=told.std, source="policy", learned=told
            )
        else:
            problems.append(
                f"the value {told.value:g} of {name} is not within the bounds [{low:g}, {high:g}] "
                f"that {system.name} states"
            )
    if problems:
        place = f"{where}: " if where else ""
        raise ModelError.of([f"{place}calibration.parameters: {line}" for line in problems])
    return replace(system, parameters={**system.parameters, **found})


def _names_frame(log: Log) -> bool:
    return names_frame(log.parameters, log.autopilot)


def _of_frame(factor: str, log: Log) -> float:
    """Return ``roll_3`` and the like of the motors of a log, NaN where it does not tell."""
    axis, _, number = factor.partition("_")
    motors = motors_of(log.parameters, log.autopilot, log.vehicle)
    told = (getattr(motor, axis) for motor in motors if motor.number == int(number))
    return float(next(told, nan))


def _asked(parameter: Parameter, log: Log | None) -> list[Source]:
    """Return the sources that this log's autopilot, messages and parameters leave."""
    if log is None:
        return []
    return [
        source
        for source in parameter.sources
        if source.autopilot in (None, log.autopilot)
        and not any(name in log or log.parameters.get(name) for name in source.unless)
    ]


def without_unset(
    equations: Sequence[Equation], parameters: Mapping[str, Parameter], log: Log | None
) -> tuple[list[Equation], list[str]]:
    """Return the equations that need no parameter which the vehicle did not set, and what is told.

    What only such an equation determines is not known either: what needs it goes with it.
    """
    told_by_log = {name: p for name, p in parameters.items() if p.sources or p.frame}
    values = {name: value_of(p, log).value for name, p in told_by_log.items()}
    unset = [name for name in values if log is not None and isnan(values[name])]
    needed = {e.name: _names(e) for e in equations} if unset else {}
    needing = {name: _needing(name, equations, needed) for name in unset}
    gone = [equation for some in needing.values() for equation in some]
    told = list[str]()
    for reason, is_held in (("the vehicle sets no", True), ("not in this log:", False)):
        names, whom = dict[str, None](), dict[str, None]()
        for name, without in needing.items():
            asked = [source.name for source in _asked(parameters[name], log)]
            held = [name for name in asked if log is not None and name in log.parameters]
            if without and asked and bool(held) == is_held:
                names[(held or asked)[0]] = None
                whom |= dict.fromkeys(e.component for e in without if e.component)
        if names:
            told.append(
                f"{reason} {', '.join(names)}: without the tests of {', '.join(whom)} that need it"
            )
    of_frame = [e for name, without in needing.items() if parameters[name].frame for e in without]
    if of_frame:
        whom = dict.fromkeys(e.component for e in of_frame if e.component)
        told.append(
            "this log does not tell where the motors stand and which way they turn: without the "
            f"tests{' of ' * bool(whom)}{', '.join(whom)} that need it"
        )
    return [e for e in equations if e not in gone], told


def _needing(
    name: str, equations: Sequence[Equation], needed: Mapping[str, set[str]]
) -> list[Equation]:
    """Return the equations that need a parameter, or what only those determine that do."""
    kept, lost, gone = list(equations), {name}, list[Equation]()
    while lost:
        new = [e for e in kept if lost & needed[e.name]]
        kept = [e for e in kept if e not in new]
        gone += new
        given = {name for e in kept for name in e.solves or ()}
        lost = {name for e in new for name in e.solves or ()} - given
    return gone


def assumptions(
    parameters: Mapping[str, Parameter],
    equations: Iterable[Equation],
    measurements: Iterable[Measurement],
    log: Log | None,
) -> list[str]:
    """Return one sentence for the parameters that are used and of which the log has no source."""
    used = {name for e in equations for name in _names(e)}
    used |= {n for m in measurements for x in (m.value, m.when, m.reported) for n in _symbols(x)}
    assumed = []
    for name, parameter in parameters.items():
        asked = _asked(parameter, log)
        if log is None or name not in used or not asked or parameter.value is None:
            continue
        if not any(source.name in log.parameters for source in asked):
            unit = "" if parameter.unit == "1" or asked[0].scale != 1 else f" {parameter.unit}"
            assumed.append(f"{asked[0].name} {parameter.value / asked[0].scale:g}{unit}")
    told = [f"not in this log, so assumed: {', '.join(dict.fromkeys(assumed))}"] if assumed else []
    of_frame = [p for name, p in parameters.items() if p.frame and name in used]
    judged = log is not None and MOTORS in log  # without their outputs nothing rests on it
    if judged and any(value_of(p, log).source == "default" for p in of_frame):
        told.append(
            "this log does not tell the frame, so assumed: motors stand and turn as in the model"
        )
    return told


def _names(equation: Equation) -> set[str]:
    sides = (equation.left, equation.right, equation.when, *equation.errors, *equation.swings)
    return {name for side in sides for name in _symbols(side)}


def _symbols(expression: Expression | None) -> tuple[str, ...]:
    return () if expression is None else symbols(expression)
