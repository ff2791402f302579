"""Tells what can be computed from what, and in which order, when not every entry can be solved.

In: a model and rules (which entries an equation can be solved along, whether several equations may
be solved at once, whether one may differentiate, what each equation costs). Out: the unknowns that
can be computed, each by one step, and for every equation left over the set of equations behind it:
a minimal overdetermined set with a valid matching.

A step solves one equation for its only unknown that is not computed yet, along a solvable entry, or
a loop: a strongly connected part of several equations, none of them differential, along any of
their entries (Zogopoulos-Papaliakos et al. 2018, section III). Steps are taken cheapest first, by
the sum of the costs of all that they need, as in Knuth's generalisation of Dijkstra's algorithm.
Loops are looked for only when no single step is left.

Every unknown is computed once. So an equation left over, with the steps it needs, has one equation
more than unknowns and none that it could do without, which is an MSO set; and its matching is valid
because it was made in computing order.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Final

from fdi.errors import UsageError
from fdi.shown import Shown
from fdi.structure.decomposition import underdetermined
from fdi.structure.incidence import Model
from fdi.structure.loops import strong_components
from fdi.structure.matching import match

DERIVATIVE_COST: Final = 100.0


@dataclass(frozen=True, slots=True)
class Rules(Shown):
    """Say which matchings are valid and what they cost.

    Parameters
    ----------
    loops : bool
        Whether several equations may be solved at once for as many unknowns. Inside such a loop
        any entry may be matched, but no equation of it may be differential.
    differentiate : bool
        Whether ``dx = d/dt x`` may be solved for dx. It is never solved for x: integrating needs a
        start value.
    solvable : frozenset of (int, int), optional
        Entries (equation, unknown) along which one equation may be solved; by default all but
        the model's ``nonsolvable`` ones and states.
    costs : tuple of float, optional
        One for each equation, not negative; by default 1, and 100 for a differential one.
    integrate : bool
        Whether ``dx = d/dt x`` may also be solved for x, alone or in a dynamic loop: as an
        observer, whose residual holds start value and drift. What was integrated is not
        differentiated.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, "A Fault Diagnosis Framework for
    MAVLink-Enabled UAVs Using Structural Analysis", 2018, section III; Svärd, Nyberg, IEEE Trans.
    SMC-A 40(6), 2010.

    Examples
    --------
    >>> Rules(loops=False)
    Rules(loops=False, differentiate=True, solvable=None, costs=None, integrate=False)
    """

    loops: bool = True
    differentiate: bool = True
    solvable: frozenset[tuple[int, int]] | None = None
    costs: tuple[float, ...] | None = None
    integrate: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Are the possible steps of a model under rules, ready for repeated use.

    Parameters
    ----------
    rows : tuple of tuple of int
        Unknowns of each equation.
    holders : tuple of tuple of int
        Equations of each unknown.
    solvable : tuple of frozenset of int
        For each equation the unknowns that it alone may be solved for.
    in_loop : tuple of bool
        Whether an equation may be part of a loop.
    differential : mapping of (int, int) to {"i", "d"}
        Entries of differential constraints, at the state and at its derivative.
    costs : tuple of float
    free : bool
        Whether the rules allow every matching, so that structure alone decides.
    integrate : bool
        Whether states may be integrated; ``solvable`` does not hold them.

    References
    ----------
    As :class:`Rules`.

    Examples
    --------
    >>> steps(Model.from_matrix([[1, 1]]), Rules()).holders
    ((0,), (0,))
    """

    rows: tuple[tuple[int, ...], ...]
    holders: tuple[tuple[int, ...], ...]
    solvable: tuple[frozenset[int], ...]
    in_loop: tuple[bool, ...]
    differential: Mapping[tuple[int, int], str]
    costs: tuple[float, ...]
    free: bool
    integrate: bool = False


@dataclass(frozen=True, slots=True)
class LeftOver:
    """Is an equation left over, with what its residual is computed from.

    Parameters
    ----------
    residual : int
        The equation left over.
    equations : int
        Bit set: the equation itself and every equation of the steps it needs.

    References
    ----------
    Svärd, Nyberg, IEEE Trans. SMC-A 40(6), 2010 (sequential residual generators).

    Examples
    --------
    >>> LeftOver(2, 0b110).residual
    2
    """

    residual: int
    equations: int


