"""Which sets of faults together explain all alarms? Minimal hitting sets of conflicts.

In: the conflicts, each a set of faults (or components) that cannot all be healthy: the signature of
a test that alarmed. Out: the diagnoses, sets that hit every conflict and hold no smaller such set,
those of one fault first, then of two, and more on request. A test that is quiet is no conflict and
excuses nobody: its faults may be too small, or cancel out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fdi.errors import UsageError
from fdi.structure.incidence import bitset, members


def minimal_hitting_sets(conflicts: Iterable[int], *, most: int = 2) -> Iterator[int]:
    """Yield the minimal sets that share an element with every conflict, smallest first.

    Parameters
    ----------
    conflicts : iterable of int
        Bit sets, see :func:`fdi.structure.members`.
    most : int
        Elements that a set may have. Every minimal set up to this size is found.

    Yields
    ------
    int
        Bit sets; the empty one where there is no conflict, none where a conflict is empty. Of equal
        size, in ascending order of their elements.

    Raises
    ------
    UsageError
        When ``most`` is below zero.

    Notes
    -----
    Sets of k elements cost at most s**k steps, s being the size of the smallest conflict.

    References
    ----------
    Reiter, "A theory of diagnosis from first principles", Artificial Intelligence 32(1), 1987;
    de Kleer, Williams, "Diagnosing multiple faults", Artificial Intelligence 32(1), 1987.

    Examples
    --------
    >>> [bin(found) for found in minimal_hitting_sets([0b0111, 0b1110])]
    ['0b10', '0b100', '0b1001']
    """
    if most < 0:
        raise UsageError(f"most is {most}: a diagnosis has no fewer than 0 faults")
    distinct = sorted(set(conflicts), key=lambda c: (c.bit_count(), c))
    needed: list[int] = []
    for conflict in distinct:  # one that holds a smaller one is hit when that one is
        if not any(other & conflict == other for other in needed):
            needed.append(conflict)
    for size in range(most + 1):
        found = {chosen for chosen in _hitting(needed, size, 0, 0) if _is_minimal(chosen, needed)}
        yield from sorted(found, key=members)


def diagnoses(
    reacts: ArrayLike, alarmed: ArrayLike, *, most: int = 2
) -> tuple[tuple[int, ...], ...]:
    """Return the minimal sets of faults that explain all tests in alarm.

    Parameters
    ----------
    reacts : (n_tests, n_f) bool array_like
        The signatures: true where a test is sensitive to a fault.
    alarmed : (n_tests,) bool array_like
        Which tests are in alarm. Quiet and unknown ones are false alike.
    most : int
        Faults that may occur together.

    Returns
    -------
    tuple of tuple of int
        Numbers of faults, as :func:`minimal_hitting_sets`; one empty diagnosis where nothing
        alarmed, none where no set of this size explains the alarms.

    Raises
    ------
    UsageError
        When the shapes do not fit, or ``most`` is below zero.

    References
    ----------
    As :func:`minimal_hitting_sets`; for tests as conflicts Cordier et al., "Conflicts versus
    analytical redundancy relations", IEEE Trans. SMC-B 34(5), 2004.

    Examples
    --------
    >>> diagnoses([[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 0, 1]], [True, True, False])
    ((1,), (0, 2))
    """
    signatures, alarms = np.asarray(reacts, dtype=bool), np.asarray(alarmed, dtype=bool)
    if signatures.ndim != 2 or alarms.shape != signatures.shape[:1]:
        raise UsageError(
            f"signatures have shape {signatures.shape} and alarms {alarms.shape}: "
            "(tests, faults) and (tests,) are needed"
        )
    conflicts = [bitset(np.flatnonzero(row).tolist()) for row in signatures[alarms]]
    return tuple(members(found) for found in minimal_hitting_sets(conflicts, most=most))


def _hitting(conflicts: Sequence[int], size: int, chosen: int, barred: int) -> Iterator[int]:
    """Yield sets of this size that hit all conflicts; of an element once tried, later ones do."""
    left = [conflict for conflict in conflicts if not conflict & chosen]
    if not left:
        if not size:
            yield chosen
        return
    if not size:
        return
    first = min((conflict & ~barred for conflict in left), key=int.bit_count)
    if size == 1:  # only what all of them share
        for conflict in left:
            first &= conflict
    while first:
        element = first & -first
        yield from _hitting(left, size - 1, chosen | element, barred)
        first ^= element
        barred |= element


def _is_minimal(chosen: int, conflicts: Sequence[int]) -> bool:
    """Return whether every element alone hits some conflict."""
    alone = 0
    for conflict in conflicts:
        shared = conflict & chosen
        if not shared & (shared - 1):
            alone |= shared
    return alone == chosen
