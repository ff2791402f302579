"""What do the fields of the topics hold?

In: where the records of each topic begin in the file. Out: a column per field, decoded when one is
asked for.

All fields of a record lie in one or two cache lines, and fetching these is what costs time: so all
columns of a topic are made together, and those that were used last are kept for the next field.
Machine code then makes those of all topics in one go, if they are few enough to be kept, once some
of them were asked for. Topics too large to be kept (in logs of gigabytes) are read field by field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.compiled import compiled, fill_columns
from fdi.telemetry.formats.gather import gather
from fdi.telemetry.formats.texts import texts
from fdi.telemetry.formats.ulog_definitions import Bytes, Field, Layout
from fdi.telemetry.formats.ulog_walk import words

Ints = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]

_KEPT_BYTES: Final = 64 << 20  # of columns, beside those that the log itself keeps
_SEVERAL: Final = 8  # who asked for an eighth of a log wants all of it
_WIDTHS: Final = (1, 2, 4, 8)


class Places(NamedTuple):
    """The records of a topic, (n,): their layout and first bytes of their fields."""

    layout: Layout
    at: Ints

    @property
    def size(self) -> int:
        """How many bytes the columns have."""
        return self.at.size * self.layout.size


@dataclass(slots=True, eq=False)
class Store:
    """Decodes the records of a log's topics; the columns that were used last are kept."""

    data: Bytes
    topics: Sequence[Places]
    kept: dict[int, Columns] = field(default_factory=dict)

    def load(self, topic: int, wanted: Field) -> NDArray[Any]:
        """Return the raw values of a field of the topic with a number, (n,); texts as `str`."""
        if self.topics[topic].size > _KEPT_BYTES:
            at, width = self.topics[topic].at + wanted.offset, np.dtype(wanted.dtype).itemsize
            values = gather(self.data, at, width).view(wanted.dtype).reshape(-1)
        else:
            if topic not in self.kept:
                self.decode(topic)
            values = self.kept[topic][wanted.name]
        return texts(values) if wanted.is_text else values

    def decode(self, topic: int) -> None:
        """Make the columns of a topic, and of all others once it seems that all are wanted."""
        fill = compiled(fill_columns, self.data.size)
        if fill is None:
            self.kept[topic] = _by_record(self.data, self.topics[topic])
        else:
            wanted = [topic]
            made, total = (sum(one.size for one in some) for some in (self.done(), self.topics))
            if made * _SEVERAL > total and total <= _KEPT_BYTES:
                wanted = [one for one in range(len(self.topics)) if one not in self.kept]
            columns = _filled(fill, self.data, [self.topics[one] for one in wanted])
            self.kept.update(zip(wanted, columns, strict=True))
        while sum(one.size for one in self.done()) > _KEPT_BYTES:
            del self.kept[next(iter(self.kept))]

    def done(self) -> list[Places]:
        """Return the topics whose columns are kept."""
        return [self.topics[one] for one in self.kept]


def _by_record(data: Bytes, topic: Places) -> Columns:
    layout, at = topic
    rows = gather(data, at, layout.size)
    return {
        f.name: np.ndarray(at.shape, f.dtype, rows, f.offset, (layout.size,)).copy()
        for f in layout.fields
    }


def _filled(
    fill: Callable[..., None], data: Bytes, topics: Sequence[Places]
) -> list[dict[str, NDArray[Any]]]:
    """Return the columns of all topics, by machine code; texts by numpy."""
    made: list[dict[str, NDArray[Any]]] = [{} for _ in topics]
    bounds = np.append(0, np.cumsum([topic.at.size for topic in topics]))
    fields, places = [], []
    for width in _WIDTHS:
        rows: list[tuple[int, int, int]] = []
        named = []
        room = 0
        for number, (layout, at) in enumerate(topics):
            for one in layout.fields:
                if _width(one) == width:
                    rows.append((number, one.offset, room))
                    named.append(one)
                    room += at.size
        out = np.empty(room, f"<u{width}")
        for (number, _, first), one in zip(rows, named, strict=True):
            column = out[first : first + topics[number].at.size]
            made[number][one.name] = column.view(one.dtype)
        table = np.array(rows, np.int64).reshape(-1, 3)
        table[:, 2] -= bounds[table[:, 0]]
        fields.append(table.astype(np.uint64))
        places.append(out)
    at = np.concatenate([topic.at for topic in topics])
    sources = tuple(words(data, f"<u{width}") for width in _WIDTHS)
    fill(sources, at.view(np.uint64), bounds.astype(np.uint64), tuple(fields), tuple(places))
    for columns, topic in zip(made, topics, strict=True):
        for one in topic.layout.fields:
            if one.name not in columns:
                bytes_ = gather(data, topic.at + one.offset, np.dtype(one.dtype).itemsize)
                columns[one.name] = bytes_.view(one.dtype).reshape(-1)
    return made


def _width(one: Field) -> int:
    return 0 if one.is_text else int(one.dtype[-1])
