"""Is a MAVLink frame's checksum right?

CRC-16/MCRF4XX (polynomial 0x8408 reflected, start 0xFFFF, no final xor) over everything from the
length byte to the end of the payload and one CRC_EXTRA byte per message. With numpy two bytes a
step, over thousands of frames at once and somewhat beyond their ends; the CRC at the end of each
is picked from those of all steps. The compiled walk takes eight bytes a step with `byte_tables`.
"""

from __future__ import annotations

from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import FrameChecks
from fdi.telemetry.formats.bytes.gather import gather

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Words = NDArray[np.uint16]

_WIDTHS: Final = (32, 48, 64, 96, 272)  # bytes of a frame that are looked at: the longest has 266
_BYTES: Final = 1 << 19  # of frames looked at together: they stay in the cache


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
    least = -1
    for width in _WIDTHS:
        rows = np.flatnonzero((covered > least) & (covered <= width - 2))
        least = width - 2
        for low in range(0, rows.size, _BYTES // width):
            some = rows[low : low + _BYTES // width]
            extra = checks.extra[number[some]].astype(np.uint16)
            right[some] = _is_right(gather(data, at[some], width), covered[some], extra)
    return right


def _is_right(rows: Bytes, covered: NDArray[np.int16], extra: Words) -> NDArray[np.bool_]:
    """Return which rows of bytes are followed by their checksum; every one has room for it."""
    count, width = rows.shape
    words = np.ascontiguousarray(rows.view("<u2").T)
    after = np.full(words.shape, 0xFFFF, np.uint16)  # row k: the CRC over k words of every frame
    mixed, table = np.empty(count, np.uint16), _word_table()
    for k in range(words.shape[0] - 1):
        np.bitwise_xor(after[k], words[k], out=mixed)
        table.take(mixed, out=after[k + 1], mode="clip")
    here, flat = np.arange(count), rows.reshape(-1)
    end = here * width + covered
    crc = after.reshape(-1).take(covered.astype(np.int64) // 2 * count + here)
    crc = np.where(covered & 1, _step(crc, flat.take(end - 1)), crc)
    stored = flat.take(end) | flat.take(end + 1).astype(np.uint16) << 8
    is_right: NDArray[np.bool_] = _step(crc, extra) == stored
    return is_right


def _step(crc: Words, byte: Bytes | Words) -> Words:
    after: Words = (crc >> 8) ^ byte_tables()[0].take((crc ^ byte) & 0xFF)
    return after
