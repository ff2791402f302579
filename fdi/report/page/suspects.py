"""How sure is an accusation, and what would have to be true if it was somebody else?

In: an analysis and a finding. Out: the second suspect, another component or nobody, what its guilt
would mean and what speaks against it; and why it was nobody else. The probabilities and the reasons
are the diagnosis' own (`fdi.diagnosis.others`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.diagnosis import Ending, Finding, First
from fdi.diagnosis.concerns import Concerns
from fdi.diagnosis.ending import led_to, went_wrong
from fdi.diagnosis.plain import alarm_clause, alarm_sentences, alarm_words
from fdi.model.naming import component_words, inside
from fdi.model.parts import Component
from fdi.report.words import at, per_cent
from fdi.result import Analysis
from fdi.telemetry.airtime import when_in_air
from fdi.telemetry.impact import HARD_SPEED

SOON: Final = 10.0
"""s after the onset that count for it."""
NEGLIGIBLE: Final = 0.005
MOST_SIGNS: Final = 5
MOST_ALARMED: Final = 2
"""Parts with alarms of which it is told at length why they are not accused."""
NOTHING: Final = "nothing that the tests show speaks against it"
_SAYS: Final = ("alarm", "event", "trigger", "command")
_HOW: Final = {
    "landed": "It landed.",
    "restarted": "The autopilot started anew in the air; what became of the vehicle is not known.",
    "in_air": "The recording stops in flight.",
    "failsafe": "After a failsafe: the autopilot reports one in this flight.",
    "on_ground": "It never left the ground.",
    "tipped_over": "It tipped over on the ground.",
    "control_lost": "Out of control as the flight ends; no blow is seen.",
}


@dataclass(frozen=True, slots=True)
class Suspect:
    """Who else it may have been, how probable that is, what would have to be true, what is not."""

    name: str
    share: float
    asks: tuple[str, ...]
    against: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Rest:
    """Why it was nobody else either.

    Attributes
    ----------
    alarmed : tuple of (str, float, tuple of str)
        Parts about which tests alarmed: name, from when on, s, what speaks against it.
    more, quiet : tuple of str
        Further such parts, and those of which no test alarmed.
    """

    alarmed: tuple[tuple[str, float, tuple[str, ...]], ...]
    more: tuple[str, ...]
    quiet: tuple[str, ...]


def ending_words(ending: Ending | None, flights: int = 1) -> str:
    """Return how a flight ended, as a sentence or two, and which of them it is."""
    if ending is not None and flights > 1:
        return f"Flight {ending.end.flight + 1} of {flights}: {ending_words(ending)}"
    if ending is None:
        return "No flight is seen in this log."
    end = ending.end
    if end.how == "impact":
        speed = end.how_fast
        what = "hit the ground" if end.is_seen else "fell"
        when = f"log {at(end.at)} s" if end.is_seen else f"as the log ends, {at(end.at)} s"
        said = f"It {what}{speed}, {when}."
    elif end.how == "landed" and end.speed is not None and end.speed > HARD_SPEED:
        said = f"It came down at {end.speed:.1f} m/s, harder than a landing, and lies still."
    else:
        said = _HOW[end.how]
    if end.lost_control is not None:
        before = end.at - end.lost_control
        what = end.loss[0].upper() + end.loss[1:]
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
    asks = []
    if explained:
        telling = max(explained, key=lambda row: _peak(analysis, row, finding.onset))
        clause = alarm_clause(name, analysis.bank.generators[telling], system)
        asks.append(clause if clause.startswith("it ") else f"what it disturbs: {clause}")
    against = next((one.against for one in finding.others if one.component == name), ())
    words = component_words(name, system.components)
    return Suspect(words, share, tuple(asks), against or (NOTHING,))


def _nobody(share: float, *, is_alone: bool) -> Suspect:
    asks = (
        "every part worked, and what the tests show came from outside the model: wind, ground, "
        "the pilot, or a vehicle unlike its model"
    )
    alone = ("none of these alarms concerns another part",) if is_alone else ()
    return Suspect("no part at all", share, (asks, *alone), ())


def _peak(analysis: Analysis, row: int, onset: float) -> float:
    t = analysis.alarms.residuals.t
    own = analysis.alarms.strength[row, (t >= onset - 1.0) & (t <= onset + SOON)]
    known = own[np.isfinite(own)]
    return float(known.max()) if known.size else 0.0


def rest(finding: Finding, told: Sequence[Suspect], analysis: Analysis) -> Rest:
    """Return why it was none of those who are neither accused, suspects nor ruled out.

    Parameters
    ----------
    finding : Finding
    told : sequence of Suspect
        Of this finding.
    analysis : Analysis
    """
    components = analysis.system.components
    done = {one.name for one in told}
    done |= {component_words(one.component, components) for one in analysis.ruled_out}
    left = [(component_words(o.component, components), o) for o in finding.others]
    alarmed = [(name, o.alarm, o.against) for name, o in left if o.alarm is not None]
    alarmed = [one for one in alarmed if one[0] not in done]
    quiet = [name for name, o in left if o.alarm is None and o.against and name not in done]
    return Rest(
        tuple(alarmed[:MOST_ALARMED]),
        tuple(name for name, _, _ in alarmed[MOST_ALARMED:]),
        tuple(quiet),
    )


def does_as_well_as_its_parts(component: Component | None) -> bool:
    """Return whether a component is a program, which does as well as what it works with."""
    return component is not None and (component.computed or component.group == "autopilot")


def behind(finding: Finding, analysis: Analysis) -> tuple[str, ...]:
    """Return what directly disturbs an accused program when it fails, and is not ruled out.

    A controller does as well as the parts it works with: to accuse it asks what is behind it.
    """
    components = analysis.system.components
    if not does_as_well_as_its_parts(components.get(finding.component)):
        return ()
    cleared = {one.component for one in analysis.ruled_out}
    return tuple(
        component_words(name, components)
        for name in components
        if name not in cleared and finding.component in components[name].affects
    )


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


def first_signs(ending: Ending | None, analysis: Analysis) -> list[First]:
    """Return what happened first before a flight went wrong, `MOST_SIGNS` at most.

    What the last seconds show (`Ending.first`), and what somebody is accused of since longer. What
    concerns the accused goes before all else; then alarms and what the autopilot reports, then what
    passed, then what somebody asked for.
    """
    if ending is None or not ending.end.is_bad:
        return []
    end = ending.end
    accused = [one for one in analysis.findings if led_to(end, one.flight, one.end)]
    told = {one.text: one for one in ending.first}
    for sign in (_sign(one, analysis) for one in accused if one.onset <= went_wrong(end)):
        if sign is not None:
            known = told.get(sign.text, sign)
            told[sign.text] = replace(known, at=min(known.at, sign.at))
    whom = {one.component for one in accused}
    order = sorted(
        told.values(), key=lambda o: (o.component not in whom, _SAYS.index(o.kind), o.at)
    )
    return sorted(order[:MOST_SIGNS], key=lambda one: one.at)


def alarmed(analysis: Analysis) -> list[tuple[float, str]]:
    """Return what alarmed in the air though nobody is accused: from when on, s, and what it says.

    In the order of time; alarms that say the same are told once.
    """
    if analysis.findings:
        return []
    alarms, says = analysis.alarms, alarm_sentences(analysis.bank)
    raised = alarms.alarm & when_in_air(analysis.signals)
    told: dict[str, float] = {}
    for row in map(int, np.flatnonzero(raised.any(axis=1))):
        at = float(alarms.residuals.t[int(np.argmax(raised[row]))])
        told[says[row]] = min(at, told.get(says[row], at))
    return sorted((at, text) for text, at in told.items())


def _sign(finding: Finding, analysis: Analysis) -> First | None:
    """Return what a finding rests on as a first sign, None where no test of the bank tells it."""
    by_id = {generator.id: generator for generator in analysis.bank.generators}
    tests = (finding.evidence.telling, *finding.evidence.residuals)
    known = next((by_id[name] for name in tests if name in by_id), None)
    if known is None:
        return None
    text = alarm_words(finding.component, known, analysis.system)
    return First(finding.onset, "alarm", text, finding.component)
