"""What do the records of one DataFlash layout hold, as columns?

In: the bytes and where the records begin. Out: a `Table` per layout, whose columns are decoded when
they are asked for. Text logs make the same tables from lines.

All fields of a record lie in one or two cache lines, and fetching these is what costs time: so the
records of a table are copied together, and the copies used last are kept for the next field. Tables
too large for that (in logs of gigabytes) are read field by field.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.dataflash_layouts import Field, Layout
from fdi.telemetry.formats.dataflash_records import Bytes, Ints, Offsets
from fdi.telemetry.formats.gather import gather
from fdi.telemetry.formats.texts import binary, texts

_KEPT_BYTES: Final = 64 << 20  # of records copied for their columns
_BINARY: Final = ("FILE", "Data")  # the text field that holds no text


class Source(Protocol):
    """Who decodes the records of a table: `Blocks`, or the lines of a text log."""

    def load(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the raw values of a field, (n,); texts as `str`."""

    def split(self, table: Table, field: Field) -> Iterator[tuple[int, Table, Ints]]:
        """Yield the records by the value of a field: the value, a table and its rows in the old."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """The records of one layout: where each begins in the file, (n,) ascending, and its columns."""

    layout: Layout
    start: Offsets
    source: Source

    def column(self, field: Field) -> NDArray[Any]:
        """Return the raw values of a field, (n,); texts as `str`."""
        return self.source.load(self, field)


Tables = Sequence[Table]


def columns(tables: Tables, name: str, *fields: str) -> Iterator[tuple[int, list[NDArray[Any]]]]:
    """Yield number and raw values of the tables of a name that have all of these fields."""
    for i, table in enumerate(tables):
        if table.layout.name != name:
            continue
        found = [table.layout.field(field) for field in fields]
        if None not in found:
            yield i, [table.column(field) for field in found if field is not None]


class Blocks:
    """Decodes the records of a binary log; the blocks of records that were used last are kept."""

    def __init__(self, data: Bytes) -> None:
        self._data = data
        self._kept: deque[tuple[Offsets, NDArray[np.void]]] = deque()

    def load(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the raw values of a field, (n,); texts as `str`."""
        layout, start = table.layout, table.start
        if start.size * layout.length <= _KEPT_BYTES:
            values = np.ascontiguousarray(self._block(layout, start)[field.name])
        else:
            width = np.dtype(field.dtype).itemsize
            at = start + np.asarray(field.offset, start.dtype)
            values = gather(self._data, at, width).view(field.dtype).reshape(-1)
        if not field.is_text:
            return values
        return binary(values) if (layout.name, field.name) == _BINARY else texts(values)

    def split(self, table: Table, field: Field) -> Iterator[tuple[int, Table, Ints]]:
        """Yield the records by the value of a field: the value, a table and its rows in the old."""
        values = table.column(field)
        whole = [kept for kept in self._kept if kept[0] is table.start]
        self._kept = deque(kept for kept in self._kept if kept[0] is not table.start)
        for value in np.flatnonzero(np.bincount(values)).tolist():
            rows = np.flatnonzero(values == value)
            part = Table(table.layout, table.start[rows], self)
            for _, block in whole:
                self._keep(part.start, block[rows])
            yield value, part, rows

    def _block(self, layout: Layout, start: Offsets) -> NDArray[np.void]:
        for whose, block in tuple(self._kept):
            if whose is start:
                return block
        made = gather(self._data, start, layout.length).view(_record(layout)).reshape(-1)
        self._keep(start, made)
        return made

    def _keep(self, start: Offsets, block: NDArray[np.void]) -> None:
        self._kept.append((start, block))
        while sum(b.nbytes for _, b in self._kept) > _KEPT_BYTES and len(self._kept) > 1:
            self._kept.popleft()


def _record(layout: Layout) -> np.dtype[np.void]:
    fields = layout.fields
    return np.dtype(
        {
            "names": [f.name for f in fields],
            "formats": [f.dtype for f in fields],
            "offsets": [f.offset for f in fields],
            "itemsize": layout.length,
        }
    )
