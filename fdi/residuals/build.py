"""Which residual generators does a system have?

In: a system and the choice of tests. Out: a ``Bank``. The sets to be implemented (``sets.py``) come
from structure; each gets a valid matching (``rules.py``), which orders the computations; these
become nodes of one shared graph. A set without a valid matching is kept with the reason.

With ``mtes`` that is the published matching, the cheapest; otherwise the best, which of equal costs
has fewer equations in loops and lets less noise through.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from fdi.model.calculus import subtract
from fdi.model.expression import Apply, Expression, Symbol, symbols
from fdi.model.parts import MEASURED, SLOPE
from fdi.model.system import System, SystemEquation
from fdi.residuals.bank import Bank, Generator, NotImplementable
from fdi.residuals.node import Node
from fdi.residuals.rules import (
    Choices,
    NoMatching,
    Reason,
    best_matchings,
    cheapest_matching,
    choices_of,
)
from fdi.residuals.sets import FORWARD, MAX_DERIVED, Tests, sets_of
from fdi.residuals.solve import solve
from fdi.structure.sequence import Order

Arguments = tuple[tuple[str, int], ...]
"""Names and the nodes that give them."""


class _UnsolvableError(Exception):
    """A matched step that cannot be computed."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(text)
        self.reason = reason


def build_bank(system: System, tests: Tests = "mtes+cross_checks") -> Bank:
    """Return the bank of residual generators of a system.

    Parameters
    ----------
    system : System
    tests : str
        ``mtes``, ``mtes+cross_checks`` or ``selected``; the first two select likewise where there
        are too many sets to list, which ``listed`` and ``notes`` of the bank say.
    """
    graph = _Graph(system)
    choices = choices_of(system.equations)
    generators: list[Generator] = []
    refused: list[NotImplementable] = []
    fault_of = {fault.equation: fault.name for fault in system.faults}
    chosen = sets_of(system, tests)
    for numbers, origin in chosen.sets:
        faults = tuple(fault_of[i] for i in numbers if i in fault_of)
        matching = _matching(choices, numbers, published=tests == "mtes")
        if isinstance(matching, NoMatching):
            refused.append(
                NotImplementable(numbers, faults, matching.text, origin, matching.reason)
            )
            continue
        solved = choices.solved(matching)
        try:
            node = graph.add_generator(matching, solved)
        except _UnsolvableError as error:
            refused.append(NotImplementable(numbers, faults, str(error), origin, error.reason))
            continue
        used = tuple(sorted({matching.residual, *solved}))
        generators.append(
            Generator(
                f"r{len(generators) + 1}",
                used,
                tuple(fault_of[i] for i in used if i in fault_of),
                node,
                matching.residual,
                tuple(solved.items()),
                matching.restricted,
                origin,
            )
        )
    return Bank(
        system,
        tuple(graph.nodes),
        tuple(generators),
        tuple(refused),
        chosen.listed,
        chosen.notes,
    )


def _matching(choices: Choices, numbers: tuple[int, ...], *, published: bool) -> Order | NoMatching:
    """Return the matching by which a set is implemented, or why there is none."""
    if published:
        return cheapest_matching(choices, numbers)
    best = best_matchings(choices, numbers, 1)
    return best if isinstance(best, NoMatching) else best[0]


