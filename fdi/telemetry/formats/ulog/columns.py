"""What do the fields of the topics hold?

In: where the records of each topic begin in the file. Out: a column per field, decoded when one is
asked for.

All fields of a record lie in one or two cache lines, and fetching these is what costs time: so the
records of a topic are copied together and kept for the next field. Machine code copies those of all
topics in one go once some of them were asked for. Topics too large to be kept (in logs of
gigabytes) are read field by field.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.bytes.texts import texts
from fdi.telemetry.formats.ulog.definitions import Bytes, Field, Layout
from fdi.telemetry.formats.ulog.kernels import copy_records

Ints = NDArray[np.int64]
Block = NDArray[np.void]

_KEPT_BYTES: Final = 64 << 20  # of records
_SEVERAL: Final = 16  # reading a log needs a thirtieth of it; who asks for a sixteenth wants half


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
    total: int = field(init=False)  # bytes of all records

    def __post_init__(self) -> None:
        self.total = sum(one.size for one in self.topics)

    def load(self, topic: int, wanted: Field) -> NDArray[Any]:
        """Return the raw values of a field of the topic with a number, (n,); texts as `str`."""
        if topic not in self.kept and self.topics[topic].size <= _KEPT_BYTES:
            self.copy(topic)
        values: NDArray[Any]
        if topic in self.kept:
            values = self.kept[topic][wanted.name]
            values = values if self.total <= _KEPT_BYTES else values.copy()
        else:
            at, width = self.topics[topic].at + wanted.offset, np.dtype(wanted.dtype).itemsize
            values = gather(self.data, at, width).view(wanted.dtype).reshape(-1)
        return texts(values) if values.dtype.kind == "S" else values

    def copy(self, topic: int) -> None:
        """Copy the records of a topic, and of all others once it seems that all are wanted."""
        kernel = compiled(copy_records, self.data.size)
        wants_all = self.total <= _KEPT_BYTES and self.kept_size * _SEVERAL > self.total
        if kernel is not None and wants_all:
            self.copy_others(kernel)
            return
        layout, at = self.topics[topic]
        self.keep(topic, gather(self.data, at, layout.size).reshape(-1))
        while self.kept_size > _KEPT_BYTES:
            self.kept_size -= self.kept.pop(next(iter(self.kept))).nbytes

    def copy_others(self, kernel: Callable[..., None]) -> None:
        """Copy the records of all topics that are not kept, by machine code."""
        wanted = [one for one in range(len(self.topics)) if one not in self.kept]
        topics = [self.topics[one] for one in wanted]
        at = np.concatenate([one.at for one in topics])
        counts = np.array([one.at.size for one in topics])
        sizes = np.array([one.layout.size for one in topics])
        ends = np.cumsum(counts * sizes)
        # one piece of memory: many small ones cost twice the time to fill
        blocks = np.empty(ends[-1], np.uint8)
        kernel(self.data, at, (np.cumsum(counts), sizes, ends - counts * sizes), blocks)
        for one, records in zip(wanted, np.split(blocks, ends[:-1]), strict=True):
            self.keep(one, records)

    def keep(self, topic: int, records: Bytes) -> None:
        """Keep the records of a topic, one after the other."""
        layout, at = self.topics[topic]
        self.kept[topic] = np.ndarray(at.shape, _record(layout), records)
        self.kept_size += records.size


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
