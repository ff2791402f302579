"""Where in these bytes are ULog messages, what defines them, and which bytes belong to none?

In: the bytes. Out: `Records`.

A message is ``size u16, type u8, body``; there is no checksum. It is believed when its header is
plausible (a known type whose body fits; data: a subscribed id with the length of its topic) and the
next header is, too. If the next is not, and inside the message a plausible one begins that is
followed by another, the message was cut: the reading goes on there. Otherwise it is kept and the
search for two plausible headers in a row goes on behind it. So damage is recognised by data
messages, which are everywhere, and not by sync messages, which old logs do not have.

Data of an id that nobody subscribed are skipped by their length while the headers around them are
plausible; where one unused format of the file alone fits them, they are read as its records.

Method: all headers of data messages in a window at once, and a run of messages that end where the
next header stands is taken whole (`compiled` does the same one by one). Only at the ends of such
runs Python decides.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.ulog_definitions import (
    Bytes,
    Format,
    Layout,
    Subscription,
    parse_format,
    parse_key,
    parse_subscription,
    resolve,
)

Ints = NDArray[np.int64]

_DATA: Final = ord("D")
_SYNC: Final = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_NEVER: Final = 1 << 20  # larger than any message: the id is not subscribed
_WINDOW: Final = range(1 << 14, 1 << 22)  # bytes looked at at once: after a definition, at most
_SEARCH: Final = range(1 << 10, 1 << 20)
_KEY_AT: Final = {ord("I"): 0, ord("M"): 1, ord("P"): 0, ord("Q"): 1}
_TEXT_AT: Final = {ord("L"): 9, ord("C"): 11}
_FLAGS: Final = (bytes(8), b"\1" + bytes(7))  # incompatible flags that are known
_LEVELS: Final = tuple(b"%d" % level for level in range(8))
_NO_TEXT: Final = re.compile(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f\x7f]")
_ANY: Final = 1 << 16
_KINDS: Final = {  # sizes of the bodies of the known types
    **{ord("B"): range(40, _ANY), ord("F"): range(3, _ANY), ord("A"): range(4, _ANY)},
    **{ord("I"): range(2, _ANY), ord("M"): range(3, _ANY), ord("P"): range(2, _ANY)},
    **{ord("Q"): range(3, _ANY), ord("L"): range(9, _ANY), ord("C"): range(11, _ANY)},
    **{ord("R"): range(2, 3), ord("S"): range(8, 9), ord("O"): range(2, 3)},
    _DATA: range(2, _ANY),
}
_SMALLEST: Final = np.array([_KINDS.get(k, range(_NEVER, 0)).start for k in range(256)])
_LARGEST: Final = np.array([_KINDS.get(k, range(1)).stop - 1 for k in range(256)])
_IS_OTHER: Final = np.array([k in _KINDS and k != _DATA for k in range(256)])
_EVIDENCE: Final = 3  # data messages that must ascend before their topic is guessed
_LARGEST_US: Final = 2**45  # a year since boot
_LETTER: Final = re.compile(rb"[A-Z]")


@dataclass(frozen=True, slots=True)
class Other:
    """A message that holds no data: its type, first byte and body."""

    kind: int
    start: int
    body: bytes


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The data messages of one subscription: first bytes of the fields, (n,), in file order.

    ``is_guess``: nobody subscribed them, the topic is the only one that fits.
    """

    layout: Layout
    instance: int
    at: Ints
    is_guess: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """What a ULog consists of.

    Attributes
    ----------
    rows : tuple of Rows
    others : tuple of Other
        All other messages, in file order.
    opaque : tuple of (int, int, int)
        First byte, size and message id of data that nobody defines, in file order.
    undefined : tuple of str
        Topics that are subscribed and whose format is missing, circular or too large.
    lost : (k, 2) int
        Byte ranges that belong to no message.
    unknown : tuple of (int, int, int)
        First byte, size and type of whole messages of an unknown type.
    cut : tuple of (int, int)
        Byte ranges of messages that the end of the file, or of a part, cuts.
    """

    rows: tuple[Rows, ...]
    others: tuple[Other, ...]
    opaque: tuple[tuple[int, int, int], ...]
    undefined: tuple[str, ...]
    lost: Ints
    unknown: tuple[tuple[int, int, int], ...]
    cut: tuple[tuple[int, int], ...]


