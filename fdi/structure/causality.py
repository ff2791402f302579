"""Tells what can be computed when differential constraints are integrated, or differentiated.

In: a model whose constraints ``dx = d/dt x`` are marked ("i" at the state, "d" at its derivative).
Out: the equations that remain testable when a constraint may be used in one direction only.
Integral causality computes the state from its derivative, derivative causality the derivative from
its state, mixed causality whatever is of use.
"""

from __future__ import annotations

from collections.abc import Iterable

from fdi.errors import UsageError
from fdi.structure.decomposition import overdetermined, underdetermined
from fdi.structure.incidence import Model
from fdi.structure.matching import match

CAUSALITIES = ("mixed", "integral", "derivative")


def require_causality(causality: str) -> None:
    """Raise unless the name is that of a causality.

    Parameters
    ----------
    causality : str

    Raises
    ------
    UsageError
        When it is none of :data:`CAUSALITIES`.

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012.

    Examples
    --------
    >>> require_causality("int")
    Traceback (most recent call last):
    ...
    fdi.errors.UsageError: causality 'int' is none of mixed, integral, derivative
    """
    if causality not in CAUSALITIES:
        raise UsageError(f"causality {causality!r} is none of {', '.join(CAUSALITIES)}")


def causally_overdetermined(
    model: Model, causality: str = "mixed", *, without: Iterable[int] = ()
) -> tuple[int, ...]:
    """Return the equations that stay overdetermined under a causality, ascending.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}
    without : iterable of int
        Equations that are taken out of the model first.

    Returns
    -------
    tuple of int

    Raises
    ------
    UsageError
        When the causality is none of the three.

    Notes
    -----
    Integral: while unknowns are underdetermined without the edges at derivatives, the equations
    that contain them go. Derivative: unknowns are computed from equations whose states are all
    computed already; equations with an unknown that never is go. An equation without unknowns
    is overdetermined under each.

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, "Diagnosability analysis considering causal
    interpretations for differential constraints", IEEE Trans. SMC-A 42(5), 2012, section V.

    Examples
    --------
    One sensor sees both the state and its derivative, another one the state alone.

    >>> model = Model(("dx = d/dt x", "y1 = dx + x", "y2 = x"), ("x", "dx"),
    ...               ((0, 1), (0, 1), (0,)), (), ((0, 0, "i"), (0, 1, "d")))
    >>> [causally_overdetermined(model, name) for name in CAUSALITIES]
    [(0, 1, 2), (0, 1, 2), (0, 1, 2)]
    >>> causally_overdetermined(model, "derivative", without=(2,))
    ()
    """
    require_causality(causality)
    removed = set(without)
    kept = [e for e in range(len(model.rows)) if e not in removed]
    if causality == "integral":
        return tuple(_integral(model, kept))
    if causality == "derivative":
        return tuple(_derivative(model, kept))
    return tuple(_plus(model, kept))


def _plus(model: Model, kept: list[int]) -> list[int]:
    return [kept[i] for i in overdetermined([model.rows[e] for e in kept])]


def _integral(model: Model, kept: list[int]) -> list[int]:
    at_derivative = {(e, u) for e, u, kind in model.derivative if kind == "d"}
    while True:
        kept = _plus(model, kept)
        present = {u for e in kept for u in model.rows[e]}
        rows = [[u for u in model.rows[e] if (e, u) not in at_derivative] for e in kept]
        _, loose = underdetermined(rows, *match(rows, len(model.unknowns)))
        loose &= present  # an unknown that occurs nowhere is no reason
        if not loose:
            return kept
        kept = [e for e in kept if loose.isdisjoint(model.rows[e])]


def _derivative(model: Model, kept: list[int]) -> list[int]:
    states_of: dict[int, set[int]] = {}
    for e, u, kind in model.derivative:
        if kind == "i":
            states_of.setdefault(e, set()).add(u)
    computed: set[int] = set()
    while True:
        usable = [e for e in kept if states_of.get(e, set()) <= computed]
        rows = [[u for u in model.rows[e] if u not in computed] for e in usable]
        more = _determined(rows, len(model.unknowns))
        if not more:
            break
        computed |= more
    return _plus(model, [e for e in kept if computed.issuperset(model.rows[e])])


def _determined(rows: list[list[int]], n_unknowns: int) -> set[int]:
    """Return the unknowns of the over- and just-determined part."""
    equation_of, unknown_of = match(rows, n_unknowns)
    _, loose = underdetermined(rows, equation_of, unknown_of)
    return {u for row in rows for u in row if u not in loose}
