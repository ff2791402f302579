"""Which residual generators does a system have?

In: a system and the choice of tests. Out: a ``Bank``. The sets to be implemented (``sets.py``) come
from structure; each gets a valid matching (``rules.py``), which orders the computations; these
become nodes of one shared graph. A set without a valid matching is kept with the reason.

With ``mtes`` that is the published matching, the cheapest; otherwise the best, which of equal costs
has fewer equations in loops and lets less noise through. Where states may be integrated, a set has
one more, the best of those that do; of the two the one that lets less noise through is taken, and
of equal ones that which differentiates, because it needs no start value.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from fdi.model.calculus import subtract
from fdi.model.expression import Apply, Expression, Symbol, symbols
from fdi.model.parts import MEASURED, SLOPE
from fdi.model.system import System, SystemEquation
from fdi.residuals.bank import Bank, Generator, NotImplementable
from fdi.residuals.newton import linear_slopes
from fdi.residuals.node import Node
from fdi.residuals.observer import is_linear
from fdi.residuals.reads import needed_for
from fdi.residuals.rules import (
    MAX_COMPARED,
    Choices,
    NoMatching,
    Reason,
    best_matchings,
    cheapest_matching,
    choices_of,
    is_integral,
    noise_gain,
)
from fdi.residuals.sets import FORWARD, MAX_DERIVED, Tests, sets_of
from fdi.residuals.solve import solve
from fdi.structure.loops import strong_components
from fdi.structure.sequence import Order

Arguments = tuple[tuple[str, int], ...]
"""Names and the nodes that give them."""


class _UnsolvableError(Exception):
    """A matched step that cannot be computed."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(text)
        self.reason = reason


def build_bank(
    system: System, tests: Tests = "mtes+cross_checks", *, integrate: bool = False
) -> Bank:
    """Return the bank of residual generators of a system.

    Parameters
    ----------
    system : System
    tests : str
        ``mtes``, ``mtes+cross_checks`` or ``selected``; the first two select likewise where there
        are too many sets to list, which ``listed`` and ``notes`` of the bank say.
    integrate : bool
        Whether states may be integrated, held by an observer, where that is the only way or the
        one with less noise. See ``observer.py``.
    """
    graph = _Graph(system)
    choices = choices_of(system.equations)
    integrating = choices_of(system.equations, integrate=True) if integrate else None
    generators: list[Generator] = []
    refused: list[NotImplementable] = []
    fault_of = {fault.equation: fault.name for fault in system.faults}
    chosen = sets_of(system, tests, integrate=integrate)
    for numbers, origin in chosen.sets:
        faults = tuple(fault_of[i] for i in numbers if i in fault_of)
        plain = _matching(choices, numbers, published=tests == "mtes")
        candidates: list[Order | NoMatching] = [plain]
        if integrating is not None:
            candidates = _by_noise(integrating, plain, numbers)
        found = _first(graph, choices, candidates)
        if isinstance(found, NoMatching):
            refused.append(NotImplementable(numbers, faults, found.text, origin, found.reason))
            continue
        matching, node = found
        solved = choices.solved(matching)
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


def _by_noise(
    choices: Choices, plain: Order | NoMatching, numbers: tuple[int, ...]
) -> list[Order | NoMatching]:
    """Return what may implement a set, the best first: without integration, and with."""
    best = best_matchings(choices, numbers, MAX_COMPARED)
    if isinstance(best, NoMatching):
        return [plain] if isinstance(plain, Order) else [best]
    integral: list[Order | NoMatching] = [order for order in best if is_integral(choices, order)]
    if isinstance(plain, NoMatching):
        return integral or [plain]
    quieter = [
        order
        for order in integral
        if isinstance(order, Order) and noise_gain(choices, order) < noise_gain(choices, plain)
    ]
    return [*quieter, plain]


