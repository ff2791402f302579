"""How sure is an accusation, and what would have to be true if it was somebody else?

In: an analysis and a finding. Out: the second suspect, another component or nobody, and what its
guilt would ask of the tests: which alarms it explains, which it does not, which tests that hold it
stayed quiet. The probabilities are the diagnosis' own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.decision.alarms import UNKNOWN
from fdi.diagnosis import Ending, Finding, First
from fdi.diagnosis.concerns import Concerns
from fdi.diagnosis.plain import alarm_clause
from fdi.model.naming import component_words, inside
from fdi.model.parts import Component
from fdi.report.words import at, per_cent, plural
from fdi.result import Analysis

SOON: Final = 10.0
"""s after the onset in which a test that holds a component should have shown its fault."""
NEGLIGIBLE: Final = 0.005
MOST_SIGNS: Final = 4
_SAYS: Final = ("alarm", "trigger", "event", "command")
_HOW: Final = {
    "landed": "It landed.",
    "in_air": "The log ends in the air.",
    "failsafe": "After a failsafe that the autopilot reports.",
    "on_ground": "It never left the ground.",
    "control_lost": "Out of control; the log ends before it hits anything.",
}


@dataclass(frozen=True, slots=True)
class Suspect:
    """Who else it may have been, how probable that is, and what would have to be true."""

    name: str
    share: float
    asks: tuple[str, ...]


def ending_words(ending: Ending | None) -> str:
    """Return how a flight ended, as a sentence or two."""
    if ending is None:
        return "No flight is seen in this log."
    end = ending.end
    if end.how == "impact":
        speed = "" if end.speed is None else f" at {end.speed:.1f} m/s"
        said = f"It hit the ground{speed}, log {at(end.at)} s."
    else:
        said = _HOW[end.how]
    if end.lost_control is not None:
        before = end.at - end.lost_control
        what = "All motors stopped" if end.lost_by == "stop" else "Control was lost"
        said += f" {what} {before:.1f} s before (log {at(end.lost_control)} s)."
    return said


def suspects(finding: Finding, analysis: Analysis, whom: Concerns) -> list[Suspect]:
    """Return the other explanations of a finding's alarms, the more probable first.

    The most probable other component, and nobody; who is next to impossible only if nothing else
    is left to tell.
    """
    nobody = 1.0 - finding.confidence - sum(share for _, share in finding.rivals)
    found = [_nobody(max(nobody, 0.0), is_alone=not finding.rivals)]
    if finding.rivals:
        found.append(_rival(*max(finding.rivals, key=lambda one: one[1]), finding, analysis, whom))
    found.sort(key=lambda one: -one.share)
    return [one for one in found if one.share >= NEGLIGIBLE] or found[:1]


def _rival(
    name: str, share: float, finding: Finding, analysis: Analysis, whom: Concerns
) -> Suspect:
    place = {g.id: row for row, g in enumerate(analysis.bank.generators)}
    rows = [place[test] for test in finding.evidence.residuals if test in place]
    explained = [row for row in rows if name in whom.of(row)]
    system = analysis.system
    words = component_words(name, system.components)
    asks = []
    if explained:
        telling = max(explained, key=lambda row: _peak(analysis, row, finding.onset))
        clause = alarm_clause(name, analysis.bank.generators[telling], system)
        asks.append(clause if clause.startswith("it ") else f"what it disturbs: {clause}")
    left = len(rows) - len(explained)
    if left:
        asks.append(
            f"{left} of the {plural(len(rows), 'alarm')} would have another cause: "
            f"{'its test does' if left == 1 else 'their tests do'} not concern it"
        )
    quiet, judged = _silent(name, analysis, whom, finding.onset)
    if judged:
        asks.append(
            f"{quiet} of the {plural(judged, 'test')} that look at it stayed quiet all the same"
        )
    return Suspect(words, share, tuple(asks))


def _nobody(share: float, *, is_alone: bool) -> Suspect:
    asks = (
        "every part worked, and what the tests show came from outside the model: wind, ground, "
        "the pilot, or a vehicle unlike its model"
    )
    alone = ("none of these alarms concerns another part",) if is_alone else ()
    return Suspect("no part at all", share, (asks, *alone))


def _peak(analysis: Analysis, row: int, onset: float) -> float:
    t = analysis.alarms.residuals.t
    own = analysis.alarms.strength[row, (t >= onset - 1.0) & (t <= onset + SOON)]
    known = own[np.isfinite(own)]
    return float(known.max()) if known.size else 0.0


def _silent(component: str, analysis: Analysis, whom: Concerns, onset: float) -> tuple[int, int]:
    """Return how many tests that hold a component stayed quiet after an onset, and were judged."""
    alarms = analysis.alarms
    t = alarms.residuals.t
    soon = (t >= onset - 1.0) & (t <= onset + SOON)
    rows = [row for row in range(len(alarms.state)) if component in whom.held_by(row)]
    judged = [row for row in rows if (alarms.state[row, soon] != UNKNOWN).any()]
    return sum(not alarms.alarm[row, soon].any() for row in judged), len(judged)


def sure_words(finding: Finding, components: Mapping[str, Component]) -> str:
    """Return how sure an accusation is, and why, in sentences."""
    told = f"{per_cent(finding.confidence)} that it was this part"
    if finding.inseparable_from:
        names = (inside(component_words(one, components)) for one in finding.inseparable_from)
        told += f"; it cannot be told from {', '.join(names)}"
    sides = (("For it", 1.0), ("Against it", -1.0))
    terms = [
        (side, [t.words for t in finding.because if t.weight * way > 0]) for side, way in sides
    ]
    return " ".join([f"{told}.", *(f"{side}: {'; '.join(said)}." for side, said in terms if said)])


def first_signs(ending: Ending | None) -> list[First]:
    """Return what happened first in the seconds before a flight went wrong, `MOST_SIGNS` at most.

    What tests and the autopilot told goes before what somebody asked for.
    """
    if ending is None or not ending.end.is_bad:
        return []
    order = sorted(ending.first, key=lambda one: (_SAYS.index(one.kind), one.at))
    return sorted(order[:MOST_SIGNS], key=lambda one: one.at)
