"""What does every residual say over the whole flight, and how far may it stray in health?

In: the nodes of a bank, signals and how to differentiate. Out: one column per residual with its
predicted spread. The nodes are walked once. Beside its value, every node carries the effects of its
inputs: how far it moves when one input is moved by its standard deviation. An effect of a function
is the difference between the function at the moved and at the given arguments, so a residual's
Jacobian is never formed, and loops and conditions are treated like everything else. A derivative
multiplies effects by its noise gain. The spread is the root of the sum of squares.

The noise of an input has two parts: the channel's accuracy (stated, or reported by the log itself,
see ``accuracy.py``), and its rate of change times the uncertainty of its time, a quarter of the
channel's own period (the reason why residuals swell in manoeuvres). How well a sensor's latency is
known is carried apart, one source for all channels of a message: it is the same all along, so a
derivative feels only the change of the rate; and records of one message alone, which are late
together, show nothing of it. Where the log tells how well records stand for the time between them
(``sampled``), their own time is of that kind, too. A constant offset that a
healthy sensor may have is carried likewise, apart, as are tolerances of equations; they bound, they
do not spread. A parameter that was identified has both: how well its constant value is known, which
bounds what lasts, one source for all that uses it, and how far it wanders, which is noise.

A node is dropped when the last node that needs it is done, so memory stays small.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Column, Floats, evaluate, holds, wrap
from fdi.model.expression import Apply, Expression, Symbol, symbols
from fdi.model.parts import Measurement
from fdi.model.system import System, SystemEquation
from fdi.residuals.accuracy import beginning_of, believed
from fdi.residuals.differentiate import Differentiation, differentiate
from fdi.residuals.jump import jump
from fdi.residuals.newton import choose, solve_loop, solve_moved
from fdi.residuals.node import Node
from fdi.residuals.observer import observe
from fdi.residuals.regress import slope
from fdi.residuals.value import Context, Effects, Source, Value, root_sum, unsure_arguments
from fdi.telemetry import Signals

TIMING_SHARE: Final = 0.25
"""Standard deviation of a record's time as a share of its channel's period (a uniform delay within
one period has 0.29)."""

BENT: Final = 0.5
"""Share of the change between two neighbouring slopes that one of them may be off."""

SAME: Final = 1e-6
"""Two sides that differ by less, relative to their size, are equal but for rounding."""


class Evaluated(NamedTuple):
    """Columns of residuals, (r, n), their delays, (r,) s, and responses to faults, (r, f).

    ``unsure``: one standard deviation of what unsure parameters make of them. ``ambiguous``: where
    they are unknown because more than one root of an equation or loop may be meant. ``ago``: how
    long ago, (n,) s, began what a row shows, for those that tell it.
    """

    values: Floats
    spread: Floats
    allowance: Floats
    swing: Floats
    swung: Floats
    unsure: Floats
    delay_s: Floats
    response: Floats
    ambiguous: NDArray[np.bool_]
    ago: Mapping[int, Floats]


def evaluate_nodes(wanted: Sequence[int], context: Context) -> Evaluated:
    """Return the columns of residuals over the whole flight, with what noise does to them.

    Parameters
    ----------
    wanted : sequence of int
        The nodes of the residuals.
    context : Context
    """
    nodes = context.nodes
    count, size = len(wanted), len(context.signals.t)
    rows: dict[int, list[int]] = {}
    for row, number in enumerate(wanted):
        rows.setdefault(number, []).append(row)
    values, spread, allowance, unsure = (np.full((count, size), np.nan) for _ in range(4))
    swing, swung = np.zeros((count, size)), np.zeros((count, size))
    ahead = np.zeros(count)
    ago: dict[int, Floats] = {}
    ambiguous = np.zeros((count, size), dtype=bool)
    response = np.full((count, len(context.system.faults)), np.nan)
    last_use = _last_uses(nodes)
    done: dict[int, Value] = {}
    for number, node in enumerate(nodes):
        done[number] = compute_node(node, done, context)
        for row in rows.get(number, ()):
            value = done[number]
            values[row] = value.column
            kinds = ("noise", "late") if _has_several_clocks(value, context) else ("noise",)
            spread[row] = root_sum(value.effects, kinds, size)
            allowance[row] = _sum(value.effects, "offset", size)
            swing[row] = root_sum(value.effects, ("swing",), size)
            swung[row] = root_sum(value.effects, ("swung",), size)
            unsure[row] = root_sum(value.effects, ("parameter",), size)
            ahead[row] = value.ahead * context.step
            response[row] = _response(value, context.system)
            if value.ambiguous is not None:
                ambiguous[row] = value.ambiguous
            if value.ago is not None:
                ago[row] = value.ago
        for used in set(node.uses):
            if last_use[used] == number:
                del done[used]
        if last_use.get(number, number) == number:
            done.pop(number, None)
    arrays = (values, spread, allowance, swing, swung, unsure, ahead, response, ambiguous)
    for array in (*arrays, *ago.values()):
        array.flags.writeable = False
    return Evaluated(*arrays, ago)


def context_of(
    system: System, nodes: tuple[Node, ...], signals: Signals, recipe: Differentiation
) -> Context:
    """Return what the nodes of a bank are computed with."""
    state = signals.state
    return Context(
        system,
        nodes,
        signals,
        recipe,
        {name: np.float64(p.value) for name, p in system.parameters.items()},  # type: ignore[misc]
        {
            **state.named(),
        },
        1.0 / signals.rate_hz,
        beginning_of(signals),
        unsure={
            name: number
            for number, (name, p) in enumerate(system.parameters.items())
            if p.std is not None
        },
    )


def _response(value: Value, system: System) -> Floats:
    known = np.isfinite(value.column)
    total: dict[int, Floats] = {}
    for (kind, source, _), effect in value.effects.items():
        if kind == "noise" and known.any():
            total[source] = total.get(source, 0.0) + np.abs(effect)
    moved = {source: float(np.median(effect[known])) for source, effect in total.items()}
    return np.array([moved.get(fault.equation, np.nan) for fault in system.faults])


def _has_several_clocks(value: Value, context: Context) -> bool:
    """Return whether records of several messages meet; one alone is late as a whole."""
    equations = context.system.equations
    shown = (equations[number].measurement for _, number, _ in value.effects if number >= 0)
    return len({_sender(one, context) for one in shown if one is not None}) != 1


def _last_uses(nodes: Sequence[Node]) -> dict[int, int]:
    return {used: number for number, node in enumerate(nodes) for used in node.uses}


def _sum(effects: Effects, kind: str, size: int) -> Floats:
    total = np.zeros(size)
    for (own, _, _), effect in effects.items():
        if own == kind:
            total += np.abs(effect)
    return total


def compute_node(node: Node, done: Mapping[int, Value], context: Context) -> Value:
    """Return a node's column, with what its inputs' noise does to it, from its arguments'."""
    match node.kind:
        case "channel":
            return _channel(node, context)
        case "part":
            return _part(node, done, context)
        case _:
            beneath = [done[i].spacing for _, i in (*node.arguments, *node.gate_arguments)]
            spacing = max([context.step, *beneath])
            valid = _valid(node, done, context, spacing)
    match node.kind:
        case "derivative":
            value = _derivative(node, done, context)
        case "slope":
            value = _slope(node, done, context)
        case "loop":
            value = _loop(node, done, context)
        case "observer":
            value = observe(node, done, context, valid)
        case _:
            value = _function(node, done, context)
    unclear = [done[i].ambiguous for _, i in node.arguments]
    told = next((done[i].ago for _, i in node.arguments if done[i].ago is not None), None)
    for part in (value, *value.parts):
        part.ago = told if part.ago is None else part.ago
        part.spacing = spacing
        part.ambiguous = _either(part.ambiguous, *unclear)
        if valid is not None:
            part.column = np.where(valid, part.column, np.nan)
    return value


