"""Writes values of this room as HTML tables, which a notebook shows in place of their ``repr``.

In: a caption, column heads and cells. Out: HTML text; everything foreign is escaped, and what is
too long for a page is cut, with a line that says how much is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

MOST_ROWS = 40
MOST_LETTERS = 200


def html_table(caption: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table as HTML.

    Parameters
    ----------
    caption : str
    head : sequence of str
        Heads of the columns.
    rows : sequence of sequences
        Cells, shown as text.

    Returns
    -------
    str

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
        lines.append("".join(f"<td>{escape(shortened(str(cell)))}</td>" for cell in row))
    if len(rows) > MOST_ROWS:
        lines.append(f'<td colspan="{len(head)}">and {len(rows) - MOST_ROWS} more</td>')
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><caption>{escape(caption)}</caption>{body}</table>"


def shortened(text: str) -> str:
    """Return a text, cut where it is too long for a cell.

    Parameters
    ----------
    text : str

    Returns
    -------
    str

    References
    ----------
    As :func:`html_table`.

    Examples
    --------
    >>> shortened("x" * 999)[-3:]
    'xx…'
    """
    return text if len(text) <= MOST_LETTERS else text[: MOST_LETTERS - 1] + "…"
