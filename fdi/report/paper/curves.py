"""What did recorded channels do? Curves over time in customary units, a panel per unit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from fdi.errors import UsageError
from fdi.report.paper.column import (
    LETTER_MM,
    PANEL,
    Floats,
    Span,
    around,
    finding_of,
    mark_times,
    marks_of,
    printed,
    stacked,
    thinned,
    whole,
)
from fdi.report.paper.tests import told_by
from fdi.report.style import CURVES, label
from fdi.report.words import shortened, unit
from fdi.result import Analysis
from fdi.telemetry import Channel
from fdi.units import customary

PANEL_MM: Final = 26.0
LINE_MM: Final = 3.0
LONGEST: Final = 44  # letters of a name
FLAT: Final = 0.05
MOST_PANELS: Final = 5
MOST_CURVES: Final = len(CURVES)
FEW: Final = 60
"""Of fewer records each is seen as a dot."""


class Curve(NamedTuple):
    """A channel in customary units."""

    name: str
    unit: str
    t: Floats
    value: Floats


def channels_figure(analysis: Analysis, channels: Sequence[str], rank: int, width_mm: float) -> Any:
    """Return channels over time: those named over the whole flight, else those of a finding."""
    if channels:
        span, named = whole(analysis), list(channels)
    else:
        if not analysis.findings:
            raise UsageError(
                "nobody is accused, so no channels are told",
                where=analysis.log.name,
                hint="name some with --channel, e.g. ATTITUDE.roll",
            )
        finding = finding_of(analysis, rank)
        span, named = around(analysis, finding), list(finding.evidence.channels)
        compared = compared_by(analysis, told_by(analysis, finding)[0])
        named = [one for one in named if one in compared] or named
    panels = panels_of(curves_of(analysis, named), span)
    if channels and (len(panels) > MOST_PANELS or max(map(len, panels)) > MOST_CURVES):
        raise UsageError(
            f"{len(channels)} channels in {len(panels)} panels are too many for one figure",
            hint=f"{MOST_PANELS} panels of {MOST_CURVES} channels at the most",
        )
    panels = panels[:MOST_PANELS]
    with printed():
        heights = [panel_mm(own, width_mm) for own in panels]
        figure, axes = stacked(width_mm, heights, extra_mm=14.0)
        marks = marks_of(analysis, span)
        rows = mark_times(axes, marks, span, PANEL * width_mm)
        for i, (ax, own) in enumerate(zip(axes, panels, strict=True)):
            draw_curves(ax, own, span, width_mm, lines_above=0 if i else rows)
        figure.align_ylabels(list(axes))
    return figure


def compared_by(analysis: Analysis, row: int) -> list[str]:
    """Return the channels that the equations of a test measure, those of conditions left out."""
    equations = analysis.system.equations
    measured = (equations[n].measurement for n in analysis.bank.generators[row].equations)
    return [str(one.channel) for one in measured if one is not None]


def curves_of(analysis: Analysis, names: Sequence[str]) -> list[Curve]:
    """Return channels of the log in customary units.

    Raises
    ------
    UsageError
        The log has no such channel.
    """
    found = []
    for name in dict.fromkeys(names):
        channel = Channel.parse(name)
        data = analysis.log.channel(channel)
        shown = customary(data.unit)
        value = data.value * shown.scale + shown.offset
        found.append(Curve(str(channel), unit(shown.unit), data.t, value))
    return found


def panels_of(curves: Sequence[Curve], span: Span) -> list[list[Curve]]:
    """Return curves by panel: of one unit, where one does not make the other a flat line.

    They share a panel if their ranges meet and the smaller is no less than `FLAT` of the larger.
    """
    panels: list[list[Curve]] = []
    for one in curves:
        for own in panels:
            if own[0].unit == one.unit and all(_fit(one, other, span) for other in own):
                own.append(one)
                break
        else:
            panels.append([one])
    return panels


def _fit(one: Curve, other: Curve, span: Span) -> bool:
    (low, high), (low_b, high_b) = _range(one, span), _range(other, span)
    sizes = sorted((high - low, high_b - low_b))
    return max(low, low_b) <= min(high, high_b) and sizes[0] >= FLAT * sizes[1]


def _range(curve: Curve, span: Span) -> tuple[float, float]:
    seen = curve.value[(curve.t >= span[0]) & (curve.t <= span[1]) & np.isfinite(curve.value)]
    return (float(seen.min()), float(seen.max())) if len(seen) else (0.0, 0.0)


def panel_mm(curves: Sequence[Curve], width_mm: float) -> float:
    """Return how tall a panel is, with the names above it."""
    shown = min(len(curves), MOST_CURVES)
    return PANEL_MM + LINE_MM * (-(-shown // _columns(curves, width_mm)) - 1)


def _columns(curves: Sequence[Curve], width_mm: float) -> int:
    """Return how many names stand side by side."""
    longest = max(len(label(one.name, LONGEST)) for one in curves[:MOST_CURVES])
    return max(1, min(2, int(0.8 * width_mm / (LETTER_MM * (longest + 6)))))


def draw_curves(
    ax: Any, curves: Sequence[Curve], span: Span, width_mm: float, *, lines_above: int
) -> None:
    """Draw curves of one unit into a panel, named above it; what is too many is counted there."""
    for one, ink in zip(curves, CURVES, strict=False):
        seen = (one.t >= span[0]) & (one.t <= span[1])
        t, value = thinned(one.t[seen], one.value[seen])
        few = seen.sum() < FEW
        name = label(one.name, LONGEST)
        ax.plot(t, value, color=ink, label=name, marker="." if few else "", markersize=2.0)
    if len(curves) > MOST_CURVES:
        ax.plot([], [], linewidth=0, label=f"and {len(curves) - MOST_CURVES} more")
    ax.set_ylabel(axis_text(curves))
    ax.ticklabel_format(axis="y", useOffset=False, style="plain")
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0 + 0.105 * lines_above),
        borderaxespad=0.1,
        frameon=False,
        ncols=_columns(curves, width_mm),
        handlelength=1.2,
        columnspacing=0.8,
    )


def axis_text(curves: Sequence[Curve]) -> str:
    """Return what stands beside a panel: the quantity where all agree, and a unit if it has one."""
    fields = list(dict.fromkeys(one.name.rpartition(".")[2] for one in curves))
    quantity = shortened(fields, 1) if len(fields) == 1 else ""
    of_unit = f"({curves[0].unit})" if curves[0].unit else ""
    return label(f"{quantity} {of_unit}".strip(), 26)