def find_records(data: Bytes, parts: Sequence[tuple[int, int]]) -> Records:
    """Return the messages of these parts of the bytes, (from, to) each."""
    walk = _Walk(data, data.data, words(data, "<u2"))
    for start, limit in parts:
        walk.part(start, limit)
    return walk.records()


def words(data: Bytes, dtype: str) -> NDArray[Any]:
    """Return a view of the bytes in which entry i is the number that begins at byte i."""
    count = max(data.size - np.dtype(dtype).itemsize + 1, 0)
    return np.ndarray((count,), dtype, data, strides=(1,))


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """Headers of data messages from byte ``low`` to ``high``.

    ``breaks``: those that do not end where the next one begins.
    """

    low: int
    high: int
    at: Ints
    end: Ints
    breaks: list[int]

    def run(self, at: int) -> tuple[Ints, int]:
        """Return the messages that follow each other from a byte on, and where they end."""
        first = row = int(np.searchsorted(self.at, at))
        rows = []
        while row < self.at.size and self.at[row] == at:
            last = self.breaks[bisect_left(self.breaks, row)]
            rows.append((row, last + 1))
            at = int(self.end[last])
            row = last + 1 + int(np.searchsorted(self.at[last + 1 :], at))
        if len(rows) == 1:
            return self.at[first : rows[0][1]], at
        parts = [self.at[low:high] for low, high in rows]
        return np.concatenate(parts) if parts else self.at[:0], at


