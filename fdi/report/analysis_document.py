"""What does ``analysis.json`` say?

In: an analysis. Out: plain values: keys in a fixed order, the same bytes for the same input,
timings and command line aside. The JSON Schema is ``analysis.schema.json`` beside this file.
"""

from __future__ import annotations

import math
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

import numpy as np

from fdi.diagnosis import Ending, Finding, Size, runs
from fdi.model import System
from fdi.model.system import Estimate, ParameterValue
from fdi.report.advice_text import advice_rows, first_advice
from fdi.report.check_document import check_rows, net_rows
from fdi.report.json_text import number
from fdi.report.log_document import input_rows, log_facts, moment, quality_rows
from fdi.report.methods_document import methods_document
from fdi.report.model_document import isolability_rows, model_files
from fdi.residuals.accuracy import Told, reported_accuracies
from fdi.residuals.departed import departed
from fdi.residuals.latency import Lag
from fdi.result import Analysis
from fdi.telemetry import Log, hardware_of
from fdi.telemetry.ordered import order_words, set_in_flight

SCHEMA_VERSION: Final = 1
# Reading (pymavlink's dialect, numba's walks), models, equations, the Earth's field, the tables.
LIBRARIES: Final = (
    "numba",
    "numpy",
    "pandas",
    "pint",
    "pydantic",
    "pygeomag",
    "pymavlink",
    "ruamel.yaml",
    "scipy",
    "sympy",
)


def analysis_document(analysis: Analysis) -> dict[str, Any]:
    """Return an analysis as plain values; numbers are finite or null."""
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {
            "name": "uav-fdi",
            "version": analysis.version,
            "command": list(analysis.command),
            "libraries": libraries(),
        },
        "log": log_facts(analysis.log),
        "model": _model(analysis),
        "policy": {
            "name": analysis.policy.name,
            "sha256": analysis.policy.sha256,
            "budget_per_hour": number(analysis.policy.budget_per_hour),
            "threshold_scale": number(analysis.alarms.scale),
        },
        "hardware": _hardware(analysis.log),
        "inputs": input_rows(analysis.log),
        "quality": quality_rows(analysis.log),
        "copies": _copies(analysis.system),
        "latencies": [_latency(lag) for lag in analysis.lags],
        "accuracies": [
            _accuracy(one) for one in reported_accuracies(analysis.system, analysis.signals)
        ],
        "structure": _structure(analysis),
        **_told(analysis),
        "parameter_changes": [
            {
                "at": moment(event.t, analysis.log),
                "name": event.text,
                "old": number(event.before),
                "new": number(event.value),
                "by": event.by,
            }
            for event in set_in_flight(analysis.log.events, analysis.log.flights)
        ],
        "stood_out": [
            {"about": fact.about, "text": fact.text, "is_wrong": fact.is_wrong}
            for fact in analysis.stood_out
        ],
        "setup": check_rows(analysis.setup),
        "safety_net": net_rows(analysis.log),
        "fault_grid": _grid(analysis),
        "residuals": _residuals(analysis),
        "methods": methods_document(analysis),
        "warnings": list(analysis.warnings),
        "timings_s": {stage: round(seconds, 4) for stage, seconds in analysis.timings.items()},
    }


def _told(analysis: Analysis) -> dict[str, Any]:
    """Return what the diagnosis says in words, and of whom."""
    diagnosis = analysis.diagnosis
    return {
        "verdict": diagnosis.verdict,
        "outlook": diagnosis.outlook,
        "advice": advice_rows(first_advice(analysis)),
        "findings": [_finding(finding, analysis) for finding in diagnosis.findings],
        "consequences": [
            {
                "component": item.component,
                "faults": list(item.faults),
                "onset": moment(item.onset, analysis.log),
                "because_of": item.because_of,
                "text": item.text,
            }
            for item in diagnosis.consequences
        ],
        "ruled_out": [
            {
                "component": item.component,
                "text": item.text,
                "residuals": list(item.residuals),
                "would_show": [
                    {
                        "fault": one.fault,
                        "size": number(one.size),
                        "unit": one.unit,
                        "how": one.how,
                    }
                    for one in item.would_show
                ],
            }
            for item in diagnosis.ruled_out
        ],
        "open": [{"component": item.component, "text": item.text} for item in diagnosis.open],
        "together": [
            {
                "flight": item.flight,
                "tests": item.tests,
                "diagnoses": [list(one) for one in item.diagnoses],
            }
            for item in diagnosis.together
        ],
        "departed": _departed(analysis),
        "ends": [_ending(item) for item in diagnosis.endings],
        "not_testable": [
            {
                "component": item.component,
                "text": item.text,
                "advice": advice_rows(item.advice),
            }
            for item in diagnosis.not_testable
        ],
    }


