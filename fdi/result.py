"""What does an analysis hold, and what is it as JSON? The value that the corridor returns.

``Analysis`` keeps the value of every stage. :func:`document` turns it into ``analysis.json``
(``schema_version`` 1, its JSON Schema is ``fdi/report/analysis.schema.json``): numbers finite or
null, keys in a fixed order, the same bytes for the same input, timings and command line aside.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fdi.decision import Alarms, Policy
from fdi.diagnosis import Diagnosis, Ending, Finding, Isolability, Size, runs
from fdi.model import Airframe, System
from fdi.residuals import Bank, Residuals
from fdi.residuals.accuracy import Told, reported_accuracies
from fdi.residuals.latency import Lag
from fdi.telemetry import Log, Signals

if TYPE_CHECKING:
    import pandas

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


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """The value of every stage of one analysis.

    Attributes
    ----------
    lags : tuple of Lag
        How late sensors come against the estimator, by the log; none where the policy takes the
        model's word.
    writer : callable
        Writes the report; handed in by the corridor, because ``fdi.report`` lies above this room.
    timings : mapping of str to float
        Wall seconds of every stage.
    """

    log: Log
    airframe: Airframe
    policy: Policy
    system: System
    bank: Bank
    signals: Signals
    lags: tuple[Lag, ...]
    residual_values: Residuals
    alarms: Alarms
    diagnosis: Diagnosis
    warnings: tuple[str, ...]
    timings: Mapping[str, float]
    command: tuple[str, ...]
    version: str
    writer: Callable[[Analysis, Path, Sequence[str] | None, bool], Path] = field(repr=False)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return the accused components, causes before effects."""
        return self.diagnosis.findings

    @property
    def verdict(self) -> str:
        """Return the answer in one sentence."""
        return self.diagnosis.verdict

    @property
    def fault_grid(self) -> pandas.DataFrame:
        """Return the marks of every fault over time: index t, a column per fault."""
        return self.diagnosis.grid.frame()

    @property
    def isolability(self) -> pandas.DataFrame:
        """Return which fault is isolable from which, by the residual generators."""
        return self.diagnosis.implementable.frame()

    @property
    def residuals(self) -> pandas.DataFrame:
        """Return every residual over time, a column per generator."""
        return self.residual_values.frame()

    def document(self) -> dict[str, Any]:
        """Return what ``analysis.json`` holds."""
        return document(self)

    def report(
        self, out: str | Path, formats: Sequence[str] | None = None, *, force: bool = False
    ) -> Path:
        """Write the report into a folder and return the folder.

        Parameters
        ----------
        out : str or Path
        formats : sequence of str, optional
            Of ``html, json, csv, png, svg, txt, parquet``; by default all.
        force : bool
            Write into a folder that is not ours; no file in it that is not ours is lost.

        Raises
        ------
        OutputError
            The folder cannot be written, or is not ours.
        """
        return self.writer(self, Path(out), formats, force)

    def __repr__(self) -> str:
        return f"<Analysis of {self.log.name}: {self.verdict}>"


def document(analysis: Analysis) -> dict[str, Any]:
    """Return ``analysis.json`` as plain values; its schema is ``report/analysis.schema.json``."""
    diagnosis = analysis.diagnosis
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
        "quality": quality_rows(analysis.log),
        "copies": _copies(analysis.system),
        "latencies": [_latency(lag) for lag in analysis.lags],
        "accuracies": [
            _accuracy(one) for one in reported_accuracies(analysis.system, analysis.signals)
        ],
        "structure": _structure(analysis),
        "verdict": diagnosis.verdict,
        "outlook": diagnosis.outlook,
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
                    {"fault": one.fault, "size": number(one.size), "unit": one.unit}
                    for one in item.would_show
                ],
            }
            for item in diagnosis.ruled_out
        ],
        "open": [{"component": item.component, "text": item.text} for item in diagnosis.open],
        "ends": [_ending(item) for item in diagnosis.endings],
        "not_testable": [
            {"component": item.component, "text": item.text} for item in diagnosis.not_testable
        ],
        "fault_grid": _grid(analysis),
        "residuals": _residuals(analysis),
        "methods": {},
        "warnings": list(analysis.warnings),
        "timings_s": {stage: round(seconds, 4) for stage, seconds in analysis.timings.items()},
    }


