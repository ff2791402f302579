"""What stands over the whole time axis? Modes as bands, events as marks, and the fault grid.

In: an analysis. Out: plain values for the browser.
"""

from __future__ import annotations

from typing import Any, Final

from fdi.diagnosis.values import MARKED, UNKNOWN
from fdi.model.naming import component_words
from fdi.report.figures import MOST_ROWS, marked_rows
from fdi.report.timeline import is_grave, told_events, told_text
from fdi.report.words import clean
from fdi.result import Analysis
from fdi.telemetry import Event, Log

MOST_MARKS: Final = 400
MOST_MODES: Final = 100
"""After a crash an old copter logs modes by the hundred: of more, those that nobody can see go."""
MOST_BARS: Final = 6000
"""Of the grid; a finer flicker is merged."""
FINEST: Final = 1500
"""Steps of the time axis below which bars are merged, where there are more."""
SEVERITY: Final[dict[str, int]] = {
    "impact": 2,
    "failsafe": 3,
    "command": 3,
    "sensor": 4,
    "reboot": 4,
    "takeoff": 5,
    "landing": 5,
    "arm": 5,
    "disarm": 5,
    "mode": 6,
    "text": 6,
}
"""MAVLink's, of events that state none."""
EDGES: Final = ("takeoff", "landing", "impact")


def extent(analysis: Analysis) -> tuple[float, float]:
    """Return from when to when the page's time axis goes, s: what the vehicle recorded."""
    low, high = analysis.log.span
    return (low, high) if high > low else (low, low + 1.0)


def modes(log: Log) -> list[tuple[float, float, str]]:
    """Return the flight modes with their times, s; one that is said again goes on."""
    events = [event for event in log.events if event.kind == "mode"]
    found: list[tuple[float, float, str]] = []
    ends = [*(event.t for event in events[1:]), log.span[1]][: len(events)]
    for event, later in zip(events, ends, strict=True):
        if found and found[-1][2] == clean(event.text):
            found[-1] = (found[-1][0], later, found[-1][2])
        else:
            found.append((event.t, later, clean(event.text)))
    shortest = (log.span[1] - log.span[0]) / FINEST if len(found) > MOST_MODES else 0.0
    return [one for one in found if one[1] - one[0] > shortest]


def level_of(event: Event) -> int:
    """Return how grave an event is, as MAVLink's severities: 0 is worst, 7 least."""
    return SEVERITY.get(event.kind, 6) if event.severity is None else event.severity


def marks(analysis: Analysis) -> list[dict[str, Any]]:
    """Return the events to mark, the onsets of findings among them, in the order of time."""
    told, _ = told_events(analysis.log, MOST_MARKS)
    components = analysis.system.components
    names = {f.component: component_words(f.component, components) for f in analysis.findings}
    found: list[dict[str, Any]] = [
        {
            "at": round(event.t, 3),
            "kind": event.kind,
            "level": level_of(event),
            "text": clean(told_text(event, times, last)) or event.kind,
            "grave": is_grave(event),
        }
        for event, times, last in told
    ]
    found += [
        {
            "at": round(finding.onset, 3),
            "kind": "onset",
            "level": 0,
            "text": clean(f"{finding.rank} {names[finding.component]}: onset"),
            "grave": True,
            "rank": finding.rank,
        }
        for finding in analysis.findings
    ]
    return sorted(found, key=lambda one: one["at"])


def grid_rows(analysis: Analysis) -> list[dict[str, Any]]:
    """Return the marked faults with when they were marked and unknown, s, as in the fault grid."""
    grid = analysis.diagnosis.grid
    accused = {finding.component for finding in analysis.findings}
    low, high = extent(analysis)
    rows: list[dict[str, Any]] = [
        {
            "fault": clean(grid.faults[row]),
            "name": _in_words(grid.faults[row], grid.components[row], analysis),
            "group": grid.groups[row],
            "accused": grid.components[row] in accused,
            "on": grid.intervals(row, MARKED),
            "off": grid.intervals(row, UNKNOWN),
        }
        for row in marked_rows(grid)[:MOST_ROWS]
    ]
    if sum(len(row["on"]) + len(row["off"]) for row in rows) > MOST_BARS:
        finest = (high - low) / FINEST
        for row in rows:
            row["on"], row["off"] = (_merged(row[kind], finest) for kind in ("on", "off"))
    for row in rows:
        for kind in ("on", "off"):
            row[kind] = [[round(edge, 2) for edge in bar] for bar in row[kind]]
    return rows


def _in_words(fault: str, component: str, analysis: Analysis) -> str:
    """Return a fault as a person tells it: whose it is, and which where a part has several."""
    whose = clean(component_words(component, analysis.system.components))
    return whose if fault == component else f"{whose}: {clean(fault)}"


def _merged(bars: list[list[float]], finest: float) -> list[list[float]]:
    """Return bars with gaps that nobody can see closed."""
    found: list[list[float]] = []
    for start, end in bars:
        if found and start - found[-1][1] < finest:
            found[-1][1] = end
        else:
            found.append([start, end])
    return found
