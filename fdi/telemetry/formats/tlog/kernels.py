"""How do the frames of a tlog become columns, as loops over bytes?

Kernels for ``bytes/compiled.py``. Each names the numpy code that it stands in for, where the words
are explained; tests hold both against each other byte by byte. They only move and compare whole
numbers: sums of floats may differ in the last bit between compilers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]


def walk_frames(
    data: Bytes,
    extra: NDArray[np.int16],
    sizes: NDArray[np.int16],
    table: NDArray[np.uint16],
    frames: tuple[Ints, Bytes, Bytes, NDArray[np.uint16], Bytes, Bytes, Bytes, NDArray[np.uint64]],
) -> tuple[int, Ints]:
    """Fill in the joined MAVLink frames; return how many, and where others may begin between them.

    Stands in for `frames._joined_frames`.

    Parameters
    ----------
    data : (n,) uint8
    extra, sizes : (m,) int16
        CRC_EXTRA (-1 unknown) and payload size per message number, the last for all beyond.
    table : (8, 256) uint16
        As `checksum.byte_tables`.
    frames : arrays of at least n // 16 rows
        Start, length, version, number, sequence, system, component, stamp.
    """
    size, unknown = data.size, extra.size - 1

    def look(at: int) -> int:
        """Return the record's end; 0 where no header is, -1 where no known frame can be."""
        if at + 16 > size:
            return 0
        if data[at + 8] == 0xFE:
            number, end = np.int64(data[at + 13]), at + 16 + data[at + 9]
            fits = data[at + 9] <= sizes[number]
        elif data[at + 8] == 0xFD and at + 20 <= size and data[at + 10] & 0xFE == 0:
            number = np.int64(data[at + 15]) | np.int64(data[at + 16]) << 8
            number = number if data[at + 17] == 0 else np.int64(unknown)
            end, fits = at + 20 + data[at + 9] + 13 * data[at + 10], True
        else:
            return 0
        return end if extra[number] >= 0 and fits and end <= size else -1

    def is_right(at: int) -> bool:
        stop, number = at + 14 + data[at + 9], np.int64(data[at + 13])
        if data[at + 8] == 0xFD:
            stop, number = stop + 4, np.int64(data[at + 15]) | np.int64(data[at + 16]) << 8
        crc = np.uint16(0xFFFF)
        place = at + 9
        while place + 8 <= stop:
            crc = (
                table[7, data[place] ^ (crc & 0xFF)]
                ^ table[6, data[place + 1] ^ (crc >> 8)]
                ^ table[5, data[place + 2]]
                ^ table[4, data[place + 3]]
                ^ table[3, data[place + 4]]
                ^ table[2, data[place + 5]]
                ^ table[1, data[place + 6]]
                ^ table[0, data[place + 7]]
            )
            place += 8
        if place + 4 <= stop:
            crc = (
                table[3, data[place] ^ (crc & 0xFF)]
                ^ table[2, data[place + 1] ^ (crc >> 8)]
                ^ table[1, data[place + 2]]
                ^ table[0, data[place + 3]]
            )
            place += 4
        while place < stop:
            crc = np.uint16(crc >> 8) ^ table[0, (crc ^ data[place]) & 0xFF]
            place += 1
        crc = np.uint16(crc >> 8) ^ table[0, (crc ^ extra[number]) & 0xFF]
        return bool(crc == (np.uint16(data[stop]) | np.uint16(data[stop + 1]) << 8))

    def joins(at: int, end: int) -> bool:
        joined, before = look(end) != 0, max(at - 288, 0)  # the longest record
        while not joined and before <= at - 16:
            joined = look(before) == at
            before += 1
        return joined

    start, length, version, number, sequence, system, component, stamp = frames
    others = np.empty(1024, np.int64)
    found = left = at = last = 0
    while at + 16 <= size:
        end = look(at)
        if end > 0 and is_right(at) and ((found > 0 and at == last) or joins(at, end)):
            shift = 2 if data[at + 8] == 0xFD else 0
            start[found], length[found], version[found] = at, data[at + 9], 1 + shift // 2
            head = at + 10 + shift
            sequence[found], system[found], component[found] = data[head : head + 3]
            number[found] = data[head + 3]
            if shift:
                number[found] |= np.uint16(data[at + 16]) << 8
            when = np.uint64(0)
            for k in range(8):
                when = when << np.uint64(8) | np.uint64(data[at + k])
            stamp[found] = when
            found += 1
            at = last = end
            continue
        if end != 0:
            if left == others.size:
                longer = np.empty(2 * left, np.int64)
                longer[:left] = others
                others = longer
            others[left] = at
            left += 1
        at += 1
    return found, others[:left].copy()