def steps(model: Model, rules: Rules | None) -> Steps:
    """Return the possible steps of a model.

    Parameters
    ----------
    model : Model
    rules : Rules, optional
        None allows every matching.

    Returns
    -------
    Steps

    Raises
    ------
    UsageError
        When the costs do not fit the equations, or an entry is not one of the model.

    References
    ----------
    As :class:`Rules`.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 1], [0, 1]])
    >>> steps(model, Rules(solvable=frozenset({(1, 1)}))).solvable
    (frozenset(), frozenset({1}))
    """
    rows = model.rows
    holders: list[list[int]] = [[] for _ in model.unknowns]
    for equation, row in enumerate(rows):
        for unknown in row:
            holders[unknown].append(equation)
    if rules is None:
        solvable = [frozenset(row) for row in rows]
        in_loop = [True] * len(rows)
        costs = (1.0,) * len(rows)
    else:
        differential = {equation for equation, _, _ in model.derivative}
        solvable = _solvable(model, rules)
        in_loop = [rules.loops and equation not in differential for equation in range(len(rows))]
        costs = _costs(model, rules, differential)
    return Steps(
        rows,
        tuple(tuple(own) for own in holders),
        tuple(solvable),
        tuple(in_loop),
        {(equation, unknown): kind for equation, unknown, kind in model.derivative},
        costs,
        all(in_loop) and all(len(own) == len(row) for own, row in zip(solvable, rows, strict=True)),
        rules is not None and rules.integrate,
    )


def _solvable(model: Model, rules: Rules) -> list[frozenset[int]]:
    own: list[set[int]] = [set(row) for row in model.rows]
    if rules.solvable is not None:
        allowed: list[set[int]] = [set() for _ in model.rows]
        for equation, unknown in rules.solvable:
            if not (0 <= equation < len(own) and unknown in own[equation]):
                raise UsageError(f"({equation}, {unknown}) is no entry of the model")
            allowed[equation].add(unknown)
        own = allowed
    else:
        for equation, unknown in model.nonsolvable:
            own[equation].discard(unknown)
    for equation, unknown, kind in model.derivative:
        if kind == "i" or not rules.differentiate:
            own[equation].discard(unknown)
    return [frozenset(unknowns) for unknowns in own]


def _costs(model: Model, rules: Rules, differential: set[int]) -> tuple[float, ...]:
    m = len(model.rows)
    if rules.costs is None:
        return tuple(DERIVATIVE_COST if e in differential else 1.0 for e in range(m))
    if len(rules.costs) != m:
        raise UsageError(f"{len(rules.costs)} costs for {m} equations")
    if not all(cost >= 0 for cost in rules.costs):
        raise UsageError("a cost is negative or not a number")
    return rules.costs


def compute(
    model_steps: Steps, stages: Iterable[Sequence[int]], hint: Mapping[int, int] | None = None
) -> tuple[list[LeftOver], set[int]]:
    """Return the equations left over when all that can be computed is computed.

    Parameters
    ----------
    model_steps : Steps
    stages : iterable of sequence of int
        Equations offered; those of a later stage only when the earlier ones lead no further. An
        equation that no stage offers is not used.
    hint : mapping of int to int, optional
        Disjoint pairs of equation and unknown, as many as possible: they shorten the search for
        loops.

    Returns
    -------
    left_over : list of LeftOver
        By equation.
    used : set of int
        Equations by which an unknown is computed.

    Notes
    -----
    Cost: about a pass over the entries, and a matching for each time that only loops go on.

    References
    ----------
    Knuth, "A generalization of Dijkstra's algorithm", Information Processing Letters 6(1), 1977.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1], [0, 1]])
    >>> compute(steps(model, None), [(0, 1, 2), (3,)])
    ([LeftOver(residual=1, equations=7), LeftOver(residual=3, equations=12)], {0, 2})
    """
    run = _Run(model_steps, hint or {})
    for stage in stages:
        run.offer(stage)
    left_over = [
        LeftOver(equation, run.needs(equation) | 1 << equation)
        for equation in sorted(run.offered)
        if not run.missing[equation] and equation not in run.used
    ]
    return left_over, run.used


