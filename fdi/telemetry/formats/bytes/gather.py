"""Which bytes lie at these offsets?

In: the bytes of a file and where records begin in them. Out: one row per record. Records lie at
any offset, so the file is seen as overlapping items of the row's width, one per byte: then numpy
copies an item at a time, 5 GB/s, where an index per byte would take a hundred times as long.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]


def gather(data: Bytes, at: Ints, count: int) -> Bytes:
    """Return (m, count) bytes: row i is data[at[i] : at[i] + count], zero beyond the data's end."""
    if not at.size or not count:
        return np.zeros((at.size, count), np.uint8)
    whole = max(data.size - count + 1, 0)
    if int(at.max()) < whole:
        return _gather_whole(data, at, count)
    rows = np.zeros((at.size, count), np.uint8)
    inside = at < whole
    rows[inside] = _gather_whole(data, at[inside], count)
    for row in np.flatnonzero(~inside):  # the last few records of a file
        rest = data[at[row] : at[row] + count]
        rows[row, : rest.size] = rest
    return rows


def _gather_whole(data: Bytes, at: Ints, count: int) -> Bytes:
    if not at.size:
        return np.zeros((0, count), np.uint8)
    items: NDArray[np.void] = np.ndarray(
        (data.size - count + 1,), f"V{count}", buffer=data, strides=(1,)
    )
    return items[at].view(np.uint8).reshape(-1, count)
