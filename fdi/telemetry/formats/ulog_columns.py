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
    kept_size: int = 0  # bytes of them
    total: int = field(init=False)  # bytes of all columns

    def __post_init__(self) -> None:
        self.total = sum(one.size for one in self.topics)

    def load(self, topic: int, wanted: Field) -> NDArray[Any]:
        """Return the raw values of a field of the topic with a number, (n,); texts as `str`."""
        kept = self.kept.get(topic)
        if kept is None and self.topics[topic].size <= _KEPT_BYTES:
            self.decode(topic)
            kept = self.kept[topic]
        if kept is not None:
            values = kept[wanted.name]
        else:
            at, width = self.topics[topic].at + wanted.offset, np.dtype(wanted.dtype).itemsize
            values = gather(self.data, at, width).view(wanted.dtype).reshape(-1)
        return texts(values) if wanted.is_text else values

    def decode(self, topic: int) -> None:
        """Make the columns of a topic, and of all others once it seems that all are wanted."""
        fill = compiled(fill_columns, self.data.size)
        if fill is None:
            self.kept[topic] = _by_record(self.data, self.topics[topic])
            self.kept_size += self.topics[topic].size
        else:
            wanted = [topic]
            if self.kept_size * _SEVERAL > self.total and self.total <= _KEPT_BYTES:
                wanted = [one for one in range(len(self.topics)) if one not in self.kept]
            columns = _filled(fill, self.data, [self.topics[one] for one in wanted])
            self.kept.update(zip(wanted, columns, strict=True))
            self.kept_size += sum(self.topics[one].size for one in wanted)
        while self.kept_size > _KEPT_BYTES:
            oldest = next(iter(self.kept))
            del self.kept[oldest]
            self.kept_size -= self.topics[oldest].size


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
    rows: dict[int, list[tuple[int, int, int, Field]]] = {width: [] for width in _WIDTHS}
    room = dict.fromkeys(_WIDTHS, 0)
    for number, (layout, at) in enumerate(topics):
        for one in layout.fields:
            if one.is_text:
                letters = gather(data, at + one.offset, int(one.dtype[1:]))
                made[number][one.name] = letters.view(one.dtype).reshape(-1)
                continue
            width = int(one.dtype[-1])
            rows[width].append((number, one.offset, room[width], one))
            room[width] += at.size
    fields, places = [], []
    for width, some in rows.items():
        out = np.empty(room[width], f"<u{width}")
        views = {dtype: out.view(dtype) for dtype in {one.dtype for _, _, _, one in some}}
        for number, _, first, one in some:
            made[number][one.name] = views[one.dtype][first : first + topics[number].at.size]
        table = np.array([row[:3] for row in some], np.int64).reshape(-1, 3)
        table[:, 2] -= bounds[table[:, 0]]
        fields.append(table.astype(np.uint64))
        places.append(out)
    places_of = np.concatenate([topic.at for topic in topics]).view(np.uint64)
    sources = tuple(words(data, f"<u{width}") for width in _WIDTHS)
    fill(sources, places_of, bounds.astype(np.uint64), tuple(fields), tuple(places))
    return made