class _Graph:
    """The shared computations while they are collected; equal nodes are one."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.nodes: list[Node] = []
        self._number: dict[Node, int] = {}
        self._roots: dict[tuple[int, str], tuple[Expression, ...] | None] = {}
        self._shown: dict[str, int] = {}
        for i, e in sorted(enumerate(system.equations), key=lambda pair: pair[1].fault is not None):
            if e.measurement is not None:
                self._shown.setdefault(e.measurement.variable, i)

    def add_generator(self, order: Order, solved: Mapping[int, str]) -> int:
        """Return the node of a generator's residual, with everything before it added."""
        values: dict[str, int] = {}
        for block in order.blocks:
            numbers = tuple(number for number, _ in block)
            if len(numbers) > 1:
                self._add_loop(numbers, solved, values)
            else:
                name = solved[numbers[0]]
                values[name] = self._add_step(numbers[0], name, values)
        return self._add_residual(order.residual, values)

    def _add(self, node: Node) -> int:
        if node not in self._number:
            self._number[node] = len(self.nodes)
            self.nodes.append(node)
        return self._number[node]

    def _channel(self, number: int) -> int:
        return self._add(Node("channel", number, (self._variable(number),)))

    def _variable(self, number: int) -> str:
        measurement = self.system.equations[number].measurement
        assert measurement is not None
        return measurement.variable

    def _near(self, names: Iterable[str]) -> Arguments:
        shown = [name for name in names if name in self._shown]
        return tuple((name, self._channel(self._shown[name])) for name in shown)

    def _arguments(
        self, expressions: Iterable[Expression], number: int, values: dict[str, int]
    ) -> tuple[tuple[str, int], ...]:
        arguments = {}
        for expression in expressions:
            for name in symbols(expression):
                if name == MEASURED:
                    arguments[name] = self._channel(number)
                elif name in values:
                    arguments[name] = values[name]
                elif name in self.system.variables:
                    # Only a condition can get here: a matching computes all other unknowns.
                    arguments[name] = self._look_up(name, number, ())
        return tuple(sorted(arguments.items()))

    def _look_up(self, name: str, asked_by: int, pending: tuple[str, ...]) -> int:
        """Return a node for a variable that a condition reads: shown, or derived."""
        if name in self._shown:
            return self._channel(self._shown[name])
        for number, equation in enumerate(self.system.equations):
            if equation.edges.get(name) not in FORWARD or equation.when:
                continue
            others = [other for other in equation.edges if other != name]
            if len(pending) >= MAX_DERIVED or set(others) & {name, *pending}:
                continue
            try:
                known = {o: self._look_up(o, asked_by, (*pending, name)) for o in others}
            except _UnsolvableError:
                continue
            return self._add_step(number, name, known)
        text = f"the condition of {self.system.equations[asked_by].name} needs {name}: not measured"
        raise _UnsolvableError(Reason.CONDITION, text)

    def _gate(
        self, equation: SystemEquation, number: int, values: dict[str, int]
    ) -> tuple[Expression | None, tuple[tuple[str, int], ...]]:
        if equation.when is None:
            return None, ()
        return equation.when, self._arguments([equation.when], number, values)

    def _add_step(self, number: int, name: str, values: dict[str, int]) -> int:
        equation = self.system.equations[number]
        gate, gate_arguments = self._gate(equation, number, values)
        if equation.measurement is not None:
            return self._channel(number)
        if equation.differential:
            derivative, state = equation.differential
            if name != derivative:
                text = f"{equation.name} would have to be integrated"
                raise _UnsolvableError(Reason.INTEGRATION, text)
            given = ((state, values[state]),)
            return self._add(Node("derivative", number, (name,), (), given, gate, gate_arguments))
        if equation.regressed:
            return self._add_slope(number, equation.regressed, values, gate, gate_arguments)
        key = (number, name)
        if key not in self._roots:
            self._roots[key] = solve(equation, name, self.system.variables[name])
        roots = self._roots[key]
        if roots is None:
            return self._add_newton((number,), {number: name}, values)[name]
        arguments = self._arguments(roots, number, values)
        near = self._near((name,)) if len(roots) > 1 else ()
        node = Node("solve", number, (name,), roots, arguments, gate, gate_arguments, near)
        return self._add(node)

    def _add_loop(
        self, block: tuple[int, ...], solved: Mapping[int, str], values: dict[str, int]
    ) -> None:
        members = [self.system.equations[i] for i in block]
        if any(equation.differential or equation.regressed for equation in members):
            names = ", ".join(self.system.equations[i].name for i in block)
            text = f"{names} form a dynamic loop, which would have to be integrated"
            raise _UnsolvableError(Reason.DYNAMIC_LOOP, text)
        values.update(self._add_newton(block, solved, values))

    def _add_newton(
        self, block: tuple[int, ...], solved: Mapping[int, str], values: dict[str, int]
    ) -> dict[str, int]:
        names = tuple(solved[i] for i in block)
        expressions = []
        arguments: dict[str, int] = {}
        known = {name: node for name, node in values.items() if name not in names}
        for number in block:
            equation = self.system.equations[number]
            expression = subtract(equation.right, equation.left)
            inner = {n for n in symbols(expression) if n in names}
            others = [n for n in symbols(expression) if n not in inner]
            arguments.update(self._arguments([Symbol(n) for n in others], number, known))
            expressions.append(expression)
        gates = [w for number in block if (w := self.system.equations[number].when)]
        gate = Apply("and", tuple(gates)) if gates else None
        node = self._add(
            Node(
                "loop",
                block[0],
                names,
                tuple(expressions),
                tuple(sorted(arguments.items())),
                gate,
                self._arguments(gates, block[0], known),
                self._near(names),
            )
        )
        return {
            name: self._add(Node("part", block[0], (name,), (), (("", node),))) for name in names
        }

    def _add_residual(self, number: int, values: dict[str, int]) -> int:
        equation = self.system.equations[number]
        gate, gate_arguments = self._gate(equation, number, values)
        if equation.differential:
            derivative, state = equation.differential
            slope = self._add(
                Node("derivative", number, (derivative,), (), ((state, values[state]),))
            )
            return self._add_difference(number, slope, values[derivative], gate, gate_arguments)
        if equation.regressed:
            slope = self._add_slope(number, equation.regressed, values, None, ())
            given = values[equation.regressed[0]]
            return self._add_difference(number, slope, given, gate, gate_arguments)
        expression = subtract(equation.right, equation.left)
        arguments = self._arguments([expression], number, values)
        return self._add(
            Node("residual", number, (), (expression,), arguments, gate, gate_arguments)
        )

    def _add_slope(
        self,
        number: int,
        regressed: tuple[str, tuple[str, ...]],
        values: dict[str, int],
        gate: Expression | None,
        gate_arguments: Arguments,
    ) -> int:
        name, names = regressed
        arguments = tuple((own, values[own]) for own in names)
        return self._add(Node("slope", number, (name,), (), arguments, gate, gate_arguments))

    def _add_difference(
        self,
        number: int,
        windowed: int,
        given: int,
        gate: Expression | None,
        gate_arguments: Arguments,
    ) -> int:
        """Return the residual of ``y = der(x)`` or ``y = slope(v, u)``, y known otherwise."""
        left = self.system.equations[number].left
        assert isinstance(left, Symbol)
        sides = ((SLOPE, windowed), (left.name, given))
        difference = (subtract(Symbol(SLOPE), left),)
        return self._add(Node("residual", number, (), difference, sides, gate, gate_arguments))
