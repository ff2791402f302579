"""Draws a fair sample of the minimal sets where there are too many to list.

In: a model and how many sets are wanted. Out: MSO sets or MTES, drawn independently, each of all
sets with the same probability, and an estimate of how many there are.

Method: the search tree of ``flats.py`` holds every set once. Of each branch an upper bound of the
sets in it is known beforehand, C(n, k) where k of n cells are to be removed. A draw descends from
the root, to each branch with the probability of its bound; where a branch turns out to hold at most
a part of what its bound says, the draw goes on with the probability of that part and is otherwise
thrown away. So a draw ends at any set with probability 1 / bound of the root, whatever the bounds
are. They are kept and corrected as branches become known, so that ever fewer draws are thrown away.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import comb
from random import Random
from typing import Final, Literal

from fdi.errors import UsageError
from fdi.structure.dual import null_space, without
from fdi.structure.field import WIDTH, nonzero, ones
from fdi.structure.flats import Node, sets_of_plane
from fdi.structure.incidence import Model
from fdi.structure.search import search
from fdi.structure.testsets import Group, mso_groups, mtes_groups

MAX_DRAWS: Final = 100_000
"""Draws thrown away or not; about 0.2 ms each."""
MAX_KEPT: Final = 4_000
"""Branches of which the bounds are kept: 70 MB at redundancy 20 and 56 classes."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Is a fair sample of minimal sets.

    Parameters
    ----------
    sets : tuple of int
        Bit sets of equations in the order drawn; one may occur again.
    estimate : float
        How many sets there are: its expectation is their number.
    bound : int
        There are not more.
    draws : int
        How many were made for it.

    References
    ----------
    As :func:`sample_sets`.

    Examples
    --------
    >>> sample_sets(Model.from_matrix([[1], [1]]), 1)
    Sample(sets=(3,), estimate=1.0, bound=1, draws=1)
    """

    sets: tuple[int, ...]
    estimate: float
    bound: int
    draws: int


def sample_sets(
    model: Model,
    size: int,
    *,
    kind: Literal["mso", "mtes"] = "mso",
    seed: int = 0,
    max_draws: int = MAX_DRAWS,
) -> Sample:
    """Return a fair sample of the MSO sets or MTES, without listing them.

    Parameters
    ----------
    model : Model
    size : int
        How many are wanted.
    kind : {"mso", "mtes"}
    seed : int
        The same one gives the same sample.
    max_draws : int
        After so many draws the search ends.

    Returns
    -------
    Sample
        Empty when the model has no such set.

    Raises
    ------
    UsageError
        When fewer than ``size`` of ``max_draws`` draws led to a set, or an argument is wrong.

    Notes
    -----
    Draws are independent and uniform over all sets.

    References
    ----------
    Knuth, "Estimating the efficiency of backtrack programs", Mathematics of Computation 29(129),
    1975 (random descents); Gilks, Wild, Applied Statistics 41(2), 1992 (bounds that adapt).

    Examples
    --------
    >>> model = Model.from_matrix([[1], [1], [1], [1]])
    >>> sample = sample_sets(model, 1000)
    >>> sorted(set(sample.sets))
    [3, 5, 6, 9, 10, 12]
    >>> sample.estimate
    6.0
    """
    if kind not in ("mso", "mtes"):
        raise UsageError(f"there is no kind {kind!r} of sets", hint="mso or mtes")
    if size < 0 or max_draws < size:
        raise UsageError(f"{size} sets cannot be drawn with {max_draws} draws")
    random = Random(seed)
    tree = _Tree(mso_groups(model) if kind == "mso" else mtes_groups(model))
    sets: list[int] = []
    total = draws = 0
    while len(sets) < size and tree.bound:
        if draws == max_draws:
            raise UsageError(
                f"{len(sets)} of {draws} draws led to a set, {size} are wanted",
                hint="raise max_draws, or ask for fewer",
            )
        draws += 1
        bound = tree.bound
        found = tree.draw(random)
        if found is not None:
            sets.append(found)
            total += bound
    return Sample(tuple(sets), total / max(draws, 1), tree.bound, draws)


@dataclass(slots=True)
class _Branch:
    """A node of the search tree: all its sets, or the cells whose removal leads on from it."""

    sets: list[int]
    node: Node | None
    cells: list[int]
    bounds: list[int]  # of the branches behind each cell; at the leaves none
    known: dict[int, _Branch]

    @property
    def bound(self) -> int:
        return len(self.sets) + sum(self.bounds)


class _Tree:
    """The search trees of all groups, as far as they were visited."""

    def __init__(self, groups: Iterable[Group]) -> None:
        self._groups = list(groups)
        self._ones = [ones(len(group.sets)) for group in self._groups]
        self._roots = [self._root(i) for i in range(len(self._groups))]
        self._kept = 0
        self.bound = sum(root.bound for root in self._roots)

    def draw(self, random: Random) -> int | None:
        """Return one of all sets with probability 1 / bound each, or None."""
        place = random.randrange(self.bound)
        for number, root in enumerate(self._roots):
            if place < root.bound:
                before = root.bound
                found = self._descend(number, root, place)
                self.bound += root.bound - before
                return None if found is None else found | self._groups[number].always
            place -= root.bound
        raise AssertionError("the bound is the sum of those of the groups")

    def _root(self, number: int) -> _Branch:
        group = self._groups[number]
        redundancy = len(group.rows) - len({u for row in group.rows for u in row})
        if redundancy < 3:
            batches = search(group.rows, group.sets, group.may_go, compiled=False)
            return _Branch([one for batch in batches for one in batch], None, [], [], {})
        vectors = null_space(group.rows)
        alive = nonzero(vectors[0], self._ones[number])
        chosen = sum(1 << WIDTH * k for k, may in enumerate(group.may_go) if may)
        return self._branch(number, Node(vectors, alive, alive & chosen, 0))

    def _branch(self, number: int, node: Node) -> _Branch:
        if len(node.vectors) <= 3:
            batches = sets_of_plane(node, tuple(self._groups[number].sets))
            return _Branch([one for batch in batches for one in batch], None, [], [], {})
        cells = [k for k in range(len(self._groups[number].sets)) if node.allowed >> WIDTH * k & 1]
        left, needed = len(cells), len(node.vectors) - 1
        bounds = [comb(left - 1 - rank, needed - 1) for rank in range(left)]
        return _Branch([], node, cells, bounds, {})

    def _descend(self, number: int, root: _Branch, place: int) -> int | None:
        """Return the set at a place below the bound, or None where there is none."""
        path: list[tuple[_Branch, int]] = []
        branch: _Branch | None = root
        kept = True
        while branch is not None and branch.node is not None:
            rank = 0
            while place >= branch.bounds[rank]:
                place -= branch.bounds[rank]
                rank += 1
            after = branch.known.get(rank)
            if after is None:
                after = self._after(number, branch.node, branch.cells[: rank + 1])
                kept = kept and self._kept < MAX_KEPT
                if kept and after is not None:
                    branch.known[rank] = after
                    self._kept += 1
                # A place is uniform below the old bound, so it is below the new one with the
                # probability of their ratio, and then uniform below that.
                branch.bounds[rank] = 0 if after is None else after.bound
            if kept:
                path.append((branch, rank))
            branch = after
            if branch is not None and place >= branch.bound:
                branch = None
        found = None if branch is None else branch.sets[place]
        for above, rank in reversed(path):
            below = above.known.get(rank)
            above.bounds[rank] = 0 if below is None else below.bound
        return found

    def _after(self, number: int, node: Node, cells: list[int]) -> _Branch | None:
        """Return what the removal of the last of some cells leads to; the others have to stay."""
        ones_mask = self._ones[number]
        *before, cell = cells
        vectors = without(node.vectors, WIDTH * cell, ones_mask)
        alive = nonzero(vectors[0], ones_mask)
        forbidden = node.forbidden | sum(1 << WIDTH * k for k in before)
        if forbidden & alive != forbidden:
            return None
        return self._branch(
            number, Node(vectors, alive, node.allowed & alive & ~forbidden, forbidden)
        )
