"""What do the records of one DataFlash layout hold, as columns?

In: the bytes and where the records begin. Out: a `Table` per layout and instance, whose columns are
decoded when one of them is asked for. Text logs make the same tables from lines.

All fields of a record lie in one or two cache lines, and fetching these is what costs time: so the
records of a table are copied together and kept for the next field.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.bytes.gather import gather
from fdi.telemetry.formats.bytes.texts import binary, coded
from fdi.telemetry.formats.dataflash.kernels import copy_records
from fdi.telemetry.formats.dataflash.layouts import Field, Layout
from fdi.telemetry.formats.dataflash.records import SMALL, Bytes, Ints, Offsets, Records

_TYPES: Final = 256
_KEPT: Final = 8 << 20  # bytes of records kept of a large file, the largest table copied at once
_WHOLE: Final = "iu"  # kinds of dtype
_KINDS: Final = {
    **dict.fromkeys(("Label", "UnitIds", "MultIds", "Name", "Columns"), "S"),
    **dict.fromkeys(("Mult", "P1", "P2"), "f"),
    "Alt": "if",  # whole centimetres in old firmware
    "Mode": "iuS",  # text logs have names
}
_BINARY: Final = ("FILE", "Data")  # the text field that holds no text


class Source(Protocol):
    """Who decodes the records of a table: `Blocks`, or the lines of a text log."""

    def load(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the raw values of a field, (n,); texts as `str`."""

    def pick(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the same for numbers; in large logs without the other fields of the records."""

    def codes(self, table: Table, field: Field) -> tuple[NDArray[Any], Ints]:
        """Return the distinct values of a text field, (k,), and which of them each is, (n,)."""

    def split(self, table: Table, field: Field) -> Iterator[Table]:
        """Yield a table for every instance, by the field that numbers them."""

    def part(self, table: Table, rows: Ints | slice, instance: int | None = None) -> Table:
        """Return a table of some of the records, ascending."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """The records of one layout (of one instance of it): first bytes, (n,) ascending, and columns.

    ``instance`` is None for the first one (0), and where there are none.
    """

    layout: Layout
    start: Offsets
    source: Source
    instance: int | None = None

    def column(self, field: Field) -> NDArray[Any]:
        """Return the raw values of a field, (n,); texts as `str`."""
        return self.source.load(self, field)

    def pick(self, field: Field) -> NDArray[Any]:
        """Return the same of a field of numbers of which the whole log is to be looked at."""
        return self.source.pick(self, field)


Tables = Sequence[Table]


def columns(tables: Tables, name: str, *fields: str) -> Iterator[tuple[int, list[NDArray[Any]]]]:
    """Yield number and raw values of the tables of a name that have all of these fields.

    A definition may fit together and yet give a field another character than firmware does: such a
    table is left out, so that a text is a text here and a code a whole number.
    """
    for i, table in enumerate(tables):
        if table.layout.name != name:
            continue
        found = [field for field in map(table.layout.field, fields) if field is not None]
        usual = all(np.dtype(f.dtype).kind in _KINDS.get(f.name, _WHOLE) for f in found)
        if len(found) == len(fields) and usual:
            yield i, [table.column(field) for field in found]


class Blocks:
    """Decodes the records of a binary log, those of a table together.

    Of a file up to `SMALL` bytes they are all kept, and a column is a view of them. Of a larger one
    those used last are kept, and a column is a copy.
    """

    def __init__(self, data: Bytes, records: Records) -> None:
        self._data = data
        self._is_small = data.size <= SMALL
        # by the identity of the array of starts, which is kept too
        self._kept: dict[int, tuple[Offsets, NDArray[np.void]]] = {}
        self._codes: dict[tuple[int, str], tuple[NDArray[Any], Ints]] = {}
        # one piece of memory: many small ones cost twice the time to fill
        self._free = np.empty(data.size if self._is_small else 0, np.uint8)
        copy = compiled(copy_records, data.size)
        if copy is not None and records.in_order:
            self._copy_all(records, copy)

    def load(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the raw values of a field, (n,); texts as `str`."""
        values = self._values(table, field)
        if not field.is_text:
            return values
        if (table.layout.name, field.name) == _BINARY:
            return binary(values)
        distinct, which = self.codes(table, field)
        found: NDArray[Any] = distinct[which]
        return found

    def pick(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the same for numbers; in large logs without the other fields of the records."""
        return self._values(table, field) if self._is_small else self._gathered(table, field)

    def codes(self, table: Table, field: Field) -> tuple[NDArray[Any], Ints]:
        """Return the distinct values of a text field, (k,), and which of them each is, (n,)."""
        key = id(table.start), field.name
        if key not in self._codes:
            made = coded(self._values(table, field))
            if not self._is_small:
                return made
            self._codes[key] = made
        return self._codes[key]

    def split(self, table: Table, field: Field) -> Iterator[Table]:
        """Yield a table for every instance, by the field that numbers them."""
        for number, rows in rows_of(self.pick(table, field)):
            yield self.part(table, rows, number or None)

    def part(self, table: Table, rows: Ints | slice, instance: int | None = None) -> Table:
        """Return a table of some of the records, ascending."""
        part = replace(table, start=table.start[rows], instance=instance)
        if self._is_small:
            self._kept[id(part.start)] = part.start, self._block(table)[rows]
        return part

    def _values(self, table: Table, field: Field) -> NDArray[Any]:
        if self._is_small:
            values: NDArray[Any] = self._block(table)[field.name]
            return values
        if table.start.size * table.layout.length > _KEPT:
            return self._gathered(table, field)
        return np.ascontiguousarray(self._block(table)[field.name])

    def _gathered(self, table: Table, field: Field) -> NDArray[Any]:
        at = table.start + np.asarray(field.offset, table.start.dtype)
        rows = gather(self._data, at, np.dtype(field.dtype).itemsize)
        values: NDArray[Any] = rows.view(field.dtype).reshape(-1)
        return values

    def _block(self, table: Table) -> NDArray[np.void]:
        _, block = self._kept.get(id(table.start), (None, None))
        if block is None:
            rows = gather(self._data, table.start, table.layout.length).reshape(-1)
            if self._is_small:
                piece = self._piece(rows.size)
                piece[:] = rows
                rows = piece
            block = rows.view(_record(table.layout))
            while not self._is_small and self._kept_bytes() + block.nbytes > _KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[id(table.start)] = table.start, block
        return block

    def _kept_bytes(self) -> int:
        return sum(block.nbytes for _, block in self._kept.values())

    def _piece(self, size: int) -> Bytes:
        piece, self._free = self._free[:size], self._free[size:]
        return piece

    def _copy_all(self, records: Records, copy: Callable[..., None]) -> None:
        lengths, free = np.zeros((2, _TYPES), np.int64)
        pairs = list(zip(records.layouts, records.starts, strict=True))
        number_of = Counter(one.number for one in records.layouts)
        pairs = [(one, start) for one, start in pairs if number_of[one.number] == 1]
        blocks = self._free
        for one, start in pairs:
            lengths[one.number], free[one.number] = one.length, blocks.size - self._free.size
            block = self._piece(one.length * start.size).view(_record(one))
            self._kept[id(start)] = start, block
        for window in records.in_order:
            copy(self._data, window.at, window.type, lengths, free, blocks)


def rows_of(numbers: NDArray[Any]) -> Iterator[tuple[int, Ints | slice]]:
    """Yield each number that occurs, ascending, and where it stands."""
    distinct = np.flatnonzero(np.bincount(numbers)).tolist()
    k = len(distinct)
    turns = numbers[:k].tolist()
    if sorted(turns) == distinct and np.array_equal(numbers[k:], numbers[:-k]):
        yield from ((number, slice(turns.index(number), None, k)) for number in distinct)
    else:
        yield from ((number, np.flatnonzero(numbers == number)) for number in distinct)


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