class _Run:
    """One computation under way: what is known, and what each known unknown needs."""

    def __init__(self, model_steps: Steps, hint: Mapping[int, int]) -> None:
        self.steps = model_steps
        self._hint = hint
        self.offered: set[int] = set()
        self.used: set[int] = set()
        self.missing = [len(row) for row in model_steps.rows]
        self._missing_sum = [sum(row) for row in model_steps.rows]  # the unknown when one is left
        n = len(model_steps.holders)
        self._known = [False] * n
        self._behind = [0] * n  # bit set of equations
        self._price = [0.0] * n
        self._ready: list[tuple[float, int]] = []
        self._integrated: set[int] = set()
        self._constraint: dict[int, tuple[int, int]] = {}  # state and derivative of each
        if model_steps.integrate:
            ends = sorted((e, kind != "i", u) for (e, u), kind in model_steps.differential.items())
            self._constraint = {
                e: (x, dx) for (e, _, x), (_, _, dx) in zip(ends[::2], ends[1::2], strict=True)
            }

    def offer(self, equations: Sequence[int]) -> None:
        """Take equations in and compute what they allow."""
        self.offered.update(equations)
        for equation in equations:
            if self.missing[equation] == 1:
                self._push(equation)
        self._take_steps()
        while self._take_loops() or (self._constraint and self._integrate()):
            self._take_steps()

    def needs(self, equation: int) -> int:
        """Return the equations from which the known unknowns of an equation are computed."""
        behind = 0
        for unknown in self.steps.rows[equation]:
            behind |= self._behind[unknown]
        return behind

    def _push(self, equation: int) -> None:
        price = self.steps.costs[equation]
        for unknown in self.steps.rows[equation]:
            price += self._price[unknown]
        heappush(self._ready, (price, equation))

    def _learn(self, unknowns: Sequence[int], behind: int, price: float) -> None:
        missing, missing_sum, offered = self.missing, self._missing_sum, self.offered
        for unknown in unknowns:
            self._known[unknown] = True
            self._behind[unknown] = behind
            self._price[unknown] = price
        for unknown in unknowns:
            for equation in self.steps.holders[unknown]:
                missing[equation] -= 1
                missing_sum[equation] -= unknown
                if missing[equation] == 1 and equation in offered:
                    self._push(equation)

    def _take_steps(self) -> None:
        ready, solvable = self._ready, self.steps.solvable
        while ready:
            price, equation = heappop(ready)
            unknown = self._missing_sum[equation]
            if self.missing[equation] == 1 and unknown in solvable[equation]:
                if not self._integrated.isdisjoint(self.steps.rows[equation]):
                    if equation in self._constraint:
                        continue  # what was integrated is not differentiated
                    self._integrated.add(unknown)
                self.used.add(equation)
                self._learn((unknown,), self.needs(equation) | 1 << equation, price)

    def _integrate(self) -> bool:
        """Integrate the cheapest state whose derivative is known, else dynamic loops."""
        alone = [
            (self._price[dx], equation)
            for equation, (x, dx) in self._constraint.items()
            if equation in self.offered and self.missing[equation] == 1 and self._known[dx]
        ]
        if alone:
            price, equation = min(alone)
            self._settle((equation,), (self._constraint[equation][0],), price)
            return True
        pool = [e for e in sorted(self.offered) if self.missing[e] > 1]
        pool = [e for e in pool if self.steps.in_loop[e] or e in self._constraint]
        rows = {e: [u for u in self.steps.rows[e] if not self._known[u]] for e in pool}
        states = {e: self._constraint[e] for e in pool if e in self._constraint}
        taken = False
        for part, solved in dynamic_loops(self.steps, rows, states):
            unknowns = [solved[e] for e in part]
            inside = set(unknowns)
            if any(self._known[u] for u in unknowns) or any(
                self.missing[e] != len(inside.intersection(self.steps.rows[e])) for e in part
            ):
                continue
            self._settle(part, unknowns, 0.0)
            self._take_steps()
            taken = True
        return taken

    def _settle(self, equations: Sequence[int], unknowns: Sequence[int], price: float) -> None:
        """Take some equations together as one step of integration."""
        behind = 0
        for equation in equations:
            behind |= self.needs(equation) | 1 << equation
            price += self.steps.costs[equation]
        self.used.update(equations)
        self._integrated.update(unknowns)
        self._learn(unknowns, behind, price)

    def _take_loops(self) -> bool:
        """Solve loops, and what becomes a single step by them; return whether there were any."""
        known, missing = self._known, self.missing
        pool = [e for e in sorted(self.offered) if missing[e] > 1 and self.steps.in_loop[e]]
        rows = [[u for u in self.steps.rows[equation] if not known[u]] for equation in pool]
        taken = False
        start = [self._hint.get(equation, -1) for equation in pool]
        for loop, unknowns in _loops(rows, start):
            equations = [pool[i] for i in loop]
            inside = set(unknowns)
            if any(known[unknown] for unknown in unknowns) or any(
                missing[e] != len(inside.intersection(self.steps.rows[e])) for e in equations
            ):
                continue  # its turn may come when loops are looked for again
            behind, price = 0, 0.0
            for equation in equations:
                behind |= self.needs(equation) | 1 << equation
                price += self.steps.costs[equation]
                price += sum(self._price[u] for u in self.steps.rows[equation])
            if any(not self._integrated.isdisjoint(self.steps.rows[e]) for e in equations):
                self._integrated.update(unknowns)
            self.used.update(equations)
            self._learn(unknowns, behind, price)
            self._take_steps()
            taken = True
        return taken


