"""How much is it, where a statement is violated? What a person can check.

In: a bank, one of its generators, signals. Out: the amounts that the model states of the equation
left over (``amounts:``), over the whole flight, with what noise and parameters that are not exact
make of them. They are computed as a residual is, from the same nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from fdi.model.evaluate import Column, Floats, evaluate, holds
from fdi.model.expression import Expression, symbols
from fdi.residuals.bank import Generator, Residuals
from fdi.residuals.evaluate import compute_node, context_of, moved_by
from fdi.residuals.reads import needed_for
from fdi.residuals.value import Value, root_sum, unsure_arguments

UNSURE = ("noise", "late", "offset", "parameter")
"""The effects that make an amount uncertain."""


class Told(NamedTuple):
    """An amount over a flight, (n,), with its standard deviation, in ``unit``.

    In ``words`` a # stands for it. Unknown, NaN, where it is none. For alarms of ``least`` s.
    """

    words: str
    value: Floats
    sigma: Floats
    unit: str
    least: float


def amounts(residuals: Residuals, generator: Generator) -> Iterator[Told]:
    """Yield what the model states of the equation that a generator leaves over.

    What this generator does not compute on its way is left out.

    Parameters
    ----------
    residuals : Residuals
    generator : Generator
        Of their bank.
    """
    bank = residuals.bank
    stated = bank.system.equations[generator.residual].amounts
    if not stated:
        return
    context = context_of(bank.system, bank.nodes, residuals.signals, residuals.recipe)
    done: dict[int, Value] = {}
    known: dict[str, Value] = {}
    for number in needed_for(bank.nodes, generator.node):
        node = bank.nodes[number]
        done[number] = compute_node(node, done, context)
        if len(node.variables) == 1:
            known[node.variables[0]] = done[number]
    for own in stated:
        used = {*symbols(own.value), *(symbols(own.when) if own.when else ())}
        names = [name for name in used if name in bank.system.variables]
        if not all(name in known for name in names):
            continue
        arguments = {name: known[name] for name in names}
        arguments |= unsure_arguments([own.value], context)
        size = len(residuals.t)
        value, sigma = _amount(own.value, arguments, context.constants, size)
        if own.when is not None:
            columns = {name: argument.column for name, argument in arguments.items()}
            valid = holds(own.when, {**context.constants, **context.states, **columns})
            value = np.where(valid, value, np.nan)
        yield Told(own.words, value, sigma, own.unit, own.least)


def _amount(
    expression: Expression,
    arguments: Mapping[str, Value],
    constants: Mapping[str, Column],
    size: int,
) -> tuple[Floats, Floats]:
    def compute(columns: Mapping[str, Column]) -> Floats:
        value = evaluate(expression, {**constants, **columns})
        return np.asarray(np.broadcast_to(value, size), np.float64)

    value = compute({name: argument.column for name, argument in arguments.items()})
    effects = moved_by(compute, value, arguments, circular=False)
    return value, root_sum(effects, UNSURE, size)
