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

Method: every position whose ninth byte is a magic and whose header can be read is a candidate. One
that joins another one end to start, of a known message and with a right checksum, is a frame; of
overlapping ones the first in the file (a frame may carry frames in its payload: tunnels). In what
bytes remain, lone candidates count too when checksum, length and stamp are right. So the walk
resynchronises after any damage, and at the start of the file. Numpy looks at all candidates at
once; the compiled walk (`kernels.walk_frames`) goes from frame to frame and finds the same.

pymavlink loses intact frames where MAVLink 1 and 2 are mixed, and reads nothing from a file whose
first bytes are not a record: as an oracle it needs these exceptions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.dialect import ID_LIMIT, FrameChecks
from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.tlog.checksum import byte_tables, checksum_is_right
from fdi.telemetry.formats.tlog.kernels import walk_frames

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
_Gaps = tuple[Ints, Ints]
_Walk = Callable[..., tuple[int, Ints]]

_V2: Final = 0xFD
_SCAN_BLOCK: Final = 1 << 22  # bytes searched for a magic at once: bounds the memory for masks
_NEAR: Final = 4  # how many candidates on the next frame begins, but for rare ones
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
    length: NDArray[np.uint8]
    version: NDArray[np.uint8]
    number: NDArray[np.uint16]
    sequence: NDArray[np.uint8]
    system: NDArray[np.uint8]
    component: NDArray[np.uint8]
    stamp_us: NDArray[np.uint64]
    damage: tuple[Damage, ...]

    @property
    def payload(self) -> Ints:
        """Where the payloads begin, (n,)."""
        return payload_offsets(self.start, self.version)

    def of(self, rows: Ints) -> Frames:
        """Return some of the frames, ascending; the damage stays that of the file."""
        return replace(
            self,
            start=self.start[rows],
            length=self.length[rows],
            version=self.version[rows],
            number=self.number[rows],
            sequence=self.sequence[rows],
            system=self.system[rows],
            component=self.component[rows],
            stamp_us=self.stamp_us[rows],
        )


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
    walk = compiled(walk_frames, data.size)
    if walk is None:
        others = _candidates(data, _magic_places(data))
        frames = _describe(data, _joined_frames(data, others, checks))
    else:
        frames, places = _walked(data, checks, walk)
        others = _candidates(data, places)
    gaps = _gaps(frames)
    lone = _lone_frames(others, frames, gaps, checks)
    if lone.size:
        frames = _describe(data, np.sort(np.concatenate((frames.start, lone))))
        gaps = _gaps(frames)
    return replace(frames, damage=_damage(data.size, gaps, others, checks))


def _walked(data: Bytes, checks: FrameChecks, walk: _Walk) -> tuple[Frames, Ints]:
    """Return the joined frames, and where other candidates begin."""
    room = data.size // 16 + 1  # memory that is not written is not used
    start, number = np.empty(room, np.int64), np.empty(room, np.uint16)
    stamp = np.empty(room, np.uint64)
    length, version, sequence, system, component = (np.empty(room, np.uint8) for _ in range(5))
    arrays = (start, length, version, number, sequence, system, component, stamp)
    count, others = walk(data, checks.extra, checks.size, byte_tables(), arrays)
    frames = Frames(
        data,
        start[:count],
        length[:count],
        version[:count],
        number[:count],
        sequence[:count],
        system[:count],
        component[:count],
        stamp[:count],
        (),
    )
    return frames, others


def _magic_places(data: Bytes) -> Ints:
    """Return where records may begin: eight bytes before every magic, room for a frame behind."""
    found = [np.empty(0, np.int64)]
    for low in range(8, data.size - 7, _SCAN_BLOCK):
        block = data[low : min(low + _SCAN_BLOCK, data.size - 7)]
        found.append(np.flatnonzero((block - np.uint8(_V2)) < 2) + (low - 8))  # FD, FE -> 0, 1
    return np.concatenate(found)


def _candidates(data: Bytes, start: Ints) -> _Candidates:
    """Return what the headers at these places say, where they can be read."""
    is_v2 = data.take(start + 8) == _V2
    readable = ~is_v2 | (data.take(np.minimum(start + 10, data.size - 1)) & 0xFE == 0)
    cut = np.searchsorted(start, data.size - 20, side="right")
    readable[cut:] &= ~is_v2[cut:]
    if not readable.all():
        start = start[readable]
    head = gather(data, start + 8, 10)
    is_v2 = head[:, 0] == _V2
    length, number = head[:, 1].copy(), _numbers(head, is_v2)
    end = start + length
    end += np.where(is_v2, np.uint8(20) + np.uint8(13) * head[:, 2], np.uint8(16))
    return _Candidates(start, end, is_v2, length, number)


def _numbers(head: Bytes, is_v2: Mask) -> NDArray[np.int32]:
    number = head[:, 5].astype(np.int32)
    if is_v2.any():
        long = head[:, 7].astype(np.int32)
        long |= head[:, 8].astype(np.int32) << 8
        long |= head[:, 9].astype(np.int32) << 16
        number = np.where(is_v2, long, number)
    return number


def _joined_frames(data: Bytes, every: _Candidates, checks: FrameChecks) -> Ints:
    """Return where frames begin that join other candidates."""
    limit = np.where(checks.extra >= 0, checks.size, np.int16(-1))
    limit = limit.take(every.number, mode="clip")
    # Only MAVLink 2 can be longer than we know it: newer definitions append extension fields.
    plausible = (every.end <= data.size) & (limit >= every.length * ~every.is_v2)
    rows = np.flatnonzero(plausible & _joins(every, plausible))
    rows = rows[_checksums(data, every, rows, checks)]
    return every.start[rows[_disjoint(every.start[rows], every.end[rows])]]


