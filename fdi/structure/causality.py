"""Tells what remains testable when differential constraints may be used in one direction only.

In: a model whose differential constraints ``dx = d/dt x`` are marked ("i" at the state, "d" at its
derivative). Out: the equations that stay overdetermined. Integral causality computes the state from
its derivative, derivative causality the derivative from its state, mixed causality whatever is of
use. What a single removed equation does to this part stands in ``losses.py``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fdi.errors import UsageError
from fdi.structure.decomposition import overdetermined, reached, underdetermined
from fdi.structure.incidence import Model, existing
from fdi.structure.matching import complete, match

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
        When the causality is none of the three, or there is no such equation.

    Notes
    -----
    Integral: while unknowns are underdetermined without the edges at derivatives, the equations
    that contain them go. Derivative: unknowns are computed from equations whose states are all
    computed already; equations with an unknown that never is go. An equation without unknowns
    is overdetermined under each.

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, "Diagnosability analysis considering causal
    interpretations for differential constraints", IEEE Trans. SMC-A 42(5), 2012.

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
    removed = set(existing(model, without))
    kept = [e for e in range(len(model.rows)) if e not in removed]
    if causality == "integral":
        return tuple(_integral(model, kept))
    if causality == "derivative":
        return tuple(_derivative(model, kept))
    return tuple(_plus(model, kept))


def _plus(model: Model, kept: list[int]) -> list[int]:
    return [kept[i] for i in overdetermined([model.rows[e] for e in kept])]


def _integral(model: Model, kept: list[int]) -> list[int]:
    return sorted(integrable(set(kept), *integration(model, kept)))


class Matched(NamedTuple):
    """Is a graph with a matching, all of it lists that are changed in place.

    Parameters
    ----------
    rows : list of sequences of int
        By equation of the model; empty where the equation does not take part.
    equation_of, unknown_of : list of int
        See :func:`fdi.structure.matching.match`.

    References
    ----------
    Berge, Proc. National Academy of Sciences 43(9), 1957.

    Examples
    --------
    >>> Matched([(0,), ()], [0], [0, -1]).copy().rows
    [(0,), ()]
    """

    rows: list[Sequence[int]]
    equation_of: list[int]
    unknown_of: list[int]

    def copy(self) -> Matched:
        """Return one that can be changed without changing this one."""
        return Matched(list(self.rows), list(self.equation_of), list(self.unknown_of))

    def take_out(self, equations: Iterable[int]) -> None:
        """Empty some rows, and the matching with them; it need not stay a maximum one."""
        for e in equations:
            self.rows[e] = ()
            if (u := self.unknown_of[e]) >= 0:
                self.unknown_of[e] = self.equation_of[u] = -1


def integration(model: Model, kept: Iterable[int]) -> tuple[Matched, Matched]:
    """Return the graph of some equations, whole and without the edges at derivatives, matched.

    Parameters
    ----------
    model : Model
    kept : iterable of int

    Returns
    -------
    whole, integrating : Matched

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012.

    Examples
    --------
    >>> model = Model(("dx = d/dt x",), ("x", "dx"), ((0, 1),), (), ((0, 0, "i"), (0, 1, "d")))
    >>> integration(model, [0])[1].rows
    [[0]]
    """
    whole: list[Sequence[int]] = [()] * len(model.rows)
    for e in kept:
        whole[e] = model.rows[e]
    integrating = list(whole)
    for e, unknown, kind in model.derivative:
        if kind == "d":
            integrating[e] = [u for u in integrating[e] if u != unknown]
    n = len(model.unknowns)
    return Matched(whole, *match(whole, n)), Matched(integrating, *match(integrating, n))


def integrable(kept: set[int], whole: Matched, integrating: Matched) -> set[int]:
    """Return the largest overdetermined part whose unknowns can all be computed by integrating.

    Parameters
    ----------
    kept : set of int
        Equations that take part.
    whole, integrating : Matched
        Their graph with and without the edges at derivatives. Both are changed; what is returned
        is left of them, with maximum matchings.

    Returns
    -------
    set of int

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012, section V.

    Examples
    --------
    >>> model = Model(("dx = d/dt x", "y1 = dx", "y2 = x"), ("x", "dx"), ((0, 1), (1,), (0,)), (),
    ...               ((0, 0, "i"), (0, 1, "d")))
    >>> integrable({0, 1, 2}, *integration(model, range(3)))
    {0, 1, 2}
    """
    while True:
        complete(*whole)
        over = kept.intersection(reached(*whole))
        for graph in (whole, integrating):
            graph.take_out(kept - over)
        complete(*integrating)
        if all(integrating.equation_of[u] >= 0 for e in over for u in whole.rows[e]):
            return over
        _, loose = underdetermined(*integrating)
        kept = {e for e in over if loose.isdisjoint(whole.rows[e])}
        for graph in (whole, integrating):
            graph.take_out(over - kept)


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
