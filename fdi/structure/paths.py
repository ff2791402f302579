"""Enumerates the minimal sets by alternating paths: no numbers, little memory, the first set soon.

In: rows (one per PSO class), their sets of equations, which of them may be removed. Out: the sets
that ``flats.py`` gives, in the same order. Where that one computes a basis of the left null space
first, which takes time and memory that grow faster than the square of a large model, this one
matches once.

Method: the search removes the first row that may go until redundancy 3 is left. Which rows these
are tells one matching in which rows are used from the last to the first: those left over are the
first independent ones (greedy algorithm of the dual matroid). So the first descent costs nothing
per level. Where redundancy 3 is left, the rows that leave together when one is removed
(``equivalence.py``) are the lines through it, so one pass over the edges gives a set for each.

The trap: a node shares the matching with its parent where it can; it is copied before it changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fdi.structure.equivalence import topmost_dominators
from fdi.structure.incidence import Rows
from fdi.structure.matching import in_order

PASSIVE, ALLOWED, FORBIDDEN = 0, 1, 2  # where rows are equivalent the highest holds


@dataclass(frozen=True, slots=True)
class _Node:
    """Is what is left after some rows were removed.

    ``sources`` are the rows that are neither removed nor matched, as many as the redundancy;
    ``alive`` the rows that alternating paths reach from them, in order of reach.
    """

    equation_of: list[int]
    unknown_of: list[int]
    sources: list[int]
    alive: list[int]
    allowed: set[int]
    forbidden: set[int]


@dataclass(frozen=True, slots=True)
class _Graph:
    """Is the unknowns of each row, and the rows of each unknown."""

    rows: Rows
    holders: list[list[int]]


def minimal_sets(rows: Rows, sets: Sequence[int], may_go: Sequence[bool]) -> Iterator[list[int]]:
    """Yield the minimal sets of one graph component of redundancy 3 or more, some at a time.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of each of the m rows; all overdetermined, no two equivalent.
    sets : sequence of int
        For each row its equations, as a bit set.
    may_go : sequence of bool
        Which rows may be chosen for removal.

    Yields
    ------
    list of int
        Sets of equations, as from :func:`fdi.structure.flats.minimal_sets`. A list may be empty.

    Notes
    -----
    Memory: the model and a matching for each level on the way down, O(m * redundancy) at most.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section V (order of removal); Oxley,
    "Matroid Theory", 2nd ed. 2011, sections 1.6 and 1.8 (transversal matroids, greedy algorithm).

    Examples
    --------
    >>> [s for sets in minimal_sets([[0]] * 4, [1, 2, 4, 8], [True] * 4) for s in sets]
    [12, 10, 6, 9, 5, 3]
    """
    place: dict[int, int] = {}
    own = [[place.setdefault(unknown, len(place)) for unknown in row] for row in rows]
    graph = _Graph(own, _holders(own, len(place)))
    free = {row for row, may in enumerate(may_go) if may}
    last_first = sorted(range(len(own)), key=lambda row: (row in free, -row))
    equation_of, unknown_of = in_order(own, len(place), last_first)
    left_over = [row for row, unknown in enumerate(unknown_of) if unknown < 0]
    levels = len(left_over) - 3
    if not free.issuperset(left_over[:-1]):
        return  # too few may go
    branches = []
    for removed in range(levels):
        branches.append(_first_path(graph, (equation_of, unknown_of), left_over, removed, free))
    sources = left_over[levels:]
    alive = _reached_from(own, equation_of, sources)
    root = _Node(equation_of, unknown_of, sources, alive, free.intersection(alive), set())
    yield from _sets_of_plane(own, sets, root)
    while branches:
        node = next(branches[-1], None)
        if node is None:
            branches.pop()
        elif len(node.sources) > 3:
            branches.append(_children(graph, node))
        else:
            yield from _sets_of_plane(own, sets, node)


def _holders(rows: Rows, n_unknowns: int) -> list[list[int]]:
    holders: list[list[int]] = [[] for _ in range(n_unknowns)]
    for row, unknowns in enumerate(rows):
        for unknown in unknowns:
            holders[unknown].append(row)
    return holders


def _first_path(
    graph: _Graph,
    matching: tuple[list[int], list[int]],
    left_over: list[int],
    removed: int,
    free: set[int],
) -> Iterator[_Node]:
    """Yield the later children of a node of the first path; the first was searched before."""
    rows, (equation_of, unknown_of) = graph.rows, matching
    sources = left_over[removed:]
    alive = _reached_from(rows, equation_of, sources)
    gone = set(alive).difference(_reached_from(rows, equation_of, sources[1:]))
    allowed = free.intersection(alive)
    node = _Node(
        equation_of, unknown_of, sources, alive, allowed - gone, allowed.intersection(gone)
    )
    yield from _children(graph, node)


def _children(graph: _Graph, node: _Node) -> Iterator[_Node]:
    """Yield one node for each class that may be removed."""
    rows, inside = graph.rows, set(node.alive)
    allowed, forbidden = set(node.allowed), set(node.forbidden)
    while len(allowed) >= len(node.sources) - 1 and _hang_together(graph, inside, forbidden):
        equation_of, unknown_of, sources = _without(rows, node, min(allowed))
        alive = _reached_from(rows, equation_of, sources)
        tried = allowed.difference(alive)
        allowed -= tried
        if forbidden.issubset(alive) and _hang_together(graph, set(alive), forbidden):
            yield _Node(equation_of, unknown_of, sources, alive, set(allowed), set(forbidden))
        forbidden |= tried


def _hang_together(graph: _Graph, alive: set[int], some: set[int]) -> bool:
    """Return whether one graph component of the rows that are alive holds all of some.

    A minimal set lies in one component, so where rows that must stay are spread over several there
    is none; without this the search of 4,000 rows looked at 10,000 nodes for each set.
    """
    if len(some) < 2:
        return True
    queue = [next(iter(some))]
    seen, passed, missing = set(queue), set[int](), len(some) - 1
    for row in queue:  # grows while it is walked
        for unknown in graph.rows[row]:
            if unknown in passed:
                continue
            passed.add(unknown)
            for other in graph.holders[unknown]:
                if other in alive and other not in seen:
                    seen.add(other)
                    queue.append(other)
                    missing -= other in some
            if not missing:
                return True
    return False


def _without(rows: Rows, node: _Node, row: int) -> tuple[list[int], list[int], list[int]]:
    """Return matching and sources when a row that is alive is removed."""
    if row in node.sources:
        return node.equation_of, node.unknown_of, [s for s in node.sources if s != row]
    came: dict[int, int] = {}  # through which row a matched one was reached first
    queue = list(node.sources)
    seen = set(queue)
    for here in queue:  # grows while it is walked
        for unknown in rows[here]:
            other = node.equation_of[unknown]
            if other not in seen:
                seen.add(other)
                came[other] = here
                queue.append(other)
        if row in came:
            break
    equation_of, unknown_of = node.equation_of.copy(), node.unknown_of.copy()
    unknown, unknown_of[row] = unknown_of[row], -1
    while row in came:  # each row on the path takes over what the next one was matched to
        row = came[row]
        equation_of[unknown] = row
        unknown, unknown_of[row] = unknown_of[row], unknown
    return equation_of, unknown_of, [s for s in node.sources if s != row]


def _reached_from(rows: Rows, equation_of: list[int], sources: list[int]) -> list[int]:
    """Return the rows that alternating paths reach from some unmatched ones, in order of reach."""
    order = list(sources)
    seen = set(order)
    for row in order:  # grows while it is walked
        for unknown in rows[row]:
            other = equation_of[unknown]
            if other not in seen:
                seen.add(other)
                order.append(other)
    return order


def _sets_of_plane(rows: Rows, sets: Sequence[int], node: _Node) -> Iterator[list[int]]:
    """Yield the minimal sets at redundancy 3: all but the rows of one line."""
    yield []  # gives the caller a chance to stop
    if len(node.allowed) < 2:
        return
    points = _classes(rows, node.equation_of, node.unknown_of, node.alive)
    point_of = {row: k for k, point in enumerate(points) for row in point}
    kinds = [_kind(point, node) for point in points]
    point_sets = [sum(sets[row] for row in point) for point in points]
    everything = sum(point_sets)
    stays = [kind == FORBIDDEN for kind in kinds]  # and what was removed once
    for c, kind in enumerate(kinds):
        if kind != ALLOWED:
            continue
        equation_of, unknown_of, sources = _without(rows, node, points[c][0])
        order = _reached_from(rows, equation_of, sources)
        lines: dict[int, int] = {}  # by their first later point that may be removed
        for line in _classes(rows, equation_of, unknown_of, order):
            others = sorted({point_of[row] for row in line})
            first = next((k for k in others if kinds[k] == ALLOWED), None)
            if first is not None and not any(stays[k] for k in others):
                lines[first] = sum(point_sets[k] for k in others)
        stays[c] = True
        rest = everything ^ point_sets[c]
        yield [rest ^ lines[k] for k in sorted(lines)]


def _kind(point: list[int], node: _Node) -> int:
    if not node.forbidden.isdisjoint(point):
        return FORBIDDEN
    return PASSIVE if node.allowed.isdisjoint(point) else ALLOWED


def _classes(
    rows: Rows, equation_of: list[int], unknown_of: list[int], order: list[int]
) -> list[list[int]]:
    """Return which rows leave together, by their smallest row, each ascending."""
    top = topmost_dominators(rows, equation_of, unknown_of, order)
    groups: dict[int, list[int]] = {}
    for row in sorted(order):
        groups.setdefault(top[row], []).append(row)
    return list(groups.values())
