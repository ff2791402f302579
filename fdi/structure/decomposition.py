"""Splits a model into its over-, just- and underdetermined part, and into graph components.

In: a :class:`~fdi.structure.incidence.Model`, or bare rows. Out: parts, each with its equations and
unknowns. From one maximum matching: the overdetermined part is what alternating paths reach from
unmatched equations, the underdetermined part what they reach from unmatched unknowns, the rest is
just determined, and its strongly connected components are the Hall blocks.

The trap: an equation without unknowns is never matched, so it is overdetermined.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fdi.shown import html_table
from fdi.structure.incidence import Model, Rows, existing
from fdi.structure.loops import strong_components
from fdi.structure.matching import match


@dataclass(frozen=True, slots=True)
class Part:
    """Is a part of a model: its equations and its unknowns, as ascending indices.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> Part((0, 1), (0,)).redundancy
    1
    """

    equations: tuple[int, ...]
    unknowns: tuple[int, ...]

    @property
    def redundancy(self) -> int:
        """Number of equations minus number of unknowns."""
        return len(self.equations) - len(self.unknowns)


@dataclass(frozen=True, slots=True)
class Decomposition:
    """Is the decomposition of Dulmage and Mendelsohn.

    Parameters
    ----------
    over, just, under : Part
        Disjoint; together they hold every equation and every unknown.
    hall : tuple of Part
        Hall blocks of the just-determined part, by their smallest equation: the smallest square
        systems that can be solved one after another.
    rank : int
        Size of a maximum matching.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> decompose(Model.from_matrix([[1, 0], [1, 0], [0, 1]]))
    <Decomposition: over 2 x 1, just 1 x 1, under 0 x 0, redundancy 1, rank 2>
    """

    over: Part
    just: Part
    under: Part
    hall: tuple[Part, ...]
    rank: int

    @property
    def redundancy(self) -> int:
        """Number of equations minus number of unknowns of the overdetermined part."""
        return self.over.redundancy

    def __repr__(self) -> str:
        parts = ", ".join(
            f"{name} {len(part.equations)} x {len(part.unknowns)}"
            for name, part in (("over", self.over), ("just", self.just), ("under", self.under))
        )
        return f"<Decomposition: {parts}, redundancy {self.redundancy}, rank {self.rank}>"

    def _repr_html_(self) -> str:
        parts = [("over", self.over), ("just", self.just), ("under", self.under)]
        parts += [(f"Hall block {k}", block) for k, block in enumerate(self.hall, start=1)]
        cells = [
            (
                name,
                len(part.equations),
                len(part.unknowns),
                _listed(part.equations),
                _listed(part.unknowns),
            )
            for name, part in parts
        ]
        head = ("part", "equations", "unknowns", "which equations", "which unknowns")
        return html_table(repr(self)[1:-1], head, cells)


def decompose(model: Model) -> Decomposition:
    """Return the over-, just- and underdetermined part of a model.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Decomposition

    Notes
    -----
    The parts do not depend on which maximum matching is found. Cost: that of the matching.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> parts = decompose(Model.from_matrix([[1, 0, 0], [1, 0, 0], [1, 1, 1]]))
    >>> parts.over.equations, parts.under.equations, parts.under.unknowns
    ((0, 1), (2,), (1, 2))
    """
    return decompose_rows(model.rows, len(model.unknowns))


def decompose_rows(rows: Rows, n_unknowns: int) -> Decomposition:
    """Return the parts of bare rows, see :func:`decompose`.

    Parameters
    ----------
    rows : sequence of sequences of int
        For each equation the indices of its unknowns.
    n_unknowns : int
        Number of unknowns, n.

    Returns
    -------
    Decomposition

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> decompose_rows(((0,), (0, 1)), 2).hall
    (Part(equations=(0,), unknowns=(0,)), Part(equations=(1,), unknowns=(1,)))
    """
    n = n_unknowns
    equation_of, unknown_of = match(rows, n)
    over = set(reached(rows, equation_of, unknown_of))
    over_unknowns = {unknown for equation in over for unknown in rows[equation]}
    under, under_unknowns = underdetermined(rows, equation_of, unknown_of)
    just = [e for e in range(len(rows)) if e not in over and e not in under]
    just_unknowns = [u for u in range(n) if u not in over_unknowns and u not in under_unknowns]
    return Decomposition(
        _part(over, over_unknowns),
        _part(just, just_unknowns),
        _part(under, under_unknowns),
        _hall_blocks(rows, just, just_unknowns, equation_of),
        sum(equation >= 0 for equation in equation_of),
    )


def overdetermined(rows: Rows) -> tuple[int, ...]:
    """Return the equations of the overdetermined part, ascending.

    Parameters
    ----------
    rows : sequence of sequences of int
        For each equation the indices of its unknowns.

    Returns
    -------
    tuple of int

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> overdetermined(((0,), (0,), (0, 1)))
    (0, 1)
    """
    n_unknowns = 1 + max((unknown for row in rows for unknown in row), default=-1)
    return tuple(sorted(reached(rows, *match(rows, n_unknowns))))


def graph_components(model: Model, equations: Iterable[int] | None = None) -> tuple[Part, ...]:
    """Return the connected parts of the bipartite graph over the given equations.

    Parameters
    ----------
    model : Model
    equations : iterable of int, optional
        By default those of the overdetermined part.

    Returns
    -------
    tuple of Part
        By smallest equation. An equation without unknowns is a graph component of its own.

    Raises
    ------
    UsageError
        When there is no such equation.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, "A Fault Diagnosis Framework for
    MAVLink-Enabled UAVs Using Structural Analysis", 2018, section III.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [0, 1], [1, 0], [0, 1]])
    >>> [part.equations for part in graph_components(model)]
    [(0, 2), (1, 3)]
    """
    chosen = overdetermined(model.rows) if equations is None else existing(model, equations)
    rows = [model.rows[equation] for equation in chosen]
    return tuple(
        _part([chosen[i] for i in group], {unknown for i in group for unknown in rows[i]})
        for group in connected(rows)
    )


def connected(rows: Rows) -> list[list[int]]:
    """Return the rows grouped by shared unknowns, groups by their smallest row.

    Parameters
    ----------
    rows : sequence of sequences of int

    Returns
    -------
    list of list of int
        Each ascending.

    References
    ----------
    As :func:`graph_components`.

    Examples
    --------
    >>> connected(((0,), (1,), (0, 2), ()))
    [[0, 2], [1], [3]]
    """
    holders: dict[int, list[int]] = {}
    for i, row in enumerate(rows):
        for unknown in row:
            holders.setdefault(unknown, []).append(i)
    seen = [False] * len(rows)
    groups: list[list[int]] = []
    for start in range(len(rows)):
        if seen[start]:
            continue
        seen[start] = True
        group = [start]
        for i in group:  # grows while it is walked
            for unknown in rows[i]:
                for other in holders.pop(unknown, ()):
                    if not seen[other]:
                        seen[other] = True
                        group.append(other)
        groups.append(sorted(group))
    return groups


def reached(rows: Rows, equation_of: list[int], unknown_of: list[int]) -> list[int]:
    """Return the equations that alternating paths reach from unmatched ones, in order of reach.

    Parameters
    ----------
    rows : sequence of sequences of int
    equation_of, unknown_of : list of int
        A maximum matching, see :func:`fdi.structure.matching.match`.

    Returns
    -------
    list of int
        The overdetermined part: first the unmatched equations, then breadth first.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> reached(((0,), (0,), (1,)), [0, 2], [0, -1, 1])
    [1, 0]
    """
    order = [equation for equation, unknown in enumerate(unknown_of) if unknown < 0]
    seen = set(order)
    for equation in order:  # grows while it is walked
        for unknown in rows[equation]:
            other = equation_of[unknown]
            if other not in seen:
                seen.add(other)
                order.append(other)
    return order


def underdetermined(
    rows: Rows, equation_of: list[int], unknown_of: list[int]
) -> tuple[set[int], set[int]]:
    """Return the equations and unknowns that alternating paths reach from unmatched unknowns.

    Parameters
    ----------
    rows : sequence of sequences of int
    equation_of, unknown_of : list of int
        A maximum matching, see :func:`fdi.structure.matching.match`.

    Returns
    -------
    equations, unknowns : set of int
        The underdetermined part. Unknowns that occur in no equation belong to it.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958.

    Examples
    --------
    >>> underdetermined(((0,), (1, 2)), [0, 1, -1], [0, 1])
    ({1}, {1, 2})
    """
    holders: dict[int, list[int]] = {}
    for equation, row in enumerate(rows):
        for unknown in row:
            holders.setdefault(unknown, []).append(equation)
    order = [unknown for unknown, equation in enumerate(equation_of) if equation < 0]
    unknowns, equations = set(order), set[int]()
    for unknown in order:  # grows while it is walked
        for equation in holders.get(unknown, ()):
            equations.add(equation)
            if (other := unknown_of[equation]) not in unknowns:
                unknowns.add(other)
                order.append(other)
    return equations, unknowns


def _hall_blocks(
    rows: Rows, just: list[int], just_unknowns: list[int], equation_of: list[int]
) -> tuple[Part, ...]:
    inside = set(just_unknowns)
    arrows = {e: [equation_of[u] for u in rows[e] if u in inside] for e in just}
    block_of: dict[int, int] = {}
    parts = strong_components(just, arrows)
    for k, part in enumerate(parts):
        block_of.update(dict.fromkeys(part, k))
    unknowns: list[list[int]] = [[] for _ in parts]
    for unknown in just_unknowns:
        unknowns[block_of[equation_of[unknown]]].append(unknown)
    blocks = (Part(tuple(e), tuple(u)) for e, u in zip(parts, unknowns, strict=True))
    return tuple(sorted(blocks, key=lambda block: block.equations))


def _listed(indices: tuple[int, ...]) -> str:
    return ", ".join(map(str, indices))


def _part(equations: Iterable[int], unknowns: Iterable[int]) -> Part:
    return Part(tuple(sorted(equations)), tuple(sorted(unknowns)))
