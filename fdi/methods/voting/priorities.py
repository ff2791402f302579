"""Whom does an autopilot prefer, by the errors that it counted of each?

In: error counters, any number of cases at once. Out: priorities, 1 the best, n the worst.

Of three autopilots the published program's arithmetic is kept as a table of its results: it depends
on the order of the counters alone, and is applied in the order own, first, second, so that in 110
of the 1,728 triples of 0 to 11 two autopilots rank the same counters differently; the vote is the
same. Of any other number: 1 for the fewest errors, then dense ranks. Where all have as many errors,
at least one, nobody is better than the one in charge: all are n.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from fdi.methods.voting.settings import tables

Ints = NDArray[np.int64]

THREE = 3


def patterns(counters: Ints) -> Ints:
    """Return the order pattern: 0 for no error, else the dense rank among those with errors.

    Parameters
    ----------
    counters : (..., n) int
        Not negative.

    Returns
    -------
    (..., n) int

    Examples
    --------
    >>> patterns(np.array([4, 0, 9])).tolist()
    [1, 0, 2]
    """
    ordered = np.sort(counters, axis=-1)
    is_new = np.ones(ordered.shape, np.bool_)
    is_new[..., 1:] = ordered[..., 1:] != ordered[..., :-1]
    is_new &= ordered > 0
    not_above = ordered[..., None, :] <= counters[..., :, None]
    rank: Ints = np.sum(is_new[..., None, :] & not_above, axis=-1)
    return rank


def priorities(counters: Ints, *, keeps_vote_when_equal: bool = True) -> Ints:
    """Return the priority of each autopilot from the counters, before anybody is silent.

    Parameters
    ----------
    counters : (..., n) int
        Errors counted; of three autopilots in the order own, first, second.
    keeps_vote_when_equal : bool
        Whether equal counters above 0 of all are n for everybody (the vote then stays), or 1.

    Returns
    -------
    (..., n) int
        1 to n.

    References
    ----------
    Thesis, section 5.3.1 (equal counters, equal priorities); the table is of the published program.

    Examples
    --------
    >>> priorities(np.array([4, 0, 0])).tolist(), priorities(np.array([2, 2, 5, 0])).tolist()
    ([3, 1, 1], [2, 2, 3, 1])
    """
    pattern = patterns(counters)
    n = counters.shape[-1]
    if n == THREE:
        found = _of_three()[pattern[..., 0], pattern[..., 1], pattern[..., 2]]
    else:
        found = pattern - pattern.min(axis=-1, keepdims=True) + 1
    is_equal = np.all(pattern == 1, axis=-1)
    return np.where(is_equal[..., None], n if keeps_vote_when_equal else 1, found)


@cache
def _of_three() -> Ints:
    """Return the published table, indexed by the pattern; 0 where no pattern can be."""
    table = np.zeros((THREE + 1,) * THREE + (THREE,), np.int64)
    for row in tables()["priorities_of_three"]:
        table[tuple(row["pattern"])] = row["priorities"]
    table.flags.writeable = False
    return table
