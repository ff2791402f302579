"""Where in these bytes are DataFlash records, and which bytes belong to none?

In: the bytes and the layouts. Out: `Records`, by layout and in file order.

A record is ``A3 95 type`` and a body whose length the type's FMT gives; there is no checksum. It is
believed when the next header stands at its end or the file ends there. If not, and inside it a
record begins that is followed by another, it was cut: the reading goes on there. Otherwise it is
kept and the search goes on behind it.

Method: records that join end to start are taken as whole runs, by a compiled loop or, without one,
from all headers at once; only where a run breaks Python decides, in the same words for both.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.dataflash.kernels import (
    find_definitions,
    group_records,
    walk_records,
)
from fdi.telemetry.formats.dataflash.layouts import (
    FMT,
    LENGTHS,
    Layout,
    defined,
    fmt_layout,
    with_known,
)

Bytes = NDArray[np.uint8]
Offsets = NDArray[Any]  # uint32, in files of 4 GiB and more int64
Ints = NDArray[np.int64]

SMALL: Final = 64 << 20  # bytes of a file that is decoded at once
HEADER: Final = b"\xa3\x95"
_BLOCK: Final = 1 << 20  # bytes searched at once: they stay in the cache
_ROWS: Final = 1 << 17  # records looked at together
_PAGE: Final = 1 << 12
_TYPES: Final = 256
_SPECIMEN: Final = 4 << 20  # bytes that decide between known versions
_LAYERS: Final = 8  # types without a definition that may follow each other
_ENOUGH: Final = 5  # gaps of one length that show the length of a type
_ALIKE: Final = 0.9  # share of the gaps of a type that have it
_WIDEST: Final = 1024  # bytes of a gap that a few records may fill


@dataclass(frozen=True, slots=True, eq=False)
class Headers:
    """Where ``A3 95`` stands, (n,) ascending, and the type byte behind it."""

    at: Offsets
    type: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Believed records by ``layouts``: first bytes, (n,) ascending; ``lost`` (k, 2) byte ranges."""

    layouts: tuple[Layout, ...]
    starts: tuple[Offsets, ...]
    lost: Ints
    is_cut: bool  # the last of the lost ranges is a record that the file's end cuts
    in_order: tuple[Headers, ...] = ()  # of all records, in file order; none of large files

    @property
    def count(self) -> int:
        """How many records there are."""
        return sum(start.size for start in self.starts)

    @property
    def lost_bytes(self) -> int:
        """How many bytes belong to no record."""
        return int((self.lost[:, 1] - self.lost[:, 0]).sum())

    def spans(self) -> Ints:
        """Return first byte and end of every record, (n, 2) ascending."""
        low = np.concatenate([np.empty(0, np.int64), *self.starts]).astype(np.int64)
        sizes = [np.full(s.size, one.length) for one, s in self._pairs()]
        high = low + np.concatenate([np.empty(0, np.int64), *sizes])
        return np.stack((low, high), axis=1)[np.argsort(low, kind="stable")]

    def _pairs(self) -> Iterator[tuple[Layout, Offsets]]:
        return zip(self.layouts, self.starts, strict=True)


def find_headers(data: Bytes) -> Headers:
    """Return where ``A3 95`` and a type byte stand."""
    ats, types = [np.empty(0, offset_type(data))], [np.empty(0, np.uint8)]
    for low in range(0, data.size - 2, _BLOCK):
        part = data[low : low + _BLOCK + 2]
        at = np.flatnonzero(part[:-2] == HEADER[0])
        at = at[part[1:][at] == HEADER[1]]
        types.append(part[2:][at])
        ats.append((at + low).astype(ats[0].dtype))
    return Headers(np.concatenate(ats), np.concatenate(types))


def offset_type(data: Bytes) -> type[np.uint32] | type[np.int64]:
    """Return the smallest type that counts the bytes of a file, records beyond its end included."""
    return np.uint32 if data.size < 2**32 - _TYPES else np.int64


