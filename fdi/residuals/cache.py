"""Was the bank of this very system compiled before?

In: a system and the choice of tests. Out: its bank, from an earlier process where one compiled the
same. The key covers what a bank depends on: the equations with their edges, costs, conditions and
faults, which unknowns may be negative, what a condition can read. Parameter values, tolerances,
accuracies and units are not in it, so that two logs of one vehicle share a bank. What is read back
is checked: every index, name and kind that evaluation relies on.
"""

from __future__ import annotations

import json
from typing import Any, Final

from fdi import store
from fdi.errors import EntryError
from fdi.model.codec import FOREIGN, decode, encode
from fdi.model.expression import REGRESSED, Apply, Expression, symbols, walk
from fdi.model.given import Given
from fdi.model.parts import STATES, Measurement
from fdi.model.system import System
from fdi.residuals.bank import Bank, Generator, NotImplementable
from fdi.residuals.build import build_bank
from fdi.residuals.node import Node
from fdi.residuals.sets import MAX_SETS, Tests

KIND: Final = "bank"
MAX_ROOTS: Final = 64


def cached_bank(
    system: System, tests: Tests = "mtes+cross_checks", *, integrate: bool = False
) -> Bank:
    """Return the bank of a system, from the user's cache where it is there; see `build_bank`."""
    if _holds_code(system):
        return build_bank(system, tests, integrate=integrate)
    kind = f"{tests}+integrate" if integrate else tests
    key = store.digest(KIND, kind, _depends_on(system))
    tree = store.fetch(KIND, key)
    bank = _read_bank(system, tree) if tree is not None else None
    if bank is None:
        bank = build_bank(system, tests, integrate=integrate)
        store.keep(KIND, key, [encode(p) for p in _parts(bank)])
    return bank


def _holds_code(system: System) -> bool:
    """Return whether an equation uses a function that Python handed over: that is kept nowhere."""
    sides = (
        side
        for e in system.equations
        for side in (e.left, e.right, e.when, *e.errors, *e.swings)
        if side
    )
    return any(
        isinstance(node, Apply) and isinstance(node.operator, Given)
        for side in sides
        for node in walk(side)
    )


def _parts(bank: Bank) -> tuple[Any, ...]:
    return bank.nodes, bank.generators, bank.not_implementable, bank.listed, bank.notes


def _depends_on(system: System) -> str:
    equations = [
        [
            e.name,
            e.kind.value,
            encode(e.left),
            encode(e.right),
            dict(e.edges),
            encode(e.when),
            [encode(error) for error in e.errors],
            [encode(swing) for swing in e.swings],
            e.cost,
            e.measurement and _shown(e.measurement),
        ]
        for e in system.equations
    ]
    variables = [
        [v.name, v.low is None or v.low < 0, v.low is not None and v.high is not None, v.circular]
        for v in system.variables.values()
    ]
    faults = [[fault.name, fault.equation] for fault in system.faults]
    return json.dumps([equations, variables, sorted(system.parameters), faults])


def _shown(measurement: Measurement) -> list[Any]:
    return [measurement.variable, str(measurement.channel), measurement.accuracy is not None]


def _read_bank(system: System, tree: Any) -> Bank | None:
    """Return the bank that a tree stands for, or None where it is not one of this system."""
    try:
        nodes, generators, refused, listed, notes = tree
        bank = Bank(
            system,
            decode(tuple[Node, ...], nodes),
            decode(tuple[Generator, ...], generators),
            decode(tuple[NotImplementable, ...], refused),
            decode(bool, listed),
            decode(tuple[str, ...], notes),
        )
        _check(bank)
    except FOREIGN:
        return None
    return bank


def _require(holds: bool) -> None:
    if not holds:
        raise EntryError("not a bank of this system")


def _check(bank: Bank) -> None:
    """Raise EntryError where evaluation would run astray."""
    system = bank.system
    for number, node in enumerate(bank.nodes):
        _check_node(bank, number, node)
    faults = {fault.name for fault in system.faults}
    rows: tuple[Generator | NotImplementable, ...] = (*bank.generators, *bank.not_implementable)
    _require(len(rows) <= MAX_SETS)
    for row in rows:
        _require(all(0 <= i < len(system.equations) for i in row.equations))
        _require(set(row.faults) <= faults)
    for place, generator in enumerate(bank.generators, start=1):
        _require(generator.id == f"r{place}")
        _require(0 <= generator.node < len(bank.nodes))
        _require(bank.nodes[generator.node].kind in ("residual", "observer"))
        _require({generator.residual, *(i for i, _ in generator.steps)} <= set(generator.equations))
        _require(all(name in system.variables for _, name in generator.steps))


def _check_node(bank: Bank, number: int, node: Node) -> None:
    system = bank.system
    _require(0 <= node.equation < len(system.equations))
    _require(all(name in system.variables for name in node.variables))
    _require(all(0 <= i < number for i in node.uses))
    _require(all(name in system.variables for name, _ in node.error_arguments))
    given = [bank.nodes[i].kind for i in node.uses]
    _require(all(bank.nodes[i].kind == "channel" for _, i in node.near))
    _require(
        {"residual", "observer"}.isdisjoint(given) and ("loop" not in given or node.kind == "part")
    )
    counts = (len(node.variables), len(node.expressions), len(node.arguments))
    match node.kind:
        case "channel":
            _require(
                counts == (1, 0, 0) and system.equations[node.equation].measurement is not None
            )
        case "solve":
            _require(counts[0] == 1 and 1 <= counts[1] <= MAX_ROOTS)
        case "loop":
            _require(1 <= counts[0] == counts[1])
        case "part":
            _require(counts == (1, 0, 1) and given == ["loop"])  # no gate, nothing near
            _require(node.variables[0] in bank.nodes[node.arguments[0][1]].variables)
        case "derivative":
            _require(counts == (1, 0, 1) and node.arguments[0][0] in system.variables)
        case "slope":
            _require(counts[:2] == (1, 0) and counts[2] >= 2 and counts[2] % 2 == 0)
            _require(all(name in system.variables for name, _ in node.arguments))
        case "residual":
            _require(counts[:2] == (0, 1))
        case "observer":
            _require(1 <= node.states <= counts[0] == counts[1] - 1 == len(node.by))
            _require(all(0 <= i < len(system.equations) for i in node.by))
            _require(all(size > 0 for size in node.blocks))
            _require(node.states + sum(node.blocks) == counts[0])
    known = {*system.parameters, *(name for name, _ in node.arguments)}
    if node.kind in ("loop", "observer"):
        known.update(node.variables)
    for expression in node.expressions:
        _check_names(expression, known)
    if node.gate is not None:
        names = {name for name, _ in node.gate_arguments}
        _check_names(node.gate, {*system.parameters, *STATES, *names})


def _check_names(expression: Expression, known: set[str]) -> None:
    _require(set(symbols(expression)) <= known)
    windowed = {"der", *REGRESSED}
    _require(not any(isinstance(n, Apply) and n.operator in windowed for n in walk(expression)))
