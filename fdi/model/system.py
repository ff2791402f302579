"""Which equations hold with the telemetry of this very log, and which faults do they bring?

In: an airframe and a log. Out: a ``System``. Every relation, limit and equality of the model is in
it; a measurement is in it when its channel is in the log, and brings one equation and one fault.
Whether an equation can be solved for an unknown follows from its expression (see ``calculus.py``)
unless the model says otherwise.

The trap for a maintainer: inside a measurement equation the channel's value is always called
``measured``, so that expressions of equal shape stay equal whatever the channel is.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from math import isclose, nan
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError, ModelError
from fdi.model.calculus import isolate
from fdi.model.dimensions import Dimension, dimension
from fdi.model.evaluate import evaluate, holds
from fdi.model.expression import (
    Expression,
    Number,
    Symbol,
    differential,
    substitute,
    symbols,
)
from fdi.model.parts import (
    MEASURED,
    STATES,
    Component,
    Equation,
    Kind,
    Measurement,
    Parameter,
    Side,
    Variable,
)
from fdi.model.world import world_value
from fdi.structure import Fault as StructuralFault
from fdi.structure import Model
from fdi.telemetry import Log, Request

if TYPE_CHECKING:
    from fdi.model.airframe import Airframe

EdgeKind = Literal["solvable", "fixed", "derivative", "integral"]
DIFFERENTIAL: Final = ("derivative", "integral")


@dataclass(frozen=True, slots=True)
class SystemEquation:
    """An equation over the unknowns of one system.

    Attributes
    ----------
    edges : mapping of str to EdgeKind
        For every unknown it holds: ``solvable`` for it, ``fixed`` (non-invertible), or its
        ``derivative`` or ``integral`` edge.
    circular : bool
        Whether its two sides are angles, so that their difference wraps.
    measurement : Measurement or None
        The channel, where the equation is one.
    """

    name: str
    kind: Kind
    left: Expression
    right: Expression
    edges: Mapping[str, EdgeKind]
    circular: bool = False
    when: Expression | None = None
    cost: float = 1.0
    fault: str | None = None
    component: str | None = None
    tolerance: float = 0.0
    window: float = 0.0
    offset: float = 0.0
    side: Side = ""
    scale: float = 0.0
    supports: bool = False
    unit: str = ""
    suspects: tuple[str, ...] = ()
    measurement: Measurement | None = None
    text: str = ""

    @property
    def differential(self) -> tuple[str, str] | None:
        """Return (derivative, state) of ``y = der(x)``, else None."""
        return differential(self.left, self.right)


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of a system, by the equation that it enters."""

    name: str
    component: str
    group: str
    equation: int


@dataclass(frozen=True, slots=True)
class ParameterValue:
    """The value a parameter has in this system; ``source`` is default, log or identified."""

    value: float
    unit: str
    source: Literal["default", "log", "identified"]
    std: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """The equations that hold with one log.

    Attributes
    ----------
    channels : tuple of Request
        What to ask of the log: every measured channel.
    curtailed : frozenset of str
        Components of which a relation fell away because the log lacks what it needs beside them.
    warnings : tuple of str
        What of the model could not be used with this log, and why.
    """

    name: str
    sha256: str
    equations: tuple[SystemEquation, ...]
    unknowns: tuple[str, ...]
    faults: tuple[Fault, ...]
    channels: tuple[Request, ...]
    variables: Mapping[str, Variable]
    parameters: Mapping[str, ParameterValue]
    components: Mapping[str, Component]
    curtailed: frozenset[str] = frozenset()
    warnings: tuple[str, ...] = ()

    @property
    def inputs(self) -> Mapping[str, int]:
        """Return the variables that inputs show, with the equations that do."""
        return {
            equation.measurement.variable: number
            for number, equation in enumerate(self.equations)
            if equation.kind is Kind.INPUT and equation.measurement
        }

    def structure(self, *, limits: bool = True) -> Model:
        """Return the incidence of the system, as pure structure.

        A variable that an input shows is known and trusted, so it is no unknown here.

        Parameters
        ----------
        limits : bool
            False leaves limits and equalities out: they are no redundancy for a cross-check. The
            names of the equations, not their numbers, then lead back to the system.
        """
        left_out = (Kind.INPUT,) if limits else (Kind.INPUT, Kind.LIMIT, Kind.EQUALITY)
        kept = [i for i, equation in enumerate(self.equations) if equation.kind not in left_out]
        row_of = {number: row for row, number in enumerate(kept)}
        known = self.inputs
        used = {name for i in kept for name in self.equations[i].edges}
        names = [name for name in self.unknowns if name in used and name not in known]
        place = {name: column for column, name in enumerate(names)}
        edges = [
            (row_of[i], place[name], kind)
            for i in kept
            for name, kind in self.equations[i].edges.items()
            if name in place
        ]
        return Model(
            equations=tuple(self.equations[i].name for i in kept),
            unknowns=tuple(names),
            rows=tuple(
                tuple(sorted(place[n] for n in self.equations[i].edges if n in place)) for i in kept
            ),
            faults=tuple(
                StructuralFault(fault.name, (row_of[fault.equation],))
                for fault in self.faults
                if fault.equation in row_of
            ),
            derivative=tuple((i, j, kind[0]) for i, j, kind in edges if kind in DIFFERENTIAL),
            nonsolvable=tuple((i, j) for i, j, kind in edges if kind == "fixed"),
            name=self.name,
        )

    def __repr__(self) -> str:
        return (
            f"<System {self.name}: {len(self.equations)} equations, "
            f"{len(self.unknowns)} unknowns, {len(self.faults)} faults>"
        )