def _hardware(log: Log) -> dict[str, Any]:
    """Return which parts the log names, and the kinds of which it names none."""
    found = hardware_of(log)
    rows = [{"kind": p.kind, "what": p.what, "told_by": p.told_by} for p in found.parts]
    return {"found": rows, "not_told": list(found.not_told)}


def _departed(analysis: Analysis) -> dict[str, Any] | None:
    found = departed(analysis.residual_values)
    if found is None:
        return None
    return {
        "share": number(found.share),
        "parameters": list(found.parameters),
        "tests": [
            {
                "component": one.component,
                "test": one.test,
                "value": number(one.value),
                "std": number(one.std),
            }
            for one in found.tests
        ],
        "text": found.text,
    }


def _ending(item: Ending) -> dict[str, Any]:
    end = item.end
    return {
        "flight": end.flight,
        "how": end.how,
        "at_s": number(end.at),
        "speed": number(end.speed),
        "over_ground": number(end.over_ground),
        "lost_control_s": number(end.lost_control),
        "lost_by": end.lost_by,
        "is_seen": end.is_seen,
        "first": [
            {"at_s": number(one.at), "kind": one.kind, "text": one.text} for one in item.first
        ],
        "chain": [
            {"t_s": number(one.t), "what": one.what, "by": one.by, "text": order_words(one)}
            for one in end.chain
        ],
        "advice": advice_rows(item.advice),
    }


def libraries() -> dict[str, str]:
    """Return the versions of the libraries on which the figures of an analysis depend.

    They are read from what was installed, without importing anything; one that is not there (an
    optional one) is left out.
    """
    found: dict[str, str] = {}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _model(analysis: Analysis) -> dict[str, Any]:
    return {
        "name": analysis.airframe.name,
        "sha256": analysis.airframe.sha256,
        "files": model_files(analysis.airframe),
        "parameters": {name: _parameter(p) for name, p in analysis.system.parameters.items()},
    }


def _parameter(own: ParameterValue) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "value": number(own.value),
        "unit": own.unit,
        "source": own.source,
        "std": number(own.std),
    }
    if own.learned is not None:
        entry["learned"] = _estimate(own.learned) | {"flights": own.learned.flights}
        if own.flight is not None:
            entry["flight"] = _estimate(own.flight)
    return entry


def _estimate(told: Estimate) -> dict[str, Any]:
    return {"value": number(told.value), "std": number(told.std)}


def _copies(system: System) -> list[dict[str, Any]]:
    """Return the channels that repeat another one, a row each."""
    return [
        {
            "channel": str(copy.channel),
            "of": str(copy.of),
            "scale": number(copy.scale),
            "offset": number(copy.offset),
            "share": number(copy.share),
            "records": copy.records,
            "without": [name for name, by in system.implied.items() if by == copy],
        }
        for copy in system.copies
    ]


def _latency(lag: Lag) -> dict[str, Any]:
    known = math.isfinite(lag.value)
    return {
        "message": lag.source,
        "component": lag.component,
        "against": list(lag.against),
        "stated_s": number(lag.stated),
        "estimated_s": number(lag.stated + lag.value) if known else None,
        "sigma_s": number(lag.sigma),
        "pieces": number(lag.blocks),
        "used": lag.used,
        "why": lag.why,
    }


def _accuracy(one: Told) -> dict[str, Any]:
    return {
        "channel": str(one.channel),
        "unit": one.unit,
        "stated": number(one.stated),
        "reported": number(one.reported),
        "used": number(one.used),
        "worst": number(one.worst),
        "bounded": number(one.bounded),
    }


