"""Which matching of a test set is valid, and which valid one is cheapest?

In: a set of equations of a system. Out: a complete matching of its unknowns with one equation left
over, such that everything can be computed in order, or the reason why there is none. The published
rules (mixed causality):

1. Take out the equations matched by an integral or derivative edge. Strongly connected parts of
   what remains are algebraic loops; inside them a non-invertible edge may be matched, because the
   loop is solved as a system.
2. Contract these and put the others back. Strongly connected parts are dynamic loops; inside them
   a matched non-invertible edge (outside the algebraic loops) or derivative edge is invalid.
3. On the remaining paths a matched non-invertible edge or a matched integral edge is invalid.

Cost 1 for an ordinary edge (times the equation's own cost), 100 for a derivative one. Matchings
without non-invertible edges are preferred.

An integral edge is valid inside a dynamic loop only, which would have to be integrated from a start
value that no log states; so it is never matched here. Then no matching has to be searched for: once
the left-over equation is chosen, the strongly connected parts are the same for every matching of
the others (Dulmage and Mendelsohn 1958), an equation's only edge into its own part decides rule 3,
a part of several is valid when none of its equations is differential, and the cost is that of the
equations, whatever each is matched to. Left-over equations are tried from the cheapest on.

References
----------
Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos: A Fault Diagnosis Framework for MAVLink-Enabled
UAVs Using Structural Analysis, section III. Svard, Nyberg, IEEE Trans. SMC-A 40(6), 2010.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from typing import Final

from fdi.model.system import EdgeKind, SystemEquation
from fdi.structure.loops import strong_components

DERIVATIVE_COST: Final = 100.0
MAX_TRIES: Final = 5_000
"""Choices of left-over equations looked at per set. A set has as many as equations, unless parts of
it that bring no fault are redundant among themselves, which is rare."""

Equations = Mapping[int, SystemEquation]


@dataclass(frozen=True, slots=True)
class ValidMatching:
    """A matching that can be computed.

    Attributes
    ----------
    pairs : tuple of (int, str)
        Equation and the unknown it is solved for, in computing order within ``blocks``.
    blocks : tuple of tuple of int
        Equations in computing order; a block of several is an algebraic loop.
    residual : int
        The equation left over.
    cost : float
    restricted : bool
        Whether no non-invertible edge is matched.
    """

    pairs: tuple[tuple[int, str], ...]
    blocks: tuple[tuple[int, ...], ...]
    residual: int
    cost: float
    restricted: bool


@dataclass(frozen=True, slots=True)
class NoMatching:
    """Why a set has no valid matching."""

    reason: str


def cheapest_matching(
    numbers: Sequence[int], system: Sequence[SystemEquation]
) -> ValidMatching | NoMatching:
    """Return the cheapest valid matching of a set of equations, or why there is none.

    Parameters
    ----------
    numbers : sequence of int
        The set, numbers of equations; it must have more equations than unknowns.
    system : sequence of SystemEquation
        All equations.

    Notes
    -----
    Of equal costs an equation of the model is left over before a measurement, so that a residual
    compares what the model says. Where more than one equation is left over, the first in this order
    is the residual, and what it does not need is not part of the generator.
    """
    equations = {i: system[i] for i in numbers}
    unknowns = {name for equation in equations.values() for name in equation.edges}
    excess = len(equations) - len(unknowns)
    if excess < 1:
        return NoMatching("it has no equation to spare")
    with_fault = {i for i, equation in equations.items() if equation.fault}
    fallback: ValidMatching | None = None
    reason: str | None = None
    for left_over in _choices(equations, excess):
        judged = _judge(equations, unknowns, left_over)
        if isinstance(judged, NoMatching):
            reason = reason or judged.reason
        elif with_fault.isdisjoint({judged.residual, *(i for i, _ in judged.pairs)}):
            reason = reason or "it compares nothing that could fail"
        elif judged.restricted:
            return judged
        else:
            fallback = fallback or judged
    return fallback or NoMatching(reason or "it has no complete matching")


def _cost(equation: SystemEquation) -> float:
    return equation.cost * (DERIVATIVE_COST if equation.differential else 1.0)


def _choices(equations: Equations, excess: int) -> list[tuple[int, ...]]:
    """Return the equations that may be left over, cheapest for the others first."""

    def rank(number: int) -> tuple[float, bool, int]:
        equation = equations[number]
        shown = equation.measurement is not None
        return -_cost(equation), shown, -number if shown else number

    order = sorted(equations, key=rank)
    choices = list(islice(combinations(order, excess), MAX_TRIES))
    choices.sort(key=lambda choice: -sum(_cost(equations[i]) for i in choice))
    return choices


def _judge(
    equations: Equations, unknowns: set[str], left_over: tuple[int, ...]
) -> ValidMatching | NoMatching:
    """Return the matching of the equations that are not left over, or what makes it invalid."""
    rest = [number for number in equations if number not in left_over]
    options = {number: list(equations[number].edges) for number in rest}
    solved = _match(options)
    if len(solved) < len(unknowns):
        return NoMatching("it has no complete matching")
    arrows = _arrows(equations, solved)
    parts = strong_components(rest, arrows)
    needed = _needed(equations, solved, left_over[0])
    restricted = True
    for part in parts:
        if part[0] not in needed:
            continue
        if len(part) == 1:
            number = part[0]
            problem = _PROBLEM.get(equations[number].edges[solved[number]])
            if problem:
                text = f"{equations[number].name} would have to be {problem} for {solved[number]}"
                return NoMatching(text)
        elif any(equations[number].differential for number in part):
            names = ", ".join(equations[number].name for number in part)
            return NoMatching(f"{names} form a dynamic loop, which would have to be integrated")
        else:
            own = {solved[number] for number in part}
            better = _match({n: _solvable(equations[n], own) for n in part})
            restricted = restricted and len(better) == len(part)
            solved.update(better if len(better) == len(part) else {})
    blocks = tuple(tuple(part) for part in parts if part[0] in needed)
    pairs = tuple((number, solved[number]) for block in blocks for number in block)
    cost = sum(_cost(equations[number]) for number, _ in pairs)
    return ValidMatching(pairs, blocks, left_over[0], cost, restricted)


_PROBLEM: Final[Mapping[EdgeKind, str]] = {
    "fixed": "solved, which it cannot be,",
    "integral": "integrated",
}


def _solvable(equation: SystemEquation, own: set[str]) -> list[str]:
    return [n for n, kind in equation.edges.items() if kind == "solvable" and n in own]


def _arrows(equations: Equations, solved: Mapping[int, str]) -> dict[int, list[int]]:
    """Return for every matched equation the matched ones that hold its unknown."""
    holders: dict[str, list[int]] = {}
    for number in solved:
        for name in equations[number].edges:
            holders.setdefault(name, []).append(number)
    return {
        number: [other for other in holders[name] if other != number]
        for number, name in solved.items()
    }


def _needed(equations: Equations, solved: Mapping[int, str], residual: int) -> set[int]:
    """Return the matched equations from which the residual is computed."""
    equation_of = {name: number for number, name in solved.items()}
    reached: set[int] = set()
    stack = [residual]
    while stack:
        for name in equations[stack.pop()].edges:
            number = equation_of[name]
            if number not in reached:
                reached.add(number)
                stack.append(number)
    return reached


def _match(options: Mapping[int, Sequence[str]]) -> dict[int, str]:
    """Return a largest matching of equations to unknowns (Kuhn 1955), without recursion."""
    equation_of: dict[str, int] = {}
    for root in options:
        parent: dict[str, int] = {}
        queue = [root]
        end: str | None = None
        while queue and end is None:
            number = queue.pop()
            for name in options[number]:
                if name in parent:
                    continue
                parent[name] = number
                if name not in equation_of:
                    end = name
                    break
                queue.append(equation_of[name])
        solved = {number: name for name, number in equation_of.items()} if end else {}
        while end is not None:
            number = parent[end]
            equation_of[end] = number
            end = solved.get(number)
    return {number: name for name, number in equation_of.items()}
