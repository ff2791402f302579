"""Which frames came twice?

Two links of one vehicle put identical frames into one file: same sender, number, sequence and
payload. A repeat within a second is left out (the sequence alone comes round after 256 frames, at
100 a second that is 2.6 s). A sender that does not count its frames is left alone.

The checksum stands for the payload, and repeats are looked for between neighbours in its order,
which numpy finds by counting. A stranger with the same checksum within that second (one in 65536)
would hide one repeat, which is no harm.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.tlog.frames import Frames
from fdi.telemetry.quality import QualityRecord

Ints = NDArray[np.int64]

_SOON_US: Final = 1_000_000
_WORTH_LOOKING: Final = 0.001  # share of steps that do not count on; less is not worth the sorting
_COUNTS: Final = 0.2  # share of steps that count on; with four links in one file it is a quarter


def without_repeats(
    frames: Frames, senders: Mapping[tuple[int, int], Ints]
) -> tuple[Frames, list[QualityRecord]]:
    """Return the frames without repeats, and how many these were.

    ``senders``: the rows of every sender's frames.
    """
    keep = np.ones(frames.start.size, np.bool_)
    for rows in senders.values():
        if _may_repeat(frames.sequence[rows]):
            keep[_repeats(frames, rows)] = False
    count = int(keep.size - np.count_nonzero(keep))
    if not count:
        return frames, []
    text = f"{count} messages came twice within a second: the first of each is kept"
    kept = frames.of(np.flatnonzero(keep))
    return kept, [QualityRecord("duplicate", None, None, None, count, text)]


def _may_repeat(sequence: NDArray[np.uint8]) -> bool:
    """Return whether a sender counts its frames, but not always on."""
    if sequence.size < 2:
        return False
    step = (sequence[1:] - sequence[:-1]).view(np.int8)  # -128 .. 127
    counts = int(np.count_nonzero(step > 0)) / step.size
    return 1 - counts > _WORTH_LOOKING and counts > _COUNTS


def _repeats(frames: Frames, rows: Ints) -> Ints:
    """Return which of one sender's frames repeat another one."""
    end = frames.payload[rows] + frames.length[rows]
    checksum = frames.data[end] + frames.data[end + 1] * np.uint16(256)
    order = np.argsort(checksum, kind="stable")
    checksum, rows = checksum[order], rows[order]
    stamp = np.minimum(frames.stamp_us[rows], np.uint64(2**62)).astype(np.int64)
    again = (checksum[1:] == checksum[:-1]) & (np.abs(np.diff(stamp)) < _SOON_US)
    for same in (frames.sequence[rows], frames.number[rows]):
        again &= same[1:] == same[:-1]
    repeated: Ints = rows[1:][again]
    return repeated