def _ending(item: Ending) -> dict[str, Any]:
    end = item.end
    return {
        "flight": end.flight,
        "how": end.how,
        "at_s": number(end.at),
        "speed": number(end.speed),
        "lost_control_s": number(end.lost_control),
        "first": [
            {"at_s": number(one.at), "kind": one.kind, "text": one.text} for one in item.first
        ],
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
        "parameters": {
            name: {
                "value": number(value.value),
                "unit": value.unit,
                "source": value.source,
                "std": number(value.std),
            }
            for name, value in analysis.system.parameters.items()
        },
    }


def model_files(airframe: Airframe) -> list[dict[str, Any]]:
    """Return the files that a model was read from."""
    return [
        {"name": file.name, "sha256": file.sha256, "shipped": file.shipped}
        for file in airframe.files
    ]


def number(value: float | None) -> float | None:
    """Return a finite number rounded to nine significant digits, or None."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.9g}")


def moment(t: float | None, log: Log) -> dict[str, Any] | None:
    """Return a time of the log's clock with what it is since boot and in UTC."""
    if t is None:
        return None
    return {"log_s": number(t), "boot_s": number(log.clock.boot(t)), "utc": log.clock.utc(t)}


def log_facts(log: Log) -> dict[str, Any]:
    """Return what is said about a log itself: its name, vehicle, clock and flights."""
    return {
        "name": log.name,
        "sha256": log.sha256,
        "format": log.format,
        "bytes": log.bytes,
        "duration_s": number(log.duration),
        "vehicle": log.vehicle,
        "autopilot": log.autopilot,
        "firmware": log.firmware,
        "files": list(log.files),
        "recordings": [
            {
                "name": one.name,
                "format": one.format,
                "bytes": one.bytes,
                "sha256": one.sha256,
                "offset_s": number(one.offset),
                "uncertainty_s": number(one.uncertainty),
                "placed_by": one.placed_by,
                "messages": list(one.messages),
                "added": {key: list(fields) for key, fields in one.added.items()},
            }
            for one in log.recordings
        ],
        "system_id": log.system_id,
        "start_utc": log.clock.utc(0.0),
        "boot_offset_s": number(log.clock.boot(0.0)),
        "flights": [
            {
                "start_s": number(flight.start),
                "end_s": number(flight.end),
                "takeoff_s": number(flight.takeoff),
                "landing_s": number(flight.landing),
                "impact_s": number(flight.impact),
            }
            for flight in log.flights
        ],
    }


def quality_rows(log: Log) -> list[dict[str, Any]]:
    """Return what was lost or repaired in a log, a row each."""
    return [
        {
            "kind": record.kind,
            "channel": None if record.channel is None else str(record.channel),
            "start_s": number(record.start),
            "end_s": number(record.end),
            "count": record.count,
            "text": record.text,
        }
        for record in log.quality
    ]


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


def isolability_rows(value: Isolability) -> dict[str, Any]:
    """Return what can be seen and told apart, as strings of 0 and 1 per fault."""
    names = list(value.faults)
    return {
        "detectable": [n for n, seen in zip(names, value.detectable, strict=True) if seen],
        "undetectable": [n for n, seen in zip(names, value.detectable, strict=True) if not seen],
        "isolability": {
            "faults": names,
            "rows": ["".join("1" if cell else "0" for cell in row) for row in value.matrix],
        },
        "not_isolable_groups": [list(group) for group in value.groups],
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
        "confidence": number(finding.confidence),
        "inseparable_from": list(finding.inseparable_from),
        "evidence": {
            "text": finding.evidence.text,
            "residuals": list(finding.evidence.residuals),
            "channels": list(finding.evidence.channels),
        },
        "grounds": {
            "share": number(finding.grounds.share),
            "strength": number(finding.grounds.strength),
            "exclusive": finding.grounds.exclusive,
            "part": finding.grounds.part,
        },
        "size": None if finding.size is None else _size(finding.size, analysis.log),
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
