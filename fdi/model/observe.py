"""What of a model holds with the telemetry of this very log? Part by part.

In: measurements, equations, parameters of an airframe and a log. Out: the parts of a ``System``,
which :meth:`fdi.model.airframe.Airframe.observe` puts together. Whether an equation can be solved
for an unknown follows from its expression (see ``calculus.py``) unless the model says otherwise.

The trap for a maintainer: inside a measurement equation the channel's value is always called
``measured``, so that expressions of equal shape stay equal whatever the channel is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from math import isclose
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import ModelError
from fdi.model.calculus import isolate
from fdi.model.dimensions import Dimension, dimension
from fdi.model.evaluate import evaluate, holds
from fdi.model.expression import (
    KEPT,
    OVER_A_WHILE,
    Apply,
    Expression,
    Number,
    Symbol,
    differential,
    substitute,
    symbols,
    walk,
)
from fdi.model.lacking import Fallen, lacking_words
from fdi.model.parts import (
    MEASURED,
    Component,
    Equation,
    Kind,
    Measurement,
    Parameter,
    Variable,
    fields_of,
)
from fdi.model.system import EdgeKind, Fault, ParameterValue, SystemEquation
from fdi.telemetry import Log, Request
from fdi.telemetry.meaning import RESTART

_STATED: Final = tuple(
    field.name for field in fields(Equation) if field.name in SystemEquation.__dataclass_fields__
)
"""What the model says of an equation and every system hands on."""


def usable(
    equations: Sequence[Equation],
    measurements: Sequence[Measurement],
    present: Sequence[Measurement],
    components: Mapping[str, Component],
    log: Log | None,
    warnings: list[str],
) -> tuple[list[Equation], frozenset[str]]:
    """Return the equations whose inputs this telemetry shows, and the components curtailed.

    A relation that needs an input is a statement about what is known. Without the channel the
    variable would become one more unknown, and every equation that shares it would be tied to all
    others: thousands of entangled sets that nobody meant. A component whose relation falls away is
    curtailed, unless all that is lacking is a sensor of its own that the vehicle does not have.
    """
    shown = {m.variable for m in present}
    unwatched = {m.variable for m in measurements if m.stillness} - shown
    lost = {m.variable for m in measurements if m.trusted} - shown - unwatched
    lost = _not_computed(lost, equations)
    kept = [e for e in equations if not unwatched & set(symbols(e.left))]
    # asked for every lost input of every observation: a log of few messages has many of both
    needing: dict[str, list[Equation]] = {}
    for equation in kept:
        for name in {*symbols(equation.left), *symbols(equation.right)} & lost:
            needing.setdefault(name, []).append(equation)
    gone: set[str] = set()
    curtailed: set[str] = set()
    fallen: list[Fallen] = []
    for name in sorted(lost):
        without = [e for e in needing.get(name, ()) if e.name not in gone]
        gone |= {e.name for e in without}
        channels = {m.channel for m in measurements if m.trusted and m.variable == name}
        if all(channel.message == RESTART for channel in channels):
            continue  # it is made where something happened: without it nothing is lacking
        if without:
            fallen.append(Fallen(frozenset(channels), tuple(without)))
        heard = {c for c in channels if log is not None and c.source in log}
        for equation in without:
            own = {
                m.channel
                for m in measurements
                if not m.trusted and m.component == equation.component
            }
            if equation.component and (heard or not channels <= own):
                curtailed.add(equation.component)
    warnings += lacking_words(fallen, components, log)
    return [e for e in kept if e.name not in gone], frozenset(curtailed)


def _not_computed(lost: set[str], equations: Iterable[Equation]) -> set[str]:
    """Return the inputs that no equation gives which can only be solved for them."""
    for equation in equations:
        names = {*symbols(equation.left), *symbols(equation.right)}
        given = equation.solves or frozenset()
        if len(given) == 1 and given <= lost and not lost & (names - given):
            lost = lost - given
    return lost


def first_inputs(present: Iterable[Measurement]) -> list[Measurement]:
    """Return the measurements with one input for a variable: a second one would be a copy."""
    shown: set[str] = set()
    kept = []
    for measurement in present:
        if measurement.trusted and measurement.variable in shown:
            continue
        if measurement.trusted:
            shown.add(measurement.variable)
        kept.append(measurement)
    return kept


def is_present(
    measurement: Measurement,
    log: Log | None,
    wanted: str,
    parameters: Mapping[str, Parameter],
    units: Mapping[str, Dimension],
    warnings: list[str],
) -> bool:
    """Return whether a log shows a measurement; what is not usable of it is added to warnings.

    Parameters
    ----------
    wanted : str
        The unit of the measured variable.
    parameters, units
        Of the airframe.

    Raises
    ------
    ModelError
        The log gives another unit.
    """
    if log is None:
        return True
    channel = measurement.channel
    if channel.source not in log:
        return False
    message = log[channel.source]
    if measurement.made_by and message.made_from is None:
        return False  # the log's own message of that name is no method's
    asked = fields_of(measurement, parameters)
    missing = [name for name in asked if name not in message.fields]
    if missing:
        if measurement.made_by:
            warnings.append(
                f"{channel}: the method {measurement.made_by} gives no {', '.join(missing)}"
            )
        elif message.made_from is None:  # otherwise the log has no such message at all
            warnings.append(f"{channel}: this log has no field {', '.join(missing)}")
        return False
    streamed = log.format == "tlog" and log.autopilot != "px4" and message.made_from is None
    if measurement.silence and streamed:
        return False  # ArduPilot sends its streams whatever its sensors do: who stopped one is told
    if measurement.raw:
        return True
    field = channel.field if measurement.value is None else _meant(measurement.value)
    if field is None:
        return True
    own = message.unit(field)
    if not own and (units.get(wanted) or dimension(wanted)).exponents:
        warnings.append(
            f"{channel}: this log does not state its unit (raw: true takes it as it is)"
        )
        return False
    if measurement.value is not None:
        return True
    if not _fits(own, wanted, units):
        raise ModelError(
            f"the log gives {own!r}, the variable {measurement.variable!r} is in {wanted!r}",
            where=str(channel),
        )
    return message.has_known(channel.field)


def _meant(value: Expression) -> str | None:
    """Return the field that a value is of a while of, in its own unit; None for any other value."""
    if isinstance(value, Apply) and value.operator in OVER_A_WHILE:
        of = value.arguments[0]
        return of.name if isinstance(of, Symbol) else None
    return None


def _fits(own: str, wanted: str, units: Mapping[str, Dimension]) -> bool:
    """Return whether a log's values are in the unit of a variable."""
    if own == wanted:
        return True
    variable = units.get(wanted) or dimension(wanted)
    if own:
        try:
            return (units.get(own) or dimension(own)).fits(variable)
        except ModelError:  # a log may have a unit that is none of physics
            return False
    # No unit is a number; per cent and degrees it is not, because these became fractions and
    # radians when the log was read.
    return isclose(variable.factor, 1.0)


