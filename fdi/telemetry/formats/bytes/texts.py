"""Which of many rows of bytes are alike, and what do they say as texts?

Logs repeat few texts many times: each distinct one is decoded once.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

# odd, for hashes that have nothing to do with each other: what is left after these is sorted
_FACTORS: Final = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93)
_SLOTS: Final = 2  # per row


def distinct(rows: Bytes) -> tuple[Ints, Ints]:
    """Return where each distinct row stands first, (k,) ascending, and which one each row is, (n,).

    Notes
    -----
    The first row that falls into a slot of a hash table stands for all that fall there; those that
    differ from it try again with another hash. That takes a tenth of the time of sorting texts.
    """
    n, width = rows.shape
    padded = np.zeros((n, -(-width // 8) * 8), np.uint8)
    padded[:, :width] = rows
    words = padded.view(np.uint64).T
    first, left = np.arange(n), np.arange(n)
    bits = max(_SLOTS * n, 2).bit_length()
    table = np.empty(1 << bits, np.int32 if n < 1 << 31 else np.int64)
    for factor in _FACTORS:
        keys = words if left.size == n else words[:, left]
        slot = _hash(keys, np.uint64(factor)) >> np.uint64(64 - bits)
        table[slot[::-1]] = left[::-1]
        of_slot = table[slot]
        is_other = np.zeros(left.size, np.bool_)
        for word, key in zip(words, keys, strict=True):
            is_other |= word[of_slot] != key
        first[left] = of_slot
        left = left[is_other]
        if not left.size:
            break
    if left.size:
        items = padded[left].view(f"V{padded.shape[1]}").reshape(-1)
        _, at, which = np.unique(items, return_index=True, return_inverse=True)
        first[left] = left[at[which.reshape(-1)]]
    places = np.flatnonzero(first == np.arange(n))
    number = np.empty(n, np.int64)
    number[places] = np.arange(places.size)
    return places, number[first]


def _hash(words: NDArray[np.uint64], factor: np.uint64) -> NDArray[np.uint64]:
    mixed = np.zeros(words.shape[1], np.uint64)
    for word in words:
        mixed = (mixed ^ (mixed >> np.uint64(29)) ^ word) * factor
    return mixed


def coded(values: NDArray[Any]) -> tuple[NDArray[Any], Ints]:
    """Return the distinct texts, (k,) `str`, and which of them each value is, (n,).

    They end at the first NUL; what is not UTF-8 is Latin-1.
    """
    rows = np.ascontiguousarray(values).view(np.uint8)
    first, place = distinct(rows.reshape(values.size, values.dtype.itemsize))
    decoded = np.empty(first.size, object)
    for i, raw in enumerate(values[first].tolist()):
        cut = raw.split(b"\0")[0]
        try:
            decoded[i] = cut.decode("utf-8")
        except UnicodeDecodeError:
            decoded[i] = cut.decode("latin-1")
    return decoded, place


def texts(values: NDArray[Any]) -> NDArray[Any]:
    """Return the texts, (n,) `str`, as `coded` decodes them."""
    decoded, place = coded(values)
    found: NDArray[Any] = decoded[place]
    return found


def binary(values: NDArray[Any]) -> NDArray[Any]:
    """Return `str` of one character per byte (Latin-1), NULs included."""
    found = np.empty(values.size, object)
    # as bytes of no kind: numpy takes trailing NULs off texts
    raws = np.ascontiguousarray(values).view(f"V{values.dtype.itemsize}").tolist()
    found[:] = [raw.decode("latin-1") for raw in raws]
    return found
