"""What stands behind a finding? The residuals that tell most, then the channels they compare."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from fdi.errors import UsageError
from fdi.report.paper.column import (
    PANEL,
    around,
    finding_of,
    mark_times,
    marks_of,
    printed,
    stacked,
)
from fdi.report.paper.curves import (
    Curve,
    compared_by,
    curves_of,
    draw_curves,
    panel_mm,
    panels_of,
)
from fdi.report.paper.tests import draw_residual, told_by
from fdi.result import Analysis

MOST_RESIDUALS: Final = 2
MOST_PANELS: Final = 3
RESIDUAL_MM: Final = 26.0


def behind_figure(analysis: Analysis, rank: int, width_mm: float) -> Any:
    """Return the curves behind a finding, around its onset.

    Raises
    ------
    UsageError
        There is no such finding, or it names no residual.
    """
    finding = finding_of(analysis, rank)
    rows = told_by(analysis, finding)[:MOST_RESIDUALS]
    span = around(analysis, finding)
    compared = [name for row in rows for name in compared_by(analysis, row)]
    curves = _read(analysis, compared) or _read(analysis, finding.evidence.channels)
    panels = panels_of(curves, span)[:MOST_PANELS]
    heights = [RESIDUAL_MM] * len(rows) + [panel_mm(own, width_mm) for own in panels]
    with printed():
        figure, axes = stacked(width_mm, heights, extra_mm=14.0)
        above = mark_times(axes, marks_of(analysis, span), span, PANEL * width_mm)
        for i, row in enumerate(rows):
            draw_residual(
                axes[i],
                analysis,
                row,
                span,
                width_mm,
                lines_above=0 if i else above,
                component=finding.component,
            )
        for ax, own in zip(axes[len(rows) :], panels, strict=True):
            draw_curves(ax, own, span, width_mm, lines_above=0)
        figure.align_ylabels(list(axes))
    return figure


def _read(analysis: Analysis, names: Iterable[str]) -> list[Curve]:
    """Return those of some channels that the log holds."""
    found = []
    for name in dict.fromkeys(names):
        try:
            found += curves_of(analysis, [name])
        except UsageError:  # made of the log, as the time since the last record: no channel of it
            continue
    return found
