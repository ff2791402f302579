"""Which faults can be told apart? A matrix where it can be read, else the groups that cannot.

A group is a connected group of "every test that contains f contains g"; of what is in no group
every fault can be told from every other one, so that groups say what a matrix of a hundred faults
says.
"""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap as lines_of
from typing import Any, Final

import numpy as np

from fdi.diagnosis import Isolability
from fdi.report.paper.column import LETTER_MM, SMALL, page, printed
from fdi.report.style import FAINT, INK, colour, label
from fdi.report.words import plural
from fdi.result import Analysis

MOST_FAULTS: Final = 24
LINE_MM: Final = 2.7
GAP_MM: Final = 1.6
SHADES: Final = ("#eef2f6", "#d0605e", "#52606d")


def isolability_figure(analysis: Analysis, width_mm: float) -> Any:
    """Return which faults the residual generators tell apart, as a printed figure."""
    value = analysis.diagnosis.implementable
    with printed():
        if 0 < int(value.detectable.sum()) <= MOST_FAULTS:
            return _matrix(value, width_mm)
        groups = {fault.name: fault.group for fault in analysis.system.faults}
        components = {fault.name: fault.component for fault in analysis.system.faults}
        return _groups(value, groups, components, width_mm)


def _matrix(value: Isolability, width_mm: float) -> Any:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    place = {name: i for i, name in enumerate(value.faults)}
    grouped = [place[name] for group in value.groups for name in group]
    single = [i for i in np.flatnonzero(value.detectable).tolist() if i not in grouped]
    order = [i for i in grouped if value.detectable[i]] + single
    shade = (~value.matrix[np.ix_(order, order)]).astype(int)
    np.fill_diagonal(shade, 2)
    figure = page(width_mm, width_mm + 12.0)
    ax = figure.subplots()
    ax.pcolormesh(shade, cmap=ListedColormap(list(SHADES)), vmin=0, vmax=2, edgecolor="white")
    ax.set_aspect("equal")
    ax.set_ylim(len(order), 0)
    names = [label(value.faults[i], 26) for i in order]
    ax.set_yticks(np.arange(len(order)) + 0.5, names, fontsize=SMALL - 0.5)
    ax.set_xticks(np.arange(len(order)) + 0.5, names, fontsize=SMALL - 0.5, rotation=90)
    ax.tick_params(length=0)
    ax.set_ylabel("this fault ...")
    ax.set_xlabel("... can be told from this one")
    handles = [Patch(color=SHADES[0], label="yes"), Patch(color=SHADES[1], label="no")]
    figure.legend(handles=handles, loc="outside lower right", ncols=2, frameon=False)
    return figure


def _groups(
    value: Isolability, groups: Mapping[str, str], components: Mapping[str, str], width_mm: float
) -> Any:
    """Return the groups as blocks of names on a page measured in mm."""
    letters = int((width_mm - 6.0) / LETTER_MM)
    blocks: list[tuple[list[str], list[str], str]] = []
    for names in value.groups:
        whose = ", ".join(dict.fromkeys(label(components[name], 30) for name in names))
        head = lines_of(f"{plural(len(names), 'fault')} of {whose}", int(0.88 * letters))
        text = lines_of(", ".join(label(name, 40) for name in names), letters)
        shades = [groups[name] for name in names]
        blocks.append((head, text, colour(max(dict.fromkeys(shades), key=shades.count))))
    grouped = {name for names in value.groups for name in names}
    alone = sum(
        bool(seen) and name not in grouped
        for name, seen in zip(value.faults, value.detectable, strict=True)
    )
    unseen = [n for n, seen in zip(value.faults, value.detectable, strict=True) if not seen]
    head = [f"{plural(alone, 'further fault')} can be told from every other one"]
    blocks.append((head, [], FAINT))
    if unseen:
        text = lines_of(", ".join(label(name, 40) for name in unseen), letters)
        blocks.append(([f"{plural(len(unseen), 'fault')} cannot be detected"], text, "#ffffff"))
    heights = [LINE_MM * (len(head) + len(text)) for head, text, _ in blocks]
    height = sum(heights) + GAP_MM * (len(blocks) + 2) + LINE_MM
    figure = page(width_mm, height)
    figure.set_layout_engine("none")
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set_xlim(0, width_mm)
    ax.set_ylim(height, 0)
    ax.set_axis_off()
    ax.text(1.0, GAP_MM, "faults that cannot all be told from each other", va="top", color=INK)
    top = LINE_MM + 2 * GAP_MM
    for (head, text, ink), size in zip(blocks, heights, strict=True):
        ax.fill_between([1.0, 2.2], top, top + size, color=ink, linewidth=0)
        for number, line in enumerate((*head, *text)):
            weight = "bold" if number < len(head) else "normal"
            at = top + number * LINE_MM
            ax.text(3.4, at, line, va="top", fontsize=SMALL, fontweight=weight, color=INK)
        top += size + GAP_MM
    return figure
