"""For which rows does a file repeat its entries?

In: a document and the rows of the file that includes it. Out: the rows of its ``for``: columns of
its own, or a list of the columns that it takes from whoever includes it, so that one file serves
vehicles with any number of motors.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from fdi.errors import ModelError
from fdi.model.yaml import Document, Place

KEY: Final = "for"
MAX_ROWS: Final = 32
"""ArduPilot drives no more outputs."""
MAX_WORD: Final = 80
"""Characters; names are no longer either."""
_WORD: Final = re.compile(r"\w+\Z")

Row = Mapping[str, str]
"""The words of a row by column; the first is what tells the rows apart."""


def rows_of(document: Document, given: Sequence[Row] = ()) -> list[Row]:
    """Return the rows that a document repeats its entries for, none where it repeats nothing.

    Parameters
    ----------
    document : Document
    given : sequence of Row
        Those of the file that includes it.

    Raises
    ------
    ModelError
        The columns are none, differ in length or are not given; all such problems together.
    """
    columns = document.tree.get(KEY, {})
    problems: list[str] = []
    if taken(document):
        rows = _from_given(document, columns, given, problems)
    else:
        rows = _own(document, columns, problems)
    if problems:
        raise ModelError.of(problems)
    return rows


def taken(document: Document) -> list[str]:
    """Return the names of the columns that a document takes from the file that includes it."""
    match document.tree.get(KEY):
        case list() as names if all(isinstance(name, str) for name in names):
            return names
    return []


def told(document: Document, place: Place, text: str) -> str:
    """Return a problem with the line and the name of the entry that has it."""
    return f"{document.name}:{document.line(place)}: {'.'.join(map(str, place))}: {text}"


def _from_given(
    document: Document, names: Sequence[str], given: Sequence[Row], problems: list[str]
) -> list[Row]:
    """Return the columns of these names that the including file has."""
    known = given[0] if given else {}
    missing = [name for name in names if name not in known]
    if missing:
        text = f"no file that includes this one gives the column {', '.join(map(repr, missing))}"
        problems.append(told(document, (KEY,), text))
        return []
    return [{name: row[name] for name in names} for row in given]


def _own(document: Document, columns: Any, problems: list[str]) -> list[Row]:
    """Return the rows of columns that are written out."""
    if not isinstance(columns, dict):
        text = "must be columns, such as {i: [1, 2, 3, 4]}, or a list of words"
        problems.append(told(document, (KEY,), text))
        return []
    words: dict[str, list[str]] = {}
    for name, cells in columns.items():
        wrong = _wrong(name, cells)
        if wrong:
            problems.append(told(document, (KEY, name), wrong))
        else:
            words[name] = [str(cell) for cell in cells]
    lengths = {name: len(cells) for name, cells in words.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        problems.append(told(document, (KEY,), f"columns must be equally long: {listed}"))
        return []
    return [dict(zip(words, row, strict=True)) for row in zip(*words.values(), strict=True)]


def _wrong(name: str, cells: Any) -> str:
    """Return what is wrong with a column, nothing where it is right."""
    if not _WORD.match(name):
        return "is not a word"
    if not isinstance(cells, list) or not 0 < len(cells) <= MAX_ROWS:
        return f"must be a list of 1 to {MAX_ROWS} words or numbers"
    if any(isinstance(cell, bool) or not isinstance(cell, str | int) for cell in cells):
        return "may hold words and whole numbers only"
    if max(len(str(cell)) for cell in cells) > MAX_WORD:
        return f"has a word of more than {MAX_WORD} characters"
    return ""
