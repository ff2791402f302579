"""What do healthy flights do at a time, and how far is another flight off?

In: the courses of healthy flights. Out: a `Band`: middle and half width of what 90 % of their
samples do within `WINDOW_S` of that time, no narrower than what 90 % of the samples of all their
time do, since healthy flights turn and climb at other times than this one does, and than what the
model itself allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.comparison.values import Band, Course, Floats
from fdi.grid import uniform

STEP_S: Final = 5.0
WINDOW_S: Final = 10.0
TAIL: Final = 0.05
"""Share of samples that may lie beyond each edge; healthy flights are held against it below."""
HOLD_S: Final = 1.0
"""A difference counts as far as it is held for so long: one sample is no difference."""
LEAST: Final = 5
"""Samples; of fewer nothing is said."""


def band_of(courses: Sequence[Course]) -> Band:
    """Return the band of courses: (k, b) over times from take-off to after the longest."""
    longest = max((float(one.t[-1]) for one in courses if len(one.t)), default=0.0)
    # the last of them is later than all: what is known there is what all their time shows
    records = sum(len(one.t) for one in courses)
    t = uniform(0.0, longest + WINDOW_S + 2 * STEP_S, STEP_S, records=records)
    low, high = quantiles(np.concatenate([one.values for one in courses], axis=1))
    edges = np.full((2, len(low), len(t)), np.nan)
    for place, centre in enumerate(t):
        parts = []
        for one in courses:
            a, b = np.searchsorted(one.t, (centre - WINDOW_S, centre + WINDOW_S))
            parts.append(one.values[:, a:b])
        edges[0, :, place], edges[1, :, place] = quantiles(np.concatenate(parts, axis=1))
    lower, upper = np.fmin(edges[0], low[:, None]), np.fmax(edges[1], high[:, None])
    floor = np.median(np.concatenate([one.floor for one in courses], axis=1), axis=1)
    return Band(t, (lower + upper) / 2, np.maximum((upper - lower) / 2, floor[:, None]))


def quantiles(values: Floats) -> tuple[Floats, Floats]:
    """Return both edges of what all but the tails of each row do, (k,); NaN where too few know.

    Examples
    --------
    >>> low, high = quantiles(np.append(np.arange(101.0), np.nan)[None])
    >>> float(low[0]), float(high[0])
    (5.0, 95.0)
    """
    ordered = np.sort(values, axis=1)  # unknown goes last
    count = np.isfinite(ordered).sum(axis=1)
    found = []
    for share in (TAIL, 1.0 - TAIL):
        at = share * np.maximum(count - 1, 0)
        under = np.floor(at).astype(int)
        over = np.minimum(under + 1, np.maximum(count - 1, 0))
        rows = np.arange(len(ordered))
        if ordered.shape[1] == 0:
            found.append(np.full(len(ordered), np.nan))
            continue
        edge = ordered[rows, under] + (at - under) * (ordered[rows, over] - ordered[rows, under])
        found.append(np.where(count >= LEAST, edge, np.nan))
    return found[0], found[1]


def at_times(band: Band, course: Course) -> tuple[Floats, Floats]:
    """Return middle and half width of a band at the times of a course, (k, n).

    The half width is no less than what the model itself allows that flight's residual.
    """
    place = np.clip(np.rint(course.t / STEP_S).astype(int), 0, len(band.t) - 1)
    return band.middle[:, place], np.maximum(band.half[:, place], course.floor)


def distance(band: Band, course: Course) -> tuple[Floats, Floats]:
    """Return how far a course is off the middle of a band, in its half widths, (k, n).

    On the side on which its statement is violated, where it has but one (`Course.way`).

    Returns
    -------
    distance : (k, n) float
        NaN where unknown, or where a band has no width to count in.
    held : (k, n) float
        The least over `HOLD_S` from there on; 0 where something in it is unknown.
    """
    middle, half = at_times(band, course)
    off = _off(course, middle)
    far = np.divide(off, half, out=np.full_like(off, np.nan), where=half > 0)
    far = np.where((half == 0) & (off == 0), 0.0, far)
    step = float(np.median(np.diff(course.t))) if len(course.t) > 1 else HOLD_S
    return far, _least_ahead(np.nan_to_num(far), _samples(step))


def reach(band: Band, course: Course) -> Floats:
    """Return how far a course is off the middle where it leaves a band, held, (k,); else 0."""
    _, held = distance(band, course)
    middle, _ = at_times(band, course)
    step = float(np.median(np.diff(course.t))) if len(course.t) > 1 else HOLD_S
    off = _least_ahead(np.nan_to_num(_off(course, middle)), _samples(step))
    found: Floats = np.where(held > 1, off, 0.0).max(axis=1, initial=0.0)
    return found


def _off(course: Course, middle: Floats) -> Floats:
    """Return how far a course is off the middle on the side that counts, (k, n), 0 on the other."""
    off, way = course.values - middle, course.way[:, None]
    found: Floats = np.where(way == 0, np.abs(off), np.maximum(way * off, 0.0))
    return found


def _samples(step: float) -> int:
    """Return how many samples hold for `HOLD_S`."""
    return int(np.ceil(HOLD_S / step)) + 1


def _least_ahead(values: Floats, size: int) -> Floats:
    """Return the least of each sample and those that follow it; 0 where so many do not follow."""
    held = np.zeros_like(values)
    if values.shape[1] >= size:
        windows: NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(
            values, size, axis=1
        )
        held[:, : windows.shape[1]] = windows.min(axis=2)
    return held
