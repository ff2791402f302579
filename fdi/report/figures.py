"""What do fault grid and isolability matrix look like?

In: an analysis, or an isolability. Out: a matplotlib figure. The grid shows the faults that were
marked at least once, by component in the order of their first marks, coloured by group; unknown is
hatched; take-off, landing, impact and the onsets of the findings stand as lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Final

import numpy as np

from fdi.diagnosis.values import MARKED, UNKNOWN, FaultGrid, Isolability
from fdi.report.style import (
    ACCENT,
    FAINT,
    FONT,
    GRID,
    INK,
    colour,
    label,
    levels,
    new_figure,
    styled,
    tidy,
)
from fdi.result import Analysis

ROW_HEIGHT: Final = 0.185  # inches
MOST_ROWS: Final = 120
MOST_SHAPES: Final = 3000
"""More bars are drawn as an image, so that an SVG stays small."""
LETTER: Final = 0.0075
"""Width of a letter as a share of the plot's width."""
MOST_NAMES: Final = 90
"""An isolability matrix with more faults has no room for their names."""

_Bar = tuple[int, float, float]
"""Row, and from when to when."""


@dataclass(frozen=True, slots=True)
class _Line:
    t: float
    text: str
    colour: str
    dashes: str


def fault_grid_figure(analysis: Analysis) -> Any:
    """Return the fault grid as a figure."""
    grid = analysis.diagnosis.grid
    rows = marked_rows(grid)
    with styled():
        if not rows:
            return _nothing_marked(analysis)
        shown = rows[:MOST_ROWS]
        figure = new_figure(11.0, 1.75 + ROW_HEIGHT * len(shown))
        axes = figure.subplots()
        _draw_rows(axes, grid, shown)
        _frame(axes, analysis)
        axes.set_yticks(range(len(shown)), [label(grid.faults[row]) for row in shown])
        axes.set_ylim(len(shown) - 0.4, -0.6)
        _name_components(axes, [grid.components[row] for row in shown])
        left_out = len(rows) - len(shown)
        _title(axes, analysis, f"{len(rows)} of {len(grid.faults)} faults are marked", left_out)
        _legend(axes, grid, shown)
    return figure


def marked_rows(grid: FaultGrid) -> list[int]:
    """Return the rows with a mark: by component in order of first marks, then by first mark."""
    is_marked = grid.marks == MARKED
    rows = np.flatnonzero(is_marked.any(axis=1)).tolist()
    first = {row: int(np.argmax(is_marked[row])) for row in rows}
    component: dict[str, int] = {}
    for row in rows:
        name = grid.components[row]
        component[name] = min(first[row], component.get(name, first[row]))
    return sorted(
        rows,
        key=lambda r: (component[grid.components[r]], grid.components[r], first[r], grid.faults[r]),
    )


def _nothing_marked(analysis: Analysis) -> Any:
    figure = new_figure(11.0, 2.1)
    axes = figure.subplots()
    grid = analysis.diagnosis.grid
    tested = int((grid.marks != UNKNOWN).any(axis=1).sum())
    text = f"No fault is marked ({tested} of {len(grid.faults)} could be tested)"
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=INK)
    axes.set_yticks([])
    _frame(axes, analysis)
    _title(axes, analysis, "no fault is marked", 0)
    return figure


def _draw_rows(axes: Any, grid: FaultGrid, rows: Sequence[int]) -> None:
    """Draw bars in rows: all of one look at once, or a hatch is laid anew behind each of them."""
    unknown: list[_Bar] = []
    marked: dict[str, list[_Bar]] = {}
    for place, row in enumerate(rows):
        unknown += [(place, start, end) for start, end in grid.intervals(row, UNKNOWN)]
        own = marked.setdefault(colour(grid.groups[row]), [])
        own += [(place, start, end) for start, end in grid.intervals(row, MARKED)]
    as_image = len(unknown) + sum(map(len, marked.values())) > MOST_SHAPES
    between = np.arange(len(rows)) + 0.5
    across = axes.get_yaxis_transform()
    axes.hlines(between, 0, 1, transform=across, color=GRID, linewidth=0.6, zorder=0)
    _bars(axes, unknown, as_image, facecolor="#f5f7fa", hatch="/////")
    for shade, bars in marked.items():
        _bars(axes, bars, as_image, facecolor=shade)


