"""How does a column of a flight fit into a page, without losing what matters in it?

In: times and columns, NaN where unknown. Out: fewer samples that keep every extreme, and a short
text that a browser turns back into numbers. Neighbouring samples share a bucket, of which the
least and the largest known value are kept, in the order in which they came as far as the bucket's
ends tell. A time within a bucket is so off by less than the bucket is long.
"""

from __future__ import annotations

import base64
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SMALL: Final = 1e-3
"""A column that varies by less than this share of its size is kept as what it varies by: 32 bits
hold seven digits, and a latitude needs nine."""
GAP_PERIODS: Final = 5.0
GAP_S: Final = 2.0
"""Where samples are missing for longer than both, a line is broken (chosen, for the eye only)."""


def thinned(
    t: Floats, values: Floats, most: int, keep: tuple[float, float] | None = None
) -> tuple[Floats, Floats]:
    """Return about ``most`` samples at the most that hold the extremes of every column.

    Parameters
    ----------
    t : (n,) float
        s, ascending.
    values : (k, n) float
        NaN where unknown.
    most : int
    keep : (float, float), optional
        Between these times all samples are kept, beside those.

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
    width = -(-2 * count // most)
    first = np.arange(0, count, width)
    if keep is not None:
        low, high = int(np.searchsorted(t, keep[0])), int(np.searchsorted(t, keep[1], side="right"))
        first = np.union1d(first, np.arange(low, min(high + 1, count)))
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
