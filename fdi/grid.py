"""Which times lie on a uniform grid, if the records at hand can fill it?

In: from when to when and how far apart, and how many records there are. Out: the times. Here alone
does an array become as long as a span of time says; and as a damaged clock can say anything, no
longer than `LEAST` and so much for every record.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError

Floats = NDArray[np.float64]

LEAST: Final = 36_000
"""Points whatever there is of records: an hour, the longest silence that a log's clock leaves in it
(`fdi.telemetry.clock`), at 10 Hz, the fastest rate that is chosen by itself."""
PER_RECORD: Final = 50
"""A longer grid would be without a record nearly everywhere: the finest step, 20 ms, of what comes
once a second."""


def uniform(start: float, end: float, step: float, *, records: int) -> Floats:
    """Return ``start``, ``start + step``, ... before ``end``, (n,).

    Parameters
    ----------
    start, end, step : float
        s; the step may be negative.
    records : int
        That are to be held against the grid.

    Raises
    ------
    LogError
        The grid is longer than so many records can fill.

    Examples
    --------
    >>> uniform(1.0, 2.0, 0.25, records=4).tolist()
    [1.0, 1.25, 1.5, 1.75]
    """
    with np.errstate(all="ignore"):
        checked(float(np.ceil(np.divide(end - start, step))), records, f"{abs(end - start):g} s")
    return np.arange(start, end, step, dtype=np.float64)


def checked(
    count: float, records: int, what: str, *, least: int = LEAST, per_record: int = PER_RECORD
) -> int:
    """Return a number of points, if so many records can fill them.

    Parameters
    ----------
    count : float
        Below 0 stands for none.
    what : str
        What is to be laid out, for the message.

    Raises
    ------
    LogError
        They cannot.
    """
    if not count <= least + per_record * records:
        said = f"{what} make {count:.0f} points, and there are {records} records"
        raise LogError(f"its times are nonsense: {said}")
    return max(int(count), 0)
