"""Is a MAVLink frame's checksum right?

CRC-16/MCRF4XX (polynomial 0x8408 reflected, start 0xFFFF, no final xor) over everything from the
length byte to the end of the payload and one CRC_EXTRA byte per message. With numpy all frames of
one length at once, two bytes a step; the compiled walk takes eight bytes a step with `byte_tables`.
"""

from __future__ import annotations

from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import FrameChecks
from fdi.telemetry.formats.gather import gather

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Words = NDArray[np.uint16]

_ROWS: Final = 1 << 14  # frames checked at once: the block stays in the cache


@cache
def byte_tables() -> Words:
    """Return (8, 256): row k is the remainder of a byte that k more bytes follow."""
    one = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        one = np.where(one & 1, (one >> 1) ^ np.uint16(0x8408), one >> 1).astype(np.uint16)
    rows = [one]
    for _ in range(7):
        rows.append((rows[-1] >> 8) ^ one[rows[-1] & 0xFF])
    tables = np.array(rows)
    tables.flags.writeable = False
    return tables


@cache
def _word_table() -> Words:
    """Return (65536,): the step of two bytes."""
    one = byte_tables()[0]
    two = np.arange(65536, dtype=np.uint16)
    for _ in range(2):
        two = (two >> 8) ^ one[two & 0xFF]
    two.flags.writeable = False
    return two


def checksum_is_right(
    data: Bytes,
    at: Ints,
    covered: NDArray[np.int16],
    number: NDArray[np.int32],
    checks: FrameChecks,
) -> NDArray[np.bool_]:
    """Return which frames have the checksum that follows them, (n,) bool.

    Parameters
    ----------
    at : (n,) int
        Offsets of the frames' length bytes.
    covered : (n,) int16
        Bytes from there to the end of the payload.
    number : (n,) int32
        Message numbers, all known.
    """
    right = np.zeros(at.size, np.bool_)
    order = np.argsort(covered, kind="stable")
    bounds = np.flatnonzero(np.diff(covered[order], prepend=-1, append=-1))
    for low, high in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        count = int(covered[order[low]])
        for first in range(low, high, _ROWS):
            rows = order[first : min(first + _ROWS, high)]
            extra = checks.extra[number[rows]].astype(np.uint16)
            block = gather(data, at[rows], count + 2)
            stored = block[:, count] | block[:, count + 1].astype(np.uint16) << 8
            right[rows] = _remainder(block[:, :count], extra) == stored
    return right


def _remainder(block: Bytes, extra: Words) -> Words:
    """Return the CRC of every row of (m, count) bytes and one byte more."""
    one, two = byte_tables()[0], _word_table()
    crc = np.full(block.shape[0], 0xFFFF, np.uint16)
    if block.shape[1] % 2:
        crc = (crc >> 8) ^ one[(crc ^ block[:, 0]) & 0xFF]
        block = block[:, 1:]
    for word in np.ascontiguousarray(block.view("<u2").T):
        crc = two.take(crc ^ word)
    done: Words = (crc >> 8) ^ one[(crc ^ extra) & 0xFF]
    return done
