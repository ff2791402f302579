"""Which lines of a DataFlash text log are records, and what do they hold, as columns?

In: the bytes and the layouts by name. Out: a `Table` per layout, and the lines that are no record.
A record has as many values as its layout has fields, each of its kind and within its range;
commas too many belong to the last text. Numbers are decoded while the lines are looked at, since
only that tells whether they are any; texts when they are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.dataflash.layouts import Field, Layout
from fdi.telemetry.formats.dataflash.tables import Table, rows_of
from fdi.telemetry.formats.dataflash.text_lines import (
    BLANKS,
    INTEGER,
    NONE,
    UNSIGNED,
    Bytes,
    Lines,
    Numbers,
    Places,
    find_lines,
    find_numbers,
    number,
    windows,
)

MODE: Final = "M"  # a name in most text logs, a number in some
_NAME_SIZE: Final = 4
_SHIFTS: Final = np.arange(_NAME_SIZE, dtype=np.uint32) * 8

Layouts = Mapping[str, Sequence[Layout]]  # by name; each holds from its ``since`` on


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The records of a text log, and the lines that are none.

    Attributes
    ----------
    tables : list of Table
    bad : dict
        How many lines with the name of a layout are no record of it.
    strange : (k, 2) int
        First byte and end of the lines that are no record, blank ones apart, ascending.
    """

    tables: list[Table]
    bad: dict[str, int]
    strange: NDArray[np.int64]