def _names(expression: Expression, parameters: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(name for name in symbols(expression) if name not in parameters)


def relation_equation(equation: Equation, variables: Mapping[str, Variable]) -> SystemEquation:
    """Return an equation of the model over the unknowns of a system."""
    names = dict.fromkeys((*symbols(equation.left), *symbols(equation.right)))
    unknowns = [name for name in names if name in variables]
    return SystemEquation(
        **{name: getattr(equation, name) for name in _STATED},
        edges={name: _edge(equation, name, variables[name]) for name in unknowns},
        circular=any(
            isinstance(side, Symbol) and side.name in variables and variables[side.name].circular
            for side in (equation.left, equation.right)
        ),
    )


def _edge(equation: Equation, name: str, variable: Variable) -> EdgeKind:
    pair = differential(equation.left, equation.right)
    if pair:
        return "derivative" if pair[0] == name else "integral"
    if equation.solves is not None:
        return "solvable" if name in equation.solves else "fixed"
    signed = variable.low is None or variable.low < 0
    solution = isolate(equation.left, equation.right, name, signed=signed)
    return "solvable" if solution is not None and len(solution.roots) == 1 else "fixed"


def measurement_equation(
    measurement: Measurement, variables: Mapping[str, Variable]
) -> SystemEquation:
    """Return the equation that a channel of the log brings."""
    channel = str(measurement.channel)
    # A channel may be an input of one variable and the measurement of another.
    return SystemEquation(
        f"{channel}>{measurement.variable}" if measurement.trusted else channel,
        Kind.INPUT if measurement.trusted else Kind.MEASUREMENT,
        Symbol(measurement.variable),
        Symbol(MEASURED),
        {measurement.variable: "solvable"},
        circular=variables[measurement.variable].circular,
        fault=None if measurement.trusted else str(measurement.channel),
        component=measurement.component,
        unit=variables[measurement.variable].unit,
        measurement=measurement,
        text=f"{measurement.variable} = {measurement.channel}",
    )


def with_latency(measurement: Measurement, parameters: Mapping[str, ParameterValue]) -> Measurement:
    """Return a measurement with the latency that the log's parameter tells, and how sure it is."""
    told = parameters.get(measurement.late)
    if told is None:
        return measurement
    sure = measurement.latency_told if told.source == "log" else measurement.latency_accuracy
    return replace(measurement, latency=told.value, latency_accuracy=sure)


def faults_of(
    equations: Sequence[SystemEquation], components: Mapping[str, Component]
) -> list[Fault]:
    """Return the faults that enter equations, in their order."""
    faults = []
    for number, equation in enumerate(equations):
        if equation.fault is None:
            continue
        component = equation.component or "outside_model"
        group = (
            equation.measurement.group
            if equation.measurement and equation.measurement.group != "other"
            else components[component].group
        )
        faults.append(Fault(equation.fault, component, group, number))
    return faults


def request_of(
    measurement: Measurement, variable: Variable, parameters: Mapping[str, ParameterValue]
) -> Request:
    """Return what to ask of a log for a measurement."""
    value, when, reported = measurement.value, measurement.when, measurement.reported
    asked = (name for one in (value, when, reported) if one is not None for name in symbols(one))
    constants = {name: Number(parameters[name].value) for name in asked if name in parameters}
    operators = {n.operator for n in walk(value) if isinstance(n, Apply)} if value else set()
    over = bool(operators & OVER_A_WHILE)
    return Request(
        channel=measurement.channel,
        fields=fields_of(measurement, parameters),
        value=None if value is None else _compute(substitute(value, constants)),
        valid=None if when is None else _hold(substitute(when, constants)),
        raw=measurement.raw,
        circular=variable.circular,
        latency=measurement.latency,
        latency_accuracy=measurement.latency_accuracy,
        silence=measurement.silence,
        stirred=measurement.stirred,
        reported=None if reported is None else _compute(substitute(reported, constants)),
        told=() if reported is None else _names(reported, parameters),
        over=over,
        kept=KEPT in operators,
        paces=not (over or measurement.silence or measurement.made_by),
    )


def _compute(expression: Expression) -> Callable[[Mapping[str, NDArray[Any]]], NDArray[Any]]:
    return lambda columns: evaluate(expression, columns)


def _hold(condition: Expression) -> Callable[[Mapping[str, NDArray[Any]]], NDArray[np.bool_]]:
    return lambda columns: holds(condition, columns)