@dataclass(slots=True, eq=False)
class _Walk:
    """The state of the reading: what is defined so far, and what has been found."""

    data: Bytes
    view: memoryview
    word: NDArray[np.uint16]
    limit: int = 0
    formats: dict[str, Format] = field(default_factory=dict)
    subscriptions: list[tuple[Subscription, Layout]] = field(default_factory=list)
    waiting: list[Subscription] = field(default_factory=list)
    # of a message id: smallest and largest size of its data messages; the same as arrays
    sizes: dict[int, tuple[int, int]] = field(default_factory=dict)
    low: NDArray[np.int32] = field(default_factory=lambda: np.full(1 << 16, _NEVER, np.int32))
    high: NDArray[np.int32] = field(default_factory=lambda: np.full(1 << 16, -1, np.int32))
    window: _Window | None = None
    width: int = _WINDOW.start
    found: list[Ints] = field(default_factory=list)
    others: list[Other] = field(default_factory=list)
    lost: list[tuple[int, int]] = field(default_factory=list)
    unknown: list[tuple[int, int, int]] = field(default_factory=list)
    cut: list[tuple[int, int]] = field(default_factory=list)

    def part(self, at: int, limit: int) -> None:
        """Read from a byte to the limit."""
        self.limit, self.window = limit, None
        last = None  # the message before, if it ends here
        while at < limit:
            run, at = self.follow(at)
            if run.size:
                self.found.append(run)
                last = int(run[-1])
            if at >= limit:
                return
            if self.is_plausible(at):
                self.take(at)
                last, at = at, self.end(at)
            elif self.is_undefined_data(at):
                size = self.end(at) - at - 3
                self.set_sizes(self.number(at), size, size)
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
        if following is not None:
            size = self.end(at) - at if at + 3 <= following else 0
            is_whole = size == following - at and _LETTER.fullmatch(self.view[at + 2 : at + 3])
            if is_whole and self.view[at + 2] not in _KINDS:
                self.unknown.append((at, size, self.view[at + 2]))
            else:
                self.lost.append((at, following))
            return following
        is_cut = at + 3 > self.limit or (
            self.view[at + 2] in _KINDS and self.end(at) > self.limit and self.limit - at < _NEVER
        )
        (self.cut if is_cut else self.lost).append((at, self.limit))
        return self.limit

    def drop(self, last: int) -> None:
        """Forget the message that was read last."""
        if self.found and self.found[-1].size and self.found[-1][-1] == last:
            self.found[-1] = self.found[-1][:-1]
        elif self.others and self.others[-1].start == last:
            self.others.pop()

    def end(self, at: int) -> int:
        """Return where a message ends by its size."""
        return at + 3 + self.view[at] + 256 * self.view[at + 1]

    def number(self, at: int) -> int:
        """Return the id of a data message."""
        return self.view[at + 3] + 256 * self.view[at + 4]

    def is_plausible(self, at: int) -> bool:
        """Return whether a message of a known type that fits can begin here."""
        if at + 3 > self.limit or self.end(at) > self.limit:
            return False
        kind, size = self.view[at + 2], self.end(at) - at - 3
        if kind == _DATA:
            known = self.sizes.get(self.number(at)) if size >= 2 else None
            return known is not None and known[0] <= size <= known[1]
        if kind not in _KINDS or size not in _KINDS[kind]:
            return False
        return fits(kind, bytes(self.view[at + 3 : at + 3 + size]))

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

    def follow(self, at: int) -> tuple[Ints, int]:
        """Return the data messages that follow each other from a byte on, and where they end."""
        parts = []
        while at < self.limit:
            if self.window is None or not self.window.low <= at < self.window.high:
                self.window = self.look(at)
            run, at = self.window.run(at)
            parts.append(run)
            if at < self.window.high:
                break
        return parts[0] if len(parts) == 1 else np.concatenate(parts), at

    def look(self, low: int) -> _Window:
        """Return the headers of data messages from a byte on; windows grow until a definition."""
        high = min(low + self.width, self.limit)
        self.width = min(2 * self.width, _WINDOW.stop)
        at = self.data_headers(low, high)
        end = at + 3 + self.word[at]
        breaks = np.flatnonzero(end[:-1] != at[1:]).tolist()
        return _Window(low, high, at, end, [*breaks, at.size - 1])

    def data_headers(self, low: int, high: int) -> Ints:
        """Return where headers of data messages stand that fit their ids."""
        stop = min(high, self.limit - 4)
        if stop <= low:
            return np.empty(0, np.int64)
        is_data = self.data[low + 2 : stop + 2] == _DATA
        is_data &= self.data[low + 1 : stop + 1] <= self.high.max() >> 8
        at: Ints = np.flatnonzero(is_data) + low
        size, number = self.word[at], self.word[at + 3]
        good = (size >= self.low[number]) & (size <= self.high[number])
        at = at[good]
        return at[at + 3 + self.word[at] <= self.limit]

    def search(self, low: int, high: int) -> int | None:
        """Return the first byte from low to high where a message begins that another follows."""
        width = _SEARCH.start
        while low < high:
            stop = min(low + width, high)
            places = np.union1d(self.data_headers(low, stop), self.other_headers(low, stop))
            for at in places.tolist():
                if self.is_plausible(at) and self.chains(self.end(at)):
                    return int(at)
            low, width = stop, min(2 * width, _SEARCH.stop)
        return None

    def other_headers(self, low: int, high: int) -> Ints:
        """Return where headers of other messages may stand."""
        stop = min(high, self.limit - 2)
        if stop <= low:
            return np.empty(0, np.int64)
        at: Ints = np.flatnonzero(_IS_OTHER[self.data[low + 2 : stop + 2]]) + low
        size, kind = self.word[at], self.data[at + 2]
        good = (size >= _SMALLEST[kind]) & (size <= _LARGEST[kind]) & (at + 3 + size <= self.limit)
        found: Ints = at[good]
        return found

    def take(self, at: int) -> None:
        """Keep a message that holds no data; a definition holds from here on."""
        kind, body = self.view[at + 2], bytes(self.view[at + 3 : self.end(at)])
        self.others.append(Other(kind, at, body))
        if kind == ord("F"):
            made = parse_format(body)
            if made is not None:
                self.formats.setdefault(made.name, made)
                waiting, self.waiting = self.waiting, []
                for one in waiting:
                    self.subscribe(one)
        elif kind == ord("A"):
            asked = parse_subscription(body, at)
            if asked is not None:
                self.subscribe(asked)

    def subscribe(self, asked: Subscription) -> None:
        """Let an id mean records of a topic; without its format yet, later."""
        layout = resolve(asked.topic, self.formats)
        if layout is None:
            self.waiting.append(asked)
            return
        self.subscriptions.append((asked, layout))
        self.set_sizes(asked.number, layout.size + 2, layout.full + 2)

    def set_sizes(self, number: int, low: int, high: int) -> None:
        self.sizes[number] = low, high
        self.low[number], self.high[number] = low, high
        self.window, self.width = None, _WINDOW.start

    def records(self) -> Records:
        """Return what has been found."""
        rows, left = self.grouped(np.concatenate([np.empty(0, np.int64), *self.found]))
        guessed, left = self.guessed(left)
        opaque = [(at - 5, self.end(at - 5), one) for one, places in left for at in places.tolist()]
        return Records(
            (*rows, *guessed),
            tuple(self.others),
            tuple((low, high - low, one) for low, high, one in sorted(opaque)),
            tuple(sorted({one.topic for one in self.waiting})),
            np.array(self.lost, np.int64).reshape(-1, 2),
            tuple(self.unknown),
            tuple(self.cut),
        )

    def grouped(self, start: Ints) -> tuple[list[Rows], list[tuple[int, Ints]]]:
        """Return the data messages by subscription, and those of ids without one."""
        number = self.word[start + 3]
        at = start[np.argsort(number, kind="stable")] + 5
        counts = np.bincount(number, minlength=1)
        bounds = np.append(0, np.cumsum(counts))
        of_number: dict[int, list[tuple[Subscription, Layout]]] = {}
        for pair in self.subscriptions:
            of_number.setdefault(pair[0].number, []).append(pair)
        rows, opaque = [], []
        for one in np.flatnonzero(counts).tolist():
            here = at[bounds[one] : bounds[one + 1]]
            asked = of_number.get(one)
            if asked is None:
                opaque.append((one, here))
                continue
            split = np.searchsorted(here, [pair[0].since for pair in asked]).tolist()
            for (subscription, layout), low, high in zip(
                asked, [0, *split[1:]], [*split[1:], here.size], strict=True
            ):
                if high > low:
                    rows.append(Rows(layout, subscription.instance, here[low:high]))
        return rows, opaque

    def guessed(self, opaque: list[tuple[int, Ints]]) -> tuple[list[Rows], list[tuple[int, Ints]]]:
        """Return the opaque data that one unused format alone fits, and the others."""
        used = {one.topic for one, _ in self.subscriptions} | {one.topic for one in self.waiting}
        nested = {member.kind for one in self.formats.values() for member in one.members}
        free = [name for name in sorted(self.formats) if name not in used | nested]
        layouts = [layout for name in free if (layout := resolve(name, self.formats)) is not None]
        fitting = {number: [x for x in layouts if self.can_be(x, at)] for number, at in opaque}
        claims = Counter(x.topic for fit in fitting.values() for x in fit)
        found, left = [], []
        for number, at in opaque:
            fit = fitting[number]
            if len(fit) == 1 and claims[fit[0].topic] == 1:
                found.append(Rows(fit[0], 0, at, is_guess=True))
            else:
                left.append((number, at))
        return found, left

    def can_be(self, layout: Layout, at: Ints) -> bool:
        """Return whether data can be of a layout: by their size, and by stamps that ascend."""
        size = self.word[at - 5] - 2
        stamp = layout.field("timestamp")
        if (
            stamp is None
            or at.size < _EVIDENCE
            or layout.size > size.min()
            or layout.full < size.max()
        ):
            return False
        stamps = words(self.data, stamp.dtype)[at + stamp.offset]
        return bool(np.all(stamps[1:] > stamps[:-1]) and stamps[-1] < _LARGEST_US)


def fits(kind: int, body: bytes) -> bool:
    """Return whether a body can be one of a message type other than data."""
    if kind == ord("S"):
        return body == _SYNC
    if kind in _TEXT_AT:
        return body[:1] in _LEVELS and not _NO_TEXT.search(body, _TEXT_AT[kind])
    if kind in _KEY_AT:
        found = parse_key(body[_KEY_AT[kind] :])
        return found is not None and found.is_whole and (kind != ord("M") or body[0] <= 1)
    if kind == ord("A"):
        return parse_subscription(body, 0) is not None
    if kind == ord("F"):
        return parse_format(body) is not None
    return kind != ord("B") or body[8:16] in _FLAGS
