"""Which frames came twice?

Two links of one vehicle put identical frames into one file: same sender, number, sequence and
payload. A repeat within a second is left out (the sequence alone comes round after 256 frames, at
100 a second that is 2.6 s). A sender that does not count its frames is left alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.mavlink_frames import Frames
from fdi.telemetry.quality import QualityRecord

_SOON_US: Final = 1_000_000
_WORTH_LOOKING: Final = 0.001  # share of steps that do not count on; less is not worth the sorting
_COUNTS: Final = 0.2  # share of steps that count on; with four links in one file it is a quarter


def without_repeats(frames: Frames) -> tuple[Frames, list[QualityRecord]]:
    """Return the frames without repeats, and how many these were."""
    may_repeat = _may_repeat(frames)
    if not may_repeat.any():
        return frames, []
    end = frames.payload + frames.length
    key = frames.number.astype(np.uint64) << 40
    for shift, part in (
        (32, frames.system),
        (24, frames.component),
        (16, frames.sequence),
        (8, frames.data[end]),  # the checksum stands for the payload
        (0, frames.data[end + 1]),
    ):
        key |= part.astype(np.uint64) << shift
    order = np.argsort(key, kind="stable")
    stamp = np.minimum(frames.stamp_us, np.uint64(2**62)).astype(np.int64)[order]
    again = (np.diff(key[order]) == 0) & (np.abs(np.diff(stamp)) < _SOON_US)
    again &= may_repeat[order[1:]]
    keep = np.ones(key.size, np.bool_)
    keep[order[1:][again]] = False
    count = int((~keep).sum())
    if not count:
        return frames, []
    rows = np.flatnonzero(keep)
    text = f"{count} messages came twice within a second: the first of each is kept"
    return _rows(frames, rows), [QualityRecord("duplicate", None, None, None, count, text)]


def _may_repeat(frames: Frames) -> NDArray[np.bool_]:
    """Return which frames are of a sender that counts them, but not always on: (n,) bool."""
    sender = frames.system.astype(np.uint16) << 8 | frames.component
    order = np.argsort(sender, kind="stable")
    same = np.diff(sender[order]) == 0
    step = np.mod(np.diff(frames.sequence[order].astype(np.int16)), 256)[same]
    whose = sender[order][1:][same]
    steps = np.maximum(np.bincount(whose, minlength=1 << 16), 1)
    stands = np.bincount(whose[(step == 0) | (step > 128)], minlength=1 << 16) / steps
    counts = np.bincount(whose[(step > 0) & (step <= 128)], minlength=1 << 16) / steps
    found: NDArray[np.bool_] = ((stands > _WORTH_LOOKING) & (counts > _COUNTS))[sender]
    return found


def _rows(frames: Frames, rows: NDArray[np.int64]) -> Frames:
    return replace(
        frames,
        start=frames.start[rows],
        payload=frames.payload[rows],
        length=frames.length[rows],
        version=frames.version[rows],
        number=frames.number[rows],
        sequence=frames.sequence[rows],
        system=frames.system[rows],
        component=frames.component[rows],
        stamp_us=frames.stamp_us[rows],
    )
