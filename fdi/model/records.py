"""What did a quantity do lately, record by record? Functions of the records before a moment.

In: the times of a message's records, s, and a quantity at each; NaN is unknown. Out: a column of
the same length. They are for the values of measured fields (``:still``, ``:recent``, ``:over``), at
the rate at which the log has them.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.windows import largest_between, sums_between

Floats = NDArray[np.float64]
Column = NDArray[Any]

FEW_RECORDS: Final = 6
RECENT_S: Final = 3.0
"""The last seconds: longer than a command needs to change, shorter than a vehicle takes to."""
WILD: Final = 1e100
"""Squares of more are none."""
SAME_S: Final = 1e-6
"""Nearer stamps are one: another clock rounds otherwise, and must move no record out of a while."""
GAP_PERIODS: Final = 3.0
GAP_S: Final = 1.0
"""A gap is longer than both: nothing is known of what lies in it."""


def still(t: Column, values: Column) -> Floats:
    """Return for how long, s, a quantity has been exactly the same.

    A few equal records in a row happen by chance, and count as none. Until it has moved once it is
    unknown: what never moves may be connected to nothing.
    """
    with np.errstate(invalid="ignore"):
        moves = np.append(True, values[1:] != values[:-1])  # unknown is not the same
    known = np.isfinite(values)
    moved = np.logical_or.accumulate(np.append(False, moves[1:] & known[1:] & known[:-1]))
    place = np.arange(len(values))
    last = np.maximum.accumulate(np.where(moves, place, 0))
    since: Floats = np.where(place - last >= FEW_RECORDS, t - t[last], 0.0)
    return np.where(known & moved, since, np.nan)


def recent(t: Column, values: Column) -> Floats:
    """Return the mean over the records of the last seconds, this one included.

    Unknown records do not count; without so many seconds of records before it, it is unknown.
    """
    known = np.isfinite(values)
    first = np.searchsorted(t, t - RECENT_S + SAME_S, side="right")
    last = np.arange(1, len(t) + 1)
    total = sums_between(np.where(known, values, 0.0), first, last)
    number = sums_between(known.astype(float), first, last)
    mean: Floats = np.divide(total, number, out=np.full(len(t), np.nan), where=number > 0)
    return np.where(known & (t - t[:1] >= RECENT_S), mean, np.nan)


def change(t: Column, values: Column, seconds: float) -> Floats:
    """Return by how much a quantity has changed since so many seconds ago.

    Between two records it lies on their line. Unknown where it began within a gap; what was in
    between does not matter.

    Examples
    --------
    >>> change(np.arange(5.0), np.array([0.0, 1.0, 4.0, 9.0, 16.0]), 2.0).tolist()
    [nan, nan, 4.0, 8.0, 12.0]
    """
    known, at, _ = _records(t, values)
    found = np.full(len(t), np.nan)
    if len(at):
        own, before = values[known], at - seconds
        after = np.minimum(np.searchsorted(at, before), len(at) - 1)
        told = (before >= at[0]) & ((at[after] == before) | ~_after_gap(at)[after])
        found[known] = np.where(told, own - np.interp(before, at, own), np.nan)
    return found


def integral(t: Column, values: Column, seconds: float) -> Floats:
    """Return the integral of a quantity over the last seconds, by trapezoids.

    Unknown where a gap lies on the way.

    Examples
    --------
    >>> integral(np.arange(5.0), np.array([0.0, 2.0, 4.0, 6.0, 8.0]), 2.0).tolist()
    [nan, nan, 4.0, 8.0, 12.0]
    """
    known, at, ended = _records(t, values)
    found = np.full(len(t), np.nan)
    if len(at) < 2:
        return found
    own, before = values[known], at - seconds
    steps = np.append(np.diff(at) * (own[1:] + own[:-1]) / 2, 0.0)
    place = np.arange(len(at))
    first = np.minimum(np.searchsorted(at, before, side="right"), place)
    whole = sums_between(steps, first, np.maximum(place, first + 1))
    part = (at[first] - before) * (np.interp(before, at, own) + own[first]) / 2
    total = np.where(first < place, whole, 0.0) + part
    found[known] = np.where(before >= ended, total, np.nan)
    return found


def kept(t: Column, values: Column, seconds: float) -> Floats:
    """Return the mean over the last so many seconds of known records, for as long as none follow.

    Unknown until there have been so many seconds without a gap.

    Examples
    --------
    >>> kept(np.arange(5.0), np.array([1.0, 3.0, 5.0, np.nan, np.nan]), 2.0).tolist()
    [nan, nan, 3.0, 3.0, 3.0]
    """
    order = np.argsort(t, kind="stable")
    mean = integral(t, values, seconds)[order] / seconds
    rows = np.where(np.isfinite(mean), np.arange(len(t)), 0)
    found = np.empty(len(t))
    found[order] = mean[np.maximum.accumulate(rows)]
    return found


def sampled(t: Column, values: Column, seconds: float) -> Floats:
    """Return how well a mean over the last seconds is known from these records, one sigma.

    A record tells of the time up to the next one only as far as the quantity keeps to a line in
    between, which is told by how far each lies off the line through its two neighbours: of values
    that scatter by sigma that is 1.5 sigma**2, squared and on average. A jump is no scatter, and
    must not widen what it is held against: of the last seconds and the two spells before, the
    middle one counts. (Of white noise that is 7 % too little with 4 records in that time, and 1 %
    with 50.) Unknown where a gap lies on the way.

    Examples
    --------
    >>> sampled(np.arange(5.0), np.array([0.0, 2.0, 4.0, 6.0, 8.0]), 3.0).tolist()
    [nan, nan, nan, 0.0, 0.0]
    >>> sampled(np.arange(5.0), np.array([0.0, 3.0, 0.0, 3.0, 0.0]), 4.0)[-1].round(2).item()
    1.22
    """
    known, at, ended = _records(t, values)
    found = np.full(len(t), np.nan)
    if len(at) < 3:
        return found
    off, _ = _off_line(at, values[known])
    off = np.concatenate([[0.0], np.clip(off, -WILD, WILD) ** 2 / 1.5, [0.0]])
    first, last, before = _newest(at, seconds)
    square = sums_between(off, first, last) / before / (before + 1)
    earlier = [np.searchsorted(at, at - k * seconds + SAME_S, side="right") - 1 for k in (1, 2)]
    three = [square, *(np.where(e > 0, square[np.maximum(e, 0)], square) for e in earlier)]
    error = np.sqrt(np.median(three, axis=0))
    found[known] = np.where(at - seconds >= ended - SAME_S, error, np.nan)
    return found


def noise(t: Column, values: Column, seconds: float) -> Floats:
    """Return by how much the records of the last seconds scatter from one to the next, one sigma.

    From how far each lies off the line through its two neighbours, so that a drift does not count:
    for white noise it is the noise's own deviation. The mean size and not the square is taken, so
    that a single jump among many records counts for little. Records beside a gap are left out;
    unknown where gaps leave less than half of that time.

    Examples
    --------
    >>> noise(np.arange(6.0), np.array([0.0, 2.0, 4.0, 6.0, 8.0, 10.0]), 3.0).tolist()
    [nan, nan, nan, 0.0, 0.0, 0.0]
    >>> noise(np.arange(6.0), np.array([0.0, 3.0, 0.0, 3.0, 0.0, 3.0]), 4.0)[-1].round(2).item()
    3.07
    """
    known, at, _ = _records(t, values)
    found = np.full(len(t), np.nan)
    if len(at) < 3:
        return found
    off, spread = _off_line(at, values[known])
    beside = _after_gap(at)
    used = np.concatenate([[0.0], ~(beside[1:-1] | beside[2:]), [0.0]])
    # of a normal quantity the mean size is sqrt(2 / pi) of its deviation
    sizes = np.minimum(np.abs(off), WILD) / spread * np.sqrt(np.pi / 2)
    first, last, _ = _newest(at, seconds)
    total = sums_between(np.concatenate([[0.0], sizes, [0.0]]) * used, first, last)
    number = sums_between(used, first, last)
    steps = np.where(beside, 0.0, np.diff(at, prepend=at[0]))
    begun = np.searchsorted(at, at - seconds + SAME_S, side="right")
    told = sums_between(steps, begun, np.arange(1, len(at) + 1))
    enough = (number > 0) & (told >= seconds / 2 - SAME_S)
    mean = np.divide(total, number, out=np.zeros(len(at)), where=number > 0)
    found[known] = np.where(enough & (at - seconds >= at[0] - SAME_S), mean, np.nan)
    return found


def span(t: Column, values: Column, seconds: float) -> Floats:
    """Return how far the largest of the records of the last seconds lies above the smallest.

    Unknown where a gap lies on the way.

    Examples
    --------
    >>> span(np.arange(5.0), np.array([0.0, 3.0, 1.0, 1.0, 1.0]), 2.0).tolist()
    [nan, nan, 3.0, 2.0, 0.0]
    """
    known, at, ended = _records(t, values)
    found = np.full(len(t), np.nan)
    if len(at):
        own, place = values[known], np.arange(len(at))
        first = np.searchsorted(at, at - seconds - SAME_S)
        highest, lowest = largest_between(own, first, place), largest_between(-own, first, place)
        found[known] = np.where(at - seconds >= ended - SAME_S, highest + lowest, np.nan)
    return found


def _off_line(at: Floats, own: Floats) -> tuple[Floats, Floats]:
    """Return how far records lie off the line through their neighbours, the outer two left out.

    And the standard deviation of that, if they scatter by 1 each.
    """
    span = at[2:] - at[:-2]
    share = np.divide(at[1:-1] - at[:-2], span, out=np.full(len(span), 0.5), where=span > 0)
    line = (1 - share) * own[:-2] + share * own[2:]
    return own[1:-1] - line, np.sqrt(1 + share**2 + (1 - share) ** 2)


def _newest(at: Floats, seconds: float) -> tuple[NDArray[np.intp], NDArray[np.intp], Column]:
    """Return from which to which record, that one excluded, the last seconds have both neighbours.

    And how many these are, at least 1: the newest has no neighbour yet, and counts as those before.
    """
    place = np.arange(len(at))
    begun = np.searchsorted(at, at - seconds + SAME_S, side="right")
    first = np.minimum(begun, np.maximum(place - 1, 0))
    return first, np.maximum(place, first + 1), np.maximum(place - first, 1)


def _records(t: Column, values: Column) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Return which records are known, when they came, and when the last gap before each ended.

    In the order of time: the stamps of a recorder may go back.
    """
    known = np.flatnonzero(np.isfinite(values))
    known = known[np.argsort(t[known], kind="stable")]
    at = np.asarray(t[known], np.float64)
    ended = np.maximum.accumulate(np.where(_after_gap(at), at, at[:1]))
    return known, at, ended


def _after_gap(at: Floats) -> NDArray[np.bool_]:
    """Return which records end a gap."""
    steps = np.diff(at)
    longest = max(GAP_S, GAP_PERIODS * float(np.median(steps))) if len(steps) else GAP_S
    return np.append(np.zeros(len(at[:1]), bool), steps > longest)