def _bars(axes: Any, bars: Sequence[_Bar], as_image: bool, **look: Any) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if bars:
        place, start, end = np.array(bars).T
        low, high = place - 0.38, place + 0.38
        corners = [(start, low), (end, low), (end, high), (start, high), (start, low)]
        around = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
        path = Path(np.array(corners).transpose(2, 0, 1).reshape(-1, 2), around * len(bars))
        axes.add_patch(PathPatch(path, zorder=2, linewidth=0, rasterized=as_image, **look))


def _frame(axes: Any, analysis: Analysis) -> None:
    tidy(axes)
    axes.set_xlabel("s of the log's clock")
    axes.set_xlim(*_extent(analysis))
    _mark_times(axes, _lines(analysis))


def _lines(analysis: Analysis) -> list[_Line]:
    lines = []
    for flight in analysis.log.flights:
        for text, t in (
            ("take-off", flight.takeoff),
            ("landing", flight.landing),
            ("impact", flight.impact),
        ):
            if t is not None:
                lines.append(_Line(t, text, "#52606d", "-"))
    lines += [_Line(f.onset, f"{f.rank} {f.component}", ACCENT, "--") for f in analysis.findings]
    low, high = _extent(analysis)
    return sorted((line for line in lines if low <= line.t <= high), key=lambda line: line.t)


def _mark_times(axes: Any, lines: Sequence[_Line]) -> None:
    """Draw vertical lines with their texts above the plot, on as many levels as they need."""
    low, high = axes.get_xlim()
    for line, (level, leans_left) in zip(lines, _places(lines, low, high), strict=True):
        axes.axvline(line.t, color=line.colour, linestyle=line.dashes, linewidth=0.9, zorder=3)
        axes.annotate(
            label(line.text, 28),
            (line.t, 1.0),
            (-1 if leans_left else 1, 3 + level * (FONT + 2.5)),
            ha="right" if leans_left else "left",
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            color=line.colour,
            fontsize=FONT - 0.5,
            annotation_clip=False,
        )


def _places(lines: Sequence[_Line], low: float, high: float) -> list[tuple[int, bool]]:
    """Return for every text its level above the plot, and whether it ends at its line."""
    widths = [LETTER * len(label(line.text, 28)) + 0.004 for line in lines]
    places = [(line.t - low) / (high - low) for line in lines]
    leans = [place + width > 1.06 for place, width in zip(places, widths, strict=True)]
    starts = [
        place - width if left else place
        for place, width, left in zip(places, widths, leans, strict=True)
    ]
    order = sorted(range(len(lines)), key=lambda i: starts[i])
    found = levels([starts[i] for i in order], [widths[i] for i in order], 0.006)
    level = dict(zip(order, found, strict=True))
    return [(level[i], leans[i]) for i in range(len(lines))]


def _extent(analysis: Analysis) -> tuple[float, float]:
    """Return from when to when the grid holds; its last sample lasts one step."""
    t = analysis.diagnosis.grid.t
    if not len(t):
        return 0.0, 1.0
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    return float(t[0]), float(t[-1]) + step


def _name_components(axes: Any, components: Sequence[str]) -> None:
    """Write the component beside its rows, with a bracket over them."""
    place = 0
    for name, own in groupby(components):
        count = len(list(own))
        low, high = place - 0.36, place + count - 1 + 0.36
        place += count
        across = axes.get_yaxis_transform()
        axes.plot(
            [1.008, 1.008], [low, high], transform=across, color=FAINT, linewidth=2, clip_on=False
        )
        axes.text(
            1.016, (low + high) / 2, label(name, 26), transform=across, va="center", fontsize=FONT
        )