def _valid(
    node: Node, done: Mapping[int, Value], context: Context, spacing: float
) -> NDArray[np.bool_] | None:
    """Return where the condition of a node holds, None for everywhere."""
    if node.gate is None:
        return None
    columns = {name: done[i].column for name, i in node.gate_arguments}
    step = {"step": np.array(spacing)}
    return holds(node.gate, {**context.constants, **context.states, **step, **columns})


def _either(*masks: NDArray[np.bool_] | None) -> NDArray[np.bool_] | None:
    some = [mask for mask in masks if mask is not None]
    return np.logical_or.reduce(some) if some else None


def _channel(node: Node, context: Context) -> Value:
    measurement = context.system.equations[node.equation].measurement
    assert measurement is not None
    column = context.signals.columns[measurement.channel]
    circular = context.system.variables[measurement.variable].circular
    effects: Effects = {}
    spacing = context.signals.spacing.get(measurement.channel, np.nan)
    spacing = context.step if np.isnan(spacing) else spacing
    if node.equation in context.added:
        column = column + context.added[node.equation]
        column = wrap(column) if circular else column
    if not context.spreads:
        return Value(column, effects, spacing=spacing)
    if measurement.accuracy is not None:
        noise = _noise(column, measurement, circular, context)
        effects["noise", node.equation, 0] = noise
    late = context.signals.late.get(measurement.channel, 0.0)
    if measurement.is_sampled:  # its own time is off as that of all channels of the message
        late = np.hypot(late, _untimed(measurement, context))
    if late:
        effects["late", _sender(measurement, context), 0] = late * _rate(column, circular, context)
    if measurement.offset:
        effects["offset", node.equation, 0] = np.full(len(column), measurement.offset)
    return Value(column, effects, spacing=spacing)


