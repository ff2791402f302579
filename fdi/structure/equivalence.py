"""Finds which equations leave the overdetermined part together: the PSO equivalence classes.

In: a model. Out: a partition of its overdetermined part M. Two equations are equivalent when
removing one takes the other out of the overdetermined part too, (M without e)+ = M minus the class
of e; so every PSO subset is a union of classes, and isolability is class membership.

Method: draw an arc from equation r to the equation that is matched to u, for every unknown u of r.
By Menger's theorem e and e' are equivalent exactly when one equation lies on every path from the
unmatched equations to either, that is, when they share their topmost dominator. Only that topmost
dominator is computed, not the tree: see :func:`topmost_dominators`.
"""

from __future__ import annotations

from dataclasses import dataclass

from fdi.shown import html_table
from fdi.structure.decomposition import Part, reached
from fdi.structure.incidence import Model, Rows
from fdi.structure.matching import match


@dataclass(frozen=True, slots=True)
class Classes:
    """Is the partition of the overdetermined part into PSO equivalence classes.

    Parameters
    ----------
    sets : tuple of Part
        By smallest equation. The unknowns of a class are those that no other class contains; it
        has exactly one equation more than such unknowns.
    free : tuple of int
        Unknowns of the overdetermined part that several classes contain.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section IV.

    Examples
    --------
    >>> classes(Model.from_matrix([[1, 0], [1, 1], [0, 1], [0, 1]]))
    <Classes: 3 of 4 equations, 1 free unknowns>
    """

    sets: tuple[Part, ...]
    free: tuple[int, ...]

    def __repr__(self) -> str:
        count = sum(len(part.equations) for part in self.sets)
        return f"<Classes: {len(self.sets)} of {count} equations, {len(self.free)} free unknowns>"

    def _repr_html_(self) -> str:
        cells = [
            (k, ", ".join(map(str, part.equations)), ", ".join(map(str, part.unknowns)))
            for k, part in enumerate(self.sets)
        ]
        return html_table(repr(self)[1:-1], ("class", "equations", "its unknowns"), cells)


def classes(model: Model) -> Classes:
    """Return the PSO equivalence classes of the overdetermined part.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Classes

    Notes
    -----
    One matching and a few passes over the edges, instead of one decomposition per class.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section IV (the classes).

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1], [0, 1]])
    >>> [part.equations for part in classes(model).sets]
    [(0, 1), (2,), (3,)]
    """
    groups = equivalent(model.rows, len(model.unknowns))
    holder: dict[int, int] = {}  # class of an unknown, -1 when several classes contain it
    for k, group in enumerate(groups):
        for equation in group:
            for unknown in model.rows[equation]:
                holder[unknown] = k if holder.get(unknown, k) == k else -1
    inner: list[list[int]] = [[] for _ in groups]
    free: list[int] = []
    for unknown, k in sorted(holder.items()):
        (free if k < 0 else inner[k]).append(unknown)
    return Classes(
        tuple(Part(tuple(g), tuple(u)) for g, u in zip(groups, inner, strict=True)), tuple(free)
    )


def equivalent(rows: Rows, n_unknowns: int) -> list[list[int]]:
    """Return the PSO equivalence classes of bare rows, as lists of equations.

    Parameters
    ----------
    rows : sequence of sequences of int
    n_unknowns : int

    Returns
    -------
    list of list of int
        By smallest equation, each ascending; equations outside the overdetermined part are missing.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section IV.

    Examples
    --------
    >>> equivalent(((0,), (0, 1), (1,), (1,), (2,)), 3)
    [[0, 1], [2], [3]]
    """
    equation_of, unknown_of = match(rows, n_unknowns)
    order = reached(rows, equation_of, unknown_of)
    top = topmost_dominators(rows, equation_of, unknown_of, order)
    groups: dict[int, list[int]] = {}
    for equation in sorted(order):
        groups.setdefault(top[equation], []).append(equation)
    return list(groups.values())


def topmost_dominators(
    rows: Rows, equation_of: list[int], unknown_of: list[int], order: list[int]
) -> list[int]:
    """Return for each equation the topmost one that all paths from unmatched equations pass.

    Parameters
    ----------
    rows : sequence of sequences of int
    equation_of, unknown_of : list of int
        A maximum matching.
    order : list of int
        The overdetermined part in order of reach, see :func:`fdi.structure.decomposition.reached`.

    Returns
    -------
    list of int
        -1 outside ``order``. The topmost dominator may be the equation itself ("top").

    Notes
    -----
    An equation is a top when it is unmatched or has predecessors with different topmost dominators.
    One pass along ``order`` is exact for the arcs that go forward in it. An arc that goes back and
    joins two different classes proves one more top (the two paths differ in their topmost vertex),
    and the pass is repeated until there is none: two to four times on the reference models.

    References
    ----------
    Lengauer and Tarjan, ACM TOPLAS 1(1), 1979, for dominators; the link to classes is Menger's
    theorem on the gammoid dual to the transversal matroid of the equations.

    Examples
    --------
    >>> topmost_dominators(((0,), (0, 1), (1,), (1,)), [0, 1], [0, 1, -1, -1], [2, 3, 1, 0])
    [1, 1, 2, 3]
    """
    arcs = [(e, [equation_of[u] for u in rows[e] if u != unknown_of[e]]) for e in order]
    fixed = [-1] * len(rows)
    for equation in order:
        if unknown_of[equation] >= 0:
            break
        fixed[equation] = equation
    position = [0] * len(rows)
    for i, equation in enumerate(order):
        position[equation] = i
    while True:
        top = fixed.copy()
        proved = False
        for equation, successors in arcs:
            mine = top[equation]
            for other in successors:
                theirs = top[other]
                if theirs in (mine, other):
                    continue
                if position[other] > position[equation]:
                    top[other] = mine if theirs < 0 else other
                else:
                    fixed[other] = other
                    proved = True
        if not proved:
            return top
