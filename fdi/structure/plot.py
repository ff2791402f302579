"""Draws structures: the decomposed incidence matrix, signatures of tests, isolability.

In: a model, and sets where they are drawn. Out: a ``matplotlib.figure.Figure`` that belongs to no
window: ``figure.savefig("name.svg")``. matplotlib is imported inside the functions.

Cells keep a size at which labels can be read, up to :data:`MOST_LABELS` rows or columns; larger
pictures have no labels and say so.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fdi.structure.decomposition import Decomposition, Part, decompose
from fdi.structure.equivalence import classes
from fdi.structure.incidence import Model
from fdi.structure.isolability import detectable, isolability, not_isolable_groups
from fdi.structure.matching import match

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_LABELS = 300
CELL = 0.2  # inches, where labels are drawn
LETTER = 0.078  # inches, width of a letter of a label, generously
TITLE_LETTER = 0.1  # inches
EDGE, HEAD, FOOT = 0.12, 0.45, 0.5  # inches
MOST_LETTERS = 32
MOST_ROWS_BELOW_NAMES = 50  # below more rows the columns are named once more
INK, FAINT, PALE = "#1f2933", "#9aa5b1", "#eef1f5"
PLAIN, STATE, DERIVATIVE, FAULT = "#52606d", "#2b6cb0", "#dd6b20", "#c53030"
PARTS = {"under": "#dd6b20", "just": "#2f855a", "over": "#2b6cb0"}

Matrix = NDArray[np.int64]


def plot_decomposition(model: Model) -> Figure:
    """Return the incidence matrix in the order of its decomposition.

    Parameters
    ----------
    model : Model

    Returns
    -------
    matplotlib.figure.Figure
        From the upper left to the lower right the under-, just- and overdetermined part; inside
        the second one the Hall blocks, inside the third one the PSO classes with their own
        unknowns, and in its last columns the unknowns that several classes share. Everything lies
        on or above the blocks. Names of faults stand at the right of the equations they enter.

    References
    ----------
    Dulmage and Mendelsohn, Canadian J. Math. 10, 1958; the classes inside the overdetermined part
    as in Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008, figure 3.

    Examples
    --------
    >>> figure = plot_decomposition(Model.from_matrix([[1, 1], [0, 1], [0, 1]]))
    >>> [text.get_text() for text in figure.axes[0].get_yticklabels()]
    ['e0', 'e1', 'e2']
    """
    parts = decompose(model)
    blocks = _blocks(model, parts)
    rows = [e for _, block in blocks for e in block.equations]
    columns = [u for _, block in blocks for u in block.unknowns]
    kind = {(e, u): kind for e, u, kind in model.derivative}
    place = {u: k for k, u in enumerate(columns)}
    entries = np.zeros((len(rows), len(columns)), dtype=np.int64)
    for i, e in enumerate(rows):
        for u in model.rows[e]:
            entries[i, place[u]] = {"x": 1, "i": 2, "d": 3}[kind.get((e, u), "x")]
    looks = [("contains", PLAIN), ("state", STATE), ("derivative", DERIVATIVE)]
    sizes = ", ".join(
        f"{name} {len(part.equations)} × {len(part.unknowns)}"
        for name, part in (("under", parts.under), ("just", parts.just), ("over", parts.over))
        if part.equations or part.unknowns
    )
    figure, axes = _matrix(
        entries,
        [model.equations[e] for e in rows],
        [model.unknowns[u] for u in columns],
        looks if model.derivative else looks[:1],
        title=_titled(model, f"{sizes}; redundancy {parts.redundancy}"),
        beside=[", ".join(f.name for f in model.faults if e in f.equations) for e in rows],
    )
    _outline(axes, blocks)
    return figure


def plot_signatures(model: Model, sets: Iterable[int]) -> Figure:
    """Return which test is sensitive to which fault, as a picture.

    Parameters
    ----------
    model : Model
    sets : iterable of int
        Tests as bit sets of equations.

    Returns
    -------
    matplotlib.figure.Figure
        A row for each test, in the order given, a column for each fault.

    References
    ----------
    Gertler, "Fault Detection and Diagnosis in Engineering Systems", 1998, chapter 6.

    Examples
    --------
    >>> from fdi.structure import mso_sets
    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> figure = plot_signatures(model, mso_sets(model))
    >>> [text.get_text() for text in figure.axes[0].get_xticklabels()]
    ['f', 'g']
    """
    masks = [sum(1 << e for e in fault.equations) for fault in model.faults]
    chosen = list(sets)
    entries = np.array([[int(bool(test & mask)) for mask in masks] for test in chosen], np.int64)
    entries = entries.reshape(len(chosen), len(masks))
    labels = [f"t{i}" for i in range(1, len(chosen) + 1)]
    looks = [("sensitive", STATE)]
    title = _titled(model, f"{len(chosen)} tests, {len(masks)} faults")
    return _matrix(entries, labels, [f.name for f in model.faults], looks, title=title)[0]


def plot_isolability(model: Model, causality: str = "mixed") -> Figure:
    """Return which fault cannot be told from which other, as a picture.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}

    Returns
    -------
    matplotlib.figure.Figure
        A cell is filled where the fault of its row cannot be told from that of its column, pale
        where the fault of its row cannot be detected at all. Faults that hang together this way
        stand side by side, undetectable ones last.

    Raises
    ------
    UsageError
        When the causality is none of the three.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definition 3.

    Examples
    --------
    >>> model = Model.from_matrix([[1, 0], [1, 0], [0, 1]], faults={"lost": 2, "f": 0, "g": 1})
    >>> figure = plot_isolability(model)
    >>> [text.get_text() for text in figure.axes[0].get_yticklabels()]
    ['f', 'g', 'lost']
    """
    told, seen = isolability(model, causality), detectable(model, causality)
    groups = not_isolable_groups(told, seen)
    grouped = {fault for group in groups for fault in group}
    alone = [int(f) for f in np.flatnonzero(seen) if f not in grouped]
    order = [*(f for g in groups for f in g), *alone, *map(int, np.flatnonzero(~seen))]
    entries = np.where(seen[:, None], 1, 2) * ~told
    names = [model.faults[f].name for f in order]
    looks = [("cannot be told apart", STATE), ("cannot be detected", FAINT)]
    counts = f"{int(seen.sum())} of {len(seen)} faults detectable"
    figure, _ = _matrix(
        entries[np.ix_(order, order)].astype(np.int64),
        names,
        names,
        looks if not seen.all() else looks[:1],
        title=_titled(model, f"row from column, {causality} causality; {counts}"),
    )
    return figure


def _blocks(model: Model, parts: Decomposition) -> list[tuple[str, Part]]:
    """Return the blocks from the upper left to the lower right, rows and columns as they stand."""
    found = classes(model)
    blocks = [("under", parts.under)] if parts.under.equations or parts.under.unknowns else []
    blocks += [("just", block) for block in _triangular(model, parts.hall)]
    blocks += [("over", part) for part in sorted(found.sets, key=lambda p: -len(p.equations))]
    blocks = [(name, _along_diagonal(model, block)) for name, block in blocks]
    order = [e for _, block in blocks for e in block.equations]
    return [*blocks, ("free", Part((), _in_order_of_use(model, order, found.free)))]


def _in_order_of_use(
    model: Model, equations: Sequence[int], unknowns: tuple[int, ...]
) -> tuple[int, ...]:
    """Return unknowns in the order of the last equations that could be matched to them."""
    place = {u: k for k, u in enumerate(unknowns)}
    backwards = [[place[u] for u in model.rows[e] if u in place] for e in reversed(equations)]
    equation_of, _ = match(backwards, len(unknowns))
    return tuple(u for _, u in sorted(zip(equation_of, unknowns, strict=True), reverse=True))


def _triangular(model: Model, blocks: Sequence[Part]) -> list[Part]:
    """Return Hall blocks so that each contains only its own unknowns and those of later ones."""
    block_of = {u: k for k, block in enumerate(blocks) for u in block.unknowns}
    needs = [
        {block_of[u] for e in block.equations for u in model.rows[e] if u in block_of} - {k}
        for k, block in enumerate(blocks)
    ]
    order: list[int] = []
    left = set(range(len(blocks)))
    while left:
        ready = [k for k in sorted(left) if needs[k].isdisjoint(left)]
        order += ready
        left.difference_update(ready)
    return [blocks[k] for k in reversed(order)]


def _along_diagonal(model: Model, block: Part) -> Part:
    """Return a block with its equations in the order of the unknowns that they are matched to."""
    place = {u: k for k, u in enumerate(block.unknowns)}
    rows = [[place[u] for u in model.rows[e] if u in place] for e in block.equations]
    equation_of, unknown_of = match(rows, len(block.unknowns))
    first = [k for k in equation_of if k >= 0]
    rest = [k for k, unknown in enumerate(unknown_of) if unknown < 0]
    last = [u for u, k in enumerate(equation_of) if k < 0]
    columns = [u for u, k in enumerate(equation_of) if k >= 0] + last
    return Part(
        tuple(block.equations[k] for k in first + rest), tuple(block.unknowns[u] for u in columns)
    )


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where a matrix stands in its picture, inches; ``named``: whether labels have room."""

    shape: tuple[int, int]
    cell: float
    left: float
    top: float
    right: float
    bottom: float
    width: float
    named: bool
    below: bool

    @property
    def height(self) -> float:
        return self.top + self.shape[0] * self.cell + self.bottom


