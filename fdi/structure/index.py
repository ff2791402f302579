"""Tells how the differential constraints of a set have to be used to compute its residual.

In: a model whose differential constraints ``dx = d/dt x`` are marked ("i" at the state, "d" at its
derivative), and a set of equations. Out: whether the set is of low index (every constraint can be
integrated), whether its unknowns are observable, how each equation of an MSO set is computed when
it is the residual, and the structural index of a square model.
"""

from __future__ import annotations

from fdi.errors import UsageError
from fdi.structure.decomposition import decompose_rows, reached
from fdi.structure.incidence import Model, Rows, existing
from fdi.structure.matching import match


def is_low_index(model: Model, equations: int | None = None) -> bool:
    """Return whether every differential constraint of a set can be integrated.

    Parameters
    ----------
    model : Model
    equations : int, optional
        Bit set of equations; by default all.

    Returns
    -------
    bool
        True when the algebraic equations of the set determine, structurally, the derivatives and
        algebraic unknowns that occur in them.

    Raises
    ------
    UsageError
        When an equation of the set does not exist.

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012; for the index
    of square models Pantelides, SIAM J. Sci. Stat. Comput. 9(2), 1988.

    Examples
    --------
    >>> model = Model(("dx = d/dt x", "y1 = dx", "y2 = x"), ("x", "dx"), ((0, 1), (1,), (0,)),
    ...               (), ((0, 0, "i"), (0, 1, "d")))
    >>> is_low_index(model), is_low_index(model, 0b101)
    (True, True)
    """
    chosen = _chosen(model, equations)
    marks = _marks(model, chosen)
    differential = {e for e, _ in marks}
    algebraic = [e for e in chosen if e not in differential]
    derivatives = {u for (_, u), kind in marks.items() if kind == "d"}
    in_constraints = {u for e in differential for u in model.rows[e]}
    wanted = {u for e in algebraic for u in model.rows[e]}
    wanted = {u for u in wanted if u in derivatives or u not in in_constraints}
    return _rank([[u for u in model.rows[e] if u in wanted] for e in algebraic]) == len(wanted)


def is_observable(model: Model, equations: int | None = None) -> bool:
    """Return whether the unknowns of a set can be told from its known variables, structurally.

    Parameters
    ----------
    model : Model
    equations : int, optional
        Bit set of equations; by default all. Unknowns that do not occur in them do not count.

    Returns
    -------
    bool

    Raises
    ------
    UsageError
        When an equation of the set does not exist.

    Notes
    -----
    With states x1, their derivatives and further unknowns x2: the algebraic equations, with each
    derivative put in its state's place, determine x1 and x2; they and the derivatives taken as
    known determine all; and no Hall block of the just-determined part integrates.

    References
    ----------
    The conditions are those of the toolbox of record, faultdiagnosistoolbox 0.12.5
    (``IsObservable``).

    Examples
    --------
    The rate alone does not tell where the state is.

    >>> model = Model(("dx = d/dt x", "y1 = dx", "y2 = x"), ("x", "dx"), ((0, 1), (1,), (0,)),
    ...               (), ((0, 0, "i"), (0, 1, "d")))
    >>> is_observable(model), is_observable(model, 0b011)
    (True, False)
    """
    chosen = _chosen(model, equations)
    marks = _marks(model, chosen)
    differential = {e for (e, _), kind in marks.items() if kind == "i"}
    state_of_constraint = {e: u for (e, u), kind in marks.items() if kind == "i"}
    derivative_of_constraint = {e: u for (e, u), kind in marks.items() if kind == "d"}
    constraint_of: dict[int, int] = {}
    for e in sorted(differential):
        constraint_of.setdefault(state_of_constraint[e], e)
    states = sorted(constraint_of)
    place_of_state = {u: k for k, u in enumerate(states)}
    n = len(states)
    places_of_derivative: dict[int, list[int]] = {}
    for k, u in enumerate(states):
        if (e := constraint_of[u]) in derivative_of_constraint:
            places_of_derivative.setdefault(derivative_of_constraint[e], []).append(k)
    rest = {u for e in chosen for u in model.rows[e]} - set(states) - set(places_of_derivative)
    place_of_rest = {u: 2 * n + k for k, u in enumerate(sorted(rest))}
    algebraic: list[list[int]] = []  # columns: states, derivatives, rest
    for e in chosen:
        if e in differential:
            continue
        row = [place_of_state[u] for u in model.rows[e] if u in place_of_state]
        row += [n + k for u in model.rows[e] for k in places_of_derivative.get(u, ())]
        row += [place_of_rest[u] for u in model.rows[e] if u in place_of_rest]
        algebraic.append(row)
    merged = [sorted({u - n if n <= u < 2 * n else u for u in row}) for row in algebraic]
    if _rank(merged) != n + len(rest):
        return False
    if _rank([[n + k] for k in range(n)] + algebraic) != 2 * n + len(rest):
        return False
    rows = [[k, n + k] for k in range(n)] + algebraic
    return not any(
        k < n and k in block.unknowns  # row k integrates state k
        for block in decompose_rows(rows, 2 * n + len(rest)).hall
        for k in block.equations
    )


