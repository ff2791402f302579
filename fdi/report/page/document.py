"""What does the page hold beside its tables? The data for its scripts, and pictures without them.

In: an analysis. Out: `Page`: JSON for the browser, and for every plot a drawing that stands where
no script runs and on paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from fdi.diagnosis import Ending, Finding
from fdi.report.page import marks
from fdi.report.page.airframe import airframe_svg
from fdi.report.page.channels import Held, held_channels
from fdi.report.page.drawing import grid_svg, panel_svg, track_svg
from fdi.report.page.evidence import Case, Court
from fdi.report.page.overview import overview
from fdi.report.page.panel import Panel, panel_json
from fdi.report.page.track import track, track_json
from fdi.report.style import GROUP_COLOURS
from fdi.result import Analysis

CONTEXT: Final = ("Height", "Speed", "Roll", "Pitch", "Outputs")
"""What of the flight's plots stands with an end that nobody is accused for."""
MOST_CASES: Final = 8
"""Findings beyond are told without their curves."""


@dataclass(frozen=True, slots=True, eq=False)
class Plot:
    """A plot of the page: where its data stand, its title, the drawing."""

    place: str
    title: str
    svg: str


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A case with its plots: a tuple for each test, of the fault's size, of the flight around."""

    case: Case
    place: str
    plots: tuple[tuple[Plot, ...], ...]
    sized: tuple[Plot, ...]
    context: tuple[Plot, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Page:
    """What the page holds beside its tables.

    Attributes
    ----------
    data : dict
        For the scripts.
    airframe, grid, way : str
        SVG; "" where there is nothing to draw.
    plots : tuple of Plot
        Of the whole flight.
    findings : list of (Finding, Shown or None)
    firsts : list of (Ending, Shown or None)
        Of flights that went wrong.
    groups : tuple of str
        Of the faults in the grid.
    """

    data: dict[str, Any]
    airframe: str
    grid: str
    way: str
    way_told: str
    plots: tuple[Plot, ...]
    findings: list[tuple[Finding, Shown | None]]
    firsts: list[tuple[Ending, Shown | None]]
    groups: tuple[str, ...]
    held: Held


def page_of(analysis: Analysis) -> Page:
    """Return what the page of an analysis holds beside its tables."""
    span = marks.extent(analysis)
    bands = marks.modes(analysis.log)
    events = marks.marks(analysis)
    lines = [
        (one["at"], "onset" if one["kind"] == "onset" else "edge")
        for one in events
        if one["kind"] in (*marks.EDGES, "onset")
    ]
    panels = overview(analysis.log)
    way = track(analysis.log)
    rows = marks.grid_rows(analysis)
    findings, firsts = _cases(analysis)
    held = held_channels(
        analysis.log, [curve.channel for panel in panels for curve in panel.curves if curve.channel]
    )
    cases = [
        (f"{kind}.{place}", case)
        for kind, cases in (("finding", findings), ("first", firsts))
        for place, (_, case) in enumerate(cases)
        if case is not None
    ]
    context = [i for i, panel in enumerate(panels) if panel.title.startswith(CONTEXT)]
    unexplained = {place for place, _ in cases if place.startswith("first")}
    data = {
        "span": [round(edge, 3) for edge in span],
        "name": analysis.log.name,
        "modes": [[round(a, 3), round(b, 3), name] for a, b, name in bands],
        "marks": events,
        "grid": rows,
        "overview": [panel_json(panel, held.names.__contains__) for panel in panels],
        "track": track_json(way),
        "cases": {
            place: {
                "at": round(case.at, 3),
                "window": [round(edge, 3) for edge in case.window],
                "context": context if place in unexplained else [],
                "sized": [panel_json(panel, held.names.__contains__) for panel in case.sized],
                "tests": [
                    [panel_json(panel, held.names.__contains__) for panel in test.panels]
                    for test in case.tests
                ],
            }
            for place, case in cases
        },
        "messages": held.messages,
    }
    shown = {
        place: Shown(
            case,
            place,
            tuple(
                _plots(test.panels, f"cases.{place}.tests.{i}", case.window, lines, bands)
                for i, test in enumerate(case.tests)
            ),
            _plots(case.sized, f"cases.{place}.sized", case.window, lines, bands),
            _plots(
                [panels[i] for i in context] if place in unexplained else [],
                f"cases.{place}.context",
                case.window,
                lines,
                bands,
            ),
        )
        for place, case in cases
    }
    return Page(
        data=data,
        airframe=airframe_svg(analysis),
        grid=grid_svg(rows, span, lines) if rows else "",
        way="" if way is None else track_svg(way),
        way_told="" if way is None else way.told,
        plots=_plots(panels, "overview", span, lines, bands),
        findings=[(f, shown.get(f"finding.{i}")) for i, (f, _) in enumerate(findings)],
        firsts=[(e, shown.get(f"first.{i}")) for i, (e, _) in enumerate(firsts)],
        groups=tuple(g for g in GROUP_COLOURS if any(row["group"] == g for row in rows)),
        held=held,
    )


def _cases(
    analysis: Analysis,
) -> tuple[list[tuple[Finding, Case | None]], list[tuple[Ending, Case | None]]]:
    """Return findings with their cases, and the ends of flights that went wrong with theirs.

    Where somebody is accused for the flight the finding's case stands for both.
    """
    court = Court(analysis)
    findings = [
        (one, court.of_finding(one) if place < MOST_CASES else None)
        for place, one in enumerate(analysis.findings)
    ]
    accused = {one.flight for one in analysis.findings}
    firsts = [
        (one, None if one.end.flight in accused else court.of_ending(one))
        for one in analysis.diagnosis.endings
        if one.end.is_bad
    ]
    return findings, firsts


def _plots(
    panels: Sequence[Panel],
    place: str,
    span: tuple[float, float],
    lines: Sequence[tuple[float, str]],
    bands: Sequence[tuple[float, float, str]],
) -> tuple[Plot, ...]:
    return tuple(
        Plot(
            f"{place}.{i}",
            f"{panel.title}, {panel.unit}" if panel.unit else panel.title,
            panel_svg(panel, span, lines, bands),
        )
        for i, panel in enumerate(panels)
    )
