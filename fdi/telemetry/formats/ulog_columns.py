"""What do the fields of the topics hold?

In: where the records of each topic begin in the file. Out: a column per field, decoded when one is
asked for.

All fields of a record lie in one or two cache lines, and fetching these is what costs time: so the
records of a topic are copied together and kept for the next field. Once some topics were asked for,
those of all the others are copied in one go through the file. Topics too large to be kept (in logs
of gigabytes) are read field by field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.compiled import compiled, copy_records
from fdi.telemetry.formats.gather import gather
from fdi.telemetry.formats.texts import texts
from fdi.telemetry.formats.ulog_definitions import Bytes, Field, Layout

Ints = NDArray[np.int64]
Block = NDArray[np.void]

_KEPT_BYTES: Final = 64 << 20  # of records
_SEVERAL: Final = 8  # who asked for an eighth of a log wants all of it
_PART: Final = 4 << 20  # bytes of the file that stay in the cache


class Places(NamedTuple):
    """The records of a topic, (n,): their layout and first bytes of their fields."""

    layout: Layout
    at: Ints

    @property
    def size(self) -> int:
        """How many bytes the records have."""
        return self.at.size * self.layout.size


@dataclass(slots=True, eq=False)
class Store:
    """Decodes the records of a log's topics.

    Of a small log they are all kept, and a column is a view of them. Of a larger one those used
    last are kept, and a column is a copy.
    """

    data: Bytes
    topics: Sequence[Places]
    kept: dict[int, Block] = field(default_factory=dict)  # records by topic
    kept_size: int = 0  # bytes of them
    is_small: bool = field(init=False)
    # for all records of a small log: many small pieces of memory cost twice the time to fill
    room: Bytes = field(init=False)
    stops: Ints = field(init=False)  # of the topics in there

    def __post_init__(self) -> None:
        self.stops = np.cumsum([one.size for one in self.topics])
        total = int(self.stops[-1])
        self.is_small = total <= _KEPT_BYTES
        self.room = np.empty(total if self.is_small else 0, np.uint8)

    def load(self, topic: int, wanted: Field) -> NDArray[Any]:
        """Return the raw values of a field of the topic with a number, (n,); texts as `str`."""
        if topic not in self.kept and self.topics[topic].size <= _KEPT_BYTES:
            (self.copy if self.is_small else self.exchange)(topic)
        values: NDArray[Any]
        if topic in self.kept:
            values = self.kept[topic][wanted.name]
            values = values if self.is_small else values.copy()
        else:
            at, width = self.topics[topic].at + wanted.offset, np.dtype(wanted.dtype).itemsize
            values = gather(self.data, at, width).view(wanted.dtype).reshape(-1)
        return texts(values) if wanted.is_text else values

    def exchange(self, topic: int) -> None:
        """Copy the records of a topic, and let go of those that were copied longest ago."""
        layout, at = self.topics[topic]
        self.keep(topic, gather(self.data, at, layout.size).reshape(-1))
        while self.kept_size > _KEPT_BYTES:
            self.kept_size -= self.kept.pop(next(iter(self.kept))).nbytes

    def copy(self, topic: int) -> None:
        """Copy the records of a topic, and of all others once it seems that all are wanted."""
        wanted = [topic]
        if self.kept_size * _SEVERAL > self.room.size:
            wanted = [one for one in range(len(self.topics)) if one not in self.kept]
        topics = [self.topics[one] for one in wanted]
        at = np.concatenate([one.at for one in topics])
        counts = np.array([one.at.size for one in topics])
        sizes = np.array([one.layout.size for one in topics])
        first = self.stops[wanted] - counts * sizes
        copy = compiled(copy_records, self.data.size) or _copy_records
        copy(self.data, at, (np.cumsum(counts), sizes, first), self.room)
        for one, low in zip(wanted, first.tolist(), strict=True):
            self.keep(one, self.room[low : self.stops[one]])

    def keep(self, topic: int, records: Bytes) -> None:
        """Keep the records of a topic, one after the other."""
        layout, at = self.topics[topic]
        self.kept[topic] = np.ndarray(at.shape, _record(layout), records)
        self.kept_size += records.size


def _copy_records(data: Bytes, at: Ints, topics: tuple[Ints, Ints, Ints], blocks: Bytes) -> None:
    """Copy the records of several topics, as `compiled.copy_records` does."""
    stops, sizes, first = (column.tolist() for column in topics)
    starts = [0, *stops[:-1]]
    for end in range(_PART, data.size + _PART, _PART):
        for k, (row, stop, size) in enumerate(zip(starts, stops, sizes, strict=True)):
            count = int(np.searchsorted(at[row:stop], end))
            if count:
                rows = gather(data, at[row : row + count], size)
                blocks[first[k] : first[k] + rows.size] = rows.reshape(-1)
                starts[k] += count
                first[k] += rows.size


def _record(layout: Layout) -> np.dtype[np.void]:
    fields = layout.fields
    return np.dtype(
        {
            "names": [f.name for f in fields],
            "formats": [f.dtype for f in fields],
            "offsets": [f.offset for f in fields],
            "itemsize": layout.size,
        }
    )
