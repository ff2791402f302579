"""Which entries does a file mean that says something once for every motor?

In: a document with rows (``columns.py``), and entries with ``{column}`` in their names. Out: the
same document with each of these entries once for every row, in its place, the row's words filled
in, and with every ``sum(... for j)`` written out over all rows. Every entry keeps the line of what
it was made from, so that whatever is wrong with it later is told where it can be mended.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from fdi.errors import ModelError
from fdi.model.columns import KEY, Row, rows_of, told
from fdi.model.yaml import MAX_BYTES, Document, Place

COLUMN: Final = re.compile(r"\{(\w+)\}")
_OVER: Final = re.compile(r" for (\w+)(?: but ([^()]+))?\)")
"""The end of a call over all rows: ``... for j)``, ``... for j but {i} and {o})``."""
_CALL: Final = re.compile(r"\b(sum|mean|min|max)\Z")


def repeated(document: Document, given: Sequence[Row] = ()) -> Document:
    """Return the document with its repeated entries written out.

    Parameters
    ----------
    document : Document
    given : sequence of Row
        Those of the file that includes it, for one that takes its columns from there.

    Raises
    ------
    ModelError
        The rows are not as in `rows_of`, a column is not there, or two entries get one name; all
        such problems are reported together.
    """
    rows = rows_of(document, given)
    writer = _Writer(document, rows)
    tree = {
        key: writer.written(value, (key,), (key,))
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
    rows: Sequence[Row]
    lines: dict[Place, int] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    characters: int = 0

    def problem(self, place: Place, text: str) -> None:
        self.problems.append(told(self.document, place, text))

    def written(self, value: Any, old: Place, new: Place, row: Row | None = None) -> Any:
        """Return a value with what is to be repeated in it; within a repetition ``row`` is set."""
        if old in self.document.lines:
            self.lines[new] = self.document.lines[old]
        match value:
            case dict():
                result: dict[str, Any] = {}
                for key, item in value.items():
                    here = (*old, key)
                    for name, own in self.names(key, here, row):
                        if name in result:
                            self.problem(here, f"{name!r} is there twice")
                        result[name] = self.written(item, here, (*new, name), own)
                return result
            case list():
                return [
                    self.written(item, (*old, i), (*new, i), row) for i, item in enumerate(value)
                ]
            case str():
                return self.filled(self.over_rows(value, old, row), old, row)
        return value

    def names(self, key: str, place: Place, row: Row | None) -> Iterator[tuple[str, Row | None]]:
        """Yield the names that a key stands for, each with the row that its entry is filled by."""
        if row is not None or not COLUMN.search(key):
            yield (key if row is None else self.filled(key, place, row)), row
            return
        unknown = [name for name in COLUMN.findall(key) if not self.is_column(name)]
        if unknown:
            self.problem(place, f"{unknown[0]!r} is no column of {KEY!r}")
            return
        for own in self.rows:
            yield self.filled(key, place, own), own

    def is_column(self, name: str) -> bool:
        return bool(self.rows) and name in self.rows[0]

    def filled(self, text: str, place: Place, row: Row | None) -> str:
        """Return a text with the words of a row."""
        for name in COLUMN.findall(text):
            if row is None and self.is_column(name):
                self.problem(place, f"{{{name}}} stands for nothing: the entry's name lacks it")
                return text
            if row is not None and name not in row:
                self.problem(place, f"{name!r} is no column of {KEY!r}")
                return text
        if row is None:
            return text
        full = COLUMN.sub(lambda found: row[found[1]], text)
        self.count(len(full), place)
        return full

    def count(self, characters: int, place: Place) -> None:
        """Take note of what repetition makes, and refuse what is too much."""
        self.characters += characters
        if self.characters > MAX_BYTES:
            where = f"{self.document.name}:{self.document.line(place)}"
            raise ModelError(f"repetition makes more than {MAX_BYTES} characters", where=where)

    def over_rows(self, text: str, place: Place, row: Row | None) -> str:
        """Return a text with each ``sum(... for j)`` written out; an inner one ends first.

        Within it ``{j}`` is the first word of every row, and the columns are the entry's own.
        """
        start = 0
        while end := _OVER.search(text, start):
            start = end.end()
            opening = _opening(text, end.start())
            call = _CALL.search(text[:opening])
            if call is None:  # words in a bracket
                continue
            words = self.words(end[1], end[2] or "", place, row)
            if not words:  # a mistake that is told; nothing is left to be wrong
                return ""
            body = text[opening + 1 : end.start()]
            terms = [body.replace(f"{{{end[1]}}}", word) for word in words]
            self.count(sum(map(len, terms)), place)
            text = text[: call.start()] + _joined(call[1], terms) + text[end.end() :]
            start = call.start()
        return text

    def words(self, bound: str, without: str, place: Place, row: Row | None) -> list[str]:
        """Return the first words of all rows but some, none where that is a mistake."""
        if self.is_column(bound):
            self.problem(place, f"'for {bound}': {bound!r} is a column, take another word")
            return []
        known = [next(iter(each.values())) for each in self.rows]
        listed = self.filled(without, place, row).replace(" and ", ",").split(",")
        left_out = {word.strip() for word in listed} - {""}
        strangers = sorted(left_out - set(known))
        words = [word for word in known if word not in left_out]
        if strangers and known:
            self.problem(place, f"'for {bound} but': {KEY!r} has no row {strangers[0]!r}")
            return []
        if not words:
            self.problem(place, f"'for {bound}': {KEY!r} has no row{' left' if known else ''}")
        return words


def _opening(text: str, end: int) -> int:
    """Return where the bracket opens that is open at ``end``, 0 where none is."""
    depth = 1
    for place in range(end - 1, -1, -1):
        depth += (text[place] == ")") - (text[place] == "(")
        if not depth:
            return place
    return 0


def _joined(call: str, terms: Sequence[str]) -> str:
    """Return a call over all terms, in what expressions have."""
    if call in ("min", "max"):
        return f"{call}({', '.join(terms)})" if len(terms) > 1 else f"({terms[0]})"
    total = f"({' + '.join(terms)})"
    return f"({total}/{len(terms)})" if call == "mean" else total
