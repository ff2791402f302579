"""What is in the page that a person hands over?

In: an analysis and its figures. Out: one HTML file that needs nothing else: no script, no font, no
picture from elsewhere, and a policy that forbids the browser to fetch any. jinja2 escapes every
value; figures are embedded as images, in which nothing runs.
"""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final

from fdi.diagnosis import Finding
from fdi.report.analysis_document import analysis_document
from fdi.report.evidence import evidence_figure
from fdi.report.style import Picture
from fdi.report.text import looked_at, onset
from fdi.report.timeline import is_grave, told_events, told_text
from fdi.report.words import (
    accuracies,
    at,
    budget,
    clean,
    copied,
    flown,
    into_flight,
    latencies,
    log_time,
    number,
    per_cent,
    plural,
    shortened,
    size,
    unit,
    window,
)
from fdi.residuals.accuracy import reported_accuracies
from fdi.result import Analysis
from fdi.units import customary

MOST_FIGURES: Final = 12
"""Findings beyond are told without their curves."""
MOST_EVENTS: Final = 400
SMALL: Final = 1_500_000
"""An SVG above this size, bytes, is embedded as PNG."""


def html_report(analysis: Analysis, pictures: Mapping[str, Picture]) -> str:
    """Return the report as one self-contained HTML page.

    Parameters
    ----------
    analysis : Analysis
    pictures : mapping of str to Picture
        ``fault_grid`` and ``isolability``.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("fdi.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_finalize,
    )
    environment.filters.update(
        at=at, number=number, per_cent=per_cent, plural=plural, size=size, shortened=shortened
    )
    page = environment.get_template("report.html.j2")
    events, events_left = _events(analysis)
    return page.render(
        document=analysis_document(analysis),
        copied=copied(analysis.system),
        latencies=latencies(analysis.lags),
        accuracies=accuracies(reported_accuracies(analysis.system, analysis.signals)),
        findings=[_finding(finding, i, analysis) for i, finding in enumerate(analysis.findings)],
        consequences=[
            (item, into_flight(item.onset, analysis.log), log_time(item.onset, analysis.log))
            for item in analysis.diagnosis.consequences
        ],
        events=events,
        events_left=events_left,
        residuals=_residuals(analysis),
        refused=_refused(analysis),
        pictures={name: embedded(picture) for name, picture in pictures.items()},
        policy_text=analysis.policy.description,
        budget_text=budget(analysis),
        flown=flown(analysis.log.flights),
        agreements=analysis.diagnosis.methods,
        noticed=analysis.estimator.findings if analysis.estimator else (),
        looked_at=looked_at(analysis),
        endings=[one for one in analysis.diagnosis.endings if one.first],
        window_text=window(analysis),
        model_text=analysis.airframe.description,
    )


def _finalize(value: Any) -> Any:
    """Strip control characters from foreign text, wherever a template shows it."""
    return clean(value) if type(value) is str else "–" if value is None else value


def embedded(picture: Picture) -> str:
    """Return a picture as a data URI: SVG, or PNG where that is much smaller."""
    svg = picture.bytes("svg")
    if len(svg) <= SMALL:
        return "data:image/svg+xml;base64," + base64.b64encode(svg).decode()
    return "data:image/png;base64," + base64.b64encode(picture.bytes("png")).decode()


def _finding(finding: Finding, place: int, analysis: Analysis) -> dict[str, Any]:
    figure = evidence_figure(analysis, finding) if place < MOST_FIGURES else None
    return {
        "value": finding,
        "onset": onset(finding, analysis),
        "alarm": log_time(finding.alarm, analysis.log),
        "end": None if finding.end is None else log_time(finding.end, analysis.log),
        "picture": None if figure is None else embedded(Picture(figure)),
    }


def _events(analysis: Analysis) -> tuple[list[dict[str, Any]], int]:
    log = analysis.log
    told, more = told_events(log, MOST_EVENTS)
    rows = [
        {
            "t": at(event.t),
            "when": into_flight(event.t, log),
            "kind": event.kind,
            "text": told_text(event, times, last),
            "grave": is_grave(event),
        }
        for event, times, last in told
    ]
    return rows, more


def _residuals(analysis: Analysis) -> list[dict[str, Any]]:
    """Return a row per generator; those in alarm first."""
    import numpy as np

    rows = []
    signatures = analysis.bank.signature_names()
    raised = analysis.alarms.alarm.mean(axis=1) if analysis.alarms.alarm.size else []
    for row, generator in enumerate(analysis.bank.generators):
        equation = analysis.system.equations[generator.residual]
        label, scale, _ = customary(equation.unit)
        bound = analysis.alarms.threshold[row]
        known = bound[np.isfinite(bound)]
        state = analysis.alarms.state[row]
        rows.append(
            {
                "id": generator.id,
                "text": equation.text or equation.name,
                "equations": _names(analysis, generator.equations),
                "signature": list(signatures[row]),
                "threshold": number(float(np.median(known)) * scale, 3) if len(known) else None,
                "unit": unit(label),
                "alarm": float(raised[row]) if len(state) else 0.0,
                "known": float((state != -1).mean()) if len(state) else 0.0,
            }
        )
    return sorted(rows, key=lambda item: -item["alarm"])


def _refused(analysis: Analysis) -> list[tuple[str, str, int]]:
    """Return reasons why sets have no generator, in one word and in many, and for how many sets."""
    reasons = Counter((r.reason.value, r.why) for r in analysis.bank.not_implementable)
    ordered = sorted(reasons.items(), key=lambda item: (-item[1], item[0]))
    return [(*reason, count) for reason, count in ordered]


def _names(analysis: Analysis, numbers: Sequence[int]) -> list[str]:
    return [analysis.system.equations[i].name for i in numbers]
