"""Which residual generators does a system have?

In: a system and the choice of test sets. Out: a ``Bank``. Test sets come from structure alone; each
gets its cheapest valid matching (``rules.py``), which orders the computations; these become nodes
of one shared graph. A set without a valid matching is kept with the reason.

``mtes`` is the published choice: minimal test supports of the whole system. ``mtes+cross_checks``
adds the supports of the system without limits and equalities: in the whole system a limit makes the
measurement next to it testable alone, and minimality then throws every comparison with another
sensor away (flaw 1 of the published model).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Literal

from fdi import structure
from fdi.errors import ModelError
from fdi.model.calculus import subtract
from fdi.model.expression import Apply, Expression, Symbol, symbols
from fdi.model.parts import MEASURED, SLOPE
from fdi.model.system import System, SystemEquation
from fdi.residuals.bank import Bank, Generator, Node, NotImplementable
from fdi.residuals.rules import NoMatching, ValidMatching, cheapest_matching
from fdi.residuals.solve import solve

Tests = Literal["mtes", "mtes+cross_checks"]
Origin = Literal["mtes", "cross_check"]
MAX_SETS: Final = 20_000
MAX_CANDIDATES: Final = 10_000_000
"""Upper bound on the test sets of a graph component; the shipped models stay below 400, the
published one below 8,000, and a component of 1e10 took a minute for its 39 sets."""
MAX_DERIVED: Final = 3
"""Steps by which a variable of a condition may be derived from measured ones."""


class _UnsolvableError(Exception):
    """A matched step that cannot be computed."""


def test_sets(system: System, tests: Tests) -> list[tuple[tuple[int, ...], Origin]]:
    """Return the test sets as numbers of the system's equations, in a fixed order.

    Raises
    ------
    ModelError
        There are more than 20,000 of them, or a part of the system is too entangled to search.
    """
    number = {equation.name: i for i, equation in enumerate(system.equations)}
    found: dict[tuple[int, ...], Origin] = {}
    kinds: list[tuple[bool, Origin]] = [(True, "mtes")]
    if tests == "mtes+cross_checks":
        kinds.append((False, "cross_check"))
    for limits, origin in kinds:
        model = system.structure(limits=limits)
        for component in structure.graph_components(model):
            # Per component, as published: a fault-free redundancy elsewhere in the model would
            # belong to every support of the whole by its definition, and says nothing here.
            part = structure.submodel(model, component.equations)
            _refuse_if_endless(part, system)
            for bits in structure.mtes_sets(part):
                if len(found) >= MAX_SETS:
                    raise ModelError(
                        f"has more than {MAX_SETS} test sets with this telemetry", where=system.name
                    )
                rows = [number[part.equations[row]] for row in structure.members(bits)]
                found.setdefault(_with_inputs(rows, system), origin)
    return list(found.items())


def _refuse_if_endless(part: structure.Model, system: System) -> None:
    """Refuse a graph component whose search for test sets would not end."""
    bound = structure.count_bound(part)
    if bound > MAX_CANDIDATES:
        raise ModelError(
            f"{len(part.equations)} equations hang together with up to {bound:.0e} test sets, "
            f"at most {MAX_CANDIDATES:.0e} can be searched",
            where=system.name,
            hint="show what several equations share by inputs instead of measurements",
        )


def _with_inputs(rows: list[int], system: System) -> tuple[int, ...]:
    """Return equations with the inputs that show what they hold, ascending."""
    inputs = system.inputs
    shown = {inputs[n] for i in rows for n in system.equations[i].edges if n in inputs}
    return tuple(sorted({*rows, *shown}))


def build_bank(system: System, tests: Tests = "mtes+cross_checks") -> Bank:
    """Return the bank of residual generators of a system.

    Parameters
    ----------
    system : System
    tests : str
        ``mtes`` or ``mtes+cross_checks``.
    """
    graph = _Graph(system)
    generators: list[Generator] = []
    refused: list[NotImplementable] = []
    fault_of = {fault.equation: fault.name for fault in system.faults}
    for numbers, origin in test_sets(system, tests):
        matching = cheapest_matching(numbers, system.equations)
        faults = tuple(fault_of[i] for i in numbers if i in fault_of)
        if isinstance(matching, NoMatching):
            refused.append(NotImplementable(numbers, faults, matching.reason, origin))
            continue
        try:
            node = graph.add_generator(matching)
        except _UnsolvableError as error:
            refused.append(NotImplementable(numbers, faults, str(error), origin))
            continue
        used = tuple(sorted({matching.residual, *(i for i, _ in matching.pairs)}))
        generators.append(
            Generator(
                f"r{len(generators) + 1}",
                used,
                tuple(fault_of[i] for i in used if i in fault_of),
                node,
                matching.residual,
                matching.pairs,
                matching.restricted,
                origin,
            )
        )
    return Bank(system, tuple(graph.nodes), tuple(generators), tuple(refused))


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

    def add_generator(self, matching: ValidMatching) -> int:
        """Return the node of a generator's residual, with everything before it added."""
        values: dict[str, int] = {}
        solved = dict(matching.pairs)
        for block in matching.blocks:
            if len(block) > 1:
                self._add_loop(block, solved, values)
            else:
                values[solved[block[0]]] = self._add_step(block[0], solved[block[0]], values)
        return self._add_residual(matching.residual, values)

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
            if equation.edges.get(name) not in ("solvable", "derivative") or equation.when:
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
        raise _UnsolvableError(text)

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
                raise _UnsolvableError(f"{equation.name} would have to be integrated")
            given = ((state, values[state]),)
            return self._add(Node("derivative", number, (name,), (), given, gate, gate_arguments))
        key = (number, name)
        if key not in self._roots:
            self._roots[key] = solve(equation, name, self.system.variables[name])
        roots = self._roots[key]
        if roots is None:
            return self._add_newton((number,), {number: name}, values)[name]
        arguments = self._arguments(roots, number, values)
        return self._add(Node("solve", number, (name,), roots, arguments, gate, gate_arguments))

    def _add_loop(
        self, block: tuple[int, ...], solved: dict[int, str], values: dict[str, int]
    ) -> None:
        if any(self.system.equations[i].differential for i in block):
            names = ", ".join(self.system.equations[i].name for i in block)
            raise _UnsolvableError(
                f"{names} form a dynamic loop, which would have to be integrated"
            )
        values.update(self._add_newton(block, solved, values))

    def _add_newton(
        self, block: tuple[int, ...], solved: dict[int, str], values: dict[str, int]
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
            difference = subtract(Symbol(SLOPE), equation.left)
            sides = ((SLOPE, slope), (derivative, values[derivative]))
            return self._add(
                Node("residual", number, (), (difference,), sides, gate, gate_arguments)
            )
        expression = subtract(equation.right, equation.left)
        arguments = self._arguments([expression], number, values)
        return self._add(
            Node("residual", number, (), (expression,), arguments, gate, gate_arguments)
        )
