"""Which sets of equations are to be implemented as tests?

In: a system and the choice of tests. Out: sets of its equations, each with where it comes from, and
notes where not all were listed.

``mtes`` is the published choice: minimal test supports of the whole system. ``mtes+cross_checks``
adds the supports of the system without limits and equalities: in the whole system a limit makes the
measurement next to it testable alone, and minimality then throws every comparison with another
sensor away (flaw 1 of the published model). ``selected`` lists no sets, but takes a small bank that
tells apart what all valid tests can, with and without limits and equalities, and the cheapest test
of each fault.

A graph component with too many sets to list is treated as by ``selected``, whatever was chosen, and
a note says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Final, Literal

from fdi import structure
from fdi.model.expression import symbols
from fdi.model.parts import Kind
from fdi.model.system import System
from fdi.residuals.rules import cost_of

Tests = Literal["mtes", "mtes+cross_checks", "selected"]
Origin = Literal["mtes", "cross_check", "selected"]
MAX_SETS: Final = 20_000
"""Sets that are listed in all; a graph component beyond is selected from."""
MAX_CANDIDATES: Final = 10_000_000
"""Upper bound on the sets of a graph component up to which they are listed; the shipped models stay
below 400, the published one below 8,000, and a component of 1e10 took a minute for its 39 sets."""
MAX_DERIVED: Final = 3
"""Steps by which a variable of a condition may be derived from measured ones."""
FORWARD: Final = ("solvable", "derivative")
"""Kinds of edges along which such a step computes."""


@dataclass(frozen=True, slots=True)
class Sets:
    """Sets to be implemented.

    Attributes
    ----------
    sets : tuple of (tuple of int, str)
        Numbers of the system's equations, and the origin: ``mtes``, ``selected``, or
        ``cross_check`` for what only the system without limits and equalities has.
    listed : bool
        Whether these are all sets of the kind that was asked for.
    notes : tuple of str
        Where a selection had to stand for all sets, in words.
    """

    sets: tuple[tuple[tuple[int, ...], Origin], ...]
    listed: bool
    notes: tuple[str, ...]


def sets_of(system: System, tests: Tests, *, integrate: bool = False) -> Sets:
    """Return the sets to be implemented, in a fixed order; ``integrate``: see `build_bank`."""
    number = {equation.name: i for i, equation in enumerate(system.equations)}
    found: dict[tuple[int, ...], Origin] = {}
    notes: list[str] = []
    listed = tests != "selected"
    for limits in (True,) if tests == "mtes" else (True, False):
        model = system.structure(limits=limits)
        for component in structure.graph_components(model):
            # Per component, as published: a fault-free redundancy elsewhere in the model would
            # belong to every support of the whole by its definition, and says nothing here.
            part = structure.submodel(model, component.equations)
            bank = None if tests == "selected" else _listed(part, max(MAX_SETS - len(found), 0))
            origin: Origin = "mtes" if limits else "cross_check"
            if bank is None:
                bank, undecided = _selected(
                    part, system, number, cross_check=tests != "mtes", integrate=integrate
                )
                origin = "selected" if limits else "cross_check"
                if tests != "selected":
                    listed = False
                    notes.append(_note(part, len(bank), undecided, limits))
            for bits in bank:
                rows = [number[part.equations[row]] for row in structure.members(bits)]
                found.setdefault(_with_inputs(rows, system), origin)
    return Sets(tuple(found.items()), listed, tuple(notes))


def _listed(part: structure.Model, most: int) -> list[int] | None:
    """Return all minimal test supports of a graph component, or None if they are too many."""
    if structure.count_bound(part) > MAX_CANDIDATES:
        return None
    found = list(islice(structure.mtes_sets(part), most + 1))
    return found if len(found) <= most else None


def _selected(
    part: structure.Model,
    system: System,
    number: Mapping[str, int],
    *,
    cross_check: bool,
    integrate: bool,
) -> tuple[list[int], int]:
    """Return a bank of sets for a graph component, and how many pairs of faults are undecided.

    The bank tells apart what valid tests can. Beside it stand the cheapest test of each fault, and
    for a fault without a valid test one that shows why there is none.
    """
    known = _known_in_conditions(system)
    equations = [system.equations[number[name]] for name in part.equations]
    usable = [
        row
        for row, equation in enumerate(equations)
        if equation.when is None
        or known.issuperset(n for n in symbols(equation.when) if n in system.variables)
    ]
    inner = structure.submodel(part, usable)
    own = [equations[row] for row in usable]
    costs = tuple(cost_of(equation) for equation in own)
    rules = structure.Rules(costs=costs, integrate=integrate)
    doubtful = [i for i, e in enumerate(own) if e.kind in (Kind.LIMIT, Kind.EQUALITY)]
    bank = structure.select_tests(inner, rules, assumptions=doubtful if cross_check else ())
    found = [test.equations for test in bank.tests]
    for fault, detectable in enumerate(bank.detectable):
        test = structure.find_test(inner, fault, rules=rules) if detectable else None
        found += [test.equations] if test else []
    sets = [structure.bitset(usable[i] for i in structure.members(bits)) for bits in found]
    sets += _without_matching(part, sets)
    return list(dict.fromkeys(sets)), int(bank.undecided.sum())


def _without_matching(part: structure.Model, sets: list[int]) -> Iterator[int]:
    """Yield for each fault that no set holds one that holds it by structure alone."""
    held = 0
    for bits in sets:
        held |= bits
    missing = [fault for fault in part.faults if not structure.bitset(fault.equations) & held]
    if missing:
        for test in structure.select_tests(part).tests:
            new = [fault for fault in missing if structure.bitset(fault.equations) & test.equations]
            if new:
                missing = [fault for fault in missing if fault not in new]
                yield test.equations


def _note(part: structure.Model, count: int, undecided: int, limits: bool) -> str:
    bound = f"{structure.count_bound(part):.0e}".replace("e+", "e")
    text = (
        f"{len(part.equations)} equations hang together{'' if limits else ' without limits'}, with "
        f"up to {bound} test sets: instead of all of them {count} were selected, which tell apart "
        f"what valid tests can"
    )
    return text + (f", but for {undecided} pairs of faults left undecided" if undecided else "")


def _known_in_conditions(system: System) -> set[str]:
    """Return the variables that a condition may read: shown, or derived in a few steps."""
    known = {e.measurement.variable for e in system.equations if e.measurement is not None}
    for _ in range(MAX_DERIVED):
        known |= {
            name
            for equation in system.equations
            if equation.when is None
            for name, kind in equation.edges.items()
            if kind in FORWARD and known.issuperset(n for n in equation.edges if n != name)
        }
    return known


def _with_inputs(rows: list[int], system: System) -> tuple[int, ...]:
    """Return equations with the inputs that show what they hold, ascending."""
    inputs = system.inputs
    shown = {inputs[n] for i in rows for n in system.equations[i].edges if n in inputs}
    return tuple(sorted({*rows, *shown}))