def _sender(measurement: Measurement, context: Context) -> int:
    """Return the first equation of the sensor in a message: all its channels are late alike."""
    wanted = measurement.channel.source, measurement.component
    return next(
        number
        for number, equation in enumerate(context.system.equations)
        if (m := equation.measurement) and (m.channel.source, m.component) == wanted
    )


def _rate(column: Floats, circular: bool, context: Context) -> Floats:
    """Return the change of a column per second, with its sign, 0 where unknown."""
    step = np.diff(column, prepend=column[:1])
    change = np.nan_to_num(wrap(step) if circular else step)
    return np.asarray(change / context.step, dtype=np.float64)


def _noise(column: Floats, measurement: Measurement, circular: bool, context: Context) -> Floats:
    channel, accuracy = measurement.channel, measurement.accuracy or 0.0
    rate = np.abs(_rate(column, circular, context))
    # A change shows in the sample before and after it as well: interpolation spreads it.
    around = np.pad(rate, 1)
    rate = np.maximum(rate, np.maximum(around[:-2], around[2:]))
    reported = context.signals.accuracy.get(channel)
    if measurement.is_sampled:
        share = np.zeros(len(column)) if reported is None else np.nan_to_num(reported)
        return np.asarray(np.hypot(accuracy, share), np.float64)
    if reported is None:
        own: Column = np.float64(accuracy)  # type: ignore[assignment]
    elif measurement.made_by:  # computed, not a sensor's own word
        own = np.fmax(reported, accuracy)
    else:
        own = believed(reported, accuracy, context.beginning)
    noise: Floats = np.hypot(own, _untimed(measurement, context) * rate)
    return noise


def _untimed(measurement: Measurement, context: Context) -> float:
    """Return how well the time of a record is known, s."""
    return TIMING_SHARE * context.signals.period.get(measurement.channel, context.step)


