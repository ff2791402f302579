"""How do the residuals move if a fault of a given size and shape is put into the data?

In: residuals, a stretch of time, and a fault as columns that are added to channels. Out: the change
of every residual over that stretch, with its sign: the fault's signature as a vector over the bank,
sample by sample. The graph of the bank is walked again with the changed columns, so that
derivatives, loops, conditions and roots answer as they did for the data themselves: a lasting bias
is a transient in a derivative, a drift lasts there. Only nodes that the fault reaches are computed
anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats, wrap
from fdi.residuals.bank import Bank, Residuals
from fdi.residuals.evaluate import compute_node, context_of
from fdi.residuals.value import Context, Value
from fdi.telemetry import Signals

Fault = Mapping[int, Floats]
"""Equation to the column, (n,), by which its channel reads too high, or its value is off."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A piece of a flight with every node of the bank as the data are, ``error`` included."""

    bank: Bank
    context: Context
    nodes: tuple[Value, ...]
    error: Fault = field(default_factory=dict)

    @property
    def t(self) -> Floats:
        """Return the grid of the piece, (n,) s of the log's clock."""
        return self.context.signals.t


def stretch(residuals: Residuals, span: slice | NDArray[np.int64]) -> Stretch:
    """Return a piece of a flight to put faults into.

    Parameters
    ----------
    residuals : Residuals
    span : slice or (n,) int
        Of the grid. A derivative is unknown for half its window at both ends, an observer until it
        has settled anew. Numbers may hold a piece many times over, so that many faults are put in
        at once.
    """
    bank = residuals.bank
    context = context_of(bank.system, bank.nodes, _cut(residuals.signals, span), residuals.recipe)
    # what noise does is of no interest here, but an observer chooses its gain from it
    observed = any(node.kind == "observer" for node in bank.nodes)
    context = replace(context, spreads=observed)
    done: dict[int, Value] = {}
    for number, node in enumerate(bank.nodes):
        done[number] = compute_node(node, done, context)
    return Stretch(bank, context, tuple(done.values()))


def with_error(piece: Stretch, error: Fault) -> Stretch:
    """Return the piece with an error in its data, to put faults into beside it."""
    nodes = dict(enumerate(piece.nodes)) | _reached(piece, error)
    return replace(piece, nodes=tuple(nodes.values()), error=_sum(piece.error, error))


def respond(piece: Stretch, fault: Fault) -> Floats:
    """Return by how much a fault in the data moves every residual.

    Parameters
    ----------
    piece : Stretch
    fault : mapping of int to (n,) float
        By measurement equation, in the unit of its variable; what is added to the data.

    Returns
    -------
    (r, n) float
        In each residual's unit; zero where the fault does not reach, NaN where it does and the
        residual is unknown with or without it.
    """
    bank = piece.bank
    found = reached(piece, fault)
    change = np.zeros((len(bank.generators), len(piece.t)))
    for row, generator in enumerate(bank.generators):
        if generator.node in found:
            moved = found[generator.node] - piece.nodes[generator.node].column
            circular = bank.system.equations[generator.residual].circular
            change[row] = wrap(moved) if circular else moved
    return change


def reached(piece: Stretch, fault: Fault) -> dict[int, Floats]:
    """Return the column, (n,), of every node that a fault in the data reaches, with the fault.

    Parameters
    ----------
    piece : Stretch
    fault : mapping of int to (n,) float
        By equation: what is added to a channel, to what the equation gives, or to its residual.
    """
    return {number: value.column for number, value in _reached(piece, fault).items()}


def _reached(piece: Stretch, fault: Fault) -> dict[int, Value]:
    total = _sum(piece.error, fault)
    channels = {
        number: added
        for number, added in total.items()
        if piece.bank.system.equations[number].measurement is not None
    }
    context = replace(piece.context, added=channels)
    done = dict(enumerate(piece.nodes))
    found: dict[int, Value] = {}
    for number, node in enumerate(piece.bank.nodes):
        if node.equation in fault or not found.keys().isdisjoint(node.reads):
            value = compute_node(node, done, context)
            if node.equation in total and node.equation not in channels:
                value = replace(value, column=value.column + total[node.equation])
            done[number] = found[number] = value
    return found


def _sum(one: Fault, other: Fault) -> Fault:
    return {**one, **{number: one.get(number, 0.0) + added for number, added in other.items()}}


def _cut(signals: Signals, span: slice | NDArray[np.int64]) -> Signals:
    return replace(
        signals,
        t=signals.t[span],
        columns={channel: column[span] for channel, column in signals.columns.items()},
        state=signals.state.part(span),
    )
