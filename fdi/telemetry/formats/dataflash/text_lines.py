"""Which numbers stand in the lines of a DataFlash text log?

In: bytes that hold whole lines. Out: where each line and each word of it begins and ends, and what
every word is as a number, for all words at once.

A line is ``NAME, v1, v2, ...``; it ends with CR, LF or both, blanks and tabs around a word are not
part of it. A word of up to 18 digits with a sign and a point is an integer divided by a power of
ten: both are exact in float64, so their quotient is the nearest one (Clinger 1990). Other words
(``3.1e-05``, ``NaN``) are read one by one, by `number`, where a number is expected: they are few.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Places = NDArray[np.intp]

NONE, INTEGER, DECIMAL, UNSIGNED = range(4)  # what a word is; UNSIGNED needs all of 64 bits
BLANKS: Final = bytes(range(33))
_BLANK: Final = 32
_WINDOW: Final = 1 << 20  # bytes at a time: the arrays of their words stay in the cache
_TRIMMED: Final = 3  # blanks beside a word; more are for `number`
_WIDEST: Final = 19  # characters of a word, its sign apart
_MOST_DIGITS: Final = 18  # that fit into int64
_EXACT: Final = 1 << 53  # integers up to here are exact in float64
_POWERS: Final = 10.0 ** np.arange(_WIDEST + 1)
_COMMA, _POINT, _PLUS, _MINUS, _ZERO = b",.+-0"
_LINE_FEED, _RETURN = b"\n\r"
_INTEGER: Final = re.compile(rb"[+-]?[0-9]{1,20}")
# unambiguous: of "[0-9]+[0-9]*" a word of n digits would be tried in n ways
_DECIMAL: Final = re.compile(
    rb"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:e[+-]?[0-9]+)?|[+-]?(?:nan|inf|infinity)",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Lines and their words, all places relative to ``part``.

    Attributes
    ----------
    part : (n,) uint8
    start, stop : (k,)
        Of the lines, line ends not included.
    first, last : (k,)
        The words of each line.
    begin, end : (m,)
        Of the words, blanks around them not included (but for more than a few).
    """

    part: Bytes
    start: Places
    stop: Places
    first: Places
    last: Places
    begin: Places
    end: Places

    def word(self, i: int) -> bytes:
        """Return a word."""
        return self.part[self.begin[i] : self.end[i]].tobytes()


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """What words are as numbers, (m,): which kind, as an integer (0 for decimals), as a float."""

    kind: NDArray[np.uint8]
    integer: NDArray[np.int64]
    value: NDArray[np.float64]


def whole_lines(data: Bytes) -> int:
    """Return where the last line end is over: a line behind it is cut."""
    size = 1 << 16
    while True:
        tail = data[max(data.size - size, 0) :].tobytes()
        at = max(tail.rfind(b"\n"), tail.rfind(b"\r")) + 1
        if at or size >= data.size:
            return data.size - len(tail) + at
        size *= 2


def windows(data: Bytes) -> Iterator[tuple[int, int]]:
    """Yield first byte and end of parts of some size that hold whole lines."""
    low, size = 0, whole_lines(data)
    while low < size:
        wanted, high = _WINDOW, low
        while high == low:
            high = low + whole_lines(data[low : min(low + wanted, size)])
            wanted *= 2
        yield low, high
        low = high


def find_lines(part: Bytes) -> Lines:
    """Return the lines of bytes that end with a line end."""
    is_end = (part == _LINE_FEED) | (part == _RETURN)
    breaks = np.flatnonzero(is_end | (part == _COMMA))
    last = np.flatnonzero(is_end[breaks])
    first = np.concatenate(([0], last[:-1] + 1))
    begin = np.concatenate(([0], breaks[:-1] + 1))
    start, stop = begin[first], breaks[last]
    end = breaks.copy()
    for _ in range(_TRIMMED):
        is_blank = (part[begin] <= _BLANK) & (begin < end)
        if not is_blank.any():
            break
        begin += is_blank
    for _ in range(_TRIMMED):
        is_blank = (part[end - 1] <= _BLANK) & (begin < end)
        if not is_blank.any():
            break
        end -= is_blank
    return Lines(part, start, stop, first, last, begin, end)


def find_numbers(lines: Lines) -> Numbers:
    """Return what the words are as numbers; those written in an unusual way are of no kind."""
    part, begin = lines.part, lines.begin
    sign = part[begin]
    is_negative = sign == _MINUS
    begin = begin + (is_negative | (sign == _PLUS))
    width = lines.end - begin
    width[(width < 0) | (width > _WIDEST)] = 0
    # the longest first, so that the words with a further character are always the foremost ones
    order = np.argsort((_WIDEST - width).astype(np.uint8), kind="stable")
    at, width = begin[order], width[order].astype(np.uint8)
    longer = width.size - np.cumsum(np.bincount(width, minlength=_WIDEST + 1))
    found = np.zeros(width.size, np.int64)
    digits, points, place = np.zeros((3, width.size), np.uint8)
    for p in range(_WIDEST):
        n = int(longer[p])
        if not n:
            break
        character = part[at[:n] + p]
        digit = character - np.uint8(_ZERO)
        is_digit = digit < 10
        is_point = character == _POINT
        more = found[:n] * 10
        more += digit
        np.copyto(found[:n], more, where=is_digit)
        np.copyto(place[:n], np.uint8(p + 1), where=is_point)
        digits[:n] += is_digit
        points[:n] += is_point
    is_known = (digits + points == width) & (digits > 0) & (digits <= _MOST_DIGITS)
    is_known &= (points == 0) | ((points == 1) & (found <= _EXACT))
    behind = np.where((points == 1) & is_known, width - place, np.uint8(0))
    kind = np.empty(width.size, np.uint8)
    kind[order] = np.where(is_known, np.where(points == 1, DECIMAL, INTEGER), NONE)
    value = np.empty(width.size)
    value[order] = found / _POWERS[behind]
    integer = np.empty(width.size, np.int64)
    integer[order] = found
    np.negative(value, out=value, where=is_negative)
    np.negative(integer, out=integer, where=is_negative)
    return Numbers(kind, integer, value)


def number(word: bytes) -> tuple[int, int, float]:
    """Return kind, integer and value of a word, however the number is written.

    Examples
    --------
    >>> number(b"3.1e-05")
    (2, 0, 3.1e-05)
    >>> number(b"ALT_HOLD")
    (0, 0, 0.0)
    """
    word = word.strip(BLANKS)
    if _INTEGER.fullmatch(word):
        integer = int(word)
        if -(1 << 63) <= integer < 1 << 63:
            return INTEGER, integer, float(word)
        if 0 < integer < 1 << 64:
            return UNSIGNED, integer - (1 << 64), float(word)
    if _DECIMAL.fullmatch(word):
        return DECIMAL, 0, float(word)
    return NONE, 0, 0.0