def _function(node: Node, done: Mapping[int, Value], context: Context) -> Value:
    system = context.system
    equation = system.equations[node.equation]
    circular = (
        equation.circular
        if node.kind == "residual"
        else system.variables[node.variables[0]].circular
    )
    arguments = {name: done[i] for name, i in node.arguments} | unsure_arguments(
        node.expressions, context
    )
    given = {name: value.column for name, value in arguments.items()}
    near = _near(node, done, context)

    def compute(columns: Mapping[str, Column]) -> Floats:
        everything = {**context.constants, **columns}
        roots = [evaluate(e, everything, real_part=context.real_part) for e in node.expressions]
        size = len(context.signals.t)
        stacked = np.array([np.broadcast_to(root, size) for root in roots])
        if node.kind == "solve" and not stated:
            stacked = _inside(_solving(stacked, node, everything, context), node, context)
        if len(roots) == 1:
            value = stacked[0]
        else:
            value, unclear[:] = choose(stacked[:, None, :], near, (circular,))
            value = value[0]
        return wrap(value) if circular else value

    unclear = np.zeros(len(context.signals.t), dtype=bool)
    stated = (
        Symbol(node.variables[0]) in (equation.left, equation.right) if node.variables else True
    )
    column = compute(given)
    ambiguous = unclear.copy() if unclear.any() else None
    effects = moved_by(compute, column, arguments, circular)
    sides = (equation.left, equation.right)
    if node.kind == "residual":
        constant = equation.offset
    elif Symbol(node.variables[0]) in sides:
        constant = equation.tolerance + equation.offset
    else:
        constant = 0.0
    if constant and context.spreads:
        effects["offset", -1 - node.equation, 0] = np.full(len(column), constant)
    if context.spreads:
        own = dict.fromkeys(node.variables, column)
        effects |= _strays(equation, node, done, given | own, context)
    ahead = max((value.ahead for value in arguments.values()), default=0)
    return Value(column, effects, ahead, ambiguous=ambiguous)


def _strays(
    equation: SystemEquation,
    node: Node,
    done: Mapping[int, Value],
    known: Mapping[str, Floats],
    context: Context,
) -> Effects:
    """Return what an equation is off by otherwise than in the first seconds, by its own account."""
    effects: Effects = {}
    number = -1 - node.equation
    read = {name: done[i].column for name, i in node.error_arguments if i in done}
    columns = {**context.constants, **read, **known}

    def told(expressions: Sequence[Expression]) -> Iterator[tuple[int, Floats]]:
        for place, expression in enumerate(expressions, 1):
            if columns.keys() >= set(symbols(expression)):
                value = evaluate(expression, columns)
                yield place, np.broadcast_to(value, len(context.signals.t))

    if equation.swings and isinstance(equation.left, Symbol):
        heading = known[equation.left.name]
        turned = _turned(heading, context)
        at_first = [_size_at_first(value, context) for _, value in told(equation.swings)]
        size = np.sqrt(np.nansum(np.square(at_first)))
        # of a vector in any direction a third of the square lies along the field
        swung = size * turned if np.sqrt(3) * size < 1 else np.full(len(heading), np.pi)
        effects |= {("noise", number, 0): swung, ("swung", number, 0): swung}
        effects["swing", number, 0] = turned
    for place, value in told(equation.errors):
        change = np.nan_to_num(value - _at_first(value, context))
        effects["noise", number, place] = np.abs(change)
    return effects


def _at_first(column: Floats, context: Context) -> float:
    """Return what a quantity was in the first seconds in the air, NaN where nothing tells it."""
    known = _beginning(column, context)
    return float(np.median(known)) if known.size else np.nan


def _turned(heading: Floats, context: Context) -> Floats:
    """Return how far a heading, as a unit vector, is off the mean of the first seconds, (n,).

    What goes with sine and cosine of the heading differs by that from its mean in these: by twice
    the sine of half of the turn where the vehicle kept its heading, and by as much as it is where
    the vehicle turned about.
    """
    known = _beginning(heading, context)
    if not known.size:
        return np.zeros(len(heading))
    off = np.abs(np.exp(1j * heading) - np.exp(1j * known).mean())
    return np.asarray(np.nan_to_num(off))


