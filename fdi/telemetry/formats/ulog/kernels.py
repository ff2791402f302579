"""Which loops over the messages of a ULog run as machine code?

Each says the same as the numpy code that it stands in for, byte by byte: see ``bytes/compiled.py``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


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
