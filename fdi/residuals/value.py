"""What does a node of a bank give, and what is it computed with?

The values that the evaluation of a bank hands from node to node: a column with the effects of its
inputs (how far it moves when one of them is moved by its standard deviation, or stays off by a
constant), and the surroundings of all nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Column, Floats
from fdi.model.expression import Expression, symbols
from fdi.model.system import System
from fdi.residuals.differentiate import Differentiation
from fdi.residuals.node import Node
from fdi.telemetry import Signals

Source = tuple[str, int, int]
Effects = dict[Source, Floats]
"""(``noise``, ``late``, ``offset``, ``swing``, ``swung``, ``parameter``; source, generation) to the
column by which the value moves."""


@dataclass(slots=True)
class Value:
    """A node's column, its effects, and how many samples ahead it looks.

    ``spacing``: the time between the records of the sparsest channel beneath it, s. ``ambiguous``:
    where a root beneath it is, None for nowhere. ``ago``: how long ago, s, began what it shows,
    None where it does not tell.
    """

    column: Floats
    effects: Effects
    ahead: int = 0
    parts: tuple[Value, ...] = ()
    spacing: float = 0.0
    ambiguous: NDArray[np.bool_] | None = None
    ago: Floats | None = None


@dataclass(frozen=True, slots=True)
class Context:
    """What every node is computed with.

    ``spreads``: whether effects are carried along. ``added``: columns that are added to channels,
    by measurement equation. ``unsure``: parameters that are not exact, with their numbers.
    """

    system: System
    nodes: tuple[Node, ...]
    signals: Signals
    recipe: Differentiation
    constants: Mapping[str, Column]
    states: Mapping[str, Column]
    step: float
    beginning: slice
    spreads: bool = True
    added: Mapping[int, Floats] = field(default_factory=dict)
    unsure: Mapping[str, int] = field(default_factory=dict)

    @property
    def real_part(self) -> bool:
        """Return whether imaginary roots count as their real part."""
        return self.recipe.imaginary == "real_part"


def root_sum(effects: Effects, kinds: tuple[str, ...], size: int) -> Floats:
    """Return the root of the sum of the squares of effects of some kinds, (n,)."""
    total = np.zeros(size)
    for (own, _, _), effect in effects.items():
        if own in kinds:
            total += effect**2
    return np.sqrt(total)


def unsure_arguments(expressions: Sequence[Expression], context: Context) -> dict[str, Value]:
    """Return the parameters of expressions that are not exact, as arguments with effects."""
    found: dict[str, Value] = {}
    if not context.spreads:
        return found
    used = {name for expression in expressions for name in symbols(expression)}
    size, last = len(context.signals.t), len(context.system.equations)
    for name in sorted(used & context.unsure.keys()):
        number, parameter = context.unsure[name], context.system.parameters[name]
        effects: Effects = {
            ("parameter", context.unsure[source], 0): np.full(size, share)
            for source, share in parameter.shares or ((name, parameter.std),)
        }
        if parameter.wanders:
            effects["noise", -1 - last - number, 0] = np.full(size, parameter.wanders)
        found[name] = Value(np.full(size, parameter.value), effects)
    return found