def _size_at_first(column: Floats, context: Context) -> float:
    """Return the root mean square of a quantity in the first seconds, NaN where nothing tells."""
    known = _beginning(column, context)
    return float(np.sqrt(np.mean(known**2))) if known.size else np.nan


def _beginning(column: Floats, context: Context) -> Floats:
    """Return what is known of a quantity in the first seconds in the air, (m,)."""
    start = column[context.beginning]
    return start[np.isfinite(start)]


def moved_by(
    compute: Callable[[Mapping[str, Column]], Floats],
    column: Floats,
    arguments: Mapping[str, Value],
    circular: bool,
) -> Effects:
    """Return the effects of a function: its change when each input moves all its arguments."""
    sources = dict.fromkeys(key for value in arguments.values() for key in value.effects)
    effects: Effects = {}
    for source in sources:
        change = _difference(compute(_shifted(arguments, source, 1)), column, circular)
        if source[0] == "parameter":
            # It is one unknown constant, to either side, of which a minimum may feel only one.
            other = _difference(compute(_shifted(arguments, source, -1)), column, circular)
            change = np.where(np.abs(other) > np.abs(change), -other, change)
        effects[source] = change
    return effects


def _difference(after: Floats, before: Floats, circular: bool) -> Floats:
    change = wrap(after - before) if circular else after - before
    return np.asarray(np.nan_to_num(change), dtype=np.float64)


def _shifted(arguments: Mapping[str, Value], source: Source, sign: int) -> dict[str, Floats]:
    """Return the columns of arguments, moved by what one source does to them."""
    return {
        name: value.column + sign * value.effects[source]
        if source in value.effects
        else value.column
        for name, value in arguments.items()
    }


def _solving(roots: Floats, node: Node, columns: Mapping[str, Column], context: Context) -> Floats:
    """Return the roots that solve the equation: a square undone brings some that do not."""
    equation = context.system.equations[node.equation]
    given = {*columns, node.variables[0]}
    if context.real_part or not {*symbols(equation.left), *symbols(equation.right)} <= given:
        return roots
    kept = roots.copy()
    for root in kept:
        here = {**columns, node.variables[0]: root}
        left, right = evaluate(equation.left, here), evaluate(equation.right, here)
        gap = wrap(left - right) if equation.circular else left - right
        root[np.abs(gap) > SAME * (np.abs(left) + np.abs(right))] = np.nan
    return kept


def _inside(roots: Floats, node: Node, context: Context) -> Floats:
    """Return the roots that lie in the domain of what an equation was solved for."""
    if context.real_part:
        return roots
    variable = context.system.variables[node.variables[0]]
    low = -np.inf if variable.low is None else variable.low
    high = np.inf if variable.high is None else variable.high
    return np.where((roots >= low) & (roots <= high), roots, np.nan)


def _near(node: Node, done: Mapping[int, Value], context: Context) -> Floats:
    """Return what channels show of what a node gives, (m, n), to tell several solutions apart."""
    size = len(context.signals.t)
    shown = {name: done[number].column for name, number in node.near}
    unknown = np.full(size, np.nan)
    return np.array([shown.get(name, unknown) for name in node.variables]).reshape(-1, size)


def _derivative(node: Node, done: Mapping[int, Value], context: Context) -> Value:
    ((name, number),) = node.arguments
    value = done[number]
    circular = context.system.variables[name].circular
    recipe = context.recipe
    window = max(recipe.window_s, context.system.equations[node.equation].window)
    recipe = replace(recipe, window_s=window)
    column, gain = differentiate(value.column, context.step, recipe, circular=circular)
    pace = context.signals.pace
    column, gain = column / pace, gain / pace
    effects: Effects = {
        # White noise through a difference no longer cancels against the noise it came from.
        ("noise", source, generation + 1): gain * _changing(source, context) * np.abs(effect)
        for (kind, source, generation), effect in value.effects.items()
        if kind == "noise"
    }
    effects |= {
        key: np.nan_to_num(differentiate(effect, context.step, recipe)[0]) / pace
        for key, effect in value.effects.items()
        if key[0] in ("late", "parameter")
    }
    if context.spreads:
        effects["noise", -1 - node.equation, 0] = _curvature(column)
    return Value(column, effects, value.ahead + recipe.half_width(context.step))


