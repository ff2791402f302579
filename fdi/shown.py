"""How does a notebook show a value of ours, and a pandas user take rows of them?

In: a frozen dataclass, or a caption with cells. Out: HTML text; everything foreign is escaped and
rid of what no reader sees (escape codes, marks that turn the text), and what is too long for a page
is cut, with a line that says how much is missing. It stands below all rooms, because the values of
every room are shown the same way.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    import pandas

MOST_ROWS = 40
MOST_LETTERS = 200
T = TypeVar("T")

_UNSEEN = re.compile(
    # C0 and C1 but for the line feed, marks that turn the reading direction, lone surrogates
    r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\ud800-\udfff]"
)


def clean(text: object) -> str:
    r"""Return a text without control characters, on one line.

    Examples
    --------
    >>> clean("Crash\x1b[31m\nnow")
    'Crash[31m now'
    """
    return _UNSEEN.sub("", str(text)).replace("\n", " ")


class Shown:
    """A dataclass that a notebook shows as a table of its fields."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        assert is_dataclass(self)
        shown = [one.name for one in fields(self) if one.repr and not one.name.startswith("_")]
        cells = [(name, brief(getattr(self, name))) for name in shown]
        said = repr(self)
        caption = said[1:-1] if said.startswith("<") else type(self).__name__
        return html_table(caption, ("field", "value"), cells)


class Rows(tuple[T, ...]):
    """Values of one kind, in order; a tuple that is a table as well."""

    __slots__ = ()

    def to_pandas(self) -> pandas.DataFrame:
        """Return a frame, a row per value, a column per field.

        Fields of a value inside stand as ``evidence.text``; of several values inside, a cell holds
        a tuple of dicts. Times are s, other units are those that the value's own documentation
        states. Without rows there are no columns.
        """
        import pandas as pd

        rows = [{name: _plain(cell) for name, cell in _cells(one).items()} for one in self]
        return pd.DataFrame(rows, columns=_columns(rows))

    def _repr_html_(self) -> str:
        rows = [_cells(value) for value in self]
        head = _columns(rows)
        cells = [[brief(row.get(name)) for name in head] for row in rows]
        kind = type(self[0]).__name__ if self else "nothing"
        return html_table(f"{len(self)} × {kind}" if self else kind, head, cells)


def brief(value: object) -> str:
    """Return a value as a cell: arrays and long collections by what they are, not what they hold.

    Examples
    --------
    >>> brief(np.zeros((3, 4))), brief({"a": 1}), brief(("x", "y")), brief(0.123456789)
    ('(3, 4) float64', '1 entry', 'x, y', '0.123457')
    """
    if value is None:
        return "–"
    if isinstance(value, np.ndarray):
        return f"{value.shape} {value.dtype}"
    if isinstance(value, Mapping):
        return f"{len(value)} {'entry' if len(value) == 1 else 'entries'}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        if all(isinstance(one, str) for one in value):
            return ", ".join(value)
        if len(value) > 4 or any(is_dataclass(one) for one in value):
            return f"{len(value)} × {type(value[0]).__name__}"
        return ", ".join(brief(one) for one in value)
    return str(value)


def html_table(caption: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table as HTML.

    Parameters
    ----------
    caption : str
    head : sequence of str
        Headings of the columns.
    rows : sequence of sequences
        Cells, shown as text.

    References
    ----------
    HTML Living Standard, section 4.9 (tabular data).

    Examples
    --------
    >>> html_table("pair", ["e"], [["a < b"]])
    '<table><caption>pair</caption><tr><th>e</th></tr><tr><td>a &lt; b</td></tr></table>'
    """
    lines = ["".join(f"<th>{escape(text)}</th>" for text in head)]
    for row in rows[:MOST_ROWS]:
        lines.append("".join(f"<td>{escape(shortened(clean(cell)))}</td>" for cell in row))
    if len(rows) > MOST_ROWS:
        lines.append(f'<td colspan="{len(head)}">and {len(rows) - MOST_ROWS} more</td>')
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><caption>{escape(clean(caption))}</caption>{body}</table>"


def shortened(text: str) -> str:
    """Return a text, cut where it is too long for a cell.

    Examples
    --------
    >>> shortened("x" * 999)[-3:]
    'xx…'
    """
    return text if len(text) <= MOST_LETTERS else text[: MOST_LETTERS - 1] + "…"


def _plain(cell: Any) -> Any:
    """Return what needs none of our classes to be read: values of ours become dicts."""
    if is_dataclass(cell) and not isinstance(cell, type):
        return {one.name: _plain(getattr(cell, one.name)) for one in fields(cell)}
    return tuple(map(_plain, cell)) if isinstance(cell, tuple) else cell


def _columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of all rows; a value inside that some lack has the others' columns."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    inside = {name.rpartition(".")[0] for name in names}
    return [name for name in names if name not in inside]


def _cells(value: Any, prefix: str = "") -> dict[str, Any]:
    """Return the fields of a value by name, those of a value inside it with both names."""
    found: dict[str, Any] = {}
    for one in fields(value):
        inner, name = getattr(value, one.name), prefix + one.name
        if is_dataclass(inner) and not isinstance(inner, type):
            found |= _cells(inner, f"{name}.")
        else:
            found[name] = inner
    return found
