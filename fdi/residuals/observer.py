"""What does a residual say behind which states are integrated?

In: a node of the kind ``observer``, what it reads, and where its condition holds. Out: its column
with its effects. No log states the start values of states, and integrated errors drift; so the
residual corrects the states by a gain that is chosen from the stated noise: the Kalman filter
where rates and residual are linear in the states, else the extended one (``trajectory.py``). The
column is the innovation: what the residual says before it has corrected the states at that sample.
In health its samples are independent, and its predicted spread is exact where all is linear.

A fault shows as long as the states have not followed it. How long that is says the noise: accurate
inputs let the model be believed for long, a noisy residual too; and what lasts in spite of the gain
stays (the level of a tank that leaks falls short of the integral of its flows for good).

The residual is unknown until the observer has settled: until what the unknown start may still do to
it is a tenth of its noise. Where something that is integrated is unknown, or the condition does not
hold, nothing is extrapolated: the observer starts anew behind such a gap. Where only the residual
is unknown, integration goes on. Likewise behind a place where the equations have no value.

What is chosen: the gain takes constants that are not exact (offsets, tolerances, parameters) for
noise of the same size, so that the observer does not believe its model more than the model's author
does. What they do to the residual is then computed as what it is, a constant.

References
----------
Svard, Nyberg, IEEE Trans. SMC-A 40(6), 2010 (sequential residual generators in integral causality).
Frisk, Aslund, "Lowering orders of derivatives in nonlinear residual generation using realization
theory", Automatica 41, 2005. Kalman 1960 as of ``kalman.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.model.expression import Symbol, symbols
from fdi.model.system import System
from fdi.residuals.newton import linear_slopes
from fdi.residuals.node import Node
from fdi.residuals.trajectory import Move, Plant, track
from fdi.residuals.value import Context, Effects, Source, Value, unsure_arguments
from fdi.windows import runs_of

SETTLED: Final = 0.1
"""Of its noise, so much of a residual may still be due to the start."""
SPREADING: Final = ("noise",)
"""Effects that are new at every sample; others last."""
PAUSE_S: Final = 1.0
"""After a place without a value; no less than a sample."""


def observe(
    node: Node, done: Mapping[int, Value], context: Context, valid: NDArray[np.bool_] | None
) -> Value:
    """Return the column of a residual behind which states are integrated, with its effects.

    Parameters
    ----------
    node : Node
        Of the kind ``observer``.
    done : mapping of int to Value
        Its arguments.
    context : Context
        Without spreads there is no noise to choose a gain from: then the residual is unknown.
    valid : (n,) bool or None
        Where its condition holds.
    """
    arguments = {name: done[i] for name, i in node.arguments}
    arguments |= unsure_arguments(node.expressions, context)
    size = len(context.signals.t)
    column = np.full(size, np.nan)
    ahead = max((value.ahead for value in arguments.values()), default=0)
    moves = _moves(node, arguments, context.system) if context.spreads else {}
    if not any(kind in SPREADING for kind, _, _ in moves):
        return Value(column, {}, ahead)
    plant = _plant(node, arguments, moves, context)
    found = {source: np.zeros(size) for source in moves}
    whole = np.ones(size, dtype=bool) if valid is None else valid.copy()
    for name in _integrated(node) & arguments.keys():
        whole &= np.isfinite(arguments[name].column)
    pause = max(1, round(PAUSE_S / context.step))
    for first, last in runs_of(whole):
        start = first
        while start < last:
            tracked = track(plant, start, last)
            end = start + len(tracked.residual)
            part = slice(start, end)
            begun, noise = tracked.variance[:, 0], np.zeros(end - start)
            for place, source in enumerate(moves, start=1):
                if source[0] in SPREADING:
                    noise += tracked.variance[:, place]
                    found[source][part] = np.sqrt(tracked.variance[:, place])
                else:
                    found[source][part] = tracked.lasting[:, place]
            column[part] = np.where(begun <= SETTLED**2 * noise, tracked.residual, np.nan)
            start = end + pause
    effects: Effects = {source: np.nan_to_num(effect) for source, effect in found.items()}
    return Value(column, effects, ahead)


def is_linear(system: System, node: Node) -> bool:
    """Return whether rates and residual are linear in the states."""
    own = [system.variables[name] for name in node.variables]
    steps = node.variables[node.states :]
    equations = node.expressions[node.states :]
    turned = any(system.variables[name].circular for name in steps)
    return not turned and linear_slopes(equations, own) is not None


def _moves(node: Node, arguments: Mapping[str, Value], system: System) -> dict[Source, Move]:
    """Return what every source of error does to what the node reads, or to its equations."""
    found: dict[Source, Move] = {}
    for name, value in arguments.items():
        for source, effect in value.effects.items():
            if effect.any():
                found.setdefault(source, Move({}, {})).columns[name] = effect
    steps = zip(node.by[node.states :], node.variables[node.states :], strict=True)
    for number, name in steps:
        equation = system.equations[number]
        constant = equation.tolerance + equation.offset
        if constant and Symbol(name) in (equation.left, equation.right):
            found["offset", -1 - number, 0] = Move({}, {name: constant})
    if offset := system.equations[node.equation].offset:
        found["offset", -1 - node.equation, 0] = Move({}, {"": offset})
    return found


def _plant(
    node: Node, arguments: Mapping[str, Value], moves: Mapping[Source, Move], context: Context
) -> Plant:
    variables = context.system.variables
    states = [variables[name] for name in node.variables[: node.states]]
    linear = is_linear(context.system, node)
    bounds = [(v.low, v.high) if not linear else (None, None) for v in states]
    return Plant(
        node,
        context.signals.t,
        {**context.constants, **{name: value.column for name, value in arguments.items()}},
        tuple(moves.values()),
        np.array([-np.inf if low is None else low for low, _ in bounds]),
        np.array([np.inf if high is None else high for _, high in bounds]),
        frozenset(name for name in node.variables if variables[name].circular),
        context.system.equations[node.equation].circular,
        linear,
        context.real_part,
    )


def _integrated(node: Node) -> set[str]:
    """Return the names that the rates of the states need."""
    names = {name for own in node.expressions[: node.states] for name in symbols(own)}
    at = len(node.variables)
    for size in reversed(node.blocks):
        block = slice(at - size, at)
        if not names.isdisjoint(node.variables[block]):
            names.update(name for own in node.expressions[block] for name in symbols(own))
        at -= size
    return names