def _title(axes: Any, analysis: Analysis, text: str, left_out: int) -> None:
    more = f", the last {left_out} are not drawn" if left_out else ""
    name = label(analysis.log.name, 60)
    axes.set_title(f"Fault grid of {name}: {text}{more}", pad=14 + _depth(analysis) * (FONT + 2.5))


def _depth(analysis: Analysis) -> int:
    """Return on how many levels the texts above the plot stand, less one."""
    places = _places(_lines(analysis), *_extent(analysis))
    return max((level for level, _ in places), default=0)


def _legend(axes: Any, grid: FaultGrid, rows: Sequence[int]) -> None:
    from matplotlib.patches import Patch

    groups = list(dict.fromkeys(grid.groups[row] for row in rows))
    handles = [Patch(color=colour(group), label=label(group, 24)) for group in groups]
    if (grid.marks[list(rows)] == UNKNOWN).any():
        handles.append(Patch(facecolor="#f5f7fa", hatch="/////", label="unknown"))
    axes.figure.legend(
        handles=handles, loc="outside lower right", ncols=len(handles), frameon=False, fontsize=FONT
    )


def isolability_figure(value: Isolability, title: str = "Isolability") -> Any:
    """Return the isolability matrix as a figure: which fault can be told from which.

    The faults are sorted so that those that cannot be told apart stand together; undetectable ones
    are left out and counted.
    """
    order = _in_groups(value)
    count = len(order)
    with styled():
        # names take room, and blocks without them none
        side = max(4.0, 1.6 + 0.135 * count) if count <= MOST_NAMES else 6.0
        figure = new_figure(side + 1.6, side + 0.6)
        axes = figure.subplots()
        if not count:
            axes.text(0.5, 0.5, "No fault is detectable", ha="center", transform=axes.transAxes)
            axes.set_axis_off()
        else:
            _draw_matrix(axes, value, order)
        hidden = len(value.faults) - count
        axes.set_title(
            f"{label(title, 60)}: {count} detectable faults"
            + (f" ({hidden} undetectable not shown)" if hidden else "")
        )
    return figure


def _in_groups(value: Isolability) -> list[int]:
    place = {name: i for i, name in enumerate(value.faults)}
    grouped = [place[name] for group in value.groups for name in group]
    single = [i for i in range(len(value.faults)) if value.detectable[i] and i not in grouped]
    return [i for i in grouped if value.detectable[i]] + single


def _draw_matrix(axes: Any, value: Isolability, order: Sequence[int]) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    not_isolable = ~value.matrix[np.ix_(order, order)]
    shade = not_isolable.astype(int)
    np.fill_diagonal(shade, 2)
    colours = ListedColormap(["#eef2f6", "#d0605e", "#52606d"])
    axes.pcolormesh(shade, cmap=colours, vmin=0, vmax=2, rasterized=True)
    axes.set_aspect("equal")
    axes.set_ylim(len(order), 0)
    names = [label(value.faults[i], 40) for i in order] if len(order) <= MOST_NAMES else []
    small = FONT - 1.5 if len(order) <= 45 else 5.5
    axes.set_yticks(np.arange(len(names)) + 0.5, names, fontsize=small)
    axes.set_xticks(np.arange(len(names)) + 0.5, names, fontsize=small, rotation=90)
    axes.tick_params(length=0)
    axes.set_ylabel("this fault ...")
    axes.set_xlabel("... can be told from this one")
    handles = [
        Patch(color="#eef2f6", label="isolable"),
        Patch(color="#d0605e", label="not isolable"),
    ]
    axes.figure.legend(
        handles=handles, loc="outside lower right", ncols=2, frameon=False, fontsize=FONT
    )
