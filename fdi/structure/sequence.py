"""In which order can a set of equations be computed, with which equation left over?

In: the steps that rules allow (``computation.py``) and a set of equations with more equations than
unknowns. Out: its valid sequences, cheapest first, or what stands against each. A block of one
equation is solved for one unknown, a block of several is a loop.

Once it is chosen what is left over, the blocks are the strongly connected parts of the rest, and
the same for every complete matching of it (Dulmage and Mendelsohn 1958). So no matching has to be
searched for, only what to leave over; and that can be tried in the order of cost.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations, islice
from typing import Final

from fdi.structure.computation import Steps, dynamic_loops
from fdi.structure.incidence import Rows
from fdi.structure.loops import strong_components
from fdi.structure.matching import match

MAX_TRIES: Final = 5_000
"""Choices of what to leave over that are looked at. A set of redundancy one has as many as it has
equations."""


class Obstacle(StrEnum):
    """Is what stands against a sequence.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, "A Fault Diagnosis Framework for
    MAVLink-Enabled UAVs Using Structural Analysis", 2018, section III.

    Examples
    --------
    >>> print(Obstacle.DYNAMIC_LOOP)
    dynamic loop
    """

    NO_REDUNDANCY = "no redundancy"
    NO_COMPLETE_MATCHING = "no complete matching"
    NOT_INVERTIBLE = "not invertible"
    INTEGRATION = "integration"
    DIFFERENTIATION = "differentiation"
    ALGEBRAIC_LOOP = "algebraic loop"
    DYNAMIC_LOOP = "dynamic loop"


@dataclass(frozen=True, slots=True)
class Order:
    """Is a valid sequence: a matching in computing order and the equation left over.

    Parameters
    ----------
    residual : int
        The equation left over.
    blocks : tuple of tuple of (int, int)
        Pairs (equation, unknown) in computing order; a block of several is a loop.
    cost : float
        Sum of the costs of the matched equations.
    restricted : bool
        Whether no entry is matched that an equation alone cannot be solved along.

    References
    ----------
    Svärd, Nyberg, IEEE Trans. SMC-A 40(6), 2010 (computation sequence).

    Examples
    --------
    >>> Order(1, (((0, 0),),), 1.0, True).loops
    0
    """

    residual: int
    blocks: tuple[tuple[tuple[int, int], ...], ...]
    cost: float
    restricted: bool

    @property
    def loops(self) -> int:
        """Number of equations that are solved in loops."""
        return sum(len(block) for block in self.blocks if len(block) > 1)


@dataclass(frozen=True, slots=True)
class Blocked:
    """Is a choice of what to leave over that does not work.

    Parameters
    ----------
    obstacle : Obstacle
    equations : tuple of int
        Where: the equation that cannot be solved, or those of the loop.
    unknown : int or None
        The unknown that the equation would have to be solved for.

    References
    ----------
    As :class:`Obstacle`.

    Examples
    --------
    >>> Blocked(Obstacle.NOT_INVERTIBLE, (3,), 1).equations
    (3,)
    """

    obstacle: Obstacle
    equations: tuple[int, ...] = ()
    unknown: int | None = None


def orders(steps: Steps, equations: Sequence[int]) -> Iterator[Order | Blocked]:
    """Yield what comes of each choice of what to leave over, the cheapest for the rest first.

    Parameters
    ----------
    steps : Steps
    equations : sequence of int
        The set. Of equal costs, those that come first in it are left over first.

    Yields
    ------
    Order or Blocked

    Notes
    -----
    A set of redundancy r has one choice for each r of its equations; 5,000 of them are tried. The
    first one left over is the residual, and what it does not need is no part of the sequence.

    References
    ----------
    Svärd, Nyberg, IEEE Trans. SMC-A 40(6), 2010; Dulmage and Mendelsohn, Canadian J. Math. 10,
    1958.

    Examples
    --------
    >>> from fdi.structure import Model
    >>> from fdi.structure.computation import Rules, steps
    >>> model = Model(("y = x", "y = x**2"), ("x",), ((0,), (0,)), nonsolvable=((1, 0),))
    >>> for found in orders(steps(model, Rules()), (0, 1)):
    ...     print(found)
    Blocked(obstacle=<Obstacle.NOT_INVERTIBLE: 'not invertible'>, equations=(1,), unknown=0)
    Order(residual=1, blocks=(((0, 0),),), cost=1.0, restricted=True)
    """
    unknowns = {unknown for equation in equations for unknown in steps.rows[equation]}
    redundancy = len(equations) - len(unknowns)
    if redundancy < 1:
        yield Blocked(Obstacle.NO_REDUNDANCY)
        return
    costs = steps.costs
    dearest = sorted(equations, key=lambda equation: -costs[equation])
    choices = list(islice(combinations(dearest, redundancy), MAX_TRIES))
    choices.sort(key=lambda choice: -sum(costs[equation] for equation in choice))
    for choice in choices:
        rest = sorted(set(equations).difference(choice))
        yield arrange(steps, rest, choice[0])


def arrange(steps: Steps, rest: Sequence[int], residual: int) -> Order | Blocked:
    """Return the sequence in which a residual is computed from some equations.

    Parameters
    ----------
    steps : Steps
    rest : sequence of int
        As many equations as they and the residual have unknowns.
    residual : int

    Returns
    -------
    Order or Blocked

    References
    ----------
    As :func:`orders`.

    Examples
    --------
    >>> from fdi.structure import Model
    >>> from fdi.structure.computation import Rules, steps
    >>> model = Model.from_matrix([[1, 1], [1, 1], [1, 0]])
    >>> arrange(steps(model, Rules()), (0, 1), 2).blocks
    (((0, 0), (1, 1)),)
    >>> arrange(steps(model, Rules(loops=False)), (0, 1), 2).obstacle.value
    'algebraic loop'
    """
    rows = steps.rows
    solved = _matched(rest, [rows[equation] for equation in rest])
    equation_of = {unknown: equation for equation, unknown in solved.items()}
    if len(solved) < len(rest) or not all(unknown in equation_of for unknown in rows[residual]):
        return Blocked(Obstacle.NO_COMPLETE_MATCHING)
    needs = {
        equation: [equation_of[u] for u in rows[equation] if u != unknown]
        for equation, unknown in solved.items()
    }
    wanted = [equation_of[unknown] for unknown in rows[residual]]
    needed = set(wanted)
    for equation in wanted:  # grows while it is walked
        for other in needs[equation]:
            if other not in needed:
                needed.add(other)
                wanted.append(other)
    parts = strong_components([equation for equation in rest if equation in needed], needs)[::-1]
    restricted = True
    integrated: set[int] = set()
    for part in parts:
        blocked = _obstacle(steps, part, solved)
        if blocked is not None and steps.integrate:
            blocked = _integrated(steps, part, solved, blocked)
        blocked = blocked or _differentiated(steps, part, solved, integrated)
        if blocked is not None:
            return blocked
        kinds = {steps.differential.get((equation, solved[equation])) for equation in part}
        differential = steps.integrate and not kinds.isdisjoint("id")
        if "i" in kinds or any(not integrated.isdisjoint(rows[equation]) for equation in part):
            integrated.update(solved[equation] for equation in part)
        if len(part) > 1 and not differential:
            own = {solved[equation] for equation in part}
            better = _matched(part, [sorted(steps.solvable[e] & own) for e in part])
            if len(better) == len(part):
                solved.update(better)
            else:
                restricted = False
    return Order(
        residual,
        tuple(tuple((equation, solved[equation]) for equation in part) for part in parts),
        sum(steps.costs[equation] for part in parts for equation in part),
        restricted,
    )


def _matched(equations: Sequence[int], rows: Rows) -> dict[int, int]:
    """Return a maximum matching of equations with the unknowns in their rows."""
    column: dict[int, int] = {}
    local = [[column.setdefault(unknown, len(column)) for unknown in row] for row in rows]
    _, unknown_of = match(local, len(column))
    unknowns = list(column)
    return {e: unknowns[c] for e, c in zip(equations, unknown_of, strict=True) if c >= 0}


def _obstacle(steps: Steps, part: Sequence[int], solved: Mapping[int, int]) -> Blocked | None:
    """Return why a block cannot be computed, or None if it can."""
    if len(part) == 1:
        equation, unknown = part[0], solved[part[0]]
        if unknown in steps.solvable[equation]:
            return None
        kind = steps.differential.get((equation, unknown))
        return Blocked(_SINGLE[kind], (equation,), unknown)
    if all(steps.in_loop[equation] for equation in part):
        return None
    slow = {equation for equation, _ in steps.differential}
    dynamic = not slow.isdisjoint(part)
    return Blocked(Obstacle.DYNAMIC_LOOP if dynamic else Obstacle.ALGEBRAIC_LOOP, tuple(part))


def _integrated(
    steps: Steps, part: Sequence[int], solved: dict[int, int], blocked: Blocked
) -> Blocked | None:
    """Return why a block cannot be integrated either; if it can, match it so, in place."""
    constraints: dict[int, dict[str, int]] = {}
    for (equation, unknown), kind in steps.differential.items():
        if equation in part:
            constraints.setdefault(equation, {})[kind] = unknown
    if len(part) == 1:
        own = constraints.get(part[0])
        return None if own and solved[part[0]] == own["i"] else blocked
    inside = {solved[equation] for equation in part}
    rows = {equation: [u for u in steps.rows[equation] if u in inside] for equation in part}
    states = {e: (own["i"], own["d"]) for e, own in constraints.items()}
    if not all(inside.issuperset(pair) for pair in states.values()):
        return blocked
    for found, matched in dynamic_loops(steps, rows, states):
        if len(found) == len(part):
            solved.update(matched)
            return None
    return blocked


def _differentiated(
    steps: Steps, part: Sequence[int], solved: Mapping[int, int], integrated: set[int]
) -> Blocked | None:
    """Return the obstacle where a block differentiates what was integrated before."""
    for equation in part:
        kind = steps.differential.get((equation, solved[equation]))
        if kind == "d" and not integrated.isdisjoint(steps.rows[equation]):
            return Blocked(Obstacle.DIFFERENTIATION, (equation,), solved[equation])
    return None


_SINGLE: Final[Mapping[str | None, Obstacle]] = {
    None: Obstacle.NOT_INVERTIBLE,
    "i": Obstacle.INTEGRATION,
    "d": Obstacle.DIFFERENTIATION,
}