class Words:
    """Holds the columns of a text log: numbers, and where the words of texts stand."""

    def __init__(self, data: Bytes) -> None:
        self._data = data
        # by the identity of the array of starts, which is kept too
        self._kept: dict[int, tuple[NDArray[Any], dict[str, NDArray[Any]]]] = {}

    def keep(self, start: NDArray[Any], columns: dict[str, NDArray[Any]]) -> None:
        """Take the columns of the records that begin there; of texts (n, 2): begin and end."""
        self._kept[id(start)] = start, columns

    def load(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the values of a field, (n,); texts as `str`."""
        if field.is_text:
            distinct, which = self.codes(table, field)
            texts: NDArray[Any] = distinct[which]
            return texts
        return self.pick(table, field)

    def pick(self, table: Table, field: Field) -> NDArray[Any]:
        """Return the same for numbers."""
        return self._kept[id(table.start)][1][field.name]

    def codes(self, table: Table, field: Field) -> tuple[NDArray[Any], NDArray[np.int64]]:
        """Return the distinct values of a text field, (k,), and which of them each is, (n,)."""
        number_of: dict[bytes, int] = {}
        which = np.empty(table.start.size, np.int64)
        places = self._kept[id(table.start)][1][field.name]
        for row, (begin, end) in enumerate(places.tolist()):
            raw = self._data[begin:end].tobytes()
            which[row] = number_of.setdefault(raw, len(number_of))
        distinct = np.empty(len(number_of), object)
        distinct[:] = [_text(raw) for raw in number_of]
        return distinct, which

    def split(self, table: Table, field: Field) -> Iterator[Table]:
        """Yield a table for every instance, by the field that numbers them."""
        for instance, rows in rows_of(self.pick(table, field)):
            yield self.part(table, rows, instance or None)

    def part(
        self, table: Table, rows: NDArray[np.int64] | slice, instance: int | None = None
    ) -> Table:
        """Return a table of some of the records, ascending."""
        part = replace(table, start=table.start[rows], instance=instance)
        columns = self._kept[id(table.start)][1]
        self.keep(part.start, {name: values[rows] for name, values in columns.items()})
        return part


def _text(raw: bytes) -> str:
    cut = raw.split(b"\0")[0].strip(BLANKS)
    try:
        return cut.decode("utf-8")
    except UnicodeDecodeError:
        return cut.decode("latin-1")


def find_records(data: Bytes, layouts: Layouts) -> Found:
    """Return the records of a text log."""
    names = sorted(layouts, key=_key)
    collections = [[_Collection(one) for one in layouts[name]] for name in names]
    keys = np.array([_key(name) for name in names], np.uint32)
    strange = [np.empty((0, 2), np.int64)]
    for low, high in windows(data):
        lines = find_lines(data[low:high])
        numbers = find_numbers(lines)
        is_record = lines.start == lines.stop  # blank ones are none, but nothing is lost
        for which, rows in _by_name(lines, keys):
            versions = collections[which]
            newest = np.array([one.layout.since for one in versions])
            version = np.searchsorted(newest, lines.start[rows] + low, side="right") - 1
            for i in np.unique(version).tolist():
                mine = rows[version == i]
                is_record[mine] = versions[i].take(lines, numbers, mine, low)
        rows = np.flatnonzero(~is_record)
        strange.append(np.stack((lines.start[rows], lines.stop[rows]), axis=1) + low)
    source = Words(data)
    tables: list[Table] = []
    bad: dict[str, int] = {}
    for versions in collections:
        for one in versions:
            table = one.table(source)
            if table is not None:
                tables.append(table)
            if one.bad:
                bad[one.layout.name] = bad.get(one.layout.name, 0) + one.bad
    tables.sort(key=lambda table: int(table.start[0]))
    return Found(tables, bad, np.concatenate(strange))


def _key(name: str) -> int:
    return int.from_bytes(name.encode(), "little")


def _by_name(lines: Lines, keys: NDArray[np.uint32]) -> Iterator[tuple[int, Places]]:
    """Yield which of the names, ascending, some lines have, and these lines."""
    begin, end = lines.begin[lines.first], lines.end[lines.first]
    size = end - begin
    key = np.zeros(size.size, np.uint32)
    for p in range(_NAME_SIZE):
        inside = np.flatnonzero(size > p)
        key[inside] |= lines.part[begin[inside] + p].astype(np.uint32) << _SHIFTS[p]
    which = np.minimum(np.searchsorted(keys, key), keys.size - 1)
    which[(keys[which] != key) | (size > _NAME_SIZE)] = keys.size
    order = np.argsort(which.astype(np.uint16), kind="stable")
    ends = np.cumsum(np.bincount(which, minlength=keys.size + 1))
    for i in np.flatnonzero(np.diff(ends[:-1], prepend=0)).tolist():
        yield i, order[ends[i - 1] if i else 0 : ends[i]]


@dataclass(slots=True, eq=False)
class _Collection:
    """Gathers the records of a layout, window by window."""

    layout: Layout
    bad: int = 0
    starts: list[NDArray[np.int64]] = field(default_factory=list)
    parts: list[list[NDArray[Any]]] = field(default_factory=list)

    def take(self, lines: Lines, numbers: Numbers, rows: Places, low: int) -> NDArray[np.bool_]:
        """Take the records among some lines, (n,); return which of them are any."""
        fields = self.layout.fields
        texts = [i for i, one in enumerate(fields) if one.is_text]
        last_text = texts[-1] if texts else len(fields)
        count = lines.last[rows] - lines.first[rows]
        is_record = count >= len(fields) if texts else count == len(fields)
        fitting = rows[is_record]
        is_good = np.ones(fitting.size, np.bool_)
        columns = []
        small = np.uint32 if low + lines.part.size < 1 << 32 else np.int64
        for i, one in enumerate(fields):
            word = lines.first[fitting] + 1 + i
            behind = lines.last[fitting] - (len(fields) - 1 - i)
            if one.is_text or one.character == MODE:
                end = lines.end[behind if i == last_text else word]
                # an empty text may be followed by one that is not
                places = np.stack((lines.begin[word], end), axis=1) + low
                columns.append(places.astype(small))
                continue
            values, is_value = _values(lines, numbers, behind if i > last_text else word, one)
            is_good &= is_value
            columns.append(values)
        is_record[is_record] = is_good
        self.bad += int((~is_record).sum())
        self.starts.append(lines.start[rows[is_record]] + low)
        self.parts.append([values[is_good] for values in columns])
        return is_record

    def table(self, source: Words) -> Table | None:
        """Return the table of all that was taken, None where that is nothing."""
        start = np.concatenate([*self.starts, np.empty(0, np.int64)])
        if not start.size:
            return None
        fields, columns = [], {}
        for i, one in enumerate(self.layout.fields):
            whole = np.concatenate([part[i] for part in self.parts])
            for part in self.parts:
                part[i] = whole[:0]  # else all would be there twice
            columns[one.name] = whole
            fields.append(one)
        source.keep(start, columns)
        table = Table(replace(self.layout, fields=tuple(fields)), start, source)
        for i, one in enumerate(fields):
            if one.character == MODE:
                fields[i], columns[one.name] = _modes(table, one, source, columns[one.name])
        return replace(table, layout=replace(table.layout, fields=tuple(fields)))


def _values(
    lines: Lines, numbers: Numbers, words: Places, one: Field
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Return the values of a field, (n,), and which of the words are any."""
    for i in np.flatnonzero(numbers.kind[words] == NONE).tolist():
        word = words[i]
        kind, numbers.integer[word], numbers.value[word] = number(lines.word(word))
        numbers.kind[word] = kind
    kinds = numbers.kind[words]
    dtype = np.dtype(one.dtype)
    if dtype.kind == "f":
        return numbers.value[words], kinds != NONE
    integer = numbers.integer[words]
    if dtype == np.uint64:
        is_value = ((kinds == INTEGER) & (integer >= 0)) | (kinds == UNSIGNED)
    else:
        limits = np.iinfo(dtype)
        is_value = (kinds == INTEGER) & (integer >= limits.min) & (integer <= limits.max)
    return integer.astype(dtype), is_value


def _modes(
    table: Table, one: Field, source: Words, places: NDArray[Any]
) -> tuple[Field, NDArray[Any]]:
    """Return a field of modes as numbers, where all are, else as texts."""
    distinct, which = source.codes(table, one)
    if all(text.isascii() and text.isdecimal() and len(text) < 4 for text in distinct):
        return one, np.array([int(text) for text in distinct], np.int16)[which]
    return one._replace(character="N", dtype="S16"), places