def number_groups(
    system: Bytes, component: Bytes, number: NDArray[np.uint16], group: NDArray[np.uint32]
) -> Ints:
    """Fill in the group of every frame, counted from 0 as they appear; return the groups' keys.

    A key is system, component and message number in 8, 8 and 16 bits. Stands in for the numbering
    in `groups.group_payloads`.
    """
    senders, numbers = np.full(1 << 16, -1, np.int32), np.full(1 << 16, -1, np.int32)
    width = 512  # more than there are messages in the dialect
    table, keys = np.full(4 * width, -1, np.int64), np.empty(256, np.int64)
    some_senders = some_numbers = found = 0
    for row in range(group.size):
        sender = np.int64(system[row]) << 8 | component[row]
        if senders[sender] < 0:
            senders[sender] = some_senders
            some_senders += 1
            if some_senders * width > table.size:
                larger = np.full(2 * table.size, -1, np.int64)
                larger[: table.size] = table
                table = larger
        if numbers[number[row]] < 0:
            numbers[number[row]] = some_numbers
            some_numbers += 1
        place = np.int64(senders[sender]) * width + numbers[number[row]]
        if table[place] < 0:
            if found == keys.size:
                more = np.empty(2 * found, np.int64)
                more[:found] = keys
                keys = more
            table[place] = found
            keys[found] = sender << 16 | number[row]
            found += 1
        group[row] = table[place]
    return keys[:found].copy()


def spread_payloads(
    data: Bytes,
    frames: tuple[Ints, Bytes, Bytes, NDArray[np.uint32]],
    size: Ints,
    first: tuple[Ints, Ints],
    out: tuple[Ints, Bytes],
) -> None:
    """Write every frame's row and payload to the end of its group, the payload at full length.

    What was cut of a payload is zero. Stands in for the sorting in `groups.group_payloads`
    and for `columns.Payloads.block`.

    Parameters
    ----------
    frames : arrays (n,)
        Start, version, payload length and group 0 .. k - 1 of every frame.
    size : (k,)
        Bytes of a payload of the group at full length.
    first, out : rows and payloads
        Where the groups begin in the two outputs, (k,) each, and the outputs.
    """
    one = np.uint64(1)
    start, version, length, group = frames
    next_row, next_byte = first[0].copy(), first[1].copy()
    rows, payloads = out
    for row in range(start.size):
        whole, at = group[row], np.uint64(start[row] + 10 + 4 * version[row])
        rows[next_row[whole]] = row
        next_row[whole] += 1
        to = np.uint64(next_byte[whole])
        next_byte[whole] += size[whole]
        end = np.uint64(next_byte[whole])
        cut = min(to + np.uint64(length[row]), end)
        while to < cut:
            payloads[to] = data[at]
            to += one
            at += one
        while to < end:
            payloads[to] = 0
            to += one


def spread_values(
    values: NDArray[np.float64],
    group: NDArray[np.uint32],
    first: Ints,
    out: NDArray[np.float64],
) -> None:
    """Write every frame's value to the end of its group; ``first`` (k,): where the groups begin.

    Stands in for the gathering in `groups.Groups.of_each`.
    """
    place = first.copy()
    for row in range(values.size):
        out[place[group[row]]] = values[row]
        place[group[row]] += 1