def all_records(data: Bytes) -> Records:
    """Return the records of a file: of the types that it defines, and of those that it should have.

    What the file does not define is taken from known firmware, and where that is silent too, from
    the bytes themselves: a type whose records all have one length, between others, has that length;
    its records have no fields.
    """
    run = compiled(walk_records, data.size)
    headers = None if run else find_headers(data)
    own, false_definitions = defined(data, _definition_places(data, headers))
    if not any(one.number == FMT for one in own):
        own.append(fmt_layout())

    def found(layouts: Sequence[Layout]) -> Records:
        known = _Known(data, layouts, false_definitions)
        records = _Collection(known)
        if run is not None:
            _compiled_walk(run, known, records)
        else:
            _walk(headers or find_headers(data), known, records)
        return records.records(layouts)

    layouts = with_known(own, lambda choices: _filled_most(data[:_SPECIMEN], choices))
    records = found(layouts)
    for _ in range(_LAYERS):
        more = _unknown_layouts(data, records)
        if not more:
            break
        layouts = [*layouts, *more]
        records = found(layouts)
    return records


def is_mostly_records(data: Bytes) -> bool:
    """Return whether records fill more than half of the bytes, as far as their headers show."""
    headers = find_headers(data)
    if headers.at.size < max(data.size // 256, 3):
        return False
    own, _ = defined(data, _definition_places(data, headers))
    layouts = with_known(own, lambda choices: _filled_most(data, choices))
    return _filled(data, headers, layouts) > data.size // 2


def _filled_most(data: Bytes, choices: Sequence[Sequence[Layout]]) -> int:
    """Return the number of the layouts whose records fill most of the bytes."""
    headers = find_headers(data)
    return int(np.argmax([_filled(data, headers, layouts) for layouts in choices]))


def _filled(data: Bytes, headers: Headers, layouts: Sequence[Layout]) -> int:
    """Return how many bytes the records have that end where a header stands, or the file ends.

    It says enough about layouts, in a hundredth of the time that finding the records takes.
    """
    lengths = np.zeros(_TYPES, np.int64)
    for one in reversed(layouts):  # the first of a type counts
        lengths[one.number] = one.length
    sizes = lengths[headers.type]
    ends = headers.at + sizes
    follows = np.append(data, np.frombuffer(HEADER, np.uint8))  # as if one stood at the end
    ends[ends > data.size] = 0
    is_joined = (follows[ends] == HEADER[0]) & (follows[ends + 1] == HEADER[1])
    return int(sizes[is_joined & (ends > 0)].sum())


def _definition_places(data: Bytes, headers: Headers | None) -> Ints:
    if headers is not None:
        at: Ints = headers.at[headers.type == FMT].astype(np.int64)
        return at
    search = compiled(find_definitions, data.size)
    assert search is not None
    places = np.empty(_ROWS, np.int64)
    count = search(data, places)
    if count > places.size:
        places = np.empty(count, np.int64)
        search(data, places)
    return places[:count]


def _unknown_layouts(data: Bytes, records: Records) -> list[Layout]:
    """Return layouts without fields of types whose records fill the gaps between others."""
    known = {one.number for one in records.layouts}
    low, size = records.lost[:, 0], records.lost[:, 1] - records.lost[:, 0]
    inside = (size <= _WIDEST) & (size > len(HEADER)) & (low + size < data.size)
    low, size = low[inside], size[inside]
    is_header = (data[low] == HEADER[0]) & (data[low + 1] == HEADER[1])
    low, size = low[is_header], size[is_header]
    number = data[low + 2]
    made = []
    for one in np.unique(number).tolist():
        widths, count = np.unique(size[number == one], return_counts=True)
        width = int(widths[np.argmax(count)])
        if one in known or count.max() < max(_ENOUGH, _ALIKE * count.sum()):
            continue
        gaps = gather(data, low[(number == one) & (size == width)], width)
        # another unknown type may follow in the same gap
        again = (gaps[:, 1:-1] == HEADER[0]) & (gaps[:, 2:] == HEADER[1])
        places = np.append(np.flatnonzero(again.mean(axis=0) >= _ALIKE) + 1, width)
        if places[0] in LENGTHS:
            made.append(Layout(one, f"TYPE{one}", int(places[0]), ()))
    return made


class _Known:
    """Which records may begin where, and what becomes of one that is followed by none."""

    def __init__(self, data: Bytes, layouts: Sequence[Layout], false_definitions: Ints) -> None:
        self.size = data.size
        self.data = data
        self.bytes: memoryview = data.data
        self.lengths = np.zeros(_TYPES, np.int64)
        self.versions: dict[int, list[Layout]] = {}
        for one in layouts:
            self.versions.setdefault(one.number, []).append(one)
        for number, versions in self.versions.items():
            self.lengths[number] = versions[0].length
        self._length = self.lengths.tolist()
        self.since = {n: [one.since for one in v] for n, v in self.versions.items()}
        self.again = {n: v for n, v in self.versions.items() if len(v) > 1}
        self.false_definitions = false_definitions
        self._false = frozenset(false_definitions.tolist())

    def lengths_of(self, at: Ints, types: Bytes) -> Ints:
        """Return the lengths of the records whose headers stand there, 0 where none may begin."""
        found: Ints = self.lengths[types]
        for number, versions in self.again.items():
            here = np.flatnonzero(types == number)
            newest = np.searchsorted(self.since[number], at[here], side="right") - 1
            found[here] = np.array([one.length for one in versions])[newest]
        if self._false:
            here = np.flatnonzero(types == FMT)
            found[here[np.isin(at[here], self.false_definitions)]] = 0
        return found

    def length_at(self, place: int) -> int:
        """Return the length of a record that begins there, 0 where none may."""
        if place + 3 > self.size or self.bytes[place : place + 2].tobytes() != HEADER:
            return 0
        number = self.bytes[place + 2]
        if number == FMT and place in self._false:
            return 0
        if number in self.again:
            return self.again[number][bisect_right(self.since[number], place) - 1].length
        length: int = self._length[number]
        return length

    def decide(self, place: int, end: int) -> tuple[bool, int]:
        """Return whether the record there is one, and from which byte on the next one begins."""
        if end == self.size or self.length_at(end):
            return True, end
        inside = self.bytes[place + 1 : end + 1].tobytes()
        found = inside.find(HEADER)
        while found >= 0:
            at = place + 1 + found
            length = self.length_at(at)
            if at < end and length and self.length_at(at + length):
                return False, at
            found = inside.find(HEADER, found + 1)
        return end <= self.size, end if end <= self.size else place + 1

    def next_from(self, place: int) -> int:
        """Return where the next record may begin, the file's size where none may."""
        while place < self.size:
            page = self.bytes[place : place + _PAGE + 2].tobytes()
            found = page.find(HEADER)
            while found >= 0:
                if self.length_at(place + found):
                    return place + found
                found = page.find(HEADER, found + 1)
            place += _PAGE
        return self.size

    def is_cut(self, low: int) -> bool:
        """Return whether a record begins in the bytes from low on that the file's end cuts."""
        place = self.next_from(max(low, self.size - _TYPES))
        while place < self.size:
            if place + self.length_at(place) > self.size:
                return True
            place = self.next_from(place + 1)
        return False


class _Collection:
    """Gathers records that come in file order, and what lies between them."""

    def __init__(self, known: _Known) -> None:
        self.known = known
        self.windows: list[Headers] = []
        self.lost: list[tuple[int, int]] = []
        self.end = 0
        self.offset_type = offset_type(known.data)

    def reach(self, low: int, high: int) -> None:
        """Note that records cover these bytes."""
        if low > self.end:
            self.lost.append((self.end, low))
        self.end = high

    def add(self, start: Offsets, types: Bytes) -> None:
        """Take some records, (n,) ascending."""
        self.windows.append(Headers(start.astype(self.offset_type, copy=False), types))

    def records(self, layouts: Sequence[Layout]) -> Records:
        """Return all that was taken."""
        size = self.known.size
        is_cut = self.end < size and self.known.is_cut(self.end)
        if self.end < size:
            self.lost.append((self.end, size))
        of_type = self._by_type()
        parts = {
            number: iter(np.split(of_type[number], np.searchsorted(of_type[number], since[1:])))
            for number, since in self.known.since.items()
        }
        starts = [next(parts[one.number]) for one in layouts]
        lost = np.array(self.lost, np.int64).reshape(-1, 2)
        in_order = tuple(self.windows) if self.known.size <= SMALL else ()
        return Records(tuple(layouts), tuple(starts), lost, is_cut, in_order)

    def _by_type(self) -> list[Offsets]:
        count = np.zeros(_TYPES, np.int64)
        for window in self.windows:
            count += np.bincount(window.type, minlength=_TYPES)
        ends = np.cumsum(count)
        grouped = np.empty(int(ends[-1]), self.offset_type)
        free = ends - count  # where the next record of each type goes
        group = compiled(group_records, self.known.size) or _group
        for window in self.windows:
            group(window.at, window.type, free, grouped)
        return np.split(grouped, ends[:-1])


def _group(start: Offsets, types: Bytes, free: NDArray[np.int64], grouped: Offsets) -> None:
    """Do what `group_records` does."""
    count = np.bincount(types, minlength=_TYPES)
    in_order = start[np.argsort(types, kind="stable")]
    low = 0
    for number in np.flatnonzero(count).tolist():
        n = int(count[number])
        at = int(free[number])
        grouped[at : at + n] = in_order[low : low + n]
        free[number] += n
        low += n


def _walk(headers: Headers, known: _Known, found: _Collection) -> None:
    """Find the records, from the places of all headers."""
    place = 0  # where the next record begins at the earliest
    for low in range(0, headers.at.size, _ROWS):
        at = headers.at[low : low + _ROWS].astype(np.int64)
        types = headers.type[low : low + _ROWS]
        lengths = known.lengths_of(at, types)
        good = lengths > 0
        if not good.all():
            at, types, lengths = at[good], types[good], lengths[good]
        if not at.size:
            continue
        ends = at + lengths
        taken, one = np.zeros(at.size + 1, np.int8), np.int8(1)
        breaks = np.flatnonzero(np.append(ends[:-1] != at[1:], True))
        behind = np.searchsorted(at, ends[breaks])
        joined = at[np.minimum(behind, at.size - 1)] == ends[breaks]
        stops, follows, is_joined = breaks.tolist(), behind.tolist(), joined.tolist()
        row = int(np.searchsorted(at, place))
        while row < at.size:
            i = bisect_left(stops, row)
            last, next_row, is_kept = stops[i], follows[i], True
            if not is_joined[i]:
                is_kept, place = known.decide(int(at[last]), int(ends[last]))
                next_row = int(np.searchsorted(at, place))
            taken[row] += one
            taken[last + is_kept] -= one
            if last + is_kept > row:
                found.reach(int(at[row]), int(ends[last] if is_kept else at[last]))
            row = next_row
        is_taken = np.cumsum(taken[:-1], dtype=np.int8) > 0
        found.add(at[is_taken], types[is_taken])


def _compiled_walk(run: Callable[..., tuple[int, int]], known: _Known, found: _Collection) -> None:
    """Find the records, run by run."""
    data = known.data
    # where the lengths change, or a header is none: a run ends there at the latest
    changes = sorted(
        (one.since, number, one.length)
        for number, versions in known.again.items()
        for one in versions[1:]
    )
    limits = sorted(
        {since for since, *_ in changes} | {*known.false_definitions.tolist(), data.size}
    )
    starts, types = np.empty(_ROWS, offset_type(data)), np.empty(_ROWS, np.uint8)
    lengths = known.lengths.astype(np.uint8)
    place = filled = changed = 0
    while place < data.size:
        if not known.length_at(place):
            place = known.next_from(place)
            continue
        while changed < len(changes) and changes[changed][0] <= place:
            _, number, length = changes[changed]
            lengths[number] = length
            changed += 1
        limit = limits[bisect_right(limits, place)]
        first = place
        count, stop = run(data, place, limit, lengths, starts[filled:], types[filled:])
        last = int(starts[filled + count - 1])
        is_kept, place = known.decide(last, stop)
        if is_kept or count > 1:
            found.reach(first, stop if is_kept else last)
        filled += count if is_kept else count - 1
        if filled == _ROWS:
            found.add(starts, types)
            starts, types = np.empty_like(starts), np.empty_like(types)
            filled = 0
    found.add(starts[:filled], types[:filled])
