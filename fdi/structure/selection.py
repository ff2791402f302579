"""Finds tests for a purpose, and a small bank that serves all purposes, without listing all tests.

In: a model and, where not every matching will do, rules. Out: a test (an MSO set with the equation
left over) that reacts to one fault and not to another, or a bank of tests that tells apart
whatever tests can tell apart.

A purpose (``purposes.py``) is a fault to react to and equations to do without: those of another
fault, or an assumption. An assumption is an equation that may be violated although nothing failed,
such as a limit. Told from it, a fault keeps a test that does not rely on it: minimal test
supports lose these cross-checks.

Method: computing the model once (``computation.py``) leaves as many equations over as there is
redundancy; each with what it needs is a test, and does without the others that are left over. So
faults are left over in turns, those with most purposes unserved first; what remains is asked for
one by one (``finder.py``); of all tests found a few are chosen (``cover.py``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from random import Random
from typing import Final

import numpy as np

from fdi.structure.computation import LeftOver, Rules
from fdi.structure.cover import cover, greedily
from fdi.structure.finder import Finder
from fdi.structure.incidence import Model, bitset, members, place_of
from fdi.structure.isolability import Mask
from fdi.structure.purposes import Purposes, purposes

SHARE: Final = 0.5
"""Of the tests of one computation those count as found that serve at least this share of what the
best one serves; what the others serve, a later computation may serve better. Ten reference models
need 186 tests in all, 194 with a share of 0."""
PASSES: Final = 6
ENOUGH: Final = 400
"""Tests to choose from; no further pass is begun when there are as many. Each pass takes the faults
in another order: 186 tests instead of the 225 of one pass, and no fewer with twelve."""
EFFORT: Final = 20_000
"""Equations looked at in searches for single columns that led to nothing, before the rest is left
undecided: ten searches at 2,000 equations, each a quarter of a second. It happens only where not
every matching is valid."""
KEPT: Final = 1_000
"""Beyond so many tests only those are kept that were best at something when they were found."""
STALE: Final = 2
"""Computations without a new purpose served after which a pass ends."""
TRIES: Final = 40
TRIES_EFFORT: Final = 20_000
"""Equations that are done without in turn to find a cheaper test, and equations of all of these
computations: ten tries at 2,000 equations."""


@dataclass(frozen=True, slots=True)
class Test:
    """Is a test: a minimal overdetermined set, one equation of which is left over.

    Parameters
    ----------
    equations : int
        Bit set of all its equations; an MSO set.
    residual : int
        The equation left over in one valid sequence. :func:`fdi.structure.sequence.orders` gives
        all of them, with the matchings.
    cost : float
        Sum of the costs of its equations.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008 (MSO sets); Svärd, Nyberg, IEEE Trans.
    SMC-A 40(6), 2010 (sequential residual generators).

    Examples
    --------
    >>> Test(0b101, 2, 2.0).equations
    5
    """

    __test__ = False  # pytest takes every class of such a name for one of its own

    equations: int
    residual: int
    cost: float


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """Is a bank of tests, and what it can do.

    Parameters
    ----------
    tests : tuple of Test
        In order of cost.
    reacts : (n_tests, n_f) bool array
        True where a test reacts to a fault.
    detectable : (n_f,) bool array
    isolable : (n_f, n_f) bool array
        ``[i, j]`` is True when a test reacts to fault i and not to fault j.
    undecided : (n_f, n_f) bool array
        Pairs for which no test was found and none was ruled out; the diagonal stands for
        detection. All False where structure alone decides.

    References
    ----------
    As :func:`select_tests`.

    Examples
    --------
    >>> select_tests(Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1}))
    <Selection of 2 tests: 2 faults detectable, 2 pairs isolable, 0 undecided>
    """

    tests: tuple[Test, ...]
    reacts: Mask
    detectable: Mask
    isolable: Mask
    undecided: Mask

    def __repr__(self) -> str:
        return (
            f"<Selection of {len(self.tests)} tests: {self.detectable.sum()} faults detectable, "
            f"{self.isolable.sum()} pairs isolable, {self.undecided.sum()} undecided>"
        )


def select_tests(
    model: Model, rules: Rules | None = None, *, assumptions: Iterable[int] | None = None
) -> Selection:
    """Return a small bank of tests that tells apart all that tests can tell apart.

    Parameters
    ----------
    model : Model
    rules : Rules, optional
        Which matchings are valid; by default all, so that structure alone decides.
    assumptions : iterable of int, optional
        Equations on which no fault shall rely, if it need not; by default those without a fault
        that hold one unknown and cannot be solved for it, as limits do.

    Returns
    -------
    Selection

    Raises
    ------
    UsageError
        When the rules do not fit the model, or an assumption is no equation of it.

    Notes
    -----
    The number of tests is near the smallest possible, which is NP-hard to find. Where not every
    matching is valid, a pair may remain undecided in a graph component with more than 2,000 MSO
    sets.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008 (isolability); Svärd, Nyberg, Frisk,
    "Realizability constrained selection of residual generators for fault diagnosis with an
    automotive engine application", IEEE Trans. SMC: Systems 43(6), 2013 (greedy selection).

    Examples
    --------
    Two sensors of one quantity, and a limit to it. The limit tells the sensors apart, but may be
    violated by the quantity itself; only their comparison shows that a sensor is wrong.

    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> [members(test.equations) for test in select_tests(model).tests]
    [(0, 2), (1, 2)]
    >>> [members(test.equations) for test in select_tests(model, assumptions=[2]).tests]
    [(0, 1), (0, 2), (1, 2)]
    """
    finder = Finder(model, rules)
    doubtful = finder.limits() if assumptions is None else assumptions
    search = _Search(finder, purposes(model, doubtful))
    search.run()
    return search.selection()


def find_test(
    model: Model,
    fault: int | str,
    without: int | str | None = None,
    *,
    rules: Rules | None = None,
) -> Test | None:
    """Return a cheap test that reacts to one fault and not to another.

    Parameters
    ----------
    model : Model
    fault : int or str
        Index or name of the fault to react to.
    without : int or str, optional
        Index or name of the fault not to react to.
    rules : Rules, optional
        Which matchings are valid and what equations cost; by default all are, and 1.

    Returns
    -------
    Test or None
        None when there is no such test or, where not every matching is valid and the graph
        component has more than 2,000 MSO sets, none was found.

    Raises
    ------
    UsageError
        When there is no such fault, or the rules do not fit the model.

    Notes
    -----
    The cheapest test is NP-hard to find. Steps are taken cheapest first, then the equations of the
    test found are done without in turn, to see whether that makes it cheaper. Against all MSO sets
    of seven reference models the test was the cheapest one for 97 % of the pairs of faults.

    References
    ----------
    Knuth, Information Processing Letters 6(1), 1977 (cheapest first); Krysander, Frisk, IEEE Trans.
    SMC-A 38(6), 2008 (isolability).

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1], [0, 1]], faults={"f": 0, "g": 2})
    >>> members(find_test(model, 0, 1).equations)
    (0, 1, 3)
    >>> find_test(model, "f", "g") == find_test(model, 0, 1)
    True
    """
    wanted = _equations(model, fault)
    avoided = () if without is None else _equations(model, without)
    finder = Finder(model, rules)
    best = _cheapest(finder, wanted, avoided)
    if best is None and not finder.free:
        best = _listed(finder, wanted, avoided)
    if best is None:
        return None
    tried: set[int] = set()
    given_up: list[int] = []
    for _ in range(min(TRIES, TRIES_EFFORT // max(len(finder.over), 1))):
        left = [e for e in members(best.equations) if e not in tried and e not in wanted]
        if not left:
            break
        dearest = max(left, key=lambda e: (finder.steps.costs[e], -e))
        tried.add(dearest)
        # Doing without more than one goes deeper, doing without one alone leaves more to choose.
        for others in (given_up, ()) if given_up else ((),):
            other = _cheapest(finder, wanted, (*avoided, *others, dearest))
            if other is not None and finder.cost(other.equations) < finder.cost(best.equations):
                best = other
                given_up = [*others, dearest]
    return Test(best.equations, best.residual, finder.cost(best.equations))


class _Search:
    """A selection under way: the tests found and the purposes that they do not serve yet."""

    def __init__(self, finder: Finder, aims: Purposes) -> None:
        self.finder = finder
        self.aims = aims
        self.faults = aims.model.faults
        self.wanted = aims.possible()
        self.unserved = self.wanted
        self._found: dict[int, tuple[LeftOver, int]] = {}

    def run(self) -> None:
        """Find tests for all purposes that can be served, and some more to choose from."""
        self._pass(None)
        self._count_all()
        in_vain = 0
        # Detection, the last column, comes first: a fault without any test needs no further search.
        for column in reversed(range(len(self.aims.columns))):
            if self._missing(column) and in_vain * len(self.finder.over) < EFFORT:
                before = self.unserved
                self._ask(column)
                in_vain += before == self.unserved
        self._list()
        for number in range(1, PASSES):
            if len(self._found) >= ENOUGH:
                break
            left = self.unserved
            self.unserved = self.wanted
            self._pass(Random(number))
            self.unserved &= left
        self._count_all()

    def selection(self) -> Selection:
        """Return the smallest bank that can be made of the tests found."""
        n = len(self.faults)
        found = [left for left, _ in self._found.values()]
        sets = [served & self.wanted for _, served in self._found.values()]
        costs = [self.finder.cost(left.equations) for left in found]
        tests = [Test(found[i].equations, found[i].residual, costs[i]) for i in cover(sets, costs)]
        tests.sort(key=lambda test: (test.cost, members(test.equations)))
        served = self.aims.mask(self.wanted & ~self.unserved)
        undecided = self._mask()
        np.fill_diagonal(undecided[:, :n], undecided[:, -1])
        return Selection(
            tuple(tests),
            self.aims.reacts([test.equations for test in tests]),
            served[:, -1],
            served[:, :n],
            undecided[:, :n],
        )

    def _count_all(self) -> None:
        """Mark what the tests serve that did not count when they were found."""
        for _, served in self._found.values():
            self.unserved &= ~served

    def _pass(self, random: Random | None) -> None:
        stale = 0
        while stale < STALE and self.unserved:
            stale = 0 if self._round(random) else stale + 1

    def _round(self, random: Random | None) -> bool:
        """Leave over the faults that are needed most; return whether that served a purpose."""
        n = len(self.faults)
        missing = self._mask()
        need = (missing[:, :n].sum(axis=0) + missing.sum(axis=1)).tolist()
        rank = [-need[i] * (random.uniform(SHARE, 1.0) if random else 1.0) for i in range(n)]
        ranked = sorted((i for i in range(n) if need[i]), key=lambda i: (rank[i], i))
        return self._add(self.finder.leaving(self._equations(ranked)), SHARE)

    def _ask(self, column: int) -> None:
        """Serve what a column lacks, or strike out what no test can serve."""
        finder, avoided = self.finder, self.aims.columns[column]
        lack = self._mask().sum(axis=1)
        others = self._equations(np.argsort(-lack, kind="stable").tolist())
        self._search(
            column,
            lambda own: finder.leaving([*own, *others], avoided),
            lambda own: finder.holding_back(own, avoided),
            lambda own: finder.holding_back([*finder.sensors, *own], avoided),  # loops before them
        )
        self._rule_out(column)
        self._search(
            column,
            lambda own: self._valid(finder.leaving([*own, *others], avoided, loosely=True)),
            lambda own: self._valid(finder.holding_back(own, avoided, loosely=True)),
        )

    def _search(self, column: int, *searches: Callable[[list[int]], list[LeftOver]]) -> None:
        """Search for tests as long as a column lacks some, given the equations of these faults."""
        for search in searches:
            missing = self._missing(column)
            if missing:
                self._add(search(self._equations(missing)))

    def _rule_out(self, column: int) -> None:
        """Strike out what no test can do; a fault no test can react to, altogether."""
        missing = self._missing(column)
        if not missing:
            return
        possible = self.finder.possible(self.aims.columns[column])
        width = len(self.aims.columns)
        what = (1 << width) - 1 if column == width - 1 else 1 << column
        for fault in missing:
            if possible.isdisjoint(self.faults[fault].equations):
                self._strike(what << fault * width)

    def _missing(self, column: int) -> list[int]:
        """Return the faults with a column unserved, except those without any test so far."""
        mask = self._mask()
        if column < len(self.aims.columns) - 1:
            mask[mask[:, -1]] = False
        return [int(fault) for fault in np.flatnonzero(mask[:, column])]

    def _list(self) -> None:
        """Decide what is left by listing the sets of a graph component, where they are few."""
        looked_at: set[int] = set()
        missing = [self.faults[i] for i in np.flatnonzero(self._mask().any(axis=1)).tolist()]
        for part in self.finder.parts:
            if any(not part.isdisjoint(fault.equations) for fault in missing):
                sets, complete = self.finder.listed(part)
                self._add(self._valid([LeftOver(-1, bits) for bits in sets]))
                if complete:
                    looked_at |= part
        row = (1 << len(self.aims.columns)) - 1
        for number, fault in enumerate(self.faults):
            if looked_at.issuperset(self.finder.inside(fault.equations)):
                self._strike(row << number * len(self.aims.columns) & self.unserved)

    def _strike(self, purposes: int) -> None:
        """Give up purposes that no test can serve."""
        self.wanted &= ~purposes
        self.unserved &= ~purposes

    def _valid(self, found: Sequence[LeftOver]) -> list[LeftOver]:
        """Return those that serve a purpose that no earlier one serves and that can be computed."""
        unserved = self.unserved
        valid = []
        for left, served in zip(found, self._served(found), strict=True):
            if served & unserved:
                checked = self.finder.checked(left.equations)
                if checked is not None:
                    valid.append(checked)
                    unserved &= ~served
        return valid

    def _add(self, found: Sequence[LeftOver], share: float = 0.0) -> bool:
        """Keep tests, mark what they serve; return whether they served a purpose."""
        sets = self._served(found)
        costs = [self.finder.cost(left.equations) for left in found]
        best = 0
        taken = set()
        for number, gain in greedily(sets, costs, self.unserved):
            best = best or gain
            if gain < share * best:
                break
            self.unserved &= ~sets[number]
            taken.add(number)
        for number, left in enumerate(found):
            if number in taken or len(self._found) < KEPT:
                self._found.setdefault(left.equations, (left, sets[number]))
        return best > 0

    def _served(self, found: Sequence[LeftOver]) -> list[int]:
        return self.aims.served([left.equations for left in found])

    def _equations(self, faults: Sequence[int]) -> list[int]:
        return [e for fault in faults for e in self.faults[fault].equations]

    def _mask(self) -> Mask:
        """Return the purposes not served yet as an array."""
        return self.aims.mask(self.unserved)


def _cheapest(finder: Finder, wanted: Sequence[int], avoided: Sequence[int]) -> LeftOver | None:
    """Return the cheapest test found that holds one of the wanted equations."""
    mask = bitset(wanted)
    best: LeftOver | None = None
    ways = [
        (last, loosely) for loosely in (False, True)[: 2 - finder.free] for last in (wanted, ())
    ]
    for last, loosely in ways:
        for left in finder.holding_back(last, avoided, loosely=loosely):
            if not left.equations & mask:
                continue
            if best is None or finder.cost(left.equations) < finder.cost(best.equations):
                best = (finder.checked(left.equations) if loosely else left) or best
    return best


def _listed(finder: Finder, wanted: Sequence[int], avoided: Sequence[int]) -> LeftOver | None:
    """Return the cheapest test among the sets of the graph components, where they are few."""
    mask, out = bitset(wanted), bitset(avoided)
    sets = [
        bits
        for part in finder.parts
        if not part.isdisjoint(wanted)
        for bits in finder.listed(part)[0]
        if bits & mask and not bits & out
    ]
    checked = (finder.checked(bits) for bits in sorted(sets, key=finder.cost))
    return next((left for left in checked if left is not None), None)


def _equations(model: Model, fault: int | str) -> tuple[int, ...]:
    return model.faults[place_of(fault, [f.name for f in model.faults], "fault")].equations