def _first(
    graph: _Graph, choices: Choices, candidates: Sequence[Order | NoMatching]
) -> tuple[Order, int] | NoMatching:
    """Return the first matching that can be computed, with its node, or why there is none."""
    reason: NoMatching | None = None
    for candidate in candidates:
        if isinstance(candidate, NoMatching):
            reason = reason or candidate
            continue
        try:
            return candidate, graph.add_generator(candidate, choices.solved(candidate))
        except _UnsolvableError as error:
            reason = reason or NoMatching(error.reason, str(error))
    assert reason is not None
    return reason


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
        inside: dict[int, str] = {}  # what is integrated, or computed from it
        for block in order.blocks:
            numbers = tuple(number for number, _ in block)
            if self._is_inside(numbers, solved, inside):
                inside.update((number, solved[number]) for number in numbers)
            elif len(numbers) > 1:
                self._add_loop(numbers, solved, values)
            else:
                name = solved[numbers[0]]
                values[name] = self._add_step(numbers[0], name, values)
        if inside:
            return self._add_observer(order.residual, inside, values)
        return self._add_residual(order.residual, values)

    def _is_inside(
        self, block: tuple[int, ...], solved: Mapping[int, str], inside: Mapping[int, str]
    ) -> bool:
        names = set(inside.values())
        members = [(self.system.equations[number], solved[number]) for number in block]
        return any(
            (own.differential is not None and own.differential[1] == name)
            or not names.isdisjoint(own.edges)
            for own, name in members
        )

    def _add_observer(
        self, residual: int, inside: Mapping[int, str], values: dict[str, int]
    ) -> int:
        """Return the node of a residual behind which states are integrated."""
        equations = self.system.equations
        states = {n: own[1] for n in inside if (own := equations[n].differential)}
        expressions = [self._rate(number, inside[number]) for number in states]
        blocks = self._in_order({n: name for n, name in inside.items() if n not in states})
        steps = [number for block in blocks for number in block]
        for block in blocks:
            expressions += self._block(block, inside)
        last = equations[residual]
        if any(
            own.regressed or own.errors or own.swings
            for own in (last, *map(equations.__getitem__, steps))
        ):
            text = f"a slope, or a stated error, lies behind what is integrated for {last.name}"
            raise _UnsolvableError(Reason.INTEGRATION, text)
        expressions.append(subtract(last.right, last.left))
        outer = {name: node for name, node in values.items() if name not in inside.values()}
        used = {name for own in expressions for name in symbols(own)} - set(inside.values())
        gates = [w for number in (*inside, residual) if (w := equations[number].when)]
        node = Node(
            "observer",
            residual,
            tuple(inside[number] for number in (*states, *steps)),
            tuple(expressions),
            self._arguments([Symbol(name) for name in sorted(used)], residual, outer),
            Apply("and", tuple(gates)) if gates else None,
            self._arguments(gates, residual, outer),
            states=len(states),
            by=(*states, *steps),
            blocks=tuple(len(block) for block in blocks),
        )
        self._check_observer(node)
        return self._add(node)

    def _rate(self, number: int, name: str) -> Expression:
        equation = self.system.equations[number]
        assert equation.differential is not None
        derivative, state = equation.differential
        if name != state:
            text = f"{equation.name} would differentiate what was integrated"
            raise _UnsolvableError(Reason.INTEGRATION, text)
        return Symbol(derivative)

    def _check_observer(self, node: Node) -> None:
        """Refuse an observer that has no noise to choose a gain from, or nowhere to start."""
        name = self.system.equations[node.equation].name
        shown = (
            self.system.equations[self.nodes[i].equation].measurement
            for _, first in node.arguments
            for i in needed_for(self.nodes, first)
            if self.nodes[i].kind == "channel"
        )
        if not any(own is not None and own.accuracy is not None for own in shown):
            text = f"no channel that {name} is computed from states an accuracy to choose a gain by"
            raise _UnsolvableError(Reason.INTEGRATION, text)
        states = [self.system.variables[own] for own in node.variables[: node.states]]
        endless = [v.name for v in states if v.low is None or v.high is None]
        if endless and not is_linear(self.system, node):
            text = (
                f"{', '.join(endless)}: integrated in equations that are not linear, and has no "
                f"domain with two ends to start from"
            )
            raise _UnsolvableError(Reason.INTEGRATION, text)

    def _in_order(self, inside: Mapping[int, str]) -> list[list[int]]:
        """Return equations in the order in which they can be computed, the states given."""
        holder = {name: number for number, name in inside.items()}
        needs = {
            number: [
                holder[other]
                for other in self.system.equations[number].edges
                if other in holder and other != name
            ]
            for number, name in inside.items()
        }
        return [sorted(group) for group in reversed(strong_components(list(inside), needs))]

    def _block(self, block: Sequence[int], inside: Mapping[int, str]) -> list[Expression]:
        """Return what gives the unknown of an equation, or is zero for those of several."""
        if len(block) == 1:
            return [self._only_root(block[0], inside[block[0]])]
        members = [self.system.equations[number] for number in block]
        zeros = [subtract(own.right, own.left) for own in members]
        unknowns = [self.system.variables[inside[number]] for number in block]
        if linear_slopes(zeros, unknowns) is None:
            names = ", ".join(own.name for own in members)
            text = f"{names} form a loop within what is integrated that is not linear"
            raise _UnsolvableError(Reason.DYNAMIC_LOOP, text)
        return zeros

    def _only_root(self, number: int, name: str) -> Expression:
        equation = self.system.equations[number]
        roots = None if equation.regressed else self._solved(number, name)
        if roots is None or len(roots) != 1:
            text = f"{equation.name} has no formula, or several, for {name}, which is integrated"
            raise _UnsolvableError(Reason.NOT_INVERTIBLE, text)
        return roots[0]

    def _solved(self, number: int, name: str) -> tuple[Expression, ...] | None:
        key = (number, name)
        if key not in self._roots:
            equation = self.system.equations[number]
            self._roots[key] = solve(equation, name, self.system.variables[name])
        return self._roots[key]

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
                    # Only a condition or an error: a matching computes all other unknowns.
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

    def _error_arguments(
        self, number: int, values: dict[str, int], solved: str = ""
    ) -> tuple[tuple[str, int], ...]:
        """Return what the errors of an equation read, but for what nothing tells here."""
        own = self.system.equations[number]
        names = {name for error in (*own.errors, *own.swings) for name in symbols(error)}
        found: dict[str, int] = {}
        for name in names - {solved}:
            with suppress(_UnsolvableError):
                found.update(self._arguments([Symbol(name)], number, values))
        return tuple(sorted(found.items()))

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
        roots = self._solved(number, name)
        if roots is None:
            return self._add_newton((number,), {number: name}, values)[name]
        arguments = self._arguments(roots, number, values)
        near = self._near((name,)) if len(roots) > 1 else ()
        node = Node("solve", number, (name,), roots, arguments, gate, gate_arguments, near)
        return self._add(replace(node, error_arguments=self._error_arguments(number, values, name)))

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
        node = Node("residual", number, (), (expression,), arguments, gate, gate_arguments)
        return self._add(replace(node, error_arguments=self._error_arguments(number, values)))

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
