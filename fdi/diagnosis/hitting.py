"""Which minimal sets of components explain a set of conflicts?

Given conflicts, each a set of components that cannot all be healthy; sought the minimal sets that
share a component with every conflict (Reiter, Artificial Intelligence 32, 1987).
"""

from __future__ import annotations

from collections.abc import Iterable


def minimal_hitting_sets(
    conflicts: Iterable[frozenset[str]], *, most: int = 3
) -> tuple[frozenset[str], ...]:
    """Return all minimal hitting sets of at most a given size, smaller ones first.

    Parameters
    ----------
    conflicts : iterable of frozenset of str
        An empty conflict cannot be hit; there is then no hitting set.
    most : int
        Largest size returned; four independent failures at once are not worth the search.

    Examples
    --------
    >>> sets = minimal_hitting_sets([frozenset("ab"), frozenset("bc")])
    >>> [sorted(s) for s in sets]
    [['b'], ['a', 'c']]
    """
    minimal = _without_supersets(frozenset(conflict) for conflict in conflicts)
    found: list[frozenset[str]] = []
    level: list[frozenset[str]] = [frozenset()]
    for _ in range(most + 1):
        following: dict[frozenset[str], None] = {}
        for partial in level:
            if any(known <= partial for known in found):
                continue
            missed = next((c for c in minimal if not c & partial), None)
            if missed is None:
                found.append(partial)
            else:
                following.update(dict.fromkeys(partial | {name} for name in sorted(missed)))
        level = sorted(following, key=sorted)
    return tuple(sorted(found, key=lambda s: (len(s), sorted(s))))


def _without_supersets(sets: Iterable[frozenset[str]]) -> list[frozenset[str]]:
    ordered = sorted(set(sets), key=lambda s: (len(s), sorted(s)))
    kept: list[frozenset[str]] = []
    for candidate in ordered:
        if not any(known <= candidate for known in kept):
            kept.append(candidate)
    return kept
