"""Which loops over bytes run as compiled code, and when is that worth it?

A kernel is a plain function over arrays, in the part of Python that numba compiles. It says
the same as the numpy code that it stands in for, byte by byte; tests hold both against each other.
`compiled` returns it as machine code, or None: then the numpy code does the work. That is so
without numba (extra ``fast``), and for small files: importing numba and loading the kept machine
code costs 0.4 s, as much as reading 50 MB with numpy alone.

The environment variable ``FDI_FAST`` decides otherwise: 0 never, 1 for files of every size.

The traps: a kernel sees no other kernel (what it calls would not be compiled), and an index that
numba takes as signed costs a test for a negative one at every access: count in np.uint64.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_WORTH_BYTES: Final = 5_000_000  # numpy alone reads that in the time that numba needs to start
_SWITCH: Final = "FDI_FAST"


def compiled(kernel: Kernel, size: int) -> Kernel | None:
    """Return the kernel as machine code, None where numpy is to do the work.

    Parameters
    ----------
    kernel : function
        One of this file, or of a file of kernels of one format.
    size : int
        Bytes of the file that it is to walk.

    Notes
    -----
    The machine code is kept beside this file, or in the user's cache where that is read-only.
    """
    wanted = os.environ.get(_SWITCH, "")
    if wanted == "0" or (size < _WORTH_BYTES and wanted != "1"):
        return None
    made: Kernel | None = _machine_code(kernel)
    return made


@cache
def _machine_code(kernel: Callable[..., Any]) -> Any:
    try:
        import numba
    except ImportError:  # not installed, or not for this numpy
        return None
    try:
        return numba.njit(cache=True, nogil=True)(kernel)
    except RuntimeError:  # no folder to keep it in
        return numba.njit(nogil=True)(kernel)


def dataflash_run(
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


def dataflash_group(
    start: NDArray[Any], types: NDArray[np.uint8], free: NDArray[np.int64], grouped: NDArray[Any]
) -> None:
    """Put records, in file order, to those of their type.

    ``free`` (256,) says where in ``grouped`` the next one of a type goes, before and after.
    """
    for row in range(np.uint64(start.size)):
        kind = types[row]
        grouped[np.uint64(free[kind])] = start[row]
        free[kind] += 1


def dataflash_blocks(
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


def dataflash_definitions(data: NDArray[np.uint8], places: NDArray[np.int64]) -> int:
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


def walk_messages(
    data: NDArray[np.uint8],
    word: NDArray[np.uint16],
    long: NDArray[np.uint64],
    part: tuple[int, int],
    tables: tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.uint16]],
    places: tuple[NDArray[np.int64], NDArray[np.uint16], NDArray[np.uint64]],
) -> tuple[int, int]:
    """Return how many data messages of a ULog follow each other, and where they end.

    Stands in for `walk.Walk.follow`, but for one call at most as many as there are places.

    Parameters
    ----------
    data : (n,) uint8
    word, long : uint16, uint64
        `walk.words` of the data.
    part : (int, int)
        First byte, and the byte behind the part of the file.
    tables : (65536,) uint16 each
        By message id: smallest and largest size, place of the stamp in a message.
    places : (m,) each
        Where first bytes, ids and stamps of the messages are put.
    """
    low, high, stamp_at = tables
    out_at, out_number, out_stamp = places
    at, limit, last = np.uint64(part[0]), np.uint64(part[1]), np.uint64(data.size)
    found = np.uint64(0)
    room = np.uint64(out_at.size)
    while found < room and at + np.uint64(5) <= limit and data[at + np.uint64(2)] == 0x44:
        size, number = word[at], word[at + np.uint64(3)]
        end = at + np.uint64(3) + np.uint64(size)
        if size < low[number] or size > high[number] or end > limit:
            break
        place = min(at + np.uint64(stamp_at[number]), last - np.uint64(8))
        out_at[found], out_number[found], out_stamp[found] = at, number, long[place]
        found += np.uint64(1)
        at = end
    return int(found), int(at)


def copy_records(
    data: NDArray[np.uint8],
    at: NDArray[np.int64],
    topics: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]],
    blocks: NDArray[np.uint8],
) -> None:
    """Copy the records of several topics, which lie anywhere in a file, to those of their topic.

    The file is gone through in parts that stay in the cache while every topic takes what it has
    there, so that each byte comes from memory once. Stands in for `gather.gather`.

    Parameters
    ----------
    data : (n,) uint8
    at : (m,) int64
        First bytes of the records, topic by topic, ascending within one.
    topics : (k,) int64 each
        The row behind a topic's last one in ``at``, bytes of a record, first byte in ``blocks``.
    blocks : uint8
        Where the records are put.
    """
    stops, sizes, firsts = topics
    rows, places = np.append(0, stops[:-1]), firsts.copy()
    part = 1 << 19
    for end in range(part, data.size + part, part):
        for topic in range(stops.size):
            row, size, to = np.uint64(rows[topic]), sizes[topic], np.uint64(places[topic])
            while row < np.uint64(stops[topic]) and at[row] < end:
                low = np.uint64(at[row])
                for i in range(np.uint64(size)):
                    blocks[to + i] = data[low + i]
                to += np.uint64(size)
                row += np.uint64(1)
            rows[topic], places[topic] = row, to


def sort_messages(
    number: NDArray[np.uint16],
    at: NDArray[np.int64],
    stamp: NDArray[np.uint64],
    header: int,
    places: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.uint64]],
) -> None:
    """Fill in messages by their ids, those of one id in their order.

    Parameters
    ----------
    number, at, stamp : (n,)
        Ids, and what goes with them.
    header : int
        What is added to ``at``.
    places : (65537,), (n,), (n,)
        Where the messages of an id begin, and the sorted rest.
    """
    bounds, sorted_at, sorted_stamp = places
    for i in range(np.uint64(number.size)):
        bounds[np.uint64(number[i]) + np.uint64(1)] += 1
    following = np.empty(65536, np.uint64)
    for k in range(np.uint64(65536)):
        following[k] = bounds[k]
        bounds[k + np.uint64(1)] += bounds[k]
    for i in range(np.uint64(number.size)):
        place = following[number[i]]
        following[number[i]] = place + np.uint64(1)
        sorted_at[place], sorted_stamp[place] = at[i] + header, stamp[i]