def build_system(airframe: Airframe, log: Log | None, also: Collection[str] = ()) -> System:
    """Return the system; see :meth:`fdi.model.airframe.Airframe.observe`."""
    warnings: list[str] = []
    parameters = {name: _value(p, log) for name, p in airframe.parameters.items()}
    present = [
        m
        for m in airframe.measurements
        if m.channel.source in also or _is_present(m, log, airframe, warnings)
    ]
    present = _first_inputs(present)
    if not present:
        raise LogError(
            f"holds no message that the model {airframe.name!r} measures",
            where=log.name if log else "",
            hint="choose another model with --model",
        )
    relations, curtailed = _usable(airframe, present, log, warnings)
    equations = [_relation(e, airframe) for e in relations]
    equations += [_shown(m, airframe) for m in present]
    unknowns = [name for equation in equations for name in equation.edges]
    return System(
        name=airframe.name,
        sha256=airframe.sha256,
        equations=tuple(equations),
        unknowns=tuple(sorted(set(unknowns))),
        faults=tuple(_faults(equations, airframe)),
        channels=tuple(_request(m, airframe.variables[m.variable], parameters) for m in present),
        variables=airframe.variables,
        parameters=parameters,
        components=airframe.components,
        curtailed=curtailed,
        warnings=tuple(warnings),
    )


def _usable(
    airframe: Airframe, present: list[Measurement], log: Log | None, warnings: list[str]
) -> tuple[list[Equation], frozenset[str]]:
    """Return the equations whose inputs this telemetry shows, and the components curtailed.

    A relation that needs an input is a statement about what is known. Without the channel the
    variable would become one more unknown, and every equation that shares it would be tied to all
    others: thousands of entangled sets that nobody meant. A component whose relation falls away is
    curtailed, unless all that is lacking is a sensor of its own that the vehicle does not have.
    """
    shown = {m.variable for m in present}
    unwatched = {m.variable for m in airframe.measurements if m.stillness} - shown
    lost = {m.variable for m in airframe.measurements if m.trusted} - shown - unwatched
    lost = _not_computed(lost, airframe.equations)
    kept = [e for e in airframe.equations if not unwatched & set(symbols(e.left))]
    curtailed: set[str] = set()
    for name in sorted(lost):
        without = [e for e in kept if name in (*symbols(e.left), *symbols(e.right))]
        kept = [e for e in kept if e not in without]
        if without:
            names = ", ".join(e.name for e in without)
            warnings.append(f"no channel of this log shows {name}: without {names}")
        channels = {m.channel for m in airframe.measurements if m.trusted and m.variable == name}
        heard = {c for c in channels if log is not None and c.source in log}
        for equation in without:
            own = {
                m.channel
                for m in airframe.measurements
                if not m.trusted and m.component == equation.component
            }
            if equation.component and (heard or not channels <= own):
                curtailed.add(equation.component)
    return kept, frozenset(curtailed)


def _not_computed(lost: set[str], equations: Iterable[Equation]) -> set[str]:
    """Return the inputs that no equation gives which can only be solved for them."""
    for equation in equations:
        names = {*symbols(equation.left), *symbols(equation.right)}
        given = equation.solves or frozenset()
        if len(given) == 1 and given <= lost and not lost & (names - given):
            lost = lost - given
    return lost


def _first_inputs(present: list[Measurement]) -> list[Measurement]:
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


def _is_present(
    measurement: Measurement, log: Log | None, airframe: Airframe, warnings: list[str]
) -> bool:
    if log is None:
        return True
    channel = measurement.channel
    if channel.source not in log:
        return False
    message = log[channel.source]
    asked = _fields(measurement, airframe.parameters)
    missing = [name for name in asked if name not in message.fields]
    if missing:
        if message.made_from is None:  # otherwise the log has no such message at all
            warnings.append(f"{channel}: this log has no field {', '.join(missing)}")
        return False
    if measurement.value is not None or measurement.raw:
        return True
    own, wanted = message.unit(channel.field), airframe.variables[measurement.variable].unit
    if not own and (airframe.units.get(wanted) or dimension(wanted)).exponents:
        warnings.append(
            f"{channel}: this log does not state its unit (raw: true takes it as it is)"
        )
        return False
    if not _fits(own, wanted, airframe.units):
        raise ModelError(
            f"the log gives {own!r}, the variable {measurement.variable!r} is in {wanted!r}",
            where=str(channel),
        )
    return message.has_known(channel.field)


