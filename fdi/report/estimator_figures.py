"""What do an estimator's ratios and its fault trees look like?

In: a log and its `EstimatorHealth`. Out: figures. Ratios stand on a logarithmic axis, each with its
own level, the limit of the mean over 4 s, and the gate; other cores are faint. A tree has one row a
node, indented as in the text, with its gate, and to the right the time in which it was true.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator import EstimatorHealth
from fdi.methods.estimator.ratios import GROWN, Ratio, trailing_mean
from fdi.methods.estimator.tree import Node, first_path, walk
from fdi.report.estimator_text import gate_of, shown_trees, state_of
from fdi.report.style import (
    ACCENT,
    CURVES,
    FAINT,
    FONT,
    GRID,
    INK,
    label,
    levels,
    new_figure,
    styled,
    tidy,
)
from fdi.telemetry import Log

SMALLEST: Final = 1e-3
"""Ratios below are drawn here: a logarithmic axis has no zero."""
TICKS: Final = (0.001, 0.01, 0.1, 1.0)
ROW: Final = 0.24  # inches
MARGIN_S: Final = 2.0
LETTERS: Final = 70
LETTER: Final = 0.0075
"""Width of a letter as a share of the plot's width."""
Floats = NDArray[np.float64]


def ratios_figure(log: Log, health: EstimatorHealth) -> Any:
    """Return the ratios of the core that flew as a figure."""
    count = max(len(health.ratios), 1)
    low, high = _extent(health)
    with styled():
        figure = new_figure(11.0, 1.0 + 1.35 * count)
        axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        for ax, ratio in zip(axes, health.ratios, strict=False):
            _draw_ratio(ax, health, ratio)
        for ax in axes:
            tidy(ax)
            ax.set_xlim(low, high)
            _draw_moments(ax, health)
        above = _name_moments(axes[0], health)
        axes[0].set_title(f"Test ratios of {label(log.name, 60)}", pad=5 + above * (FONT + 2.5))
        axes[-1].set_xlabel("s of the log's clock")
        handles, names = axes[0].get_legend_handles_labels()
        figure.legend(
            handles,
            names,
            loc="outside lower right",
            ncols=len(names),
            frameon=False,
            fontsize=FONT,
        )
        figure.align_ylabels(list(axes))
    return figure


def _draw_ratio(ax: Any, health: EstimatorHealth, ratio: Ratio) -> None:
    for _, ratios in health.core_ratios:
        for other in ratios:
            if other.quantity == ratio.quantity:
                ax.plot(other.t, _shown(other.value), color=GRID, linewidth=0.7, zorder=1)
    ax.plot(ratio.t, _shown(ratio.value), color=CURVES[0], linewidth=0.7, label="ratio")
    mean = trailing_mean(ratio.t, ratio.value)
    ax.plot(ratio.t, _shown(mean), color=INK, linewidth=1.1, label="mean of 4 s")
    if ratio.level is not None:
        ax.axhline(ratio.level, color=FAINT, linestyle="--", linewidth=0.9, label="own level")
        limit = ratio.level * GROWN
        ax.axhline(limit, color=CURVES[1], linewidth=0.9, label="limit of the mean")
    ax.axhline(1.0, color=ACCENT, linewidth=0.9, label="gate")
    ax.set_yscale("log")
    largest = ratio.peak or 1.0
    ax.set_ylim(SMALLEST, max(2.0, 1.5 * largest))
    ax.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
    ax.minorticks_off()
    ax.set_ylabel(label(ratio.quantity, 20))


def _shown(values: Floats) -> Floats:
    return np.maximum(values, SMALLEST)


def _extent(health: EstimatorHealth) -> tuple[float, float]:
    low = min(health.armed[0], health.air[0]) - MARGIN_S
    high = max(health.armed[1], health.air[1]) + MARGIN_S
    return low, high


def _moments(health: EstimatorHealth) -> list[tuple[float, str]]:
    found = [(health.air[0], "take-off" if health.flight is not None else "")]
    if health.symptom is not None:
        found.append((health.symptom.t, health.symptom.what))
    if health.complaint is not None and health.complaint != health.symptom:
        found.append((health.complaint.t, health.complaint.what))
    return [(t, what) for t, what in found if what]


def _draw_moments(ax: Any, health: EstimatorHealth) -> None:
    for t, _ in _moments(health):
        ax.axvline(t, color=ACCENT, linestyle="--", linewidth=0.8)


