"""Which loops over the records of a DataFlash log run as machine code?

Each says the same as the numpy code that it stands in for, byte by byte: see ``bytes/compiled.py``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def walk_records(
    data: NDArray[np.uint8],
    place: int,
    limit: int,
    lengths: NDArray[np.uint8],
    starts: NDArray[Any],
    types: NDArray[np.uint8],
) -> tuple[int, int]:
    """Fill in the DataFlash records that follow each other from a byte on, up to the limit.

    ``lengths`` (256,) are those of the types, 0 for unknown ones; ``starts`` and ``types`` are
    filled with first bytes and types. Returns how many there are and where the last one ends.
    """
    count = np.uint64(0)
    at = np.uint64(place)
    room = np.uint64(starts.size)
    stop = np.uint64(max(min(limit, data.size - 2), 0))
    while at < stop and count < room:
        kind = data[at + np.uint64(2)]
        length = lengths[kind]
        if data[at] != 0xA3 or data[at + np.uint64(1)] != 0x95 or length == 0:
            break
        starts[count] = at
        types[count] = kind
        count += np.uint64(1)
        at += np.uint64(length)
    return int(count), int(at)


def group_records(
    start: NDArray[Any], types: NDArray[np.uint8], free: NDArray[np.int64], grouped: NDArray[Any]
) -> None:
    """Put records, in file order, to those of their type.

    ``free`` (256,) says where in ``grouped`` the next one of a type goes, before and after.
    """
    for row in range(np.uint64(start.size)):
        kind = types[row]
        grouped[np.uint64(free[kind])] = start[row]
        free[kind] += 1


def copy_records(
    data: NDArray[np.uint8],
    start: NDArray[Any],
    types: NDArray[np.uint8],
    lengths: NDArray[np.int64],
    free: NDArray[np.int64],
    blocks: NDArray[np.uint8],
) -> None:
    """Copy records, in file order, to those of their type.

    ``lengths`` (256,) are those of the types, 0 for those that are left out; ``free`` (256,) says
    where in ``blocks`` the next one of a type goes, before and after.
    """
    for row in range(np.uint64(start.size)):
        kind = types[row]
        low, length = np.uint64(start[row]), np.uint64(lengths[kind])
        at = np.uint64(free[kind])
        for i in range(length):
            blocks[at + i] = data[low + i]
        free[kind] += lengths[kind]


def find_definitions(data: NDArray[np.uint8], places: NDArray[np.int64]) -> int:
    """Fill in where ``A3 95 80`` stands, as many as there is room for; return how many there are.

    A block is searched for the smallest difference from these bytes, without a branch (9 GB/s), and
    byte by byte only where that is none.
    """
    one, two, block = np.uint64(1), np.uint64(2), np.uint64(512)
    count, low = np.uint64(0), np.uint64(0)
    size, room = np.uint64(max(data.size - 2, 0)), np.uint64(places.size)
    while low < size:
        high = min(low + block, size)
        least = np.uint8(255)
        for i in range(low, high):
            first = data[i] ^ np.uint8(0xA3)
            apart = first | (data[i + one] ^ np.uint8(0x95)) | (data[i + two] ^ np.uint8(0x80))
            least = min(least, apart)
        if least == 0:
            for i in range(low, high):
                if data[i] == 0xA3 and data[i + one] == 0x95 and data[i + two] == 0x80:
                    if count < room:
                        places[count] = i
                    count += one
        low = high
    return int(count)
