"""How does a column of a flight fit into a page, without losing what matters in it?

In: times and columns, NaN where unknown. Out: fewer samples that keep every extreme, and a short
text that a browser turns back into numbers. Neighbouring samples share a bucket, of which the
least and the largest known value are kept, in the order in which they came as far as the bucket's
ends tell. A time within a bucket is so off by less than the bucket is long.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Spans = Sequence[tuple[float, float]]

SMALL: Final = 1e-3
"""A column that varies by less than this share of its size is kept as what it varies by: 32 bits
hold seven digits, and a latitude needs nine."""
GAP_PERIODS: Final = 5.0
GAP_S: Final = 2.0
"""Where samples are missing for longer than both, a line is broken (chosen, for the eye only)."""


def thinned(t: Floats, values: Floats, most: int, keep: Spans = ()) -> tuple[Floats, Floats]:
    """Return about ``most`` samples at the most that hold the extremes of every column.

    Parameters
    ----------
    t : (n,) float
        s, ascending.
    values : (k, n) float
        NaN where unknown.
    most : int
    keep : sequence of (float, float)
        What lies between these times, s, goes before the rest: it may have half of the room, and
        is whole where that suffices.

    Returns
    -------
    (m,) float and (k, m) float

    Examples
    --------
    >>> t = np.arange(8.0)
    >>> v = np.array([[0.0, 9.0, 0.0, 1.0, 2.0, 3.0, np.nan, 4.0]])
    >>> [part.tolist() for part in thinned(t, v, 4)]
    [[0.0, 3.0, 4.0, 7.0], [[0.0, 9.0, 2.0, 4.0]]]
    """
    count = len(t)
    if count <= most:
        return t, values
    first = _buckets(t, most, keep)
    last = np.append(first[1:], count) - 1
    least = np.fmin.reduceat(values, first, axis=1)
    largest = np.fmax.reduceat(values, first, axis=1)
    with np.errstate(invalid="ignore"):
        falls = values[:, first] > values[:, last]
    pairs = np.stack(
        [np.where(falls, largest, least), np.where(falls, least, largest)], axis=2
    ).reshape(len(values), 2 * len(first))
    times = np.stack([t[first], t[last]], axis=1).ravel()
    needed = np.ones(len(times), bool)
    needed[1::2] = last > first
    return times[needed], pairs[:, needed]


def _buckets(t: Floats, most: int, keep: Spans) -> NDArray[np.intp]:
    """Return the first sample of every bucket, ascending; a bucket of several gives two samples."""
    is_kept = np.zeros(len(t), bool)
    for low, high in keep:
        is_kept[np.searchsorted(t, low) : np.searchsorted(t, high, side="right")] = True
    kept = int(is_kept.sum())
    fine = 1 if kept <= most // 2 else -(-2 * kept // max(most // 2, 2))
    used = kept if fine == 1 else most // 2
    coarse = -(-2 * (len(t) - kept) // max(most - used, 2))
    edges = np.flatnonzero(np.diff(is_kept)) + 1
    parts = [
        np.arange(low, high)[:: fine if is_kept[low] else max(coarse, 1)]
        for low, high in zip([0, *edges.tolist()], [*edges.tolist(), len(t)], strict=True)
    ]
    return np.concatenate(parts)


def packed(values: Floats) -> dict[str, Any]:
    """Return a column as JSON: ``c`` a constant, ``i`` 16-bit integers, or ``f`` floats plus ``b``.

    Numbers are little-endian in base64.

    Examples
    --------
    >>> packed(np.array([2.0, 2.0])), packed(np.array([1.0, -1.0]))
    ({'c': 2.0}, {'i': 'AQD//w=='})
    >>> packed(np.array([np.nan, np.nan]))
    {'c': None}
    """
    known = values[np.isfinite(values)]
    if not known.size:
        return {"c": None}
    low, high = float(known.min()), float(known.max())
    if known.size == values.size:
        if low == high:
            return {"c": float(f"{low:.9g}")}
        if low >= -32768 and high <= 32767 and (known == np.round(known)).all():
            return {"i": base64.b64encode(values.astype("<i2").tobytes()).decode()}
    base = low if high - low < SMALL * max(abs(low), abs(high)) else 0.0
    with np.errstate(over="ignore"):
        text = base64.b64encode((values - base).astype("<f4").tobytes()).decode()
    return {"f": text, "b": base} if base else {"f": text}


def gaps(t: Floats) -> NDArray[np.bool_]:
    """Return after which samples a line is broken, (n - 1,) bool, since records are missing."""
    if len(t) < 2:
        return np.zeros(0, bool)
    steps = np.diff(t)
    missing: NDArray[np.bool_] = steps > max(GAP_S, GAP_PERIODS * float(np.median(steps)))
    return missing
