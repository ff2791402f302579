"""Enumerates the minimal sets: what is left when as many rows as possible have been removed.

In: the space of ``dual.py`` over some cells, the equations of each cell, and the cells that may be
chosen for removal (all for MSO sets, those with faults for MTES). Out: lists of sets of equations,
each the support of a vector whose zeros are spanned by chosen cells.

Search: remove a cell (and with it every cell that becomes zero, its class), the redundancy drops by
one; a cell once tried is forbidden for its later siblings, so every set is found once. Where
redundancy 3 is left the remaining cells are points of a projective plane, and the minimal sets are
what is left after removing a line through two of them: all lines come from the slopes between
pairs of points, about 1 microsecond each, instead of one decomposition per set.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fdi.structure.dual import without
from fdi.structure.field import WIDTH, P, cells, inverses, nonzero, ones


@dataclass(frozen=True, slots=True)
class Space:
    """Is a dual space to be searched.

    Parameters
    ----------
    vectors : tuple of int
        Generic basis, packed; three or more.
    sets : tuple of int
        For each of the m cells its equations, as a bit set.
    chosen : int
        Mask of the cells that may be chosen for removal.

    References
    ----------
    Oxley, "Matroid Theory", 2nd ed. 2011, section 2.2 (representations of the dual); Krysander,
    Åslund, Frisk, DX-10, 2010 (only equations with faults are removed).

    Examples
    --------
    >>> from fdi.structure.dual import null_space
    >>> Space(tuple(null_space(((0,),) * 4)), (1, 2, 4, 8), ones(4)).sets
    (1, 2, 4, 8)
    """

    vectors: tuple[int, ...]
    sets: tuple[int, ...]
    chosen: int


@dataclass(frozen=True, slots=True)
class Node:
    """Is a node of the search: a space from which cells were removed.

    Parameters
    ----------
    vectors : list of int
        Basis of what is left.
    alive, allowed, forbidden : int
        Masks of cells: not zero; of the chosen ones those that may still be removed; those that
        must stay.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section V (the set R).

    Examples
    --------
    >>> Node([1 + (1 << 128)], ones(2), ones(2), 0).alive == ones(2)
    True
    """

    vectors: list[int]
    alive: int
    allowed: int
    forbidden: int


@dataclass(frozen=True, slots=True)
class _Points:
    """Are the cells as points of a plane, proportional cells merged into one point."""

    x: list[int]
    y: list[int]  # different for different points
    sets: list[int]
    chosen: list[int]  # indices of the points that may be removed
    forbidden: list[int]
    passive: list[int]  # go only together with chosen ones


def minimal_sets(space: Space) -> Iterator[list[int]]:
    """Yield the minimal sets of a space, some at a time.

    Parameters
    ----------
    space : Space

    Yields
    ------
    list of int
        Sets of equations as bit sets; each occurs once over all lists, in an order that depends
        on the input alone. A list may be empty.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section V (order of removal);
    Krysander, Åslund, Frisk, DX-10, 2010 (MTES).

    Examples
    --------
    >>> from fdi.structure.dual import null_space
    >>> space = Space(tuple(null_space(((0,),) * 4)), (1, 2, 4, 8), ones(4))
    >>> [s for sets in minimal_sets(space) for s in sets]
    [12, 10, 6, 9, 5, 3]
    """
    ones_mask = ones(len(space.sets))
    alive = nonzero(space.vectors[0], ones_mask)
    root = Node(list(space.vectors), alive, alive & space.chosen, 0)
    branches = [iter((root,))]  # children are made when their turn comes, to save memory
    while branches:
        node = next(branches[-1], None)
        if node is None:
            branches.pop()
        elif len(node.vectors) > 3:
            branches.append(_children(node, ones_mask))
        else:
            yield from sets_of_plane(node, space.sets)


def _children(node: Node, ones_mask: int) -> Iterator[Node]:
    """Yield one node for each class that may be removed."""
    allowed, forbidden = node.allowed, node.forbidden
    needed = len(node.vectors) - 1
    while allowed.bit_count() >= needed:
        cell = (allowed & -allowed).bit_length() - 1
        vectors = without(node.vectors, cell, ones_mask)
        alive = nonzero(vectors[0], ones_mask)
        if forbidden & alive == forbidden:
            yield Node(vectors, alive, allowed & alive, forbidden)
        tried = allowed & ~alive
        allowed ^= tried
        forbidden |= tried


def sets_of_plane(node: Node, sets: tuple[int, ...]) -> Iterator[list[int]]:
    """Yield the minimal sets at redundancy 3: all but the points of one line.

    Parameters
    ----------
    node : Node
        With three vectors.
    sets : tuple of int
        Equations of each cell.

    Yields
    ------
    list of int

    References
    ----------
    As :func:`minimal_sets`.

    Examples
    --------
    >>> from fdi.structure.dual import null_space
    >>> node = Node(null_space(((0,),) * 4), ones(4), ones(4), 0)
    >>> [s for sets in sets_of_plane(node, (1, 2, 4, 8)) for s in sets]
    [12, 10, 6, 9, 5, 3]
    """
    if node.allowed.bit_count() < 2:
        yield []  # gives the caller a chance to stop
        return
    points = _points(node, sets)
    everything = sum(points.sets)
    covered: dict[int, set[int]] = {}  # for a point those that share a line with an earlier one
    for rank, c in enumerate(points.chosen):
        later = points.chosen[rank + 1 :]
        if c in covered:
            later = [i for i in later if i not in covered[c]]
        if later:
            lines = _lines_through(c, later, points, covered)
            rest = everything ^ points.sets[c]
            yield [rest ^ line for line in lines]


def _lines_through(
    c: int, later: list[int], points: _Points, covered: dict[int, set[int]]
) -> list[int]:
    """Return the sets of the lines through c and a later point, c itself left out."""
    x, y, sets = points.x, points.y, points.sets
    x_c, y_c = x[c], y[c]
    others = later + points.passive + points.forbidden
    slopes = [
        (x[i] - x_c) * inverse % P
        for i, inverse in zip(others, inverses([y[i] - y_c for i in others]), strict=True)
    ]
    lines: dict[int, int] = {}
    shared: dict[int, list[int]] = {}  # most lines hold two points, so this stays small
    first: dict[int, int] = {}
    for i, slope in zip(later, slopes, strict=False):
        if slope in lines:
            lines[slope] |= sets[i]
            shared.setdefault(slope, [first[slope]]).append(i)
        else:
            lines[slope] = sets[i]
            first[slope] = i
    for line in shared.values():
        for j, i in enumerate(line):
            covered.setdefault(i, set()).update(line[j + 1 :])
    n = len(later)
    for i, slope in zip(points.passive, slopes[n:], strict=False):
        if slope in lines:
            lines[slope] |= sets[i]
    for slope in slopes[n + len(points.passive) :]:
        lines.pop(slope, None)
    return list(lines.values())


def _points(node: Node, sets: tuple[int, ...]) -> _Points:
    """Return the cells in coordinates in which the first vector is 1 everywhere."""
    m = len(sets)
    kind_of = _flags(node.forbidden << 1 | node.allowed, m)
    alive = _indices(node.alive, m)
    z, middle, last = (cells(vector, m) for vector in (node.vectors[0], *node.vectors[-2:]))
    place: dict[int, int] = {}
    x, point_sets, kinds = list[int](), list[int](), list[int]()
    for k, scale in zip(alive, inverses([z[k] for k in alive]), strict=True):
        y = last[k] * scale % P
        i = place.setdefault(y, len(x))
        if i == len(x):
            x.append(middle[k] * scale % P)
            point_sets.append(sets[k])
            kinds.append(kind_of[k])
        else:
            point_sets[i] |= sets[k]
            kinds[i] = max(kinds[i], kind_of[k])
    passive, chosen, forbidden = ([i for i, k in enumerate(kinds) if k == own] for own in range(3))
    return _Points(x, list(place), point_sets, chosen, forbidden, passive)


def _flags(mask: int, n: int) -> bytes:
    """Return the lowest byte of each cell."""
    return mask.to_bytes(n * WIDTH // 8, "little")[:: WIDTH // 8]


def _indices(mask: int, n: int) -> list[int]:
    """Return the numbers of the cells in a mask, ascending."""
    return [k for k, flag in enumerate(_flags(mask, n)) if flag]
