"""Which of many rows of bytes are alike, and what do they say as texts?

Logs repeat few texts many times: each distinct one is decoded once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]


def distinct(rows: Bytes) -> tuple[Ints, Ints]:
    """Return where each distinct row stands first, (k,), and which of these each row is, (n,).

    The distinct rows are in no order of meaning, but in the same one for the same rows.

    Notes
    -----
    Rows are sorted by a hash that has the row's number in its lowest bits, which takes a tenth of
    the time that sorting texts takes; neighbours with the same hash are then compared in full.
    """
    n, width = rows.shape
    if not n:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    padded = np.zeros((n, -(-width // 8) * 8), np.uint8)
    padded[:, :width] = rows
    words = padded.view(np.uint64)
    mixed = np.zeros(n, np.uint64)
    for word in words.T:
        mixed = (mixed ^ (mixed >> np.uint64(29)) ^ word) * np.uint64(0x9E3779B97F4A7C15)
    mask = np.uint64((1 << n.bit_length()) - 1)
    key = (mixed & ~mask) | np.arange(n, dtype=np.uint64)
    key.sort()
    order = (key & mask).astype(np.int64)
    is_new = np.append(True, (key[1:] ^ key[:-1]) > mask)
    is_other = (words[order[1:]] != words[order[:-1]]).any(axis=1)
    if np.any(is_other & ~is_new[1:]):  # two rows share a hash
        whole = padded.view(f"V{padded.shape[1]}").reshape(-1)
        _, first, place = np.unique(whole, return_index=True, return_inverse=True)
        return first, place.reshape(-1)
    which = np.empty(n, np.int64)
    which[order] = np.cumsum(is_new) - 1
    return order[is_new], which


def texts(values: NDArray[Any]) -> NDArray[Any]:
    """Return `str`, cut at the first NUL; what is not UTF-8 is Latin-1."""
    rows = np.ascontiguousarray(values).view(np.uint8)
    first, place = distinct(rows.reshape(values.size, values.dtype.itemsize))
    decoded = np.empty(first.size, object)
    for i, raw in enumerate(values[first].tolist()):
        cut = raw.split(b"\0")[0]
        try:
            decoded[i] = cut.decode("utf-8")
        except UnicodeDecodeError:
            decoded[i] = cut.decode("latin-1")
    found: NDArray[Any] = decoded[place]
    return found


def binary(values: NDArray[Any]) -> NDArray[Any]:
    """Return `str` of one character per byte (Latin-1), trailing NULs cut off."""
    wide = values.view(np.uint8).astype(np.uint32).view(f"U{values.dtype.itemsize}")
    found: NDArray[Any] = wide.astype(object)
    return found
