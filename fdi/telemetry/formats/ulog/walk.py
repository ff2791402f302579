"""Where in these bytes does a ULog message begin, and where are the next ones after damage?

In: the bytes. Out: the state of a `Walk`: data messages with their ids and stamps, all others with
what they say, and the bytes that belong to none.

A message is ``size u16, type u8, body``; there is no checksum. It is believed when its header is
plausible (a known type whose body fits; data: a subscribed id with the length of its topic) and the
next header is, too. If the next is not, and inside the message a plausible one begins that is
followed by another, the message was cut: the reading goes on there. Otherwise it is kept and the
search for two plausible headers in a row goes on behind it. So damage is recognised by data
messages, which are everywhere, and not by sync messages, which old logs do not have.

Data of an id that nobody subscribed are taken by their length while the headers around them are
plausible.

Method: all headers of data messages in a window at once, and a run of messages that end where the
next header stands is taken whole; `compiled.walk_messages` does the same one by one. Only at the
ends of such runs Python decides.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.bounds import MOST_NAMES, MOST_TEXTS
from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.ulog.definitions import (
    SIZES,
    Bytes,
    Content,
    Format,
    Layout,
    Logged,
    Subscription,
    extent,
    parsed,
    resolve,
)
from fdi.telemetry.formats.ulog.kernels import walk_messages

Ints = NDArray[np.int64]
Sizes = NDArray[np.uint16]

_DATA: Final = ord("D")
_NEVER: Final = 0xFFFF, 0  # at least and at most so many bytes: the id is not subscribed
_WINDOW: Final = range(1 << 13, 1 << 20)  # bytes looked at at once: after a definition, at most
_SEARCH: Final = range(1 << 10, 1 << 20)
_BYTES: Final = 32  # of a message, usually more: so there is room for all of them
_SMALLEST: Final = np.array([SIZES.get(k, range(1)).start for k in range(256)])
_LARGEST: Final = np.array([SIZES.get(k, range(1)).stop - 1 for k in range(256)])
_IS_OTHER: Final = np.array([k in SIZES for k in range(256)])
_MOST_FIELDS: Final = 50_000  # of all topics; logs have 4,000. What is beyond counts as undefined
# What is kept of a type; PX4 writes every parameter once, and tells some hundred other keys.
MOST_OTHERS: Final = {
    **dict.fromkeys("PQIM", MOST_NAMES),
    **dict.fromkeys("LC", MOST_TEXTS // 2),
}
_LETTERS: Final = range(ord("A"), ord("Z") + 1)


class Run(NamedTuple):
    """Data messages, (n,) each: first bytes, ids, stamps as they are (noise without a stamp)."""

    at: Ints
    number: NDArray[np.uint16]
    stamp: NDArray[np.uint64]

    def part(self, low: int, high: int) -> Run:
        """Return the messages from one row to another."""
        return Run(self.at[low:high], self.number[low:high], self.stamp[low:high])


@dataclass(slots=True, eq=False)
class Found:
    """The data messages found so far, and room for more behind them."""

    rows: Run
    size: int = 0

    @classmethod
    def with_room(cls, count: int) -> Found:
        """Return none, and room for so many."""
        rows = Run(np.empty(count, np.int64), np.empty(count, np.uint16), np.empty(count, "<u8"))
        return cls(rows)

    @property
    def messages(self) -> Run:
        """Those that were found."""
        return self.rows.part(0, self.size)

    @property
    def last(self) -> int | None:
        """Where the last one begins."""
        return int(self.rows.at[self.size - 1]) if self.size else None

    def free(self, least: int = 1) -> Run:
        """Return the room behind them, for at least so many."""
        if self.rows.at.size < self.size + least:
            larger = Found.with_room(2 * self.size + least)
            larger.add(self.messages)
            self.rows = larger.rows
        return self.rows.part(self.size, self.rows.at.size)

    def add(self, some: Run) -> None:
        """Put messages behind those that were found before."""
        free, count = self.free(some.at.size), some.at.size
        free.at[:count], free.number[:count], free.stamp[:count] = some
        self.size += count


def words(data: Bytes, dtype: str) -> NDArray[Any]:
    """Return a view of the bytes in which entry i is the number that begins at byte i."""
    count = max(data.size - np.dtype(dtype).itemsize + 1, 0)
    return np.ndarray((count,), dtype, data, strides=(1,))


class Other(NamedTuple):
    """A message that holds no data: its type, first byte and what it says."""

    kind: str
    start: int
    content: Content


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """Headers of data messages from byte ``low`` to ``high``, where they end.

    ``breaks``: those that do not end where the next one begins.
    """

    low: int
    high: int
    headers: Run
    end: Ints
    breaks: list[int]

    def follow(self, at: int, found: Found) -> int:
        """Add the messages that follow each other from a byte on; return where they end."""
        starts = self.headers.at
        row = int(np.searchsorted(starts, at))
        while row < starts.size and starts[row] == at:
            last = self.breaks[bisect_left(self.breaks, row)]
            found.add(self.headers.part(row, last + 1))
            at = int(self.end[last])
            row = last + 1 + int(np.searchsorted(starts[last + 1 :], at))
        return at


@dataclass(slots=True, eq=False)
class Walk:
    """The state of the reading: what is defined so far, and what has been found.

    Attributes
    ----------
    subscriptions : list of (Subscription, Layout or None)
        In file order; None while a topic has no layout.
    waiting : dict of Subscription
        By id, those whose format is missing, circular or too large.
    found : Found
        Data messages in file order.
    others, late : list of Other
        All other messages in file order; ``late`` are the last of texts that are too many.
    counted : Counter
        How many others there were of every type.
    lost, cut : list of (int, int)
        Byte ranges that belong to no message, and of messages that the end cuts.
    unknown : list of (int, int, int)
        First byte, size and type of whole messages of an unknown type.
    """

    data: Bytes
    view: memoryview
    word: NDArray[np.uint16]
    long: NDArray[np.uint64]
    kernel: Callable[..., tuple[int, int]] | None
    found: Found
    limit: int = 0
    formats: dict[str, Format] = field(default_factory=dict)
    subscriptions: list[tuple[Subscription, Layout | None]] = field(default_factory=list)
    waiting: dict[int, Subscription] = field(default_factory=dict)
    # topics without a layout: how many formats there were when it was looked for
    tried: dict[str, int] = field(default_factory=dict)
    layouts: dict[str, Layout] = field(default_factory=dict)
    fields: int = 0  # of all layouts
    # of a message id: smallest and largest size of its data messages; the same as arrays, and
    # where the stamp stands in such a message
    sizes: dict[int, tuple[int, int]] = field(default_factory=dict)
    low: Sizes = field(default_factory=lambda: np.full(1 << 16, _NEVER[0], np.uint16))
    high: Sizes = field(default_factory=lambda: np.full(1 << 16, _NEVER[1], np.uint16))
    stamp_at: Sizes = field(default_factory=lambda: np.zeros(1 << 16, np.uint16))
    window: _Window | None = None
    width: int = _WINDOW.start
    others: list[Other] = field(default_factory=list)
    late: deque[Other] = field(default_factory=lambda: deque(maxlen=MOST_TEXTS // 2))
    counted: Counter[str] = field(default_factory=Counter)
    lost: list[tuple[int, int]] = field(default_factory=list)
    unknown: list[tuple[int, int, int]] = field(default_factory=list)
    cut: list[tuple[int, int]] = field(default_factory=list)

    @classmethod
    def over(cls, data: Bytes) -> Walk:
        """Return a walk that has not begun."""
        kernel = compiled(walk_messages, data.size)
        found = Found.with_room(data.size // _BYTES)
        return cls(data, data.data, words(data, "<u2"), words(data, "<u8"), kernel, found)

    def part(self, at: int, limit: int) -> None:
        """Read from a byte to the limit."""
        self.limit, self.window = limit, None
        last = None  # the message before, if it ends here
        while at < limit:
            if at + 3 <= limit and self.view[at + 2] == _DATA:
                end = self.follow(at)
                if end > at:
                    last, at = self.found.last, end
                    continue
                if at + 5 <= limit and self.subscribe(self.number(at)):
                    continue
            said = self.said(at)
            if said is not None:
                self.take(at, said)
                last, at = at, self.end(at)
            elif self.is_undefined_data(at):
                size = self.end(at) - at - 3
                self.set_sizes(self.number(at), size, size, 0)
            else:
                last, at = None, self.resume(last, at)

    def resume(self, last: int | None, at: int) -> int:
        """Return where the reading goes on when no message begins at a byte."""
        inside = None if last is None else self.search(last + 1, at)
        if last is not None and inside is not None:  # the last one was cut, and holds the next
            self.drop(last)
            self.lost.append((last, inside))
            return inside
        following = self.search(at + 1, self.limit)
        kind = self.view[at + 2] if at + 3 <= self.limit else _DATA
        is_known = kind == _DATA or kind in SIZES
        if following is None:
            is_cut = is_known and (at + 3 > self.limit or self.end(at) > self.limit)
            (self.cut if is_cut else self.lost).append((at, self.limit))
            return self.limit
        if not is_known and kind in _LETTERS and self.end(at) == following:
            self.unknown.append((at, following - at, kind))
        else:
            self.lost.append((at, following))
        return following

    def drop(self, last: int) -> None:
        """Forget the message that was read last."""
        if self.found.last == last:
            self.found.size -= 1
        for others in (self.late, self.others):
            if others and others[-1].start == last:
                self.counted[others.pop().kind] -= 1

    def left_out(self, kind: str) -> int:
        """Return how many other messages of a type are not kept."""
        late = sum(other.kind == kind for other in self.late)
        return max(self.counted[kind] - MOST_OTHERS[kind] - late, 0)

    def end(self, at: int) -> int:
        """Return where a message ends by its size."""
        return at + 3 + self.view[at] + 256 * self.view[at + 1]

    def number(self, at: int) -> int:
        """Return the id of a data message."""
        return self.view[at + 3] + 256 * self.view[at + 4]

    def said(self, at: int) -> Content | None:
        """Return what a message says that holds no data, None where none can begin here."""
        if at + 3 > self.limit or self.view[at + 2] not in SIZES:
            return None
        end = self.end(at)
        return (
            parsed(self.view[at + 2], bytes(self.view[at + 3 : end]), at)
            if end <= self.limit
            else None
        )

    def is_plausible(self, at: int) -> bool:
        """Return whether a message of a known type that fits can begin here."""
        if at + 5 > self.limit or self.view[at + 2] != _DATA:
            return self.said(at) is not None
        known = self.sizes.get(self.number(at))
        size = self.end(at) - at - 3
        return known is not None and known[0] <= size <= known[1] and at + 3 + size <= self.limit

    def chains(self, at: int) -> bool:
        """Return whether another message, or nothing, begins here."""
        return at == self.limit or self.is_plausible(at)

    def is_undefined_data(self, at: int) -> bool:
        """Return whether a data message of an unknown id stands here, and two others behind it."""
        if at + 5 > self.limit or self.view[at + 2] != _DATA or self.end(at) < at + 5:
            return False
        following = self.end(at)
        if self.number(at) in self.sizes or not self.is_plausible(following):
            return False
        return self.chains(self.end(following))

    def follow(self, at: int) -> int:
        """Find the data messages that follow each other from a byte on; return where they end."""
        if self.kernel is not None:
            return self.follow_compiled(self.kernel, at)
        while at < self.limit:
            if self.window is None or not self.window.low <= at < self.window.high:
                self.window = self.look(at)
            at = self.window.follow(at, self.found)
            if at < self.window.high:
                break
        return at

    def follow_compiled(self, kernel: Callable[..., tuple[int, int]], at: int) -> int:
        """Do the same by machine code."""
        tables = self.low, self.high, self.stamp_at
        while True:
            free = self.found.free()
            part = at, self.limit
            count, at = kernel(self.data, self.word, self.long, part, tables, tuple(free))
            self.found.size += count
            if count < free.at.size:
                return at

    def look(self, low: int) -> _Window:
        """Return the headers of data messages from a byte on; windows grow until a definition."""
        high = min(low + self.width, self.limit)
        self.width = min(2 * self.width, _WINDOW.stop)
        headers, end = self.data_headers(low, high)
        breaks = np.flatnonzero(end[:-1] != headers.at[1:]).tolist()
        return _Window(low, high, headers, end, [*breaks, end.size - 1])

    def data_headers(self, low: int, high: int) -> tuple[Run, Ints]:
        """Return the headers of data messages that fit their ids, and where they end."""
        stop = max(min(high, self.limit - 4), low)
        at = np.flatnonzero(self.data[low + 2 : stop + 2] == _DATA) + low
        header = self.long[at - 3]  # the bytes that end with the id: one look instead of two
        size = (header >> np.uint64(24)).astype(np.uint16)
        number = (header >> np.uint64(48)).astype(np.uint16)
        end = at + size + np.int64(3)
        good = (size >= self.low[number]) & (size <= self.high[number]) & (end <= self.limit)
        at, number, end = at[good], number[good], end[good]
        place = at + self.stamp_at[number]
        if place.size and place.max() > self.long.size - 1:
            place = np.minimum(place, self.long.size - 1)
        return Run(at, number, self.long[place]), end

    def search(self, low: int, high: int) -> int | None:
        """Return the first byte from low to high where a message begins that another follows."""
        width = _SEARCH.start
        while low < high:
            stop = min(low + width, high)
            data = self.data_headers(low, stop)[0].at
            for at in np.union1d(data, self.other_headers(low, stop)).tolist():
                if self.is_plausible(at) and self.chains(self.end(at)):
                    return int(at)
            low, width = stop, min(2 * width, _SEARCH.stop)
        return None

    def other_headers(self, low: int, high: int) -> Ints:
        """Return where headers of other messages may stand."""
        stop = max(min(high, self.limit - 2), low)
        at = np.flatnonzero(_IS_OTHER[self.data[low + 2 : stop + 2]]) + low
        size, kind = self.word[at], self.data[at + 2]
        good = (size >= _SMALLEST[kind]) & (size <= _LARGEST[kind]) & (at + 3 + size <= self.limit)
        found: Ints = at[good]
        return found

    def take(self, at: int, said: Content) -> None:
        """Keep a message that holds no data; a definition holds from here on."""
        other = Other(chr(self.view[at + 2]), at, said)
        self.counted[other.kind] += 1
        if other.kind not in MOST_OTHERS or self.counted[other.kind] <= MOST_OTHERS[other.kind]:
            self.others.append(other)
        elif isinstance(said, Logged):
            self.late.append(other)
        if isinstance(said, Format):
            self.formats.setdefault(said.name, said)
        elif isinstance(said, Subscription):
            self.waiting[said.number] = said
            if not self.subscribe(said.number):  # nor is it of the topic before any more
                self.subscriptions.append((said, None))
                self.set_sizes(said.number, *_NEVER, 0)
                del self.sizes[said.number]

    def subscribe(self, number: int) -> bool:
        """Return whether an id means records of a topic from here on, as was asked for."""
        asked = self.waiting.get(number)
        if asked is None or self.tried.get(asked.topic) == len(self.formats):
            return False
        layout = self.layouts.get(asked.topic) or self.resolved(asked.topic)
        if layout is None:
            self.tried[asked.topic] = len(self.formats)
            return False
        if asked.topic not in self.layouts:
            self.fields += len(layout.fields)
            self.layouts[asked.topic] = layout
        self.subscriptions.append((asked, layout))
        del self.waiting[number]
        place = 0 if layout.stamp is None else 5 + layout.stamp.offset
        self.set_sizes(number, layout.size + 2, layout.full + 2, place)
        return True

    def resolved(self, topic: str) -> Layout | None:
        """Return the layout of a topic, if the log has not too many fields already."""
        if extent(topic, self.formats) is None:
            return None
        if self.fields > _MOST_FIELDS:
            return None
        return resolve(topic, self.formats)

    def set_sizes(self, number: int, low: int, high: int, stamp_at: int) -> None:
        """Let data messages of an id have a size, and a stamp at that byte of theirs."""
        self.sizes[number] = low, high
        self.low[number], self.high[number], self.stamp_at[number] = low, high, stamp_at
        self.window, self.width = None, _WINDOW.start