def _fits(own: str, wanted: str, units: Mapping[str, Dimension]) -> bool:
    """Return whether a log's values are in the unit of a variable."""
    if own == wanted:
        return True
    variable = units.get(wanted) or dimension(wanted)
    if own:
        return (units.get(own) or dimension(own)).fits(variable)
    # No unit is a number; per cent and degrees it is not, because these became fractions and
    # radians when the log was read.
    return isclose(variable.factor, 1.0)


def _fields(measurement: Measurement, parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the message fields that a measurement reads; a parameter of the model is none."""
    own = (measurement.channel.field,) if measurement.value is None else symbols(measurement.value)
    condition = symbols(measurement.when) if measurement.when else ()
    names = dict.fromkeys((*own, *condition))
    return tuple(name for name in names if name not in STATES and name not in parameters)


def _relation(equation: Equation, airframe: Airframe) -> SystemEquation:
    names = dict.fromkeys((*symbols(equation.left), *symbols(equation.right)))
    unknowns = [name for name in names if name in airframe.variables]
    return SystemEquation(
        equation.name,
        equation.kind,
        equation.left,
        equation.right,
        {name: _edge(equation, name, airframe.variables[name]) for name in unknowns},
        circular=any(
            isinstance(side, Symbol)
            and side.name in airframe.variables
            and airframe.variables[side.name].circular
            for side in (equation.left, equation.right)
        ),
        when=equation.when,
        cost=equation.cost,
        fault=equation.fault,
        component=equation.component,
        tolerance=equation.tolerance,
        window=equation.window,
        offset=equation.offset,
        side=equation.side,
        scale=equation.scale,
        supports=equation.supports,
        unit=equation.unit,
        suspects=equation.suspects,
        text=equation.text,
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


def _shown(measurement: Measurement, airframe: Airframe) -> SystemEquation:
    channel = str(measurement.channel)
    # A channel may be an input of one variable and the measurement of another.
    return SystemEquation(
        f"{channel}>{measurement.variable}" if measurement.trusted else channel,
        Kind.INPUT if measurement.trusted else Kind.MEASUREMENT,
        Symbol(measurement.variable),
        Symbol(MEASURED),
        {measurement.variable: "solvable"},
        circular=airframe.variables[measurement.variable].circular,
        fault=None if measurement.trusted else str(measurement.channel),
        component=measurement.component,
        unit=airframe.variables[measurement.variable].unit,
        measurement=measurement,
        text=f"{measurement.variable} = {measurement.channel}",
    )


def _faults(equations: list[SystemEquation], airframe: Airframe) -> list[Fault]:
    faults = []
    for number, equation in enumerate(equations):
        if equation.fault is None:
            continue
        component = equation.component or "outside_model"
        group = (
            equation.measurement.group
            if equation.measurement and equation.measurement.group != "other"
            else airframe.components[component].group
        )
        faults.append(Fault(equation.fault, component, group, number))
    return faults


def _request(
    measurement: Measurement, variable: Variable, parameters: Mapping[str, ParameterValue]
) -> Request:
    constants = {name: Number(value.value) for name, value in parameters.items()}
    value, when = measurement.value, measurement.when
    return Request(
        channel=measurement.channel,
        fields=_fields(measurement, parameters),
        value=None if value is None else _compute(substitute(value, constants)),
        valid=None if when is None else _hold(substitute(when, constants)),
        raw=measurement.raw,
        circular=variable.circular,
        latency=measurement.latency,
    )


def _compute(expression: Expression) -> Callable[[Mapping[str, NDArray[Any]]], NDArray[Any]]:
    return lambda columns: evaluate(expression, columns)


def _hold(condition: Expression) -> Callable[[Mapping[str, NDArray[Any]]], NDArray[np.bool_]]:
    return lambda columns: holds(condition, columns)


def _value(parameter: Parameter, log: Log | None) -> ParameterValue:
    for name in parameter.log_names if log else ():
        assert log is not None
        if name in log.parameters:
            value = log.parameters[name] * parameter.log_scale
            return ParameterValue(value, parameter.unit, "log")
    if parameter.world and log:
        # A default would be wrong nearly everywhere: what the place and day do not tell is unknown.
        world = world_value(parameter.world, log)
        return ParameterValue(nan if world is None else world, parameter.unit, "log")
    return ParameterValue(parameter.value, parameter.unit, "default")
