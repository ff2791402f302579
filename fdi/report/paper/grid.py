"""What does the fault grid look like in a column? A row per marked fault, or per component.

Rows stand by component in the order of first marks. Where there are more than `MOST_ROWS` marked
faults, a row is a component, marked while any fault of it is, and unknown while none is known.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.values import MARKED, QUIET, UNKNOWN, FaultGrid, runs
from fdi.report.figures import marked_rows
from fdi.report.paper.column import (
    CLOCK,
    LETTER_MM,
    SMALL,
    mark_times,
    marks_of,
    page,
    printed,
    whole,
)
from fdi.report.style import GRID, INK, colour, label, tidy
from fdi.result import Analysis

MOST_ROWS: Final = 24
ROW_MM: Final = 3.2
LONGEST: Final = 34  # letters of a name
PALE: Final = "#f5f7fa"


class _Row(NamedTuple):
    name: str
    group: str
    marks: NDArray[np.int8]


def grid_figure(analysis: Analysis, width_mm: float) -> Any:
    """Return the fault grid as a printed figure."""
    grid, span = analysis.diagnosis.grid, whole(analysis)
    rows = grid_rows(grid)
    with printed():
        marks = marks_of(analysis, span)
        figure = page(width_mm, 20.0 + ROW_MM * max(len(rows), 3) + 2.5 * min(len(marks), 4))
        ax = figure.subplots()
        tidy(ax)
        for place, row in enumerate(rows):
            ax.axhline(place + 0.5, color=GRID, linewidth=0.4, zorder=0)
            _bars(ax, grid, place, row.marks == UNKNOWN, facecolor=PALE, hatch="/////")
            _bars(ax, grid, place, row.marks == MARKED, facecolor=colour(row.group))
        ax.set_yticks(range(len(rows)), [label(row.name, LONGEST) for row in rows], fontsize=SMALL)
        ax.set_ylim(max(len(rows), 3) - 0.4, -0.6)
        ax.set_xlabel(CLOCK)
        if not rows:
            tested = int((grid.marks != UNKNOWN).any(axis=1).sum())
            text = f"no fault is marked\n({tested} of {len(grid.faults)} could be tested)"
            ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=INK)
        names = max((len(label(row.name, LONGEST)) for row in rows), default=0)
        mark_times([ax], marks, span, max(width_mm - LETTER_MM * names - 6.0, 0.4 * width_mm))
        _legend(figure, rows)
    return figure


def grid_rows(grid: FaultGrid) -> list[_Row]:
    """Return the rows to draw: marked faults, or their components where these are too many."""
    rows = marked_rows(grid)
    if len(rows) <= MOST_ROWS:
        return [_Row(grid.faults[i], grid.groups[i], grid.marks[i]) for i in rows]
    found = []
    for name in dict.fromkeys(grid.components[i] for i in rows):
        own = [i for i, component in enumerate(grid.components) if component == name]
        some = grid.marks[own]
        joined = np.where(
            (some == MARKED).any(axis=0),
            MARKED,
            np.where((some == QUIET).any(axis=0), QUIET, UNKNOWN),
        ).astype(np.int8)
        found.append(_Row(name, grid.groups[own[0]], joined))
    return found


def _bars(ax: Any, grid: FaultGrid, place: int, mask: NDArray[np.bool_], **look: Any) -> None:
    spans = [(low, high - low) for low, high in runs(grid.t, mask)]
    if spans:
        many = len(spans) > 500
        ax.broken_barh(spans, (place - 0.4, 0.8), linewidth=0, rasterized=many, zorder=2, **look)


def _legend(figure: Any, rows: list[_Row]) -> None:
    from matplotlib.patches import Patch

    handles = [
        Patch(color=colour(g), label=label(g, 20)) for g in dict.fromkeys(r.group for r in rows)
    ]
    if any((row.marks == UNKNOWN).any() for row in rows):
        handles.append(Patch(facecolor=PALE, hatch="/////", label="unknown"))
    if handles:
        figure.legend(
            handles=handles,
            loc="outside lower center",
            ncols=min(len(handles), 4),
            frameon=False,
            handlelength=1.2,
            columnspacing=1.0,
        )
