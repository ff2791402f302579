"""What is a bank of residual generators? The values of the derive stage.

A bank is one graph of computations over whole columns, shared by all generators: what two of them
compute alike (the same equation solved for the same unknown from the same arguments) is one
``Node``. A ``Generator`` is a test set with its matching and the node of its residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.model.expression import Expression
from fdi.model.system import System
from fdi.residuals.rules import Reason

if TYPE_CHECKING:
    import pandas

    from fdi.residuals.differentiate import Differentiation
    from fdi.residuals.evaluate import Residuals
    from fdi.telemetry import Signals

NodeKind = Literal["channel", "solve", "loop", "part", "derivative", "residual"]


@dataclass(frozen=True, slots=True)
class Node:
    """One computation over whole columns.

    Attributes
    ----------
    kind : str
        ``channel``: a measured column. ``solve``: an equation's roots for a variable. ``loop``:
        several equations at once. ``part``: one unknown of a loop. ``derivative``: of its argument.
        ``residual``: the difference of the two sides of an equation.
    equation : int
        The equation computed (of a loop the first); for a channel its measurement equation.
    variables : tuple of str
        What it gives; empty for a residual.
    expressions : tuple of Expression
        ``solve``: one per root; ``loop``: one per equation, zero at the solution; ``residual``:
        one.
    arguments : tuple of (str, int)
        Names in the expressions and the nodes that give them.
    gate : Expression or None
        Where the equations hold; elsewhere the value is unknown.
    gate_arguments : tuple of (str, int)
        Likewise for the gate.
    """

    kind: NodeKind
    equation: int
    variables: tuple[str, ...] = ()
    expressions: tuple[Expression, ...] = ()
    arguments: tuple[tuple[str, int], ...] = ()
    gate: Expression | None = None
    gate_arguments: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Generator:
    """A residual generator.

    Attributes
    ----------
    id : str
        ``r1``, ``r2``, ... in the order of the bank.
    equations : tuple of int
        That it uses, ascending.
    faults : tuple of str
        Its signature: the faults it is sensitive to.
    node : int
        The node of its residual.
    residual : int
        The equation left over.
    steps : tuple of (int, str)
        Matched equations and what they are solved for, in computing order.
    restricted : bool
        Whether no non-invertible edge is matched.
    origin : str
        ``mtes``, ``cross_check`` for a test that minimality would have thrown away, ``selected``
        where not all sets were listed.
    """

    id: str
    equations: tuple[int, ...]
    faults: tuple[str, ...]
    node: int
    residual: int
    steps: tuple[tuple[int, str], ...]
    restricted: bool
    origin: Literal["mtes", "cross_check", "selected"] = "mtes"


@dataclass(frozen=True, slots=True)
class NotImplementable:
    """A test set that no residual generator can implement, and why: in words and as a reason."""

    equations: tuple[int, ...]
    faults: tuple[str, ...]
    why: str
    origin: Literal["mtes", "cross_check", "selected"]
    reason: Reason


@dataclass(frozen=True, slots=True, eq=False)
class Bank:
    """Residual generators for one system, compiled.

    Attributes
    ----------
    system : System
    nodes : tuple of Node
        Every node after its arguments.
    generators : tuple of Generator
    not_implementable : tuple of NotImplementable
    listed : bool
        Whether generators and not implementable sets are all sets of the kind that was asked for.
    notes : tuple of str
        Where a selection stands for sets too many to be listed, in words.
    """

    system: System
    nodes: tuple[Node, ...]
    generators: tuple[Generator, ...]
    not_implementable: tuple[NotImplementable, ...]
    listed: bool = True
    notes: tuple[str, ...] = ()

    @property
    def incidence(self) -> NDArray[np.bool_]:
        """Return the signatures, (generators, faults) bool, in the system's order of faults."""
        place = {fault.name: i for i, fault in enumerate(self.system.faults)}
        matrix = np.zeros((len(self.generators), len(place)), dtype=bool)
        for row, generator in enumerate(self.generators):
            matrix[row, [place[name] for name in generator.faults]] = True
        return matrix

    @property
    def signatures(self) -> pandas.DataFrame:
        """Return the signatures as a frame, residuals by faults."""
        import pandas as pd

        return pd.DataFrame(
            self.incidence,
            index=[generator.id for generator in self.generators],
            columns=[fault.name for fault in self.system.faults],
        )

    def evaluate(self, signals: Signals, differentiation: Differentiation) -> Residuals:
        """Return every residual over the whole flight, with its predicted spread."""
        from fdi.residuals.evaluate import evaluate_bank

        return evaluate_bank(self, signals, differentiation)

    def describe(self, generator: Generator) -> str:
        """Return the equations of a generator as one line a person can read."""
        return ", ".join(self.system.equations[i].name for i in generator.equations)

    def __repr__(self) -> str:
        return (
            f"<Bank {self.system.name}: {len(self.generators)} residual generators, "
            f"{len(self.nodes)} nodes, {len(self.not_implementable)} sets not implementable>"
        )

    def _repr_html_(self) -> Any:
        return self.signatures._repr_html_()  # type: ignore[operator]
