"""Finds the smallest additions to a model with which faults can be detected or told apart.

In: a function that returns the model with some additions (sensors, messages), how often each may be
taken, and what is wanted of the faults. Out: all minimal choices that grant it. What an addition is
is not asked here; it may bring faults of its own. The one condition: more additions never take away
what was granted, which holds when they only add equations or make unknowns known.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fdi.errors import UsageError
from fdi.structure.decomposition import overdetermined
from fdi.structure.incidence import Model
from fdi.structure.isolability import Mask, detectable, isolability

Counts = tuple[int, ...]
"""How often each addition is taken."""

Wish = tuple[str, str]
"""The name of a fault and of the one that it shall be told from, or "" for being detectable."""


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """Is what is granted, or wanted: which faults are detected and which told from which.

    Parameters
    ----------
    names : tuple of str
        Of the n faults.
    seen : (n,) bool array
        Which are detectable.
    told : (n, n) bool array
        ``[i, j]`` is True when fault i is isolable from fault j.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definitions 2 and 3.

    Examples
    --------
    >>> reach(Model.from_matrix([[1], [1]], faults={"f": 0})).seen
    array([ True])
    """

    names: tuple[str, ...]
    seen: Mask
    told: Mask

    def __post_init__(self) -> None:
        self.seen.flags.writeable = False
        self.told.flags.writeable = False


def reach(model: Model) -> Reach:
    """Return what a model grants, in mixed causality.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Reach

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definitions 2 and 3.

    Examples
    --------
    >>> reach(Model.from_matrix([[1], [1]], faults={"f": 0})).names
    ('f',)
    """
    names = tuple(fault.name for fault in model.faults)
    return Reach(names, detectable(model), isolability(model))


def gained(before: Reach, after: Reach) -> tuple[tuple[str, ...], tuple[Wish, ...]]:
    """Return what is granted after and was not before, about the faults that there were.

    Parameters
    ----------
    before, after : Reach
        The second may know more faults.

    Returns
    -------
    detectable : tuple of str
        Names of faults.
    isolable : tuple of (str, str)
        Pairs of which the first can be told from the second.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, section IV.

    Examples
    --------
    >>> pair = {"f": 0, "g": 1}
    >>> gained(reach(Model.from_matrix([[1], [1]], faults=pair)),
    ...        reach(Model.from_matrix([[1], [1], [1]], faults=pair)))
    ((), (('f', 'g'), ('g', 'f')))
    """
    names = before.names
    place = [after.names.index(name) for name in names]
    seen = after.seen[place] & ~before.seen
    told = after.told[np.ix_(place, place)] & ~before.told
    return (
        tuple(names[i] for i in np.flatnonzero(seen)),
        tuple((names[i], names[j]) for i, j in np.argwhere(told).tolist()),
    )


def minimal_additions(
    extended: Callable[[Counts], Model], most: Counts, wanted: Reach, limit: int = 10_000
) -> Iterator[Counts]:
    """Yield the minimal choices that grant every wish about the faults that there then are.

    Parameters
    ----------
    extended : function of counts to Model
        The model with these additions; faults keep their names.
    most : tuple of int
        How often each addition may be taken.
    wanted : Reach
        Wishes; those about faults that additions bring hold once these are taken.
    limit : int
        Most choices to look at.

    Yields
    ------
    tuple of int
        How often each addition is taken, fewest first. None if not even all grant every wish.

    Raises
    ------
    UsageError
        While iterating, when more than ``limit`` choices are in question.

    Notes
    -----
    A choice that falls short is grown to a largest one around it that does not grant the same wish;
    every solution takes something beyond that one. So the search branches over what is beyond, and
    the largest choices that fall short are remembered.

    References
    ----------
    Reiter, Artificial Intelligence 32(1), 1987 (the tree of hitting sets).

    Examples
    --------
    >>> model = Model.from_matrix([[1]], faults={"f": 0})
    >>> double = Model.from_matrix([[1], [1]], faults={"f": 0})
    >>> list(minimal_additions(lambda counts: double if any(counts) else model, (1, 1),
    ...                        reach(double)))
    [(0, 1), (1, 0)]
    """
    if refused_wish(extended(most), wanted):
        return
    start = (0,) * len(most)
    todo, known = [(0, start)], {start}
    found: list[Counts] = []
    short: list[tuple[Wish, Counts]] = []
    while todo:
        _, counts = heapq.heappop(todo)
        if any(_is_part(other, counts) for other in found):
            continue
        largest = _falling_short(extended, counts, most, wanted, short)
        if largest is None:
            found.append(counts)
            yield counts
            continue
        for k, n in enumerate(largest):
            larger = (*counts[:k], n + 1, *counts[k + 1 :])
            if n < most[k] and larger not in known:
                known.add(larger)
                heapq.heappush(todo, (sum(larger), larger))
        if len(known) > limit:
            raise UsageError(
                f"more than {limit} choices are in question",
                hint="name fewer candidates or raise the limit",
            )


def _falling_short(
    extended: Callable[[Counts], Model],
    counts: Counts,
    most: Counts,
    wanted: Reach,
    short: list[tuple[Wish, Counts]],
) -> Counts | None:
    """Return a largest choice around this one that does not grant one of its wishes."""
    model = extended(counts)
    names = {fault.name for fault in model.faults}
    for wish, largest in short:
        if names.issuperset(filter(None, wish)) and _is_part(counts, largest):
            return largest
    refused = refused_wish(model, wanted)
    if refused is None:
        return None
    largest = largest_without(extended, counts, most, refused)
    short.append((refused, largest))
    return largest


def largest_without(
    extended: Callable[[Counts], Model], counts: Counts, most: Counts, wish: Wish
) -> Counts:
    """Return a largest choice around one that does not grant a wish, so that it does not either.

    Parameters
    ----------
    extended, most
        As for :func:`minimal_additions`.
    counts : tuple of int
        A choice that does not grant the wish.
    wish : (str, str)

    Returns
    -------
    tuple of int
        Additions are taken in their order as long as the wish is not granted. Many are tried at
        once: for k that stand out of n it takes k * log(n) tests.

    References
    ----------
    Junker, "QuickXplain", AAAI 2004 (halving).

    Examples
    --------
    >>> model = Model.from_matrix([[1]], faults={"f": 0})
    >>> double = Model.from_matrix([[1], [1]], faults={"f": 0})
    >>> largest_without(lambda counts: double if counts[0] else model, (0, 0), (1, 1), ("f", ""))
    (0, 1)
    """
    ranges = [(0, len(most))]
    while ranges:
        first, last = ranges.pop()
        larger = (*counts[:first], *most[first:last], *counts[last:])
        if larger == counts or not _grants(extended(larger), wish):
            counts = larger
        elif last - first > 1:
            middle = (first + last) // 2
            ranges += [(middle, last), (first, middle)]
        elif most[first] - counts[first] > 1:
            larger = (*counts[:first], counts[first] + 1, *counts[last:])
            if not _grants(extended(larger), wish):
                counts = larger
                ranges.append((first, last))
    return counts


def refused_wish(model: Model, wanted: Reach) -> Wish | None:
    """Return a wish about faults of the model that is not granted, or None.

    Parameters
    ----------
    model : Model
    wanted : Reach

    Returns
    -------
    (str, str) or None

    References
    ----------
    As :func:`reach`.

    Examples
    --------
    >>> refused_wish(Model.from_matrix([[1]], faults={"f": 0}),
    ...              reach(Model.from_matrix([[1], [1]], faults={"f": 0})))
    ('f', '')
    """
    have = reach(model)
    own = [i for i, name in enumerate(have.names) if name in wanted.names]
    names = [have.names[i] for i in own]
    place = [wanted.names.index(name) for name in names]
    seen = wanted.seen[place] & ~have.seen[own]
    if seen.any():
        return names[int(seen.argmax())], ""
    told = wanted.told[np.ix_(place, place)] & ~have.told[np.ix_(own, own)]
    if told.any():
        i, j = np.argwhere(told)[0].tolist()
        return names[i], names[j]
    return None


def _grants(model: Model, wish: Wish) -> bool:
    where = {fault.name: fault.equations for fault in model.faults}
    gone = where.get(wish[1], ())
    kept = [e for e in range(len(model.rows)) if e not in gone]
    over = overdetermined([model.rows[e] for e in kept])
    return not set(where[wish[0]]).isdisjoint(kept[i] for i in over)


def _is_part(some: Counts, others: Counts) -> bool:
    return all(a <= b for a, b in zip(some, others, strict=True))
