"""Finds the irreducible fault signatures: sets of faults of which all other signatures are unions.

In: a model and a causality, that is, how tests may be computed. A signature is the set of faults
that a test of this kind can be sensitive to, at most and at once: the faults of the largest part
that stays overdetermined in this causality when other faults' equations are taken out. Out: the
signatures that are no union of smaller ones. With them, a fault of a set A can be told from all
faults of a set B, occurring together, exactly when an irreducible signature holds one of A and none
of B. MTES are the smallest of them, and know of no causality.

Two tests together are a test, so signatures are closed under union, and the irreducible ones are
those that are minimal among the signatures that hold some fault. For each fault they are found by
decoupling others as long as it stays.

The notion is that of Åslund 2026. Of that paper only abstract and introduction could be read; this
file follows them (largest testable part, signatures as a semilattice, join-irreducible elements)
and differs from it at most in names and in the method of search. The paper's own example of an
operator, low structural index, corresponds to integral causality here.
"""

from __future__ import annotations

from collections.abc import Iterator

from fdi.errors import UsageError
from fdi.structure.causality import causally_overdetermined, require_causality
from fdi.structure.incidence import Model


def irreducible_signatures(
    model: Model, causality: str = "mixed", *, limit: int | None = None
) -> Iterator[int]:
    """Yield the irreducible fault signatures of a model.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}
        How tests may use differential constraints.
    limit : int, optional
        The most signatures that are wanted.

    Yields
    ------
    int
        Bit sets of faults: bit j is ``model.faults[j]``. Each once, by their first fault that they
        are minimal for; the order depends on the model alone.

    Raises
    ------
    UsageError
        When the causality is none of the three, or, while iterating, when there are more than
        ``limit``.

    Notes
    -----
    Their number grows exponentially with the redundancy, as that of MTES does. A fault once tried
    has to stay for its later siblings, so that no signature of a fault is found twice.

    References
    ----------
    Åslund, "Graph-Theoretic Analysis of Residual Generation Under Computational Constraints", arXiv
    2603.24273, 2026, abstract and section I.

    Examples
    --------
    Either of two sensors checks the third, which has no fault; both together check nothing more.

    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> [bin(found) for found in irreducible_signatures(model)]
    ['0b1', '0b10']
    """
    require_causality(causality)
    faults_of: list[int] = [0] * len(model.rows)
    for j, fault in enumerate(model.faults):
        for e in fault.equations:
            faults_of[e] |= 1 << j
    whole = causally_overdetermined(model, causality)
    everything = _signature(whole, faults_of)
    found: set[int] = set()
    for j in range(len(model.faults)):
        if not everything >> j & 1:
            continue
        for signature in _minimal(model, causality, faults_of, whole, 1 << j):
            if signature in found:
                continue
            if limit is not None and len(found) == limit:
                raise UsageError(
                    f"more than {limit} irreducible signatures", hint="raise the limit"
                )
            found.add(signature)
            yield signature


def _signature(equations: tuple[int, ...], faults_of: list[int]) -> int:
    signature = 0
    for e in equations:
        signature |= faults_of[e]
    return signature


def _minimal(
    model: Model, causality: str, faults_of: list[int], whole: tuple[int, ...], fault: int
) -> Iterator[int]:
    """Yield the minimal signatures that hold a fault, as bit sets."""
    todo = [(whole, 0)]  # a testable part, and the faults that have to stay
    while todo:
        part, stay = todo.pop()
        signature = _signature(part, faults_of)
        minimal, children = True, []
        left = signature & ~fault
        while left:
            other = left & -left
            left ^= other
            smaller = _without(model, causality, faults_of, part, other)
            kept = _signature(smaller, faults_of)
            if not kept & fault:
                continue
            minimal = False
            if not other & stay and stay & ~kept == 0:
                children.append((smaller, stay))
            stay |= other
        if minimal:
            yield signature
        todo.extend(reversed(children))


def _without(
    model: Model, causality: str, faults_of: list[int], part: tuple[int, ...], fault: int
) -> tuple[int, ...]:
    """Return what stays testable of a part when a fault is decoupled."""
    kept = {e for e in part if not faults_of[e] & fault}
    gone = (e for e in range(len(model.rows)) if e not in kept)
    return causally_overdetermined(model, causality, without=gone)