def _curvature(slope: Floats) -> Floats:
    """Return by how much a slope over a window may miss the one at its middle.

    What changes within a window shows as a change from one slope to the next.
    """
    change = np.abs(np.nan_to_num(np.diff(slope)))
    around = np.pad(change, 1)
    bent: Floats = BENT * np.maximum(around[:-1], around[1:])
    return bent


def _slope(node: Node, done: Mapping[int, Value], context: Context) -> Value:
    """Return a slope, or its jump, where it is known to the tolerance of its equation.

    A slope carries no noise further: what is stated of one allows for that tolerance.
    """
    given = [done[number] for _, number in node.arguments]
    size = len(context.signals.t)
    equation = context.system.equations[node.equation]
    ahead = max(value.ahead for value in given)
    if isinstance(equation.right, Apply) and equation.right.operator == "jump":
        found = jump(
            [value.column for value in given[0::2]],
            [value.column for value in given[1::2]],
            context.step,
            equation.window,
            equation.tolerance,
        )
        effects: Effects = {("noise", node.equation, 0): np.nan_to_num(found.error)}
        return Value(found.size, effects, ahead, ago=found.ago)
    column, error = slope(
        [value.column for value in given[0::2]],
        [value.column for value in given[1::2]],
        [root_sum(value.effects, ("noise", "late"), size) for value in given[1::2]],
        context.step,
        equation.window,
    )
    column = np.where(error <= equation.tolerance, column, np.nan)
    return Value(column, {}, ahead + round(equation.window / (2 * context.step)))


def _changing(source: int, context: Context) -> float:
    """Return the share of an input's noise that changes from sample to sample."""
    measurement = context.system.equations[source].measurement if source >= 0 else None
    if measurement is None or not measurement.jitter or not measurement.accuracy:
        return 1.0
    return measurement.jitter / measurement.accuracy


def _loop(node: Node, done: Mapping[int, Value], context: Context) -> Value:
    arguments = {name: done[i] for name, i in node.arguments} | unsure_arguments(
        node.expressions, context
    )
    unknowns = [context.system.variables[name] for name in node.variables]
    near = _near(node, done, context)

    given = {name: value.column for name, value in arguments.items()}
    found = solve_loop(node.expressions, unknowns, {**context.constants, **given}, near)
    size = len(context.signals.t)
    columns = np.broadcast_to(found.columns, (len(unknowns), size)).copy()
    sources = dict.fromkeys(key for value in arguments.values() for key in value.effects)
    effects: list[Effects] = [{} for _ in columns]
    for source in sources:
        known = {**context.constants, **_shifted(arguments, source, 1)}
        moved = solve_moved(node.expressions, unknowns, known, columns)
        for own, unknown, column, after in zip(effects, unknowns, columns, moved, strict=True):
            own[source] = _difference(after, column, unknown.circular)
    ahead = max((value.ahead for value in arguments.values()), default=0)
    ambiguous = np.broadcast_to(found.ambiguous, size) if found.ambiguous.any() else None
    parts = tuple(
        Value(wrap(c) if unknown.circular else c, e, ahead, ambiguous=ambiguous)
        for c, e, unknown in zip(columns, effects, unknowns, strict=True)
    )
    return Value(parts[0].column, {}, ahead, parts, ambiguous=ambiguous)


def _part(node: Node, done: Mapping[int, Value], context: Context) -> Value:
    ((_, number),) = node.arguments
    place = context.nodes[number].variables.index(node.variables[0])
    return done[number].parts[place]
