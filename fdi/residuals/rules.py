"""Which matching of a test set is valid, and which valid one is cheapest?

In: a set of equations of a system. Out: a complete matching of its unknowns with one equation left
over, such that everything can be computed in order (mixed causality), or the reason why there is
none. The published rules:

1. Take out the equations matched by an integral or derivative edge. Strongly connected parts of
   what remains are algebraic loops; inside them a non-invertible edge may be matched, because the
   loop is solved as a system.
2. Contract these and put the others back. Strongly connected parts are dynamic loops; inside them
   a matched non-invertible edge (outside the algebraic loops) or derivative edge is invalid.
3. On the remaining paths a matched non-invertible edge or a matched integral edge is invalid.

Cost 1 for an ordinary edge (times the equation's own cost), 100 for an integral or derivative one.
Matchings without non-invertible edges are preferred: only where none is valid are loops searched.

References
----------
Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos: A Fault Diagnosis Framework for MAVLink-Enabled
UAVs Using Structural Analysis, section III. Svard, Nyberg, IEEE Trans. SMC-A 40(6), 2010.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from fdi.model.system import SystemEquation
from fdi.residuals.graph import strong_components

DIFFERENTIAL_COST: Final = 100.0
MAX_TRIES: Final = 20_000
"""Matchings looked at per set; sets of the shipped models need fewer than a hundred."""


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


@dataclass(slots=True)
class _Search:
    equations: Mapping[int, SystemEquation]
    options: dict[str, list[tuple[float, int]]]
    order: list[str]
    restricted: bool
    best: ValidMatching | None = None
    bound: float = float("inf")
    tries: int = 0
    reasons: dict[str, None] = field(default_factory=dict)


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
    """
    equations = {i: system[i] for i in numbers}
    reason = "it has no complete matching"
    for restricted in (True, False):
        search = _start(equations, restricted)
        if search is None:
            continue
        for assignment in _assignments(search):
            _judge(search, assignment)
        if search.best:
            return search.best
        if search.tries >= MAX_TRIES:
            reason = f"no valid one among the first {MAX_TRIES} matchings"
        elif search.reasons:
            reason = next(iter(search.reasons))
    return NoMatching(reason)


def _start(equations: Mapping[int, SystemEquation], restricted: bool) -> _Search | None:
    options: dict[str, list[tuple[float, int]]] = {}
    for number, equation in equations.items():
        for name, kind in equation.edges.items():
            entry = options.setdefault(name, [])
            if kind == "fixed" and restricted:
                continue
            cost = equation.cost * (1.0 if kind in ("solvable", "fixed") else DIFFERENTIAL_COST)
            entry.append((cost, number))
    if any(not entry for entry in options.values()):
        return None
    for entry in options.values():
        entry.sort()
    order = sorted(options, key=lambda name: (len(options[name]), name))
    return _Search(equations, options, order, restricted)


def _assignments(search: _Search) -> Iterator[dict[str, int]]:
    """Yield complete matchings, cheap choices first, bounded by the best valid one so far."""
    names = search.order
    cheapest = [search.options[name][0][0] for name in names]
    ahead = [sum(cheapest[i:]) for i in range(len(names) + 1)]
    chosen: dict[str, int] = {}
    used: set[int] = set()
    costs = [0.0]
    iterators = [iter(search.options[names[0]])] if names else []
    if not names:
        yield {}
    while iterators:
        depth = len(iterators) - 1
        name = names[depth]
        if name in chosen:
            used.discard(chosen.pop(name))
            costs.pop()
        step = next(
            (
                (cost, number)
                for cost, number in iterators[-1]
                if number not in used and costs[-1] + cost + ahead[depth + 1] < search.bound
            ),
            None,
        )
        if step is None:
            iterators.pop()
            continue
        chosen[name] = step[1]
        used.add(step[1])
        costs.append(costs[-1] + step[0])
        if depth + 1 < len(names):
            iterators.append(iter(search.options[names[depth + 1]]))
            continue
        search.tries += 1
        if search.tries > MAX_TRIES:
            return
        yield dict(chosen)


def _judge(search: _Search, assignment: Mapping[str, int]) -> None:
    """Keep a matching if it is valid and cheaper than the best; note why if it is not."""
    equations = search.equations
    solved = {number: name for name, number in assignment.items()}
    left_over = [number for number in equations if number not in solved]
    kinds = {number: equations[number].edges[name] for number, name in solved.items()}
    arrows = {
        number: [other for other in solved if other != number and name in equations[other].edges]
        for number, name in solved.items()
    }
    differential = {n for n, kind in kinds.items() if kind in ("derivative", "integral")}
    algebraic = [n for n in solved if n not in differential]
    loops = strong_components(algebraic, arrows)
    in_loop = {n for loop in loops if len(loop) > 1 for n in loop}
    parts = strong_components(list(solved), arrows)
    for part in parts:
        dynamic = len(part) > 1 and any(n in differential for n in part)
        for number in part:
            problem = _problem(kinds[number], number in in_loop, dynamic)
            if problem:
                text = f"{equations[number].name} would have to be {problem} for {solved[number]}"
                search.reasons.setdefault(text)
                return
    cost = sum(
        c for name, number in assignment.items() for c, n in search.options[name] if n == number
    )
    if cost < search.bound:
        search.bound = cost
        blocks = tuple(tuple(part) for part in parts)
        pairs = tuple((n, solved[n]) for block in blocks for n in block)
        search.best = ValidMatching(pairs, blocks, left_over[0], cost, search.restricted)


def _problem(kind: str, in_algebraic_loop: bool, in_dynamic_loop: bool) -> str | None:
    if kind == "fixed" and not in_algebraic_loop:
        return "solved, which it cannot be,"
    if kind == "derivative" and in_dynamic_loop:
        return "differentiated inside a dynamic loop"
    if kind == "integral" and not in_dynamic_loop:
        return "integrated outside a dynamic loop"
    return None
