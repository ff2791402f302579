"""Which tests does one computation of a model leave behind?

In: a model and rules. Out: equations left over, each with what it needs. The caller says what is
not to be used, and what is better left over than used. Three ways, each for what the one before
cannot find:

1. in computing order, by the rules: every test is valid as it comes;
2. as if any entry that could be in a loop, because it lies on a cycle, could be solved along alone:
   the set is a test, and valid where one of its equations can be left over by the rules. This finds
   loops of equations that cannot be solved alone, of whose unknowns some are shown as well. What it
   cannot compute, no valid test holds;
3. by listing the MSO sets of a graph component, up to a limit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import islice
from math import comb
from typing import Final

from fdi.structure.computation import LeftOver, Rules, Steps, compute, steps
from fdi.structure.decomposition import graph_components, overdetermined
from fdi.structure.equivalence import equivalent
from fdi.structure.incidence import Model, bitset, members, submodel
from fdi.structure.leaving import Leaver
from fdi.structure.loops import on_cycles
from fdi.structure.sequence import Order, arrange, orders
from fdi.structure.testsets import mso_sets

MAX_LISTED: Final = 2_000
"""MSO sets of a graph component that are listed where nothing else decides."""
STAGES: Final = 8
"""Steps in which equations held back are offered, where not every matching is valid: what is not
needed stays left over. All at once, a random model of 500 equations of which 2 % of the entries are
not solvable needed 462 tests instead of 68."""
MAX_CHECKED: Final = 64
"""Equations that a set may have to be checked with each of them left over."""
MAX_CHAIN: Final = 16
"""Equations of a larger set that are left over in turn."""
MAX_BOUND: Final = 10**8
"""Bound on the sets of a graph component, C(classes, redundancy - 1), up to which they are listed:
one with 600 classes and redundancy 30 took 45 ms for each set."""


class Finder:
    """Finds tests of a model; keeps what the searches share.

    Parameters
    ----------
    model : Model
    rules : Rules or None
        None allows every matching.

    References
    ----------
    Svärd, Nyberg, IEEE Trans. SMC-A 40(6), 2010; Oxley, "Matroid Theory", 2nd ed. 2011, section
    1.2 (fundamental circuits: an equation left over and what it needs).

    Examples
    --------
    >>> finder = Finder(Model.from_matrix([[1], [1], [1]]), None)
    >>> [found.equations for found in finder.leaving([0, 1])]
    [5, 6]
    """

    def __init__(self, model: Model, rules: Rules | None) -> None:
        self.model = model
        self.steps = steps(model, rules)
        self.over = overdetermined(model.rows)
        self.sensors = [e for e in self.over if len(model.rows[e]) == 1]
        self._loose = _loosened(self.steps, self.over)
        self._leaver = Leaver(model.rows, self.steps.holders, self.over)
        self._class_of: dict[int, int] = {}
        for number, group in enumerate(equivalent(model.rows, len(model.unknowns))):
            self._class_of.update(dict.fromkeys(group, number))
        self.parts = [frozenset(part.equations) for part in graph_components(model, self.over)]
        self._masks: dict[float, int] = {}
        for equation, cost in enumerate(self.steps.costs):
            self._masks[cost] = self._masks.get(cost, 0) | 1 << equation

    @property
    def free(self) -> bool:
        """Whether structure alone decides."""
        return self.steps.free

    def limits(self) -> list[int]:
        """Return the equations without a fault that hold one unknown and can only be compared."""
        faulty = {equation for fault in self.model.faults for equation in fault.equations}
        return [
            equation
            for equation, row in enumerate(self.model.rows)
            if len(row) == 1 and equation not in faulty and not self.steps.solvable[equation]
        ]

    def leaving(
        self, preferred: Iterable[int], avoided: Sequence[int] = (), *, loosely: bool = False
    ) -> list[LeftOver]:
        """Return tests without the avoided equations, preferred ones left over together.

        Parameters
        ----------
        preferred : iterable of int
            The most wanted first; as many are left over as fit together.
        avoided : sequence of int
        loosely : bool
            The second way (see above) instead of the first.

        Returns
        -------
        list of LeftOver
        """
        wanted: list[int] = []
        seen: set[int] = set()  # of equivalent equations only one can be left over
        for equation in (*avoided, *preferred):
            number = self._class_of.get(equation)
            if number is not None and number not in seen:
                seen.add(number)
                wanted.append(equation)
        kept_back = [e for e in self._leaver.leave(wanted) if e not in avoided]
        return self.holding_back(kept_back[::-1], avoided, loosely=loosely)

    def holding_back(
        self, last: Sequence[int], avoided: Sequence[int] = (), *, loosely: bool = False
    ) -> list[LeftOver]:
        """Return tests without the avoided equations, the last used only where all others fail.

        Parameters
        ----------
        last : sequence of int
            Of equal costs the first is used first.
        avoided : sequence of int
        loosely : bool

        Returns
        -------
        list of LeftOver
        """
        out = {*last, *avoided}
        first = [equation for equation in self.over if equation not in out]
        late = [e for e in last if e in self._class_of and e not in avoided]
        size = len(late) if self.free else max(1, len(late) // STAGES)
        stages = [first, *(late[k : k + size] for k in range(0, len(late), size or 1))]
        found, _ = compute(self._loose if loosely else self.steps, stages, self._leaver.unknown_of)
        return found

    def possible(self, avoided: Sequence[int]) -> set[int]:
        """Return the equations that a valid test without the avoided ones may hold: no others do.

        Parameters
        ----------
        avoided : sequence of int

        Returns
        -------
        set of int

        Notes
        -----
        What the second way cannot use or is not overdetermined falls away, and with it cycles, so
        that more may fall away; what is left when that ends is returned.
        """
        left = [equation for equation in self.over if equation not in avoided]
        while True:
            found, used = compute(_loosened(self.steps, left), [left])
            usable = sorted(used.union(one.residual for one in found))
            kept = [usable[i] for i in overdetermined([self.model.rows[e] for e in usable])]
            if len(kept) == len(left):
                return set(kept)
            left = kept

    def checked(self, equations: int) -> LeftOver | None:
        """Return a set with an equation that can be left over by the rules, or None.

        Parameters
        ----------
        equations : int
            Bit set of a minimal overdetermined set.

        Returns
        -------
        LeftOver or None
            None for a set of more than 64 equations also where the chain of equations that stand
            in the way, each left over in turn, comes to no end.
        """
        own = members(equations)
        if len(own) <= MAX_CHECKED:
            found = (order for order in orders(self.steps, own) if isinstance(order, Order))
            order = next(found, None)
            return None if order is None else LeftOver(order.residual, equations)
        residual, tried = own[0], set[int]()
        while residual not in tried and len(tried) < MAX_CHAIN:
            tried.add(residual)
            result = arrange(self.steps, [e for e in own if e != residual], residual)
            if isinstance(result, Order):
                return LeftOver(residual, equations)
            residual = result.equations[0] if result.equations else residual
        return None

    def listed(self, part: frozenset[int]) -> tuple[list[int], bool]:
        """Return the MSO sets of a graph component, and whether these are all.

        Parameters
        ----------
        part : frozenset of int
            One of ``parts``.

        Returns
        -------
        sets : list of int
            Bit sets of the model's equations.
        complete : bool
        """
        equations = sorted(part)
        classes = len({self._class_of[equation] for equation in part})
        redundancy = len(part) - len({u for e in part for u in self.model.rows[e]})
        if comb(classes, redundancy - 1) > MAX_BOUND:
            return [], False
        found = mso_sets(submodel(self.model, equations))
        sets = [bitset(equations[i] for i in members(bits)) for bits in islice(found, MAX_LISTED)]
        return sets, next(found, None) is None

    def cost(self, equations: int) -> float:
        """Return the sum of the costs of a bit set of equations."""
        return sum(cost * (equations & mask).bit_count() for cost, mask in self._masks.items())

    def inside(self, equations: Iterable[int]) -> set[int]:
        """Return those equations that lie in the overdetermined part."""
        return {equation for equation in equations if equation in self._class_of}


def _loosened(own: Steps, over: Sequence[int]) -> Steps:
    """Return the steps when any entry may be solved along that could be in a loop."""
    looped = [equation for equation in over if own.integrate or own.in_loop[equation]]
    inside = on_cycles({equation: own.rows[equation] for equation in looped})
    more: list[set[int]] = [set() for _ in own.rows]
    for equation, unknown in inside:
        more[equation].add(unknown)
    if own.integrate:
        for equation, unknown in own.differential:
            more[equation].add(unknown)
    solvable = tuple(alone | loose for alone, loose in zip(own.solvable, more, strict=True))
    if own.integrate:
        return replace(own, solvable=solvable, differential={}, in_loop=(True,) * len(own.rows))
    return replace(own, solvable=solvable)
