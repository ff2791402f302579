"""Finds the smallest sets of equations that can be tested: MSO sets, and MTES for a set of faults.

In: a model. Out: iterators over bit sets of equations (bit i is equation i), in an order that
depends on the model alone, one graph component after the other. The steps: equivalence classes
(``equivalence.py``) are lumped to one row each, the lumped graph is split into its connected parts,
and each part is searched (``search.py``).

An MSO set is an overdetermined set without a smaller one inside. An MTES is a smallest set of
equations with faults that holds all that can be said about these faults: equations without faults
that are overdetermined among themselves belong to every MTES of the model.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import comb

from fdi.errors import UsageError
from fdi.structure.decomposition import connected, graph_components, overdetermined
from fdi.structure.equivalence import equivalent
from fdi.structure.incidence import Model, bitset
from fdi.structure.search import search


def mso_sets(
    model: Model, *, limit: int | None = None, compiled: bool | None = None
) -> Iterator[int]:
    """Return all minimal structurally overdetermined sets.

    Parameters
    ----------
    model : Model
    limit : int, optional
        The most sets that are wanted.
    compiled : bool, optional
        Whether compiled code searches (extra ``fast``); by default when it pays, see
        ``search.py``. The result is the same.

    Returns
    -------
    iterator of int
        Bit sets of equations, see :func:`fdi.structure.incidence.members`.

    Raises
    ------
    UsageError
        While iterating, when there are more than ``limit`` sets, or compiled code is asked for
        and not there.

    Notes
    -----
    Their number grows exponentially with the redundancy of a graph component.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, 197-206.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 1], [0, 1], [0, 1]])
    >>> [bin(found) for found in mso_sets(model)]
    ['0b1100', '0b1011', '0b111']
    """
    return _limited(_batches(mso_groups(model), compiled), limit, "MSO sets")


def mtes_sets(
    model: Model,
    *,
    limit: int | None = None,
    by_component: bool = False,
    compiled: bool | None = None,
) -> Iterator[int]:
    """Return all minimal test equation supports.

    Parameters
    ----------
    model : Model
        Supports are counted in equations that carry faults: two faults of one equation count as
        one, a fault in two equations as two.
    limit : int, optional
        The most sets that are wanted.
    by_component : bool
        By definition a set takes in every fault-free overdetermined equation of the model, even
        those that share no unknown with it. If true, each graph component is taken as a model of
        its own, as Zogopoulos-Papaliakos et al. 2018 do.
    compiled : bool, optional
        As for :func:`mso_sets`.

    Returns
    -------
    iterator of int
        Bit sets of equations.

    Raises
    ------
    UsageError
        While iterating, when there are more than ``limit`` sets, or compiled code is asked for
        and not there.

    References
    ----------
    Krysander, Åslund, Frisk, 21st Workshop on Principles of Diagnosis (DX-10), 2010.

    Examples
    --------
    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> [bin(found) for found in mtes_sets(model)]
    ['0b110', '0b101']
    """
    if not by_component:
        groups = mtes_groups(model)
    else:
        parts = graph_components(model)
        groups = (group for part in parts for group in mtes_groups(model, part.equations))
    return _limited(_batches(groups, compiled), limit, "MTES")


def count_bound(model: Model) -> int:
    """Return an upper bound on the number of MTES, from counts alone.

    Parameters
    ----------
    model : Model

    Returns
    -------
    int
        Sum over the graph components of the overdetermined part of C(n_f, k), k = 0..phi-1, where
        n_f equations of the component carry faults and phi is its redundancy.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, "A Fault Diagnosis Framework for
    MAVLink-Enabled UAVs Using Structural Analysis", 2018, equation (5).

    Examples
    --------
    >>> count_bound(Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1}))
    3
    """
    faulty = {equation for fault in model.faults for equation in fault.equations}
    total = 0
    for part in graph_components(model):
        n_faulty = len(faulty.intersection(part.equations))
        total += sum(comb(n_faulty, k) for k in range(min(part.redundancy, n_faulty + 1)))
    return total


def _limited(batches: Iterable[list[int]], limit: int | None, what: str) -> Iterator[int]:
    if limit is None:
        for batch in batches:
            yield from batch
        return
    count = 0
    for batch in batches:
        count += len(batch)
        if count > limit:
            raise UsageError(
                f"more than {limit} {what} ({count} found so far)",
                hint="raise the limit, or draw some with sample_sets",
            )
        yield from batch


@dataclass(frozen=True, slots=True)
class Group:
    """Is a connected part of the lumped graph, within which minimal sets lie.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of each class.
    sets : sequence of int
        Equations of each class, as bit sets.
    may_go : sequence of bool
        Which classes may be chosen for removal.
    always : int
        Equations that belong to every set beside.

    References
    ----------
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, section IV (lumping of classes).

    Examples
    --------
    >>> next(mso_groups(Model.from_matrix([[1], [1], [1]]))).sets
    [1, 2, 4]
    """

    rows: Sequence[Sequence[int]]
    sets: Sequence[int]
    may_go: Sequence[bool]
    always: int = 0


def mso_groups(model: Model) -> Iterator[Group]:
    """Yield the groups of classes that each hold MSO sets.

    Parameters
    ----------
    model : Model

    Yields
    ------
    Group

    References
    ----------
    As :class:`Group`.

    Examples
    --------
    >>> len(list(mso_groups(Model.from_matrix([[1, 0], [1, 0], [0, 1], [0, 1]]))))
    2
    """
    sets, rows = _lumped(model, range(len(model.rows)))
    for group in connected(rows):
        yield Group([rows[k] for k in group], [sets[k] for k in group], [True] * len(group))


def mtes_groups(model: Model, equations: Sequence[int] | None = None) -> Iterator[Group]:
    """Yield the groups of classes that each hold MTES.

    Parameters
    ----------
    model : Model
    equations : sequence of int, optional
        Those of the model that count; by default all.

    Yields
    ------
    Group

    References
    ----------
    As :class:`Group`; Krysander, Åslund, Frisk, DX-10, 2010.

    Examples
    --------
    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> next(mtes_groups(model)).may_go
    [True, True, False]
    """
    faulty = bitset(equation for fault in model.faults for equation in fault.equations)
    sets, rows = _lumped(model, range(len(model.rows)) if equations is None else equations)
    fault_free = [k for k, members in enumerate(sets) if not members & faulty]
    known = [fault_free[i] for i in overdetermined([rows[k] for k in fault_free])]
    always = sum(sets[k] for k in known)
    determined = {unknown for k in known for unknown in rows[k]}
    left = sorted(set(range(len(sets))).difference(known))
    rows = [[u for u in rows[k] if u not in determined] for k in left]
    sets = [sets[k] for k in left]
    for group in connected(rows):
        some = [sets[k] for k in group]
        may_go = [bool(members & faulty) for members in some]
        yield Group([rows[k] for k in group], some, may_go, always)


def _batches(groups: Iterable[Group], compiled: bool | None) -> Iterator[list[int]]:
    for group in groups:
        for batch in search(group.rows, group.sets, group.may_go, compiled):
            yield [found | group.always for found in batch] if group.always else batch


def _lumped(model: Model, equations: Sequence[int]) -> tuple[list[int], list[list[int]]]:
    """Return the equations and the unknowns of each equivalence class.

    Unknowns that only one class contains are left out: they go with it.
    """
    rows = [model.rows[equation] for equation in equations]
    groups = equivalent(rows, len(model.unknowns))
    unknowns = [{u for i in group for u in rows[i]} for group in groups]
    count = [0] * len(model.unknowns)
    for row in unknowns:
        for u in row:
            count[u] += 1
    return (
        [bitset([equations[i] for i in group]) for group in groups],
        [sorted(u for u in row if count[u] > 1) for row in unknowns],
    )
