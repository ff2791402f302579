"""Where in these bytes are DataFlash records, and which bytes belong to none?

In: the bytes and the layouts. Out: `Records`, in file order.

A record is ``A3 95 type`` and a body whose length the type's FMT gives; there is no checksum. It is
believed when the next header stands at its end or the file ends there. If not, and inside it a
record begins that is followed by another, it was cut: the reading goes on there. Otherwise it is
kept and the search goes on behind it.

Method: all headers at once; a run of records that end where the next header stands is taken whole.
Only at the breaks of such runs Python decides one by one, each in constant time.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.dataflash_layouts import (
    FMT,
    Bytes,
    Field,
    Ints,
    Layout,
    definition_at,
    headers,
    plausible,
)

_CHUNK: Final = 16 << 20


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Believed records, (n,): first byte and which of ``layouts``; ``lost`` (k, 2) byte ranges."""

    data: Bytes
    layouts: tuple[Layout, ...]
    start: Ints
    layout: NDArray[np.int16]
    lost: Ints
    is_cut: bool  # the last of the lost ranges is a record that the file's end cuts

    def values(self, rows: Ints, field: Field) -> NDArray[Any]:
        """Return a field's raw values, (m,); texts as `str`."""
        width = np.dtype(field.dtype).itemsize
        windows = np.lib.stride_tricks.sliding_window_view(self.data, width)
        block = np.ascontiguousarray(windows[self.start[rows] + field.offset])
        values: NDArray[Any] = block.view(field.dtype).reshape(-1)
        return texts(values) if field.is_text else values


def texts(values: NDArray[Any]) -> NDArray[Any]:
    """Return `str`, cut at the first NUL; what is not UTF-8 is Latin-1."""
    distinct, place = np.unique(values, return_inverse=True)
    out = np.empty(distinct.size, object)
    for i, raw in enumerate(distinct.tolist()):
        cut = raw.split(b"\0")[0]
        try:
            out[i] = cut.decode("utf-8")
        except UnicodeDecodeError:
            out[i] = cut.decode("latin-1")
    return out[place.reshape(-1)]


def find_records(data: Bytes, layouts: list[Layout]) -> Records:
    """Return the records of these layouts."""
    at, which = _candidates(data, layouts)
    lengths = np.array([one.length for one in layouts], np.int64)
    end = at + lengths[which]
    taken = _walk(at, end, data.size)
    start, stop = at[taken], end[taken]
    low = np.concatenate(([0], stop))
    high = np.concatenate((start, [data.size]))
    gap = high > low
    lost = np.stack((low[gap], high[gap]), axis=1)
    is_cut = bool(gap[-1]) and at.size > 0 and bool(np.any((at >= low[-1]) & (end > data.size)))
    return Records(data, tuple(layouts), start, which[taken], lost, is_cut)


def _candidates(data: Bytes, layouts: list[Layout]) -> tuple[Ints, NDArray[np.int16]]:
    """Return where headers of known types stand, and the layout that holds there."""
    first = np.full(256, -1, np.int16)
    again: dict[int, list[int]] = {}
    for i, one in enumerate(layouts):
        if first[one.number] < 0:
            first[one.number] = i
        else:
            again.setdefault(one.number, [int(first[one.number])]).append(i)
    ats, kinds = [np.empty(0, np.int64)], [np.empty(0, np.int16)]
    for low in range(0, data.size, _CHUNK):
        at = headers(data, low, low + _CHUNK)
        at = at[at + 2 < data.size]
        which = first[data[at + 2]]
        good = which >= 0
        # a definition that does not fit together is none
        right = [p for p in plausible(data, at).tolist() if definition_at(data, p) is not None]
        good &= (data[at + 2] != FMT) | np.isin(at, right)
        ats.append(at[good])
        kinds.append(which[good])
    place, kind = np.concatenate(ats), np.concatenate(kinds)
    for versions in again.values():
        here = np.flatnonzero(kind == versions[0])
        since = np.array([layouts[i].since for i in versions])
        newest = np.searchsorted(since, place[here], side="right") - 1
        kind[here] = np.array(versions, np.int16)[newest]
    return place, kind


def _walk(at: Ints, end: Ints, size: int) -> NDArray[np.bool_]:
    """Return which candidates are records."""
    n = at.size
    taken = np.zeros(n, np.bool_)
    if not n:
        return taken
    goes_on = np.append(end[:-1] == at[1:], False)
    breaks = np.flatnonzero(~goes_on)
    behind = np.searchsorted(at, end[breaks])  # first candidate at or behind the end
    joined = at[np.minimum(behind, n - 1)] == end[breaks]
    chains = goes_on.copy()
    chains[breaks] = joined
    # first candidate from each on that is followed by another
    nearest = np.where(chains, np.arange(n), n)
    nearest = np.append(np.minimum.accumulate(nearest[::-1])[::-1], n)
    inside = nearest[breaks + 1]
    is_hit = (inside < behind) & ~joined & (end[breaks] != size)
    is_kept = ~is_hit & (end[breaks] <= size)
    follows = np.where(is_hit, inside, np.where(is_kept, behind, breaks + 1)).tolist()
    kept, stops = is_kept.tolist(), breaks.tolist()
    change = np.zeros(n + 1, np.int8)
    row = 0
    while row < n:
        i = bisect_left(stops, row)
        change[row] += 1
        change[stops[i] + kept[i]] -= 1
        row = follows[i]
    return np.cumsum(change[:-1], dtype=np.int8) > 0
