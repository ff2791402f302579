"""From when to when does something hold, in records that come now and then?

In: times of records and what holds at them. Out: spans (from, to). What a record says holds until
the next one; the last one holds where it stands.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fdi.windows import runs_of

Floats = NDArray[np.float64]
Span = tuple[float, float]


def spans_of(t: Floats, holds: NDArray[np.bool_]) -> tuple[Span, ...]:
    """Return from when to when something holds.

    Parameters
    ----------
    t : (n,) float, s
    holds : (n,) bool

    Examples
    --------
    >>> spans_of(np.arange(5.0), np.array([False, True, True, False, True]))
    ((1.0, 3.0), (4.0, 4.0))
    """
    if not t.size:
        return ()
    ends = np.append(t, t[-1])
    return tuple((float(t[first]), float(ends[after])) for first, after in runs_of(holds))


def lasting(spans: Sequence[Span], least: float) -> tuple[Span, ...]:
    """Return the part of each span that lies ``least`` s or more after its beginning."""
    return tuple((low + least, high) for low, high in spans if high - low > least)


def within(spans: Sequence[Span], window: Span) -> tuple[Span, ...]:
    """Return the parts of spans that lie in a window."""
    low, high = window
    cut = ((max(low, a), min(high, b)) for a, b in spans if b >= low and a <= high)
    return tuple((a, b) for a, b in cut if a <= b)


def gaps(t: Floats, longest: float, end: float) -> tuple[Span, ...]:
    """Return where records stay away for longer than ``longest`` s, from the last to the next.

    ``end``: until when the recorder ran, s.
    """
    if not t.size:
        return ()
    edges = np.append(t, max(end, float(t[-1])))
    wide = np.flatnonzero(np.diff(edges) > longest)
    return tuple(zip(edges[wide].tolist(), edges[wide + 1].tolist(), strict=True))


def largest(t: Floats, values: Floats, window: Span) -> float | None:
    """Return the largest known value in a window, None without any.

    Examples
    --------
    >>> largest(np.arange(4.0), np.array([9.0, 1.0, np.nan, 2.0]), (1.0, 3.0))
    2.0
    """
    known = values[(t >= window[0]) & (t <= window[1]) & np.isfinite(values)]
    return float(known.max()) if known.size else None


def period(t: Floats) -> float:
    """Return the median time between records, s; 0 where there are too few."""
    return float(np.median(np.diff(t))) if t.size > 1 else 0.0
