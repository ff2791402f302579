"""What did a test do? Its residual over time with the threshold as a band, alarms in red."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap as lines_of
from typing import Any, Final

import numpy as np

from fdi.diagnosis import Finding
from fdi.diagnosis.concerns import concerns
from fdi.diagnosis.plain import alarm_sentences, alarm_words
from fdi.errors import UsageError
from fdi.model.parts import Kind
from fdi.model.system import SystemEquation
from fdi.report.page.sides import residual_of
from fdi.report.paper.column import (
    LETTER_MM,
    PANEL,
    SMALL,
    Floats,
    Span,
    finding_of,
    mark_times,
    marks_of,
    printed,
    stacked,
    thinned,
    whole,
)
from fdi.report.style import ACCENT, INK, label
from fdi.report.words import unit
from fdi.result import Analysis
from fdi.units import customary

PANEL_MM: Final = 30.0
MOST_PANELS: Final = 4
BAND: Final = "#dbe7f3"


def residual_figure(analysis: Analysis, test: str | None, rank: int, width_mm: float) -> Any:
    """Return residuals over the whole flight: those of a test, or what tells most of a finding."""
    rows = (
        strongest(analysis, meant(analysis, test))[:MOST_PANELS]
        if test is not None
        else told_by(analysis, finding_of(analysis, rank))[:1]
        if analysis.findings
        else strongest(analysis, range(len(analysis.bank.generators)))[:1]
    )
    span = whole(analysis)
    with printed():
        figure, axes = stacked(width_mm, [PANEL_MM] * len(rows), extra_mm=12.0)
        above = mark_times(axes, marks_of(analysis, span), span, PANEL * width_mm)
        for i, (ax, row) in enumerate(zip(axes, rows, strict=True)):
            draw_residual(ax, analysis, row, span, width_mm, lines_above=0 if i else above)
        figure.align_ylabels(list(axes))
    return figure


def meant(analysis: Analysis, test: str) -> list[int]:
    """Return the rows of the tests that a name means: an id, a statement, a component.

    Raises
    ------
    UsageError
        There is none.
    """
    whom, equations = concerns(analysis.bank), analysis.bank.system.equations
    found = [
        row
        for row, generator in enumerate(analysis.bank.generators)
        if test in (generator.id, equations[generator.residual].name) or test in whom.of(row)
    ]
    if not found:
        ids = ", ".join(generator.id for generator in analysis.bank.generators[:3])
        raise UsageError(
            f"there is no test {test!r} in this analysis",
            hint=f"give an id such as {ids}, a statement or a component",
        )
    return found


def strongest(analysis: Analysis, rows: Sequence[int]) -> list[int]:
    """Return rows with those first that came furthest beyond, or nearest to, their threshold."""
    strength = analysis.alarms.strength
    top = {row: float(np.nanmax(np.append(strength[row], 0.0))) for row in rows}
    return sorted(rows, key=lambda row: (-top[row], row))


def told_by(analysis: Analysis, finding: Finding) -> list[int]:
    """Return the tests behind a finding, the one that tells most first.

    Raises
    ------
    UsageError
        None of them is in the bank.
    """
    place = {generator.id: row for row, generator in enumerate(analysis.bank.generators)}
    names = dict.fromkeys((finding.evidence.telling, *finding.evidence.residuals))
    rows = [place[name] for name in names if name in place]
    if not rows:
        raise UsageError(f"finding {finding.rank} names no residual", where=analysis.log.name)
    return rows


def draw_residual(
    ax: Any,
    analysis: Analysis,
    row: int,
    span: Span,
    width_mm: float,
    *,
    lines_above: int,
    component: str | None = None,
) -> None:
    """Draw a residual into a panel: the band is the threshold, alarms are red.

    What violates a statement that has but one side is drawn upwards, as on the page. ``component``:
    of whom the title is to say what an alarm means; by default whom the test concerns first.
    """
    alarms, generator = analysis.alarms, analysis.bank.generators[row]
    equation = analysis.system.equations[generator.residual]
    shown = customary(equation.unit)
    t = alarms.residuals.t
    seen = (t >= span[0]) & (t <= span[1])
    value = residual_of(alarms, row) * shown.scale * (equation.way or 1)
    bound = alarms.threshold[row] * shown.scale
    low, _ = _limit_height(ax, value[seen], bound[seen], equation)
    within = np.full(len(t), low) if equation.way else -bound
    ax.fill_between(t[seen], within[seen], bound[seen], color=BAND, linewidth=0)
    ax.plot(*thinned(t[seen], value[seen]), color=INK, linewidth=0.7)
    hot = np.where(alarms.alarm[row], value, np.nan)
    ax.plot(t[seen], hot[seen], color=ACCENT, linewidth=1.1)
    ax.set_ylabel(f"{generator.id} ({unit(shown.unit)})" if unit(shown.unit) else generator.id)
    letters = int(width_mm / LETTER_MM * 0.82)
    text = label(_meaning(analysis, row, component), 2 * letters)
    ax.set_title(
        "\n".join(lines_of(text, letters)),
        fontsize=SMALL,
        loc="left",
        pad=2 + lines_above * (SMALL + 1.5),
    )


def _meaning(analysis: Analysis, row: int, component: str | None) -> str:
    """Return what an alarm of a test means."""
    bank = analysis.bank
    if component is not None and component in concerns(bank).of(row):
        return alarm_words(component, bank.generators[row], bank.system)
    return alarm_sentences(bank)[row]


def _limit_height(
    ax: Any, value: Floats, bound: Floats, equation: SystemEquation
) -> tuple[float, float]:
    """Show all of the residual, and the threshold where it does not dwarf it; return the range."""
    sizes, limits = np.abs(value[np.isfinite(value)]), bound[np.isfinite(bound)]
    largest = float(sizes.max(initial=0.0))
    middle = float(np.median(limits)) if len(limits) else 0.0
    top = max(largest, min(middle, 5 * largest) if largest else middle)
    if top > 0:  # within a limit there is nothing below zero
        ax.set_ylim(-(0.1 if equation.kind is Kind.LIMIT else 1.1) * top, 1.1 * top)
    low, high = ax.get_ylim()
    return float(low), float(high)
