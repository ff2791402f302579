"""Which entries does a file mean that says something once for every motor?

In: a document whose ``for`` holds columns of equal length, and entries with ``{column}`` in their
names. Out: the same document with each of these entries once for every row, in its place, the row's
words filled in. Every entry keeps the line of what it was made from, so that whatever is wrong with
it later is told where it can be mended.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from fdi.errors import ModelError
from fdi.model.yaml import MAX_BYTES, Document, Place

KEY: Final = "for"
MAX_ROWS: Final = 32
"""ArduPilot drives no more outputs."""
MAX_WORD: Final = 80
"""Characters; names are no longer either."""
COLUMN: Final = re.compile(r"\{(\w+)\}")

Row = Mapping[str, str]


def repeated(document: Document) -> Document:
    """Return the document with its repeated entries written out.

    Raises
    ------
    ModelError
        The columns are none, differ in length or are not there, or two entries get one name; all
        such problems are reported together.
    """
    writer = _Writer(document)
    rows = writer.rows(document.tree.get(KEY, {}))
    tree = {
        key: writer.written(value, (key,), (key,), rows)
        for key, value in document.tree.items()
        if key != KEY
    }
    if writer.problems:
        raise ModelError.of(writer.problems)
    return Document(document.name, tree, writer.lines, document.sha256)


@dataclass(slots=True)
class _Writer:
    """Walks the tree once; keeps lines and problems."""

    document: Document
    lines: dict[Place, int] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    characters: int = 0

    def problem(self, place: Place, text: str) -> None:
        name = ".".join(map(str, place))
        self.problems.append(f"{self.document.name}:{self.document.line(place)}: {name}: {text}")

    def rows(self, columns: Any) -> list[Row]:
        """Return the rows of the columns."""
        if not isinstance(columns, dict):
            self.problem((KEY,), "must be columns, such as {i: [1, 2, 3, 4]}")
            return []
        words: dict[str, list[str]] = {}
        for name, cells in columns.items():
            place = (KEY, name)
            if not COLUMN.fullmatch(f"{{{name}}}"):
                self.problem(place, "is not a word")
            elif not isinstance(cells, list) or not 0 < len(cells) <= MAX_ROWS:
                self.problem(place, f"must be a list of 1 to {MAX_ROWS} words or numbers")
            elif any(isinstance(cell, bool) or not isinstance(cell, str | int) for cell in cells):
                self.problem(place, "may hold words and whole numbers only")
            elif max(len(str(cell)) for cell in cells) > MAX_WORD:
                self.problem(place, f"has a word of more than {MAX_WORD} characters")
            else:
                words[name] = [str(cell) for cell in cells]
        lengths = {name: len(cells) for name, cells in words.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            self.problem((KEY,), f"columns must be equally long: {told}")
            return []
        return [dict(zip(words, row, strict=True)) for row in zip(*words.values(), strict=True)]

    def written(
        self, value: Any, old: Place, new: Place, rows: list[Row], row: Row | None = None
    ) -> Any:
        """Return a value with what is to be repeated in it; within a repetition ``row`` is set."""
        if old in self.document.lines:
            self.lines[new] = self.document.lines[old]
        match value:
            case dict():
                result: dict[str, Any] = {}
                for key, item in value.items():
                    here = (*old, key)
                    for name, own in self.names(key, here, rows, row):
                        if name in result:
                            self.problem(here, f"{name!r} is there twice")
                        result[name] = self.written(item, here, (*new, name), rows, own)
                return result
            case list():
                return [
                    self.written(item, (*old, i), (*new, i), rows, row)
                    for i, item in enumerate(value)
                ]
            case str():
                return self.filled(value, old, rows, row)
        return value

    def names(
        self, key: str, place: Place, rows: list[Row], row: Row | None
    ) -> Iterator[tuple[str, Row | None]]:
        """Yield the names that a key stands for, each with the row that its entry is filled by."""
        if row is not None or not COLUMN.search(key):
            yield (key if row is None else self.filled(key, place, rows, row)), row
            return
        unknown = [name for name in COLUMN.findall(key) if not rows or name not in rows[0]]
        if unknown:
            self.problem(place, f"{unknown[0]!r} is no column of {KEY!r}")
            return
        for own in rows:
            yield self.filled(key, place, rows, own), own

    def filled(self, text: str, place: Place, rows: list[Row], row: Row | None) -> str:
        """Return a text with the words of a row."""
        for name in COLUMN.findall(text):
            if row is None and rows and name in rows[0]:
                self.problem(place, f"{{{name}}} stands for nothing: the entry's name lacks it")
                return text
            if row is not None and name not in row:
                self.problem(place, f"{name!r} is no column of {KEY!r}")
                return text
        if row is None:
            return text
        full = COLUMN.sub(lambda found: row[found[1]], text)
        self.characters += len(full)
        if self.characters > MAX_BYTES:
            where = f"{self.document.name}:{self.document.line(place)}"
            raise ModelError(f"repetition makes more than {MAX_BYTES} characters", where=where)
        return full