def structural_index(model: Model) -> tuple[int, tuple[int, ...]]:
    """Return the structural index of a square model and how often to differentiate each equation.

    Parameters
    ----------
    model : Model
        As many equations as unknowns, with a matching of all of them.

    Returns
    -------
    index : int
    differentiations : tuple of int
        For each equation, the smallest numbers.

    Raises
    ------
    UsageError
        When the model is not square or no matching covers it.

    References
    ----------
    Pantelides, SIAM J. Sci. Stat. Comput. 9(2), 1988.

    Examples
    --------
    >>> model = Model(("dx = d/dt x", "x = u"), ("x", "dx"), ((0, 1), (0,)), (),
    ...               ((0, 0, "i"), (0, 1, "d")))
    >>> structural_index(model)
    (2, (0, 1))
    """
    n, rows = len(model.unknowns), model.rows
    rank = _rank(rows)
    if not len(rows) == n == rank:
        raise UsageError(
            f"the structural index needs a square model with a complete matching, this one has "
            f"{len(rows)} equations, {n} unknowns, rank {rank}"
        )
    order_of = {(e, u): int(kind == "i") for e, u, kind in model.derivative}
    times = [0] * n
    while True:
        highest = [-1] * n
        for e, row in enumerate(rows):
            for u in row:
                highest[u] = max(highest[u], order_of.get((e, u), 0) + times[e])
        leading = [
            [u for u in row if order_of.get((e, u), 0) + times[e] == highest[u]]
            for e, row in enumerate(rows)
        ]
        equation_of, unknown_of = match(leading, n)
        over = reached(leading, equation_of, unknown_of)
        if not over:
            return max(times, default=0) + int(0 in highest), tuple(times)
        for e in over:
            times[e] += 1


def residual_causality(model: Model, equations: int) -> str:
    """Return, for each equation of an MSO set as the residual, how the others are computed.

    Parameters
    ----------
    model : Model
    equations : int
        Bit set of equations, an MSO set.

    Returns
    -------
    str
        One character for each equation in ascending order: "a" algebraic, "i" integral, "d"
        derivative, "m" mixed. A differential constraint as the residual is taken in integral form.

    Raises
    ------
    UsageError
        When the set is no MSO set: without some equation it is not just-determined.

    Notes
    -----
    The just-determined rest is computed Hall block by Hall block. A block with a state edge
    integrates the first one, and what remains of it is taken apart again.

    References
    ----------
    Svärd, Nyberg, IEEE Trans. SMC-A 40(6), 2010; Frisk, Bregon, Åslund, Krysander, Pulido, Biswas,
    IEEE Trans. SMC-A 42(5), 2012.

    Examples
    --------
    >>> model = Model(("dx = d/dt x", "y1 = dx", "y2 = x"), ("x", "dx"), ((0, 1), (1,), (0,)),
    ...               (), ((0, 0, "i"), (0, 1, "d")))
    >>> residual_causality(model, 0b111)
    'idi'
    """
    chosen = existing(model, equations)
    marks = _marks(model, chosen)
    unknowns = {u for e in chosen for u in model.rows[e]}
    if len(chosen) != len(unknowns) + 1:
        raise UsageError(f"{len(chosen)} equations with {len(unknowns)} unknowns are no MSO set")
    result = []
    for residual in chosen:
        used = _matched_kinds(model, [e for e in chosen if e != residual], marks)
        if any(marks.get((residual, u)) == "d" for u in model.rows[residual]):
            used.add("i")
        result.append("m" if len(used) == 2 else next(iter(used), "a"))
    return "".join(result)


def _matched_kinds(
    model: Model, equations: list[int], marks: dict[tuple[int, int], str]
) -> set[str]:
    """Return which of "i" and "d" the matching of a just-determined set uses."""
    kinds: set[str] = set()
    columns = sorted({u for e in equations for u in model.rows[e]})
    todo = [(equations, columns)]
    while todo:
        some, unknowns = todo.pop()
        allowed = set(unknowns)
        place = {u: k for k, u in enumerate(unknowns)}
        rows = [[place[u] for u in model.rows[e] if u in allowed] for e in some]
        parts = decompose_rows(rows, len(unknowns))
        if len(parts.just.equations) != len(some):
            raise UsageError("no MSO set: without one of its equations it is not just-determined")
        for part in parts.hall:
            block = [some[k] for k in part.equations]
            inside = [unknowns[k] for k in part.unknowns]
            edges = [
                (e, u) for e in block for u in model.rows[e] if u in inside and (e, u) in marks
            ]
            state = next((edge for edge in edges if marks[edge] == "i"), None)
            if state is not None:
                kinds.add("i")
                block = [e for e in block if e != state[0]]
                todo.append((block, [u for u in inside if u != state[1]]))
            elif edges:
                kinds.add("d")
    return kinds


def _chosen(model: Model, equations: int | None) -> list[int]:
    return list(range(len(model.rows))) if equations is None else existing(model, equations)


def _marks(model: Model, chosen: list[int]) -> dict[tuple[int, int], str]:
    inside = set(chosen)
    return {(e, u): kind for e, u, kind in model.derivative if e in inside}


def _rank(rows: Rows) -> int:
    n_unknowns = 1 + max((u for row in rows for u in row), default=-1)
    return sum(equation >= 0 for equation in match(rows, n_unknowns)[0])
