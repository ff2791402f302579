"""What does a test compare with what? The two sides of its statement, and its channels' part in it.

In: a bank's nodes over a flight (`fdi.residuals.respond`). Out: columns. Of an equation or a
measurement both sides are computed as the test computes them: what is measured against what all
else predicts. Of a limit it is the quantity and its bounds. A channel's own prediction is the value
that would make the test's residual zero, all else as it is: what was recorded less the residual
over the test's gain for this channel (one step of Newton's; exact where the test is linear in it).
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import TRIGGERED
from fdi.model.evaluate import evaluate, wrap
from fdi.model.expression import Apply, Expression, Number, Symbol, symbols, to_text
from fdi.model.parts import SLOPE, Kind
from fdi.model.system import SystemEquation
from fdi.residuals import Generator
from fdi.residuals.respond import Stretch, respond

Floats = NDArray[np.float64]

FAINT: Final = 0.02
"""A channel that one standard deviation of it moves a test by less of the test's own spread tells
nothing in it (chosen)."""


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """A side of a statement: what a person calls it, (n,) values, and whether it is a bound."""

    label: str
    value: Floats
    is_bound: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A channel's part in a test.

    Attributes
    ----------
    equation : int
        Its measurement equation.
    weight : float
        How far one standard deviation of it moves the residual, over the residual's own spread.
    recorded, predicted : (n,) float or None
        In the unit of its variable; None of what the test holds of a channel through its change, or
        through how long it stands still, only.
    """

    equation: int
    weight: float
    recorded: Floats | None
    predicted: Floats | None


def sides(piece: Stretch, generator: Generator) -> list[Side]:
    """Return both sides of the statement that a generator leaves over; none if they are no columns.

    The first is what is stated of, the second what it is held against.
    """
    bank = piece.bank
    equation = bank.system.equations[generator.residual]
    node = bank.nodes[generator.node]
    given = {name: piece.nodes[number].column for name, number in node.arguments}
    columns = {**piece.context.constants, **piece.context.states, **given}

    def column(expression: Expression) -> Floats | None:
        if not columns.keys() >= set(symbols(expression)):
            return None
        value = np.asarray(evaluate(expression, columns), np.float64)
        return np.broadcast_to(value, len(piece.t)).copy()

    found: list[Side] = []
    for label, expression, is_bound in _expressions(equation, bank.system.variables):
        value = column(expression)
        if value is None:
            return []
        if all(label != one.label for one in found):
            found.append(Side(label, value, is_bound))
    return found


def _expressions(
    equation: SystemEquation, variables: Container[str]
) -> Iterator[tuple[str, Expression, bool]]:
    if equation.differential or equation.regressed:
        name = (equation.differential or equation.regressed or ("",))[0]
        yield name, equation.left, False
        yield f"from the change of {to_text(equation.right)}", Symbol(SLOPE), False
    elif equation.kind is Kind.LIMIT:
        yield from _limited(equation.left, variables)
    elif equation.measurement is not None:
        yield f"{equation.measurement.channel}, recorded", equation.right, False
        yield f"{to_text(equation.left)}, predicted", equation.left, False
    else:
        yield to_text(equation.left), equation.left, False
        yield to_text(equation.right), equation.right, False


def _limited(
    excess: Expression, variables: Container[str]
) -> Iterator[tuple[str, Expression, bool]]:
    """Yield the quantity of a limit and its bounds, of ``max(least - x, x - most, 0)``."""
    match excess:
        case Apply("max", (*terms, Number())):
            pairs = [term.arguments for term in terms if isinstance(term, Apply)]
        case _:
            yield to_text(excess), excess, False
            return
    candidates = [
        s for pair in pairs for s in pair if isinstance(s, Symbol) and s.name in variables
    ]
    if not candidates:
        yield to_text(excess), excess, False
        return
    quantity = max(candidates, key=candidates.count)  # of equals the first
    yield quantity.name, quantity, False
    for above, below in pairs:
        bound = below if above == quantity else above
        yield f"allowed: {to_text(bound)}", bound, True


def residual_of(alarms: Alarms, row: int) -> Floats:
    """Return a residual without the constant that was taken off, (n,)."""
    residuals = alarms.residuals
    equation = residuals.bank.system.equations[residuals.bank.generators[row].residual]
    off = residuals.values[row] - alarms.centre[row]
    return wrap(off) if equation.circular else off


class Parts:
    """The parts that channels have in tests, each computed once for all tests of the bank."""

    def __init__(self, alarms: Alarms, piece: Stretch) -> None:
        self._alarms = alarms
        self._piece = piece
        self._changes: dict[int, Floats] = {}

    def of(self, row: int, component: str | None, span: tuple[float, float]) -> list[Part]:
        """Return the parts in a test within a span, s: the accused component's first."""
        alarms, piece = self._alarms, self._piece
        system, t = piece.bank.system, piece.t
        generator = piece.bank.generators[row]
        inside = (t >= span[0]) & (t <= span[1])
        told = inside & ((alarms.state[row] == TRIGGERED) | alarms.alarm[row])
        inside = told if told.any() else inside
        found = []
        for number in generator.equations:
            equation = system.equations[number]
            measurement = equation.measurement
            if measurement is None:
                continue
            is_own = equation.component == component
            if measurement.stillness or measurement.silence:
                found.append(Part(number, 0.0, None, None))
                continue
            probe = measurement.accuracy or 1e-3
            change = self._change(number, probe)[row]
            spread = alarms.residuals.spread[row]
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.abs(change) / spread
                gain = change / probe
                predicted = recorded_of(piece, number) - residual_of(alarms, row) / gain
            known = share[inside & np.isfinite(share)]
            weight = float(np.median(known)) if known.size else 0.0
            if weight > FAINT:
                predicted = np.where(share > FAINT, predicted, np.nan)  # elsewhere it has no say
                predicted = wrap(predicted) if equation.circular else predicted
                found.append(Part(number, weight, recorded_of(piece, number), predicted))
            elif is_own:  # it has its say through its change only
                found.append(Part(number, weight, recorded_of(piece, number), None))

        def order(part: Part) -> tuple[bool, float, int]:
            own = system.equations[part.equation].component == component
            return not own, -part.weight, part.equation

        return sorted(found, key=order)

    def _change(self, number: int, probe: float) -> Floats:
        if number not in self._changes:
            piece = self._piece
            self._changes[number] = respond(piece, {number: np.full(len(piece.t), probe)})
        return self._changes[number]


def recorded_of(piece: Stretch, number: int) -> Floats:
    """Return what a measurement equation's channel shows, (n,), in the unit of its variable."""
    measurement = piece.bank.system.equations[number].measurement
    assert measurement is not None
    unknown = np.full(len(piece.t), np.nan)
    return piece.context.signals.columns.get(measurement.channel, unknown)
