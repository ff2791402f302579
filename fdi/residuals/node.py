"""What is one computation of a bank? A node: over whole columns, shared by all that need it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fdi.model.expression import Expression

NodeKind = Literal[
    "channel", "solve", "loop", "part", "derivative", "slope", "residual", "observer"
]


@dataclass(frozen=True, slots=True)
class Node:
    """One computation over whole columns.

    Attributes
    ----------
    kind : str
        ``channel``: a measured column. ``solve``: an equation's roots for a variable. ``loop``:
        several equations at once. ``part``: one unknown of a loop. ``derivative``: of its argument.
        ``slope``: of each pair of its arguments, in common.
        ``residual``: the difference of the two sides of an equation. ``observer``: the same, where
        states behind it are integrated.
    equation : int
        The equation computed (of a loop the first); for a channel its measurement equation.
    variables : tuple of str
        What it gives; empty for a residual.
    expressions : tuple of Expression
        ``solve``: one per root; ``loop``: one per equation, zero at the solution; ``residual``:
        one; ``observer``: one per variable (of a state its rate, in a block of several what is zero
        at their solution), and last the residual.
    arguments : tuple of (str, int)
        Names in the expressions and the nodes that give them.
    gate : Expression or None
        Where the equations hold; elsewhere the value is unknown.
    gate_arguments : tuple of (str, int)
        Likewise for the gate.
    error_arguments : tuple of (str, int)
        Likewise for what the equation may be wrong by, which is no part of its value.
    near : tuple of (str, int)
        The channels that show what it gives, to tell several solutions apart.
    states : int
        ``observer``: so many of its variables, the first ones, are integrated; the others are
        computed from them in this order.
    by : tuple of int
        ``observer``: the equation of each variable.
    blocks : tuple of int
        ``observer``: of the variables that are not integrated, how many are computed at a time; of
        more than one the equations are solved together.
    """

    kind: NodeKind
    equation: int
    variables: tuple[str, ...] = ()
    expressions: tuple[Expression, ...] = ()
    arguments: tuple[tuple[str, int], ...] = ()
    gate: Expression | None = None
    gate_arguments: tuple[tuple[str, int], ...] = ()
    near: tuple[tuple[str, int], ...] = ()
    states: int = 0
    by: tuple[int, ...] = ()
    blocks: tuple[int, ...] = ()
    error_arguments: tuple[tuple[str, int], ...] = ()

    @property
    def reads(self) -> tuple[int, ...]:
        """Return the nodes whose columns its own is computed from."""
        return tuple(number for _, number in (*self.arguments, *self.gate_arguments, *self.near))

    @property
    def uses(self) -> tuple[int, ...]:
        """Return the nodes that its column and how far that may be off are computed from."""
        return (*self.reads, *(number for _, number in self.error_arguments))
