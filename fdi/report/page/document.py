"""What does the page hold beside its tables? The data for its scripts, and pictures without them.

In: an analysis. Out: `Page`: JSON for the browser, and for every plot a drawing that stands where
no script runs and on paper.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from fdi.diagnosis import Ending, Finding
from fdi.diagnosis.ending import went_wrong
from fdi.report.page import marks
from fdi.report.page.airframe import airframe_svg
from fdi.report.page.channels import Held, held_channels
from fdi.report.page.drawing import grid_svg, panel_svg, track_svg
from fdi.report.page.evidence import AFTER, BEFORE, Case, Court
from fdi.report.page.overview import overview
from fdi.report.page.panel import Panel, panel_json
from fdi.report.page.script import json_for_page
from fdi.report.page.suspects import does_as_well_as_its_parts
from fdi.report.page.track import track, track_json
from fdi.report.page.waterfall import waterfalls
from fdi.report.style import GROUP_COLOURS
from fdi.result import Analysis

CONTEXT: Final[tuple[str, ...]] = ("Height", "Speed", "Roll", "Pitch", "Outputs")
"""What of the flight's plots stands with an end that nobody is accused for."""
CONTROL: Final[tuple[str, ...]] = ("Outputs",)
"""The same, with the accusation of a controller: what it asked of its motors and surfaces."""
MOST_BYTES: Final = 4_800_000
"""Of plots and channels as text; with tables and scripts a page stays below 6 MB."""
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

    def all(self) -> Iterator[Plot]:
        """Yield every plot."""
        for plots in (*self.plots, self.sized, self.context):
            yield from plots


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


class _Ground(NamedTuple):
    """What all plots stand on: modes with their times, s, and moments with their class."""

    bands: list[tuple[float, float, str]]
    lines: list[tuple[float, str]]


def page_of(analysis: Analysis) -> Page:
    """Return what the page of an analysis holds beside its tables."""
    span = marks.extent(analysis)
    events = marks.marks(analysis)
    ground = _Ground(marks.modes(analysis.log), _lines(events))
    panels = [*overview(analysis.log), *waterfalls(analysis.log, span)]
    way = track(analysis.log)
    rows = marks.grid_rows(analysis)
    findings, firsts = _cases(analysis)
    cases = {
        f"{kind}.{place}": case
        for kind, cases in (("finding", findings), ("first", firsts))
        for place, (_, case) in enumerate(cases)
        if case is not None
    }
    around = _around(cases, findings, panels, analysis)
    data: dict[str, Any] = {
        "span": [round(edge, 3) for edge in span],
        "modes": [[round(a, 3), round(b, 3), name] for a, b, name in ground.bands],
        "marks": events,
        "grid": rows,
        "overview": [panel_json(panel) for panel in panels],
        "track": track_json(way),
        "cases": {p: _case_json(case) | {"context": around[p]} for p, case in cases.items()},
    }

    shown = {
        place: _shown(case, place, [panels[i] for i in around[place]], ground)
        for place, case in cases.items()
    }
    drawn = _plots(panels, "overview", span, ground)
    every = [*drawn, *(plot for one in shown.values() for plot in one.all())]
    used = len(json_for_page(data)) + sum(len(plot.svg) for plot in every)
    needed = _channels([*panels, *(panel for case in cases.values() for panel in case.panels())])
    moments = [case.window for case in cases.values()]
    moments += [
        (went_wrong(end) - BEFORE, end.at + AFTER) for end in analysis.log.ends if end.is_bad
    ]
    held = held_channels(analysis.log, needed, MOST_BYTES - used, moments)
    return Page(
        data=data | {"messages": held.messages},
        airframe=airframe_svg(analysis),
        grid=grid_svg(rows, span, ground.lines) if rows else "",
        way="" if way is None else track_svg(way),
        way_told="" if way is None else way.told,
        plots=drawn,
        findings=[(f, shown.get(f"finding.{i}")) for i, (f, _) in enumerate(findings)],
        firsts=[(e, shown.get(f"first.{i}")) for i, (e, _) in enumerate(firsts)],
        groups=tuple(g for g in GROUP_COLOURS if any(row["group"] == g for row in rows)),
        held=held,
    )


def _around(
    cases: Iterable[str],
    findings: Sequence[tuple[Finding, Case | None]],
    panels: Sequence[Panel],
    analysis: Analysis,
) -> dict[str, list[int]]:
    """Return by the place of a case which of the flight's panels stand with it."""
    components = analysis.system.components
    titles = {
        f"finding.{i}": CONTROL
        for i, (one, _) in enumerate(findings)
        if does_as_well_as_its_parts(components.get(one.component))
    }
    return {
        place: [
            i
            for i, panel in enumerate(panels)
            if panel.title.startswith(
                CONTEXT if place.startswith("first") else titles.get(place, ())
            )
        ]
        for place in cases
    }


def _lines(events: Sequence[dict[str, Any]]) -> list[tuple[float, str]]:
    """Return the moments that a drawing marks."""
    return [
        (one["at"], "onset" if one["kind"] == "onset" else "edge")
        for one in events
        if one["kind"] in (*marks.EDGES, "onset")
    ]


def _plots(
    panels: Sequence[Panel], place: str, span: tuple[float, float], ground: _Ground
) -> tuple[Plot, ...]:
    return tuple(
        Plot(
            f"{place}.{i}",
            f"{panel.title}, {panel.unit}" if panel.unit else panel.title,
            panel_svg(panel, span, ground.lines, ground.bands),
        )
        for i, panel in enumerate(panels)
    )


def _shown(case: Case, place: str, context: Sequence[Panel], ground: _Ground) -> Shown:
    def plots(panels: Sequence[Panel], kind: str) -> tuple[Plot, ...]:
        return _plots(panels, f"cases.{place}.{kind}", case.window, ground)

    tests = tuple(plots(test.panels, f"tests.{i}") for i, test in enumerate(case.tests))
    return Shown(case, place, tests, plots(case.sized, "sized"), plots(context, "context"))


def _case_json(case: Case) -> dict[str, Any]:
    return {
        "at": round(case.at, 3),
        "window": [round(edge, 3) for edge in case.window],
        "sized": [panel_json(panel) for panel in case.sized],
        "tests": [[panel_json(panel) for panel in test.panels] for test in case.tests],
    }


def _channels(panels: Sequence[Panel]) -> set[str]:
    """Return the channels of the log that panels show."""
    return {curve.channel for panel in panels for curve in panel.curves if curve.channel}


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