def _layout(
    rows: Sequence[str], columns: Sequence[str], beside: Sequence[str], title: str
) -> _Layout:
    # Placed by hand: a layout engine measures every label, seconds where there are hundreds.
    shape = max(1, len(rows)), max(1, len(columns))
    named = max(shape) <= MOST_LABELS
    cell = CELL if named else CELL * MOST_LABELS / max(shape)
    left, top = (EDGE + _longest(labels) * named for labels in (rows, columns))
    below = named and shape[0] > MOST_ROWS_BELOW_NAMES
    right, top, bottom = EDGE + _longest(beside), top + HEAD, FOOT + _longest(columns) * below
    width = max(left + shape[1] * cell + right, 2 * EDGE + TITLE_LETTER * len(title))
    return _Layout(shape, cell, left, top, right, bottom, width, named, below)


def _matrix(
    entries: Matrix,
    rows: Sequence[str],
    columns: Sequence[str],
    looks: Sequence[tuple[str, str]],
    *,
    title: str,
    beside: Sequence[str] = (),
) -> tuple[Figure, Any]:
    """Return a picture of a matrix, entry k in the colour of the k-th look, and its axes.

    ``beside`` holds a text for each row, at its right.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    if max(len(rows), len(columns)) > MOST_LABELS:
        title += "; too large for labels"
    layout = _layout(rows, columns, beside, title)
    width, height, cell = layout.width, layout.height, layout.cell
    figure = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    n_rows, n_columns = layout.shape
    place = (layout.left / width, layout.bottom / height)
    axes = figure.add_axes((*place, n_columns * cell / width, n_rows * cell / height))
    shown = entries if entries.size else np.zeros((1, 1), dtype=np.int64)
    colours = ListedColormap([PALE, *(colour for _, colour in looks)])
    axes.imshow(
        shown, cmap=colours, vmin=0, vmax=len(looks), interpolation="nearest", aspect="auto"
    )
    _label_axes(axes, rows, columns, layout)
    for row, name in enumerate(beside):
        x, said = n_columns - 0.3, _label(name)
        axes.text(x, row, said, va="center", fontsize=8, color=FAULT, parse_math=False)
    _explain(figure, looks, title, layout)
    return figure, axes


def _label_axes(axes: Any, rows: Sequence[str], columns: Sequence[str], layout: _Layout) -> None:
    """Write the names at the edges of a matrix, and draw lines between its cells."""
    named = layout.named
    axes.set_xticks(range(len(columns)) if named else [], map(_label, columns) if named else [])
    axes.set_yticks(range(len(rows)) if named else [], map(_label, rows) if named else [])
    axes.tick_params(length=0, labelsize=8, labelcolor=INK)
    axes.tick_params(labeltop=True, labelbottom=layout.below)
    for text in axes.get_xticklabels():
        text.set_rotation(90)
    for text in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        text.set_parse_math(False)
    if named:
        n_rows, n_columns = layout.shape
        axes.set_xticks(np.arange(-0.5, n_columns), minor=True)
        axes.set_yticks(np.arange(-0.5, n_rows), minor=True)
        axes.grid(which="minor", color="white", linewidth=1.2)
        axes.tick_params(which="minor", length=0)
    for spine in axes.spines.values():
        spine.set_color(FAINT)


def _explain(figure: Figure, looks: Sequence[tuple[str, str]], title: str, layout: _Layout) -> None:
    """Write the title and what each colour means."""
    from matplotlib.patches import Patch

    left, edge = EDGE / layout.width, EDGE / layout.height
    figure.legend(
        handles=[Patch(color=colour, label=text) for text, colour in looks],
        loc="lower left",
        bbox_to_anchor=(left, edge),
        bbox_transform=figure.transFigure,
        ncols=3,
        frameon=False,
        fontsize=8,
        borderpad=0,
    )
    figure.text(left, 1 - edge, title, va="top", fontsize=10, color=INK, parse_math=False)


def _outline(axes: Any, blocks: Sequence[tuple[str, Part]]) -> None:
    """Draw a frame around each block, in the colour of its part."""
    from matplotlib.patches import Rectangle

    row = column = 0
    for name, block in blocks:
        height, width = len(block.equations), len(block.unknowns)
        if name != "free" and height and width:
            corner = (column - 0.5, row - 0.5)
            frame = Rectangle(
                corner, width, height, fill=False, edgecolor=PARTS[name], linewidth=1.4, zorder=3
            )
            axes.add_patch(frame)
        row, column = row + height, column + width


def _label(text: str) -> str:
    return text if len(text) <= MOST_LETTERS else text[: MOST_LETTERS - 1] + "…"


def _longest(labels: Sequence[str]) -> float:
    """Return the width of the longest label, inches."""
    return LETTER * max((len(_label(label)) for label in labels), default=0)


def _titled(model: Model, text: str) -> str:
    return f"{_label(model.name)}: {text}" if model.name else text