def _joins(every: _Candidates, plausible: Mask) -> Mask:
    """Return which candidates end where another one begins, or begin where a plausible one ends."""
    start, end, count = every.start, every.end, every.start.size
    joins, found = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    for step in range(1, min(_NEAR, count)):
        here = end[:-step] == start[step:]
        found[:-step] |= here
        joins[step:] |= here & plausible[:-step]
    joins |= found
    rows = np.flatnonzero(plausible & ~found)
    place = np.minimum(np.searchsorted(start, end[rows]), count - 1)
    far = start[place] == end[rows]
    joins[rows[far]] = joins[place[far]] = True
    return joins


def _checksums(data: Bytes, frames: _Candidates, rows: Ints, checks: FrameChecks) -> Mask:
    covered = frames.length[rows].astype(np.int16)
    covered += np.where(frames.is_v2[rows], np.int16(9), np.int16(5))
    return checksum_is_right(data, frames.start[rows] + 9, covered, frames.number[rows], checks)


def _disjoint(start: Ints, end: Ints) -> Ints:
    """Return the rows of frames that do not overlap; where they do, the first in the file wins."""
    if not start.size:
        return np.empty(0, np.int64)
    if (start[1:] >= end[:-1]).all():
        return np.arange(start.size)
    clash = start[1:] < np.maximum.accumulate(end)[:-1]
    keep = np.ones(start.size, np.bool_)
    edges = np.flatnonzero(np.diff(clash, prepend=False, append=False))
    # runs of overlapping frames are rare and short, so the loop is over these places only
    for low, high in zip(edges[::2].tolist(), (edges[1::2] + 1).tolist(), strict=True):
        reach = 0
        for row in range(low, high):
            keep[row] = start[row] >= reach
            reach = max(reach, int(end[row]) * bool(keep[row]))
    return np.flatnonzero(keep)


def _lone_frames(others: _Candidates, good: Frames, gaps: _Gaps, checks: FrameChecks) -> Ints:
    """Return where frames begin that join no other, in the bytes that remain."""
    data, free = good.data, _inside(gaps, others)
    place = np.minimum(others.number[free], ID_LIMIT)
    plausible = (checks.extra[place] >= 0) & (others.end[free] <= data.size)
    free = free[plausible & (others.length[free] <= checks.size[place])]
    lone = others[free[_checksums(data, others, free, checks)]]
    lone = lone[_has_plausible_stamp(data, lone, good)]
    return lone.start[_disjoint(lone.start, lone.end)]


def _inside(gaps: _Gaps, others: _Candidates) -> Ints:
    """Return the rows of candidates that touch no good frame."""
    low, high = gaps
    first = np.searchsorted(others.start, low)
    count = np.searchsorted(others.start, high) - first
    rows = np.arange(count.sum()) + np.repeat(first - np.cumsum(count) + count, count)
    free: Ints = rows[others.end[rows] <= np.repeat(high, count)]
    return free


def _gaps(good: Frames) -> _Gaps:
    """Return where the byte ranges between good frames begin and end."""
    start = np.append(good.start, good.data.size)
    end = good.payload + good.length
    end += 2
    rows = np.flatnonzero(end != start[1:])
    is_signed = (good.version[rows] == 2) & (good.data[good.start[rows] + 10] & 1 == 1)
    low = np.concatenate(([0], end[rows] + 13 * is_signed))
    high = np.concatenate((start[:1], start[rows + 1]))
    return low[high > low], high[high > low]


def _has_plausible_stamp(data: Bytes, lone: _Candidates, good: Frames) -> Mask:
    """Return which lone frames have a stamp of this recording (chance hits do not)."""
    if not good.start.size or not lone.start.size:
        return np.ones(lone.start.size, np.bool_)
    stamps = _stamps(gather(data, lone.start, 8))
    low, high = np.quantile(good.stamp_us, [0.01, 0.99])
    near: Mask = (stamps >= low - _DAY_US) & (stamps <= high + _DAY_US)
    return near


def _stamps(eight: Bytes) -> NDArray[np.uint64]:
    return np.ascontiguousarray(eight).view(">u8").reshape(-1).astype(np.uint64)


def _damage(size: int, gaps: _Gaps, every: _Candidates, checks: FrameChecks) -> tuple[Damage, ...]:
    """Return what lies between good frames: records of unknown kind or wrong checksum, or bytes.

    A record is skipped by its length only where no good frame starts inside: the gaps guarantee it.
    """
    found: list[Damage] = []
    for at, stop in zip(*(edge.tolist() for edge in gaps), strict=True):
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


def _describe(data: Bytes, start: Ints) -> Frames:
    """Return the frames that begin at these places, without the damage."""
    head = gather(data, start, 18)
    is_v2 = head[:, 8] == _V2
    if is_v2.all() or not is_v2.any():
        first = 12 if is_v2.any() else 10
        sequence, system, component = (head[:, first + k].copy() for k in range(3))
    else:
        sequence, system, component = (
            np.where(is_v2, head[:, 12 + k], head[:, 10 + k]) for k in range(3)
        )
    return Frames(
        data,
        start,
        head[:, 9].copy(),
        is_v2 + np.uint8(1),
        _numbers(head[:, 8:], is_v2).astype(np.uint16),
        sequence,
        system,
        component,
        _stamps(head[:, :8]),
        (),
    )


def payload_offsets(start: Ints, version: Bytes) -> Ints:
    """Return where the payloads begin: 14 bytes into a record of MAVLink 1, 18 of 2."""
    return start + (version * np.uint8(4) + np.uint8(10))
