"""Which frames are whole in the bytes that a link has brought so far?

In: bytes of a link, which hold no stamps, in pieces of any length. Out: the frames whose checksum
is right, in order, and how many bytes are done with: what follows is the beginning of a frame and
comes again with the next piece. Checks and rules are those of files (``frames.py``): of overlapping
frames the first counts, and a frame of an unknown message, whose checksum nobody can tell, is none.

At most one frame (280 bytes) is held back, whatever comes: memory stays bounded, and noise costs
one pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import ID_LIMIT, FrameChecks
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.tlog.checksum import checksum_is_right

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

_V2: Final = 0xFD
_HEAD: Final = 10  # bytes of a MAVLink 2 header
_SIGNED: Final = 13


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """The whole frames of a piece, (n,) each; ``done``: bytes that need not come again."""

    data: Bytes
    start: Ints
    end: Ints
    payload: Ints
    length: Ints
    number: Ints
    system: Ints
    component: Ints
    done: int

    def of(self, rows: NDArray[np.bool_] | Ints) -> Piece:
        """Return some of the frames."""
        return Piece(
            self.data,
            self.start[rows],
            self.end[rows],
            self.payload[rows],
            self.length[rows],
            self.number[rows],
            self.system[rows],
            self.component[rows],
            self.done,
        )

    def bytes_of(self, row: int, size: int) -> bytes:
        """Return a payload at a full length: what was cut is zero."""
        low = int(self.payload[row])
        part = self.data[low : low + min(int(self.length[row]), size)]
        return part.tobytes().ljust(size, b"\0")

    def records(self, stamp_us: int) -> bytes:
        """Return the frames as records of a tlog, all with one stamp."""
        stamp = stamp_us.to_bytes(8, "big")
        data = self.data.tobytes()
        ends = zip(self.start.tolist(), self.end.tolist(), strict=True)
        return b"".join([stamp + data[low:high] for low, high in ends])


def whole_frames(data: Bytes, checks: FrameChecks, *, is_last: bool = False) -> Piece:
    """Return the whole frames of a piece.

    Parameters
    ----------
    data : (n,) uint8
        What was left of the piece before, and what has come since.
    checks : FrameChecks
    is_last : bool
        Nothing follows: what is incomplete does not hold back what lies behind it.
    """
    start = np.flatnonzero((data - np.uint8(_V2)) < 2)  # FD, FE -> 0, 1
    head = gather(data, start, _HEAD).astype(np.int64)
    is_v2 = head[:, 0] == _V2
    length = head[:, 1]
    long = head[:, 7] | head[:, 8] << 8 | head[:, 9] << 16
    number = np.minimum(np.where(is_v2, long, head[:, 5]), ID_LIMIT)
    payload = start + np.where(is_v2, _HEAD, 6)
    end = payload + length + 2 + np.where(is_v2, _SIGNED * (head[:, 2] & 1), 0)
    is_cut = start + np.where(is_v2, _HEAD, 6) > data.size  # its header is still to come
    fits = is_v2 | (length <= checks.size[number])
    fits &= (checks.extra[number] >= 0) & (~is_v2 | (head[:, 2] & 0xFE == 0))
    is_whole = ~is_cut & (end <= data.size)
    rows = np.flatnonzero(fits & is_whole)
    covered = (length + np.where(is_v2, 9, 5)).astype(np.int16)
    right = checksum_is_right(
        data, start[rows] + 1, covered[rows], number[rows].astype(np.int32), checks
    )
    is_right = np.zeros(start.size, np.bool_)
    is_right[rows[right]] = True
    waits = (is_cut | (fits & ~is_whole)) & (not is_last)
    found, done = _in_order(start, end, is_right, waits, data.size)
    system = np.where(is_v2, head[:, 5], head[:, 3])
    component = np.where(is_v2, head[:, 6], head[:, 4])
    return Piece(data, start, end, payload, length, number, system, component, done).of(found)


def _in_order(
    start: Ints, end: Ints, is_right: NDArray[np.bool_], waits: NDArray[np.bool_], size: int
) -> tuple[Ints, int]:
    """Return the rows of frames that do not overlap, and how many bytes are done with."""
    found: list[int] = []
    reach = 0
    for row in np.flatnonzero(is_right | waits).tolist():
        if start[row] < reach:
            continue
        if waits[row]:
            return np.array(found, np.int64), int(start[row])
        found.append(row)
        reach = int(end[row])
    return np.array(found, np.int64), size
