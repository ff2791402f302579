"""Finds what remains testable, under a causality, when an equation leaves the model.

In: a model and the equations M that its causally overdetermined part holds. Out: the PSO classes of
M, and for the few of them whose removal takes more than the class itself, what then remains. So the
isolability of all faults costs little more than the mixed one, instead of one analysis per fault.

Why few are left to look at: a class C has one equation more than unknowns of its own, and these are
matched inside C. So at most one unknown u of the rest loses its equation r. If an equation that is
not needed can step in for r, by a path of exchanges that respects the causality, everything else
is computed as before. Integral: a path in the graph without the edges at derivatives. Derivative:
a path among the unknowns that are computed in the same round as u, because a round that
differentiates a state has to come after the one that computes it. Both operators are monotone and
idempotent, so that nothing outside M matters.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from fdi.structure.causality import (
    causally_overdetermined,
    integrable,
    integration,
    require_causality,
)
from fdi.structure.decomposition import reached, underdetermined
from fdi.structure.equivalence import equivalent
from fdi.structure.incidence import Model, existing
from fdi.structure.matching import match


def causal_classes(
    model: Model, causality: str = "mixed", *, without: Iterable[int] = ()
) -> tuple[list[list[int]], dict[int, set[int]]]:
    """Return the classes of the causally overdetermined part, and which of them are missed.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}
    without : iterable of int
        Equations that are taken out of the model first.

    Returns
    -------
    classes : list of list of int
        By smallest equation, each ascending. Without an equation of a class, the class is gone.
    left : dict of int to set of int
        For the index of each class with faults that others need: the equations that remain without
        it. For every other class with faults, all others remain.

    Raises
    ------
    UsageError
        When the causality is none of the three.

    References
    ----------
    Frisk, Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012 (the causally
    overdetermined part); Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008 (classes).

    Examples
    --------
    Only one sensor sees the state, the other two its rate: without it, integrating ends nowhere.

    >>> model = Model(("dx = d/dt x", "y1 = dx", "y2 = dx", "y3 = x"), ("x", "dx"),
    ...               ((0, 1), (1,), (1,), (0,)), (), ((0, 0, "i"), (0, 1, "d")))
    >>> causal_classes(model, "integral")
    ([[0, 3], [1], [2]], {})
    >>> causal_classes(model, "derivative", without=(2,))
    ([[0, 1, 3]], {})
    """
    require_causality(causality)
    either_way = causality == "mixed" or not model.derivative
    if either_way:  # what is not overdetermined falls out below
        gone = set(existing(model, without))
        kept = tuple(e for e in range(len(model.rows)) if e not in gone)
    else:
        kept = causally_overdetermined(model, causality, without=without)
    groups = equivalent([model.rows[e] for e in kept], len(model.unknowns))
    classes = [[kept[i] for i in group] for group in groups]
    if either_way:
        return classes, {}
    wanted = {e for fault in model.faults for e in fault.equations}
    chosen = [k for k, group in enumerate(classes) if not wanted.isdisjoint(group)]
    if causality == "integral":
        return classes, _without_integrating(model, classes, chosen)
    return classes, _without_differentiating(model, classes, chosen)


def _without_integrating(
    model: Model, classes: list[list[int]], chosen: list[int]
) -> dict[int, set[int]]:
    kept = {e for group in classes for e in group}
    whole, integrating = integration(model, kept)
    replaceable = set(reached(*integrating))
    left: dict[int, set[int]] = {}
    for k in _missed(model, classes, chosen, integrating.unknown_of, replaceable):
        graphs = whole.copy(), integrating.copy()
        for graph in graphs:
            graph.take_out(classes[k])
        left[k] = integrable(kept.difference(classes[k]), *graphs)
    return left


def _without_differentiating(
    model: Model, classes: list[list[int]], chosen: list[int]
) -> dict[int, set[int]]:
    kept = {e for group in classes for e in group}
    mate, replaceable = _rounds(model, kept)
    outside = set(range(len(model.rows))) - kept
    return {
        k: set(causally_overdetermined(model, "derivative", without=outside.union(classes[k])))
        for k in _missed(model, classes, chosen, mate, replaceable)
    }


def _missed(
    model: Model,
    classes: list[list[int]],
    chosen: list[int],
    mate: list[int],
    replaceable: set[int],
) -> list[int]:
    """Return which of the chosen classes compute an unknown of others and cannot be replaced."""
    inside = [{u for e in group for u in model.rows[e]} for group in classes]
    count = Counter(u for unknowns in inside for u in unknowns)
    return [
        k
        for k in chosen
        if any(mate[e] >= 0 and count[mate[e]] > 1 and e not in replaceable for e in classes[k])
    ]


def _rounds(model: Model, kept: set[int]) -> tuple[list[int], set[int]]:
    """Return which equation computes which unknown, and those that their round can do without."""
    states: dict[int, list[int]] = {}
    for e, u, kind in model.derivative:
        if kind == "i":
            states.setdefault(e, []).append(u)
    mate, replaceable = [-1] * len(model.rows), set[int]()
    computed = set[int]()
    while True:
        usable = [
            [u for u in row if u not in computed]
            if e in kept and computed.issuperset(states.get(e, ()))
            else []
            for e, row in enumerate(model.rows)
        ]
        equation_of, unknown_of = match(usable, len(model.unknowns))
        _, loose = underdetermined(usable, equation_of, unknown_of)
        more = {u for row in usable for u in row} - loose
        if not more:
            return mate, replaceable
        for u in more:
            mate[equation_of[u]] = u
        over = reached(usable, equation_of, unknown_of)
        replaceable.update(e for e in over if unknown_of[e] >= 0)
        computed |= more
