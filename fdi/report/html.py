"""What is in the page that a person hands over?

In: an analysis. Out: one HTML file that needs nothing else: no font, no picture, no script from
elsewhere, and a policy that forbids the browser to fetch or run any but those in it
(`fdi.report.page`). jinja2 escapes every value; what scripts show they set as text.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import PureWindowsPath
from typing import Any, Final

from fdi.diagnosis import Finding
from fdi.diagnosis.advising import about_no_flight
from fdi.diagnosis.concerns import concerns
from fdi.diagnosis.plain import telling_clause
from fdi.diagnosis.safety_net import safety_net
from fdi.diagnosis.worth import worth_of
from fdi.model.naming import component_words
from fdi.report.advice_text import advised_words, first_steps, last_end
from fdi.report.analysis_document import analysis_document
from fdi.report.check_text import NET_TITLE
from fdi.report.page.airframe import STATES, states_of
from fdi.report.page.document import Shown, page_of
from fdi.report.page.marks import level_of
from fdi.report.page.script import PLOTTING, json_for_page, policy, script, style
from fdi.report.page.suspects import (
    alarmed,
    behind,
    ending_words,
    first_signs,
    rest,
    sure_words,
    suspects,
)
from fdi.report.page.templates import templates
from fdi.report.stood_out import TITLE, stood_out_lines
from fdi.report.text import looked_at, onset
from fdi.report.timeline import is_grave, told_events, told_text
from fdi.report.words import (
    accuracies,
    at,
    budget,
    copied,
    flown,
    into_flight,
    latencies,
    log_time,
    number,
    unit,
    used,
    window,
)
from fdi.residuals.accuracy import reported_accuracies
from fdi.result import Analysis
from fdi.telemetry.counters import is_counter
from fdi.units import customary

MOST_EVENTS: Final = 400


def html_report(analysis: Analysis, document: Mapping[str, Any] | None = None) -> str:
    """Return the report as one self-contained HTML page.

    ``document``: what `analysis_document` returns, where it was made before.
    """
    from markupsafe import Markup

    environment = templates()
    components = analysis.system.components
    environment.filters["advised"] = advised_words
    environment.filters["part"] = lambda name: component_words(name, components)
    page = page_of(analysis)
    events, events_left = _events(analysis)
    states = states_of(analysis)
    return environment.get_template("report.html.j2").render(
        document=analysis_document(analysis) if document is None else document,
        page=page,
        frame=analysis.log.frame,
        csp=policy(),
        style=Markup(style()),
        plotting=Markup(script(PLOTTING)),
        script=Markup(script()),
        data=Markup(json_for_page(page.data)),
        ended=ending_words(last := last_end(analysis), len(analysis.log.flights)),
        end_advice=last.advice if last else about_no_flight(analysis.log, analysis.system),
        steps=first_steps(analysis, analysis.setup),
        signs=first_signs(last, analysis),
        alarmed=alarmed(analysis),
        states=[(name, words) for name, words in STATES.items() if name in states.values()],
        inputs=[(one.name, ", ".join(one.channels), used(one)) for one in analysis.log.inputs],
        copied=copied(analysis.system),
        latencies=latencies(analysis.lags),
        accuracies=accuracies(reported_accuracies(analysis.system, analysis.signals)),
        findings=_findings(page.findings, analysis),
        firsts=page.firsts,
        consequences=[
            (item, into_flight(item.onset, analysis.log), log_time(item.onset, analysis.log))
            for item in analysis.diagnosis.consequences
        ],
        events=events,
        events_left=events_left,
        residuals=_residuals(analysis),
        refused=_refused(analysis),
        parameters=analysis.log.parameters,
        changes=[one for one in analysis.log.parameter_changes if not is_counter(one.name)],
        defaults=analysis.log.defaults,
        altered=analysis.log.altered,
        net=safety_net(analysis.log),
        net_title=NET_TITLE,
        policy_text=analysis.policy.description,
        budget_text=budget(analysis),
        flown=flown(analysis.log.flights),
        agreements=analysis.diagnosis.methods,
        worth=worth_of(analysis.airframe),
        noticed=analysis.estimator.findings if analysis.estimator else (),
        stood_out=stood_out_lines(analysis),
        stood_out_title=TITLE,
        looked_at=looked_at(analysis),
        window_text=window(analysis),
        model_text=analysis.airframe.description,
        command=" ".join(map(_without_folder, analysis.command)),
    )


def _without_folder(word: str) -> str:
    """Return a word of the command; of a path the name alone: a page is handed on."""
    option, sign, value = word.rpartition("=")
    return f"{option}{sign}{PureWindowsPath(value).name or value}"  # knows both kinds of slash


def _findings(
    findings: Sequence[tuple[Finding, Shown | None]], analysis: Analysis
) -> list[dict[str, Any]]:
    whom = concerns(analysis.bank)
    return [
        {
            "value": finding,
            "name": component_words(finding.component, analysis.system.components),
            "what": telling_clause(
                finding.component,
                (finding.evidence.telling, *finding.evidence.residuals),
                analysis.bank,
            ),
            "sure": sure_words(finding, analysis.system.components),
            "suspects": (named := suspects(finding, analysis, whom)),
            "rest": rest(finding, named, analysis),
            "behind": behind(finding, analysis),
            "onset": onset(finding, analysis),
            "alarm": log_time(finding.alarm, analysis.log),
            "end": None if finding.end is None else log_time(finding.end, analysis.log),
            "shown": shown,
        }
        for finding, shown in findings
    ]


def _events(analysis: Analysis) -> tuple[list[dict[str, Any]], int]:
    log = analysis.log
    told, more = told_events(log, MOST_EVENTS)
    rows = [
        {
            "t": at(event.t),
            "at": round(event.t, 3),
            "level": level_of(event),
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