def _structure(analysis: Analysis) -> dict[str, Any]:
    diagnosis = analysis.diagnosis
    return {
        "equations": len(analysis.system.equations),
        "unknowns": len(analysis.system.unknowns),
        "faults": len(analysis.system.faults),
        "redundancy": diagnosis.decomposition.redundancy,
        "graph_components": diagnosis.graph_components,
        "residual_generators": len(analysis.bank.generators),
        **isolability_rows(diagnosis.implementable),
        "structural": isolability_rows(diagnosis.structural),
    }


def _finding(finding: Finding, analysis: Analysis) -> dict[str, Any]:
    return {
        "rank": finding.rank,
        "flight": finding.flight,
        "component": finding.component,
        "faults": list(finding.faults),
        "kind": finding.kind,
        "onset": moment(finding.onset, analysis.log),
        "alarm": moment(finding.alarm, analysis.log),
        "end": moment(finding.end, analysis.log),
        "earlier": _rounded([[start, end] for start, end in finding.earlier]),
        "confidence": number(finding.confidence),
        "inseparable_from": list(finding.inseparable_from),
        "evidence": {
            "text": finding.evidence.text,
            "residuals": list(finding.evidence.residuals),
            "channels": list(finding.evidence.channels),
        },
        "because": [
            {"feature": one.feature, "text": one.words, "weight": number(one.weight)}
            for one in finding.because
        ],
        "rivals": [
            {"component": name, "probability": number(share)} for name, share in finding.rivals
        ],
        "others": [
            {
                "component": one.component,
                "alarm": moment(one.alarm, analysis.log),
                "against": list(one.against),
            }
            for one in finding.others
        ],
        "size": None if finding.size is None else _size(finding.size, analysis.log),
        "advice": advice_rows(finding.advice),
    }


def _size(size: Size, log: Log) -> dict[str, Any]:
    return {
        "channel": size.channels[0],
        "also": list(size.channels[1:]),
        "against": list(size.against),
        "shape": size.shape,
        "value": number(size.value),
        "sigma": number(size.sigma),
        "unit": size.unit if size.shape == "bias" else f"{size.unit}/s",
        "since": moment(size.since, log),
        "shown": None
        if size.shown is None
        else {
            "value": number(size.shown),
            "unit": size.shown_unit if size.shape == "bias" else f"{size.shown_unit}/s",
        },
    }


def _rounded(intervals: list[list[float]]) -> list[list[float | None]]:
    return [[number(edge) for edge in interval] for interval in intervals]


def _grid(analysis: Analysis) -> dict[str, Any]:
    grid = analysis.diagnosis.grid
    return {
        "t": [number(t) for t in grid.t],
        "rows": [
            {
                "fault": fault,
                "component": grid.components[row],
                "group": grid.groups[row],
                "intervals": _rounded(grid.intervals(row, 1)),
                "unknown": _rounded(grid.intervals(row, -1)),
            }
            for row, fault in enumerate(grid.faults)
        ],
    }


def _residuals(analysis: Analysis) -> list[dict[str, Any]]:
    names = [equation.name for equation in analysis.system.equations]
    signatures = analysis.bank.signature_names()
    rows: list[dict[str, Any]] = []
    for row, generator in enumerate(analysis.bank.generators):
        threshold = analysis.alarms.threshold[row]
        known = threshold[np.isfinite(threshold)]
        rows.append(
            {
                "id": generator.id,
                "equations": [names[i] for i in generator.equations],
                "signature": list(signatures[row]),
                "threshold": number(float(np.median(known))) if len(known) else None,
                "triggered": _rounded(runs(analysis.signals.t, analysis.alarms.state[row] == 1)),
                "status": "ok",
                "why": "",
                "reason": None,
            }
        )
    for place, refused in enumerate(analysis.bank.not_implementable, 1):
        rows.append(
            {
                "id": f"n{place}",
                "equations": [names[i] for i in refused.equations],
                "signature": list(refused.faults),
                "threshold": None,
                "triggered": [],
                "status": "not implementable",
                "why": refused.why,
                "reason": refused.reason.value,
            }
        )
    return rows
