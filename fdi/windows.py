"""What do the samples of a window add up to, which is the largest, where do windows lie?

In: columns. Out: sums, largest values, runs of true samples. As the difference of two running sums,
the common short cut, one wild value would spoil all that follow: the digits that it takes are lost
for good.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def trailing_sum(values: Floats, count: int) -> Floats:
    """Return the sum of the last ``count`` samples of every row, of fewer at the beginning.

    Parameters
    ----------
    values : (..., n) float
    count : int
        At least 1. The time taken grows with its logarithm: sums of 1, 2, 4 ... samples are made.

    Examples
    --------
    >>> trailing_sum(np.array([1e30, 1.0, 2.0, 3.0]), 2).tolist()
    [1e+30, 1e+30, 3.0, 5.0]
    """
    count = min(count, values.shape[-1])
    total, done = np.zeros(values.shape), 0
    part, size = values.copy(), 1
    while True:
        if count & size:
            total[..., done:] += part[..., : values.shape[-1] - done]
            done += size
        if done == count:
            return total
        part[..., size:] += part[..., :-size].copy()
        size *= 2


def centred_sum(values: Floats, half: int) -> Floats:
    """Return the sum over the samples at most ``half`` away, of fewer at both ends.

    Parameters
    ----------
    values : (..., n) float

    Examples
    --------
    >>> centred_sum(np.array([1.0, 2.0, 3.0, 1e30, 4.0]), 1).tolist()
    [3.0, 6.0, 1e+30, 1e+30, 1e+30]
    """
    longer = np.concatenate([values, np.zeros((*values.shape[:-1], half))], axis=-1)
    return trailing_sum(longer, 2 * half + 1)[..., half:]


def sums_between(values: Floats, first: NDArray[np.intp], last: NDArray[np.intp]) -> Floats:
    """Return the sums over rows ``first`` to ``last``, that one excluded, of each window.

    Parameters
    ----------
    values : (n,) float
    first, last : (m,) int
        ``first < last <= n``.

    Examples
    --------
    >>> sums_between(np.array([1e30, 1.0, 2.0]), np.array([0, 1]), np.array([1, 3])).tolist()
    [1e+30, 3.0]
    """
    bounds = np.column_stack([first, last]).ravel()
    sums: Floats = np.add.reduceat(np.append(values, 0.0), bounds)[::2]
    return sums


def largest_between(values: Floats, first: NDArray[np.intp], last: NDArray[np.intp]) -> Floats:
    """Return the largest of ``values[first:last + 1]`` for every pair, which is not empty.

    Two windows of a power of two samples cover it, and those are made once for all.

    Examples
    --------
    >>> values = np.array([3.0, 1.0, 2.0, 0.0])
    >>> largest_between(values, np.array([0, 1, 3]), np.array([2, 2, 3])).tolist()
    [3.0, 2.0, 0.0]
    """
    found = np.empty(len(first))
    level = np.frexp(np.asarray(last - first + 1, np.float64))[1] - 1
    part = np.asarray(values, np.float64)
    for power in range(int(level.max(initial=-1)) + 1):
        here = np.flatnonzero(level == power)
        found[here] = np.maximum(part[first[here]], part[last[here] - (1 << power) + 1])
        part = np.maximum(part[: -(1 << power)], part[1 << power :])
    return found


def runs_of(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield where every run of true samples begins, and where it is over.

    Examples
    --------
    >>> list(runs_of(np.array([True, True, False, True])))
    [(0, 2), (3, 4)]
    """
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
