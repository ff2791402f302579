"""Which matchings of a test set are valid, and which valid ones are best?

In: a set of equations of a system. Out: complete matchings of its unknowns with one equation left
over, such that everything can be computed in order, best first; or the reason why there is none.
The published rules (mixed causality):

1. Take out the equations matched by an integral or derivative edge. Strongly connected parts of
   what remains are algebraic loops; inside them a non-invertible edge may be matched, because the
   loop is solved as a system.
2. Contract these and put the others back. Strongly connected parts are dynamic loops; inside them
   a matched non-invertible edge (outside the algebraic loops) or derivative edge is invalid.
3. On the remaining paths a matched non-invertible edge or a matched integral edge is invalid.

Matchings without non-invertible edges come first; then the cost decides, 1 for an ordinary edge
(times the equation's own cost) and 100 for a derivative one; then the number of equations in loops.

An integral edge needs a start value that no log states. By default it is never matched; that makes
the rules those of ``fdi.structure.sequence``: only what to leave over has to be chosen. Where a
bank may integrate, an observer holds the start value (``observer.py``), the edge is valid alone and
in a dynamic loop, and what was integrated is differentiated nowhere.

References
----------
Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos: A Fault Diagnosis Framework for MAVLink-Enabled
UAVs Using Structural Analysis, section III. Svard, Nyberg, IEEE Trans. SMC-A 40(6), 2010.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from fdi.model.expression import Symbol, symbols
from fdi.model.system import DIFFERENTIAL, SystemEquation
from fdi.structure.computation import DERIVATIVE_COST, Steps
from fdi.structure.sequence import Blocked, Obstacle, Order, orders


class Reason(StrEnum):
    """Why a test set has no residual generator."""

    NO_REDUNDANCY = "no redundancy"
    NO_COMPLETE_MATCHING = "no complete matching"
    NOT_INVERTIBLE = "not invertible"
    INTEGRATION = "integration"
    DYNAMIC_LOOP = "dynamic loop"
    NO_FAULT = "no fault"
    CONDITION = "condition not measured"


@dataclass(frozen=True, slots=True)
class NoMatching:
    """Why a set has no valid matching, as a reason and in words."""

    reason: Reason
    text: str


NO_REDUNDANCY: Final = NoMatching(Reason.NO_REDUNDANCY, "it has no equation to spare")
MAX_COMPARED: Final = 64
"""Choices of what to leave over that are compared."""
INVERTED_SLOPE: Final = 2.0
"""Of a variable that a function or a loop has to be solved for; any number above 1 prefers what is
computed forwards."""


@dataclass(frozen=True, slots=True)
class Choices:
    """The equations of a system as steps, with the names of their unknowns."""

    equations: tuple[SystemEquation, ...]
    steps: Steps
    names: tuple[str, ...]

    def solved(self, order: Order) -> dict[int, str]:
        """Return what every matched equation is solved for, in computing order."""
        return {e: self.names[u] for block in order.blocks for e, u in block}


def choices_of(equations: Sequence[SystemEquation], *, integrate: bool = False) -> Choices:
    """Return what the search for matchings needs to know of all equations of a system.

    ``integrate``: whether states may be integrated.
    """
    place: dict[str, int] = {}
    rows = [
        tuple(place.setdefault(name, len(place)) for name in equation.edges)
        for equation in equations
    ]
    holders: list[list[int]] = [[] for _ in place]
    for number, row in enumerate(rows):
        for unknown in row:
            holders[unknown].append(number)
    edges = [
        (number, place[name], kind)
        for number, equation in enumerate(equations)
        for name, kind in equation.edges.items()
    ]
    solvable: list[set[int]] = [set() for _ in rows]
    for number, unknown, kind in edges:
        if kind in ("solvable", "derivative"):
            solvable[number].add(unknown)
    steps = Steps(
        rows=tuple(rows),
        holders=tuple(tuple(own) for own in holders),
        solvable=tuple(frozenset(own) for own in solvable),
        in_loop=tuple(equation.differential is None for equation in equations),
        differential={(i, u): kind[0] for i, u, kind in edges if kind in DIFFERENTIAL},
        costs=tuple(cost_of(equation) for equation in equations),
        free=False,
        integrate=integrate,
    )
    return Choices(tuple(equations), steps, tuple(place))


def matchings(choices: Choices, numbers: Sequence[int]) -> Iterator[Order | NoMatching]:
    """Yield what comes of each choice of what to leave over, the cheapest for the rest first.

    Parameters
    ----------
    choices : Choices
    numbers : sequence of int
        The set, numbers of equations.

    Notes
    -----
    Of equal costs an equation of the model is left over before a measurement, so that a residual
    compares what the model says. Where more than one equation is left over, the first in this order
    is the residual, and what it does not need is not part of the generator.
    """

    def preference(number: int) -> tuple[bool, int]:
        shown = choices.equations[number].measurement is not None
        return shown, -number if shown else number

    with_fault = {number for number in numbers if choices.equations[number].fault}
    for found in orders(choices.steps, sorted(numbers, key=preference)):
        if isinstance(found, Blocked):
            yield _in_words(found, choices)
        elif with_fault.isdisjoint({found.residual, *(e for b in found.blocks for e, _ in b)}):
            yield NoMatching(Reason.NO_FAULT, "it compares nothing that could fail")
        elif _differentiates(choices, found):
            name = choices.equations[found.residual].name
            yield NoMatching(Reason.INTEGRATION, f"{name} would differentiate what was integrated")
        else:
            yield found


def is_integral(choices: Choices, order: Order) -> bool:
    """Return whether a matching integrates a state."""
    kinds = choices.steps.differential
    return any(kinds.get(pair) == "i" for block in order.blocks for pair in block)


def _differentiates(choices: Choices, order: Order) -> bool:
    """Return whether the residual is a derivative of what was integrated before."""
    if choices.equations[order.residual].differential is None:
        return False
    steps, integrated = choices.steps, set[int]()
    for block in order.blocks:
        states = any(steps.differential.get(pair) == "i" for pair in block)
        if states or any(not integrated.isdisjoint(steps.rows[e]) for e, _ in block):
            integrated.update(unknown for _, unknown in block)
    return not integrated.isdisjoint(steps.rows[order.residual])


def cheapest_matching(choices: Choices, numbers: Sequence[int]) -> Order | NoMatching:
    """Return the published choice, or why there is none.

    That is the cheapest matching without non-invertible edges, else the cheapest valid one.
    """
    fallback: Order | None = None
    reason: NoMatching | None = None
    for found in matchings(choices, numbers):
        if isinstance(found, NoMatching):
            reason = reason or found
        elif found.restricted:
            return found
        else:
            fallback = fallback or found
    return fallback or reason or NO_REDUNDANCY


def best_matchings(
    choices: Choices, numbers: Sequence[int], k: int
) -> tuple[Order, ...] | NoMatching:
    """Return the k best valid matchings of a set, or why there is none.

    Parameters
    ----------
    choices : Choices
    numbers : sequence of int
        The set, numbers of equations.
    k : int
        The most that are wanted.

    Returns
    -------
    tuple of Order or NoMatching
        Those without non-invertible edges first, then by cost (a differentiation costs 100), then
        by the number of equations in loops, then by noise gain.

    Notes
    -----
    A set of redundancy one has as many choices as equations. Of the many choices of others the
    64 cheapest are compared, and more only until one is valid.
    """
    valid: list[tuple[tuple[bool, float, int, float, int], Order]] = []
    reason: NoMatching | None = None
    for number, found in enumerate(matchings(choices, numbers), 1):
        if isinstance(found, NoMatching):
            reason = reason or found
        else:
            gain = noise_gain(choices, found)
            valid.append(((not found.restricted, found.cost, found.loops, gain, number), found))
        if valid and number >= MAX_COMPARED:
            break
    if not valid:
        return reason or NO_REDUNDANCY
    return tuple(found for _, found in sorted(valid, key=lambda item: item[0])[:k])


def noise_gain(choices: Choices, order: Order) -> float:
    """Return how much noise a matching lets through to its residual, as far as structure tells.

    Parameters
    ----------
    choices : Choices
    order : Order

    Returns
    -------
    float
        Standard deviation of the residual for white noise of one on every channel, if a variable
        computed from others had slope 1 in each, and slope 2 where a function has to be inverted
        for it: there the slope is 1 / f', which grows where f is flat. What one channel contributes
        on several ways adds up. A derivative over 1 s has slope 1, and so has an integral: the
        observer lets through no more than the residual's own channel has.
    """
    equations = choices.equations
    noise: dict[str, dict[int, float]] = {}
    for block in order.blocks:
        first, own = block[0][0], {choices.names[unknown] for _, unknown in block}
        total = _noise_of(equations, [number for number, _ in block], noise, own)
        if any(choices.steps.differential.get(pair) == "i" for pair in block):
            inverted = not all(_is_explicit(equations[e], choices.names[u]) for e, u in block)
        else:
            inverted = len(block) > 1 or not _is_explicit(equations[first], *own)
        scale = INVERTED_SLOPE if inverted else 1.0
        for name in own:
            noise[name] = {channel: scale * part for channel, part in total.items()}
    left = _noise_of(equations, (order.residual,), noise, set())
    return math.sqrt(sum(part**2 for part in left.values()))


def _noise_of(
    equations: Sequence[SystemEquation],
    numbers: Sequence[int],
    noise: Mapping[str, Mapping[int, float]],
    own: set[str],
) -> dict[int, float]:
    """Return what each channel contributes to equations through what was computed before."""
    total: dict[int, float] = {}
    for number in numbers:
        equation = equations[number]
        if equation.measurement is not None:
            total[number] = total.get(number, 0.0) + 1.0
        for name in equation.edges:
            for channel, part in ({} if name in own else noise[name]).items():
                total[channel] = total.get(channel, 0.0) + part
    return total


def _is_explicit(equation: SystemEquation, name: str) -> bool:
    """Return whether an equation says what a variable is, without being rearranged."""
    left, right = equation.left, equation.right
    if equation.differential or equation.measurement is not None:
        return True
    alone = Symbol(name)
    return (left == alone and name not in symbols(right)) or (
        right == alone and name not in symbols(left)
    )


def _in_words(blocked: Blocked, choices: Choices) -> NoMatching:
    """Return what stands against a choice, with the names of equations and unknowns."""
    names = ", ".join(choices.equations[number].name for number in blocked.equations)
    unknown = "" if blocked.unknown is None else choices.names[blocked.unknown]
    match blocked.obstacle:
        case Obstacle.NO_REDUNDANCY:
            return NO_REDUNDANCY
        case Obstacle.NOT_INVERTIBLE:
            text = f"{names} would have to be solved, which it cannot be, for {unknown}"
            return NoMatching(Reason.NOT_INVERTIBLE, text)
        case Obstacle.INTEGRATION:
            text = f"{names} would have to be integrated for {unknown}"
            return NoMatching(Reason.INTEGRATION, text)
        case Obstacle.DYNAMIC_LOOP:
            text = f"{names} form a dynamic loop, which would have to be integrated"
            return NoMatching(Reason.DYNAMIC_LOOP, text)
        case _:
            return NoMatching(Reason.NO_COMPLETE_MATCHING, "it has no complete matching")


def cost_of(equation: SystemEquation) -> float:
    """Return what matching an equation costs."""
    return equation.cost * (DERIVATIVE_COST if equation.differential else 1.0)
