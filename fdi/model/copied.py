"""Which channels of a log bring nothing, because another one says the same already?

In: the measurements that a log holds and the relations of the model; by the data
(``fdi.telemetry.copies``) some channels repeat others. Out: the measurements that are witnesses,
and the relations that can be violated. A sensor's channel that repeats another one's is no
measurement, and a relation that holds whatever the vehicle does, because one channel feeds both of
its sides, is no test: it could only stay quiet, and rule out what it never saw.

Channels are held against each other where the model relates them: they show one variable, two
variables of one relation, or the same field of twin messages.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from fdi.model.evaluate import Floats, evaluate, wrap
from fdi.model.expression import OVER_TIME, Apply, Expression, symbols, walk
from fdi.model.parts import Equation, Kind, Measurement, Variable
from fdi.model.system import ParameterValue
from fdi.telemetry import Channel, Copy, Log, Request

DRAWS: Final = 16
"""Random states of the vehicle at which a relation is tried."""
ALWAYS: Final = 1e-9
"""A relation whose sides differ by less, relative to their size, holds by construction."""


def find_copies(
    log: Log,
    present: Sequence[Measurement],
    equations: Sequence[Equation],
    variables: Mapping[str, Variable],
    request: Callable[[Measurement], Request],
) -> tuple[Copy, ...]:
    """Return which channels of a log repeat another one that the model relates to them.

    Parameters
    ----------
    log : Log
    present : sequence of Measurement
        What the log shows; of two channels the one that stands later is the copy.
    equations, variables
        Of the model.
    request : callable
        What to ask of the log for a measurement.
    """
    related = {
        frozenset(pair)
        for equation in equations
        if equation.kind is Kind.RELATION
        for pair in combinations(_names(equation), 2)
    }
    pairs: dict[tuple[Channel, Channel], tuple[Request, Request]] = {}
    for first, second in combinations([m for m in present if not (m.stillness or m.raw)], 2):
        names = frozenset((first.variable, second.variable))
        if (
            first.channel.source == second.channel.source
            or len({variables[name].unit for name in names}) > 1
        ):
            continue
        if len(names) == 1 or names in related or _are_twins(first, second):
            pairs.setdefault((first.channel, second.channel), (request(first), request(second)))
    found = log.compare(pairs.values())
    # a sensor of which one axis differs is another sensor
    unit = {m.channel: variables[m.variable].unit for m in present}
    sensor = {c: (c.of.source, c.channel.source, unit[c.channel]) for c in found if _is_axis(c)}
    differ = {name for copy, name in sensor.items() if not _is_same(copy)}
    shows = {(m.channel, m.variable) for m in present}
    one = {(c, d) for c, name in shows for d, other in shows if name == other}
    return tuple(
        c
        for c in found
        if (_is_same(c) if (c.of, c.channel) in one else c.repeats) and sensor.get(c) not in differ
    )


def _is_same(copy: Copy) -> bool:
    """Return whether even the values are the same: an offset is a sensor's own."""
    return copy.repeats and copy.scale == 1.0 and copy.offset == 0.0


def _are_twins(first: Measurement, second: Measurement) -> bool:
    return first.channel.field == second.channel.field and first.component == second.component


def _is_axis(copy: Copy) -> bool:
    return copy.of.field == copy.channel.field


def witnesses(
    present: Sequence[Measurement], among: Sequence[Measurement], copies: Sequence[Copy]
) -> list[Measurement]:
    """Return the measurements among some without the sensors' channels that repeat another's.

    How long a channel stands still is told of each: a link may freeze one of them.
    """
    sensors = {m.channel for m in present if not m.trusted}
    repeated = {c.channel for c in copies if {c.channel, c.of} <= sensors}
    return [m for m in among if m.channel not in repeated]


def infallible(
    equations: Sequence[Equation],
    copies: Sequence[Copy],
    present: Sequence[Measurement],
    variables: Mapping[str, Variable],
    parameters: Mapping[str, ParameterValue],
) -> dict[str, Copy]:
    """Return the equations that cannot be violated, by name, with the copy that makes them so.

    With them stand those that would need what a copy shows.

    Parameters
    ----------
    present : sequence of Measurement
        What the log shows, copies included.
    """
    shown: dict[Channel, set[str]] = {}
    for measurement in present:
        shown.setdefault(measurement.channel, set()).add(measurement.variable)
    heard = {m.variable for m in witnesses(present, present, copies)}
    found: dict[str, Copy] = {}
    for equation in equations:
        names = set(_names(equation))
        for copy in copies:
            one, other = shown[copy.of] & names, shown[copy.channel] & names
            if other - heard or any(
                _is_identity(equation, (x, y), copy, variables, parameters)
                for x in sorted(one)
                for y in sorted(other - {x})
            ):
                found.setdefault(equation.name, copy)
    return found


def _is_identity(
    equation: Equation,
    pair: tuple[str, str],
    copy: Copy,
    variables: Mapping[str, Variable],
    parameters: Mapping[str, ParameterValue],
) -> bool:
    """Return whether a relation holds at any state in which one of a pair is the other's copy."""
    if equation.kind is not Kind.RELATION or any(map(_spans_time, walk(equation.right))):
        return False
    random = np.random.default_rng(0)
    state = {
        name: _drawn(variables[name], random) for name in _names(equation) if name in variables
    }
    x, y = pair
    state[y] = copy.scale * state[x] + copy.offset
    constants = {name: np.full(DRAWS, one.value) for name, one in parameters.items()}
    left, right = (
        evaluate(side, {**constants, **state}) for side in (equation.left, equation.right)
    )
    apart = wrap(left - right) if variables[x].circular else left - right
    size = np.maximum(np.maximum(np.abs(left), np.abs(right)), np.abs(state[x]))
    return bool((np.abs(apart) <= ALWAYS * size).all())


def _spans_time(node: Expression) -> bool:
    return isinstance(node, Apply) and node.operator in OVER_TIME


def _drawn(variable: Variable, random: np.random.Generator) -> Floats:
    low = -1.0 if variable.low is None else variable.low
    high = low + 2.0 if variable.high is None else variable.high
    return random.uniform(low, high, DRAWS)


def _names(equation: Equation) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*symbols(equation.left), *symbols(equation.right))))
