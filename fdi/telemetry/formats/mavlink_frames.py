"""Where in these bytes are MAVLink frames, and which bytes belong to none?

In: the bytes of a tlog. Out: `Frames`, one row per frame whose checksum is right, in file order,
and the `Damage`: every byte range that no such frame covers, with a kind.

A record is an 8-byte big-endian stamp (microseconds since 1970) and one frame:

========== ============================================================== ========================
magic      header after the magic                                         then
========== ============================================================== ========================
FE (v1)    len, seq, sysid, compid, msgid                                 payload, CRC
FD (v2)    len, incompat, compat, seq, sysid, compid, msgid (3 bytes)     payload, CRC, [13 signed]
========== ============================================================== ========================

CRC-16/MCRF4XX over everything from len to the end of the payload and one CRC_EXTRA byte per
message. A frame with an incompat bit other than 0x01 (signed) has an unknown length: damage.

Method: every position whose ninth byte is a magic is a candidate. Candidates that join another one
end to start are checked first (nearly all true ones, hardly a false one), the others only where
bytes remained uncovered: so the walk resynchronises after any damage, and at the start of the file,
without a loop over frames. Two bytes a step over all frames of one length. The trap: a frame may
carry frames in its payload (tunnels); of overlapping ones those that join others win.

pymavlink loses intact frames where MAVLink 1 and 2 are mixed, and reads nothing from a file whose
first bytes are not a record: as an oracle it needs these exceptions.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import ID_LIMIT, FrameChecks

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Bytes = NDArray[np.uint8]

_V2: Final = 0xFD
_SCAN_BLOCK: Final = 1 << 22  # bytes searched for a magic at once: bounds the memory for masks
_CRC_ROWS: Final = 1 << 14  # frames checked at once: the block stays in the cache
_DAY_US: Final = 86_400_000_000


@dataclass(frozen=True, slots=True)
class Damage:
    """Bytes that belong to no good frame; ``number`` as its header says, where there is one."""

    kind: Literal["lost_bytes", "bad_checksum", "unknown_message", "truncated"]
    offset: int
    size: int
    number: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """The frames of a file in file order, (n,) arrays; offsets in bytes from the file's start."""

    data: Bytes
    start: Ints
    payload: Ints
    length: NDArray[np.uint8]
    version: NDArray[np.uint8]
    number: NDArray[np.int32]
    sequence: NDArray[np.uint8]
    system: NDArray[np.uint8]
    component: NDArray[np.uint8]
    stamp_us: NDArray[np.uint64]
    damage: tuple[Damage, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Candidates:
    start: Ints
    end: Ints
    is_v2: Mask
    length: NDArray[np.uint8]
    number: NDArray[np.int32]

    def __getitem__(self, rows: Mask | Ints) -> _Candidates:
        return _Candidates(
            self.start[rows], self.end[rows], self.is_v2[rows], self.length[rows], self.number[rows]
        )


def find_frames(data: Bytes, checks: FrameChecks) -> Frames:
    """Return every frame of the file whose checksum is right, and the damage.

    Parameters
    ----------
    data : (n,) uint8
        The file's bytes, mapped or in memory.
    checks : FrameChecks
        CRC_EXTRA and payload size of every known message.

    Notes
    -----
    Time is linear in the file's size for any content: a candidate costs at most 134 table steps.
    """
    every = _candidates(data)
    known = checks.extra[np.minimum(every.number, ID_LIMIT)] >= 0
    size = checks.size[np.minimum(every.number, ID_LIMIT)]
    # Only MAVLink 2 can be longer than we know it: newer definitions append extension fields.
    plausible = known & (every.is_v2 | (every.length <= size)) & (every.end <= data.size)
    is_start = np.zeros(data.size + 1, np.bool_)
    is_start[every.start] = True
    is_end = np.zeros(data.size + 1, np.bool_)
    is_end[every.end[plausible]] = True
    inside = np.minimum(every.end, data.size)
    joined = plausible & ((is_start[inside] & (every.end <= data.size)) | is_end[every.start])
    rows = np.flatnonzero(joined)
    good = every[rows[_checksum_is_right(data, every[rows], checks)]]
    good = good[_disjoint(good)]

    rest = np.flatnonzero(plausible & ~joined & (every.length <= size))
    rest = rest[_is_uncovered(every[rest], good)]
    lone = every[rest[_checksum_is_right(data, every[rest], checks)]]
    lone = lone[_has_plausible_stamp(data, lone, good)]
    if lone.start.size:
        good = _merge(good, lone[_disjoint(lone)])
    return _describe(data, good, _damage(data.size, good, every, checks))


def _candidates(data: Bytes) -> _Candidates:
    found = [np.empty(0, np.int64)]
    for low in range(8, data.size, _SCAN_BLOCK):
        block = data[low : low + _SCAN_BLOCK]
        found.append(np.flatnonzero((block - np.uint8(_V2)) < 2) + (low - 8))  # FD, FE -> 0, 1
    start = np.concatenate(found)
    start = start[start + 16 <= data.size]
    is_v2 = data[start + 8] == _V2
    fits = ~is_v2 | (start + 20 <= data.size)
    start, is_v2 = start[fits], is_v2[fits]
    flags = np.where(is_v2, data[start + 10], 0)
    readable = (flags & 0xFE) == 0
    start, is_v2, flags = start[readable], is_v2[readable], flags[readable]
    length = data[start + 9]
    number = data[start + 13].astype(np.int32)
    at = start[is_v2]
    number[is_v2] = (
        data[at + 15].astype(np.int32)
        | data[at + 16].astype(np.int32) << 8
        | data[at + 17].astype(np.int32) << 16
    )
    end = start + np.where(is_v2, 20, 16) + length + 13 * flags.astype(np.int64)
    return _Candidates(start, end, is_v2, length, number)


@cache
def _crc_tables() -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Return the tables for one byte (256) and for two bytes a step (65536)."""
    one = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        one = np.where(one & 1, (one >> 1) ^ np.uint16(0x8408), one >> 1).astype(np.uint16)
    two = np.arange(65536, dtype=np.uint16)
    for _ in range(2):
        two = (two >> 8) ^ one[two & 0xFF]
    one.flags.writeable = two.flags.writeable = False
    return one, two


def _checksum_is_right(data: Bytes, frames: _Candidates, checks: FrameChecks) -> Mask:
    covered = frames.length.astype(np.int16) + np.where(frames.is_v2, 9, 5).astype(np.int16)
    right = np.zeros(covered.size, np.bool_)
    order = np.argsort(covered, kind="stable")
    bounds = np.flatnonzero(np.diff(covered[order], prepend=-1, append=-1))
    for low, high in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        for first in range(low, high, _CRC_ROWS):
            rows = order[first : min(first + _CRC_ROWS, high)]
            at, count = frames.start[rows] + 9, int(covered[order[low]])
            extra = checks.extra[frames.number[rows]].astype(np.uint16)
            stored = data[at + count] | data[at + count + 1].astype(np.uint16) << 8
            right[rows] = _crc(data, at, count, extra) == stored
    return right


def _crc(data: Bytes, at: Ints, count: int, extra: NDArray[np.uint16]) -> NDArray[np.uint16]:
    one, two = _crc_tables()
    crc = np.full(at.size, 0xFFFF, np.uint16)
    block = gather(data, at, count)
    if count % 2:
        crc = (crc >> 8) ^ one[(crc ^ block[:, 0]) & 0xFF]
        block = np.ascontiguousarray(block[:, 1:])
    for word in np.ascontiguousarray(block.view("<u2").T):
        crc = two.take(crc ^ word)
    done: NDArray[np.uint16] = (crc >> 8) ^ one[(crc ^ extra) & 0xFF]
    return done


def gather(data: Bytes, at: Ints, count: int) -> Bytes:
    """Return (m, count) bytes: row i is data[at[i] : at[i] + count], which must lie inside."""
    if not at.size or not count:
        return np.zeros((at.size, count), np.uint8)
    windows: NDArray[np.void] = np.ndarray(
        (data.size - count + 1,), f"V{count}", buffer=data, strides=(1,)
    )
    return windows[at].view(np.uint8).reshape(-1, count)


def _disjoint(frames: _Candidates) -> Ints:
    """Return the rows of frames that do not overlap; where they do, those that join others win."""
    start, end = frames.start, frames.end
    reach = np.maximum.accumulate(end) if end.size else end
    clash = start[1:] < reach[:-1]
    if not clash.any():
        return np.arange(start.size)
    # Clusters of overlapping frames are rare and short, so the loop is over these places only.
    joins = np.isin(start, end).astype(np.int64) + np.isin(end, start)
    keep = np.ones(start.size, np.bool_)
    cluster = np.cumsum(np.concatenate(([True], ~clash)))
    for number in np.unique(cluster[1:][clash]):
        low, high = np.searchsorted(cluster, [number, number + 1])
        keep[low:high] = False
        taken: list[tuple[int, int]] = []
        for row in sorted(range(low, high), key=lambda r: (-joins[r], start[r])):
            span = int(start[row]), int(end[row])
            place = bisect_left(taken, span)
            before = taken[place - 1][1] if place else 0
            after = taken[place][0] if place < len(taken) else span[1]
            if before <= span[0] and span[1] <= after:
                taken.insert(place, span)
                keep[row] = True
    return np.flatnonzero(keep)


def _is_uncovered(frames: _Candidates, good: _Candidates) -> Mask:
    """Return which frames touch no good frame."""
    if not good.start.size:
        return np.ones(frames.start.size, np.bool_)
    before = np.searchsorted(good.start, frames.start, side="right") - 1
    free_before = (before < 0) | (good.end[np.maximum(before, 0)] <= frames.start)
    last = good.start.size - 1
    free_after = (before == last) | (good.start[np.minimum(before + 1, last)] >= frames.end)
    free: Mask = free_before & free_after
    return free


def _has_plausible_stamp(data: Bytes, lone: _Candidates, good: _Candidates) -> Mask:
    """Return which lone frames have a stamp of this recording (chance hits do not)."""
    if not good.start.size:
        return np.ones(lone.start.size, np.bool_)
    stamps, known = _stamps(data, lone.start), _stamps(data, good.start)
    low, high = np.quantile(known, [0.01, 0.99])
    near: Mask = (stamps >= low - _DAY_US) & (stamps <= high + _DAY_US)
    return near


def _stamps(data: Bytes, start: Ints) -> NDArray[np.uint64]:
    return gather(data, start, 8).view(">u8").astype(np.uint64).reshape(-1)


def _merge(first: _Candidates, second: _Candidates) -> _Candidates:
    both = _Candidates(
        np.concatenate((first.start, second.start)),
        np.concatenate((first.end, second.end)),
        np.concatenate((first.is_v2, second.is_v2)),
        np.concatenate((first.length, second.length)),
        np.concatenate((first.number, second.number)),
    )
    return both[np.argsort(both.start, kind="stable")]


def _damage(
    size: int, good: _Candidates, every: _Candidates, checks: FrameChecks
) -> tuple[Damage, ...]:
    """Return what lies between good frames: records of unknown kind or wrong checksum, or bytes.

    A record is skipped by its length only where no good frame starts inside: the gaps guarantee it.
    """
    low = np.concatenate(([0], good.end))
    high = np.concatenate((good.start, [size]))
    found: list[Damage] = []
    for row in np.flatnonzero(high > low).tolist():
        at, stop = int(low[row]), int(high[row])
        while at < stop:
            place = int(np.searchsorted(every.start, at))
            is_here = place < every.start.size and every.start[place] == at
            if not is_here or every.end[place] > stop:
                break
            number = int(every.number[place])
            is_known = number < ID_LIMIT and checks.extra[number] >= 0
            kind: Literal["bad_checksum", "unknown_message"]
            kind = "bad_checksum" if is_known else "unknown_message"
            found.append(Damage(kind, at, int(every.end[place]) - at, number))
            at = int(every.end[place])
        if at < stop:
            is_cut = stop == size and size - at < 300 and (is_here or size - at < 20)
            found.append(Damage("truncated" if is_cut else "lost_bytes", at, stop - at))
    return tuple(found)


def _describe(data: Bytes, good: _Candidates, damage: tuple[Damage, ...]) -> Frames:
    at, shift = good.start, np.where(good.is_v2, 2, 0)
    return Frames(
        data,
        at,
        at + np.where(good.is_v2, 18, 14),
        good.length,
        np.where(good.is_v2, 2, 1).astype(np.uint8),
        good.number,
        data[at + 10 + shift],
        data[at + 11 + shift],
        data[at + 12 + shift],
        _stamps(data, at),
        damage,
    )