def _loops(rows: list[list[int]], start: list[int]) -> Iterator[tuple[list[int], list[int]]]:
    """Yield loops as their rows and unknowns, those that others need first.

    They are the strongly connected parts of the rows that determine all of their unknowns.
    """
    column: dict[int, int] = {}
    local = [[column.setdefault(unknown, len(column)) for unknown in row] for row in rows]
    equation_of, unknown_of = match(local, len(column), [column.get(u, -1) for u in start])
    loose, _ = underdetermined(local, equation_of, unknown_of)
    inside = [i for i, own in enumerate(unknown_of) if own >= 0 and i not in loose]
    needed = {i: [equation_of[c] for c in local[i] if c != unknown_of[i]] for i in inside}
    unknowns = list(column)
    for part in reversed(strong_components(inside, needed)):
        if len(part) > 1:
            yield part, [unknowns[unknown_of[i]] for i in part]


def dynamic_loops(
    model_steps: Steps, rows: Mapping[int, Sequence[int]], states: Mapping[int, tuple[int, int]]
) -> Iterator[tuple[list[int], dict[int, int]]]:
    """Yield loops that can be integrated, as equations and what each is solved for.

    Parameters
    ----------
    model_steps : Steps
    rows : mapping of int to sequence of int
        The equations that may take part, with their unknowns.
    states : mapping of int to (int, int)
        State and derivative of each differential constraint among them.

    Yields
    ------
    part : list of int
    solved : dict of int to int
        Every differential constraint for its state; the others so that they can be computed in
        order once the states are given, algebraic loops among them together.

    References
    ----------
    Svärd, Nyberg, IEEE Trans. SMC-A 40(6), 2010; Frisk, Bregon, Åslund, Krysander, Pulido, Biswas,
    IEEE Trans. SMC-A 42(5), 2012 (integral causality).

    Examples
    --------
    >>> model = Model(("dx = d/dt x", "dx = -x"), ("x", "dx"), ((0, 1), (0, 1)), (),
    ...               ((0, 0, "i"), (0, 1, "d")))
    >>> own = steps(model, Rules(integrate=True))
    >>> list(dynamic_loops(own, {0: (0, 1), 1: (0, 1)}, {0: (0, 1)}))
    [([0, 1], {0: 0, 1: 1})]
    """
    kept = dict(rows)
    while True:
        equations = list(kept)
        column: dict[int, int] = {}
        for row in kept.values():
            for unknown in row:
                column.setdefault(unknown, len(column))
        local = [
            [column[u] for u in ((states[e][0],) if e in states else kept[e])] for e in equations
        ]
        equation_of, unknown_of = match(local, len(column))
        loose, free = underdetermined(local, equation_of, unknown_of)
        lost = [
            e
            for e in equations
            if e in states
            and (column[states[e][1]] in free or equation_of[column[states[e][1]]] < 0)
        ]
        if not lost:
            break
        for equation in lost:
            del kept[equation]
    inside = [i for i, own in enumerate(unknown_of) if own >= 0 and i not in loose]
    names = list(column)
    needed = {
        i: [equation_of[column[u]] for u in kept[equations[i]] if column[u] != unknown_of[i]]
        for i in inside
    }
    solved = {equations[i]: names[unknown_of[i]] for i in inside}
    for group in reversed(strong_components(inside, needed)):
        part = [equations[i] for i in group]
        dynamic = len(part) > 1 and not states.keys().isdisjoint(part)
        if dynamic and not hindered(model_steps, part, solved, states):
            yield part, {equation: solved[equation] for equation in part}


def hindered(
    model_steps: Steps,
    part: Sequence[int],
    solved: Mapping[int, int],
    states: Mapping[int, tuple[int, int]],
) -> list[int]:
    """Return equations of a dynamic loop that cannot be solved when its states are given.

    Parameters
    ----------
    model_steps, solved, states
        As of :func:`dynamic_loops`.
    part : sequence of int

    Returns
    -------
    list of int

    References
    ----------
    As of :func:`dynamic_loops`.

    Examples
    --------
    >>> model = Model(("dx = d/dt x", "dx = -x"), ("x", "dx"), ((0, 1), (0, 1)), (),
    ...               ((0, 0, "i"), (0, 1, "d")), ((1, 1),))
    >>> hindered(steps(model, Rules(integrate=True)), [0, 1], {0: 0, 1: 1}, {0: (0, 1)})
    [1]
    """
    static = [equation for equation in part if equation not in states]
    holder = {solved[equation]: equation for equation in static}
    needs = {
        equation: [
            holder[u] for u in model_steps.rows[equation] if u in holder and u != solved[equation]
        ]
        for equation in static
    }
    for group in strong_components(static, needs):
        if len(group) > 1:
            if not all(model_steps.in_loop[equation] for equation in group):
                return group
        elif solved[group[0]] not in model_steps.solvable[group[0]]:
            return group
    return []