def _name_moments(ax: Any, health: EstimatorHealth) -> int:
    """Write what happened above the plot, on as many levels as it needs; return how many."""
    low, high = _extent(health)
    moments = sorted(_moments(health))
    texts = [f"{label(what, 44)} {t:.1f} s" for t, what in moments]
    widths = [LETTER * len(one) for one in texts]
    places = [(t - low) / (high - low) for t, _ in moments]
    leans = [place + width > 1.0 for place, width in zip(places, widths, strict=True)]
    starts = [p - w if left else p for p, w, left in zip(places, widths, leans, strict=True)]
    order = sorted(range(len(texts)), key=lambda i: starts[i])
    level = dict(
        zip(
            order, levels([starts[i] for i in order], [widths[i] for i in order], 0.01), strict=True
        )
    )
    for i, (t, _) in enumerate(moments):
        ax.annotate(
            texts[i],
            (t, 1.0),
            (-2 if leans[i] else 2, 3 + level[i] * (FONT + 2.5)),
            ha="right" if leans[i] else "left",
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            color=ACCENT,
            fontsize=FONT - 0.5,
            annotation_clip=False,
        )
    return max(level.values(), default=0) + 1


def trees_figure(log: Log, health: EstimatorHealth) -> Any:
    """Return the fault trees as a figure, one under the other."""
    tops, _ = shown_trees(health)
    rows = [(top, *one) for top in tops for one in walk(top)]
    with styled():
        figure = new_figure(13.0, 1.3 + ROW * max(len(rows) + len(tops), 2))
        axes = figure.subplots()
        if not rows:
            axes.text(0.5, 0.5, "no tree for this estimator", ha="center", color=INK)
            axes.set_axis_off()
            return figure
        _draw_rows(axes, rows, health)
        axes.set_title(f"What led to it: {label(log.name, 60)}")
    return figure


def _draw_rows(
    axes: Any, rows: Sequence[tuple[Node, Node, int, bool]], health: EstimatorHealth
) -> None:
    from matplotlib.ticker import MaxNLocator

    low, high = _extent(health)
    left = low - 1.05 * (high - low)  # the names take the left half of the plot
    step = 0.018 * (high - left)
    place = 0.0
    parents: list[float] = []
    for top, node, depth, is_again in rows:
        place += 1.6 if depth == 0 and place else 1.0
        parents[depth:] = [place]
        on_path = any(one.name == node.name for one in first_path(top))
        colour = ACCENT if on_path else INK if node.spans is not None else FAINT
        x = left + depth * step
        if depth:
            _join(axes, x - step, parents[depth - 1], x, place)
        axes.text(
            x,
            place,
            _said(node, depth, is_again=is_again),
            va="center",
            color=colour,
            fontsize=FONT - 0.5,
        )
        axes.axhline(place, xmin=0.52, color=GRID, linewidth=0.6, zorder=0)
        _draw_spans(axes, node, place, colour, (low, high))
    axes.set_xlim(left, high)
    axes.set_ylim(place + 1.0, 0.0)
    axes.set_yticks([])
    tidy(axes)
    axes.spines["left"].set_visible(False)
    axes.set_xticks([t for t in MaxNLocator(6).tick_values(low, high) if low <= t <= high])
    axes.set_xlabel("s of the log's clock", loc="right")


def _said(node: Node, depth: int, *, is_again: bool) -> str:
    ending = " (as above)" if is_again else f"  {gate_of(node)}"
    return f"{label(node.name, LETTERS - 3 * depth)}: {state_of(node)}{ending.rstrip()}"


def _join(axes: Any, x: float, top: float, right: float, place: float) -> None:
    """Draw the branch from a parent to its child."""
    inset = 0.35 * (right - x)
    axes.plot(
        [x + inset, x + inset, right - 0.1 * inset],
        [top + 0.45, place, place],
        color=FAINT,
        linewidth=0.8,
    )


def _draw_spans(
    axes: Any, node: Node, place: float, colour: str, extent: tuple[float, float]
) -> None:
    low, high = extent
    least = 0.004 * (high - low)  # so that a moment is seen
    bars = [(a, max(b - a, least)) for a, b in node.spans or () if b >= low and a <= high]
    if bars:
        axes.broken_barh(bars, (place - 0.33, 0.66), facecolor=colour, linewidth=0)
    if node.spans is None:
        axes.broken_barh(
            [(low, high - low)],
            (place - 0.33, 0.66),
            facecolor="#f5f7fa",
            hatch="/////",
            linewidth=0,
        )
