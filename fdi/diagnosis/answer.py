"""Which components failed first, what follows, what is ruled out, what was not testable?

The diagnose stage: ``Alarms`` + ``Bank`` -> ``Diagnosis``. Only alarms that begin in flight count,
between take-off and landing, and never after an impact: what breaks then is no cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fdi import structure
from fdi.decision import Alarms
from fdi.decision.accusing import WEIGHING_S
from fdi.decision.concerns import concerns
from fdi.diagnosis.clearing import ruled_out
from fdi.diagnosis.confidence import grounds_of, load_confidence
from fdi.diagnosis.ending import endings, led_to
from fdi.diagnosis.episodes import Run, episodes, find_runs
from fdi.diagnosis.explain import evidence, kind_of, size_in_words
from fdi.diagnosis.isolability import implementable_isolability, structural_isolability
from fdi.diagnosis.marking import fault_grid
from fdi.diagnosis.passing import is_no_failure
from fdi.diagnosis.ranking import Cause, Effect, explain_episode
from fdi.diagnosis.size import size_of
from fdi.diagnosis.undecided import left_open, not_testable
from fdi.diagnosis.values import (
    MARKED,
    Consequence,
    Diagnosis,
    FaultGrid,
    Finding,
    Open,
    RuledOut,
)
from fdi.diagnosis.verdict import count_tests, outlook, verdict
from fdi.model.parts import Kind
from fdi.residuals import Bank
from fdi.telemetry.airtime import time_in_air

MERGE_S = 15.0
"""A component accused again within this time is one finding: its alarms merely paused."""


def diagnose(alarms: Alarms, bank: Bank) -> Diagnosis:
    """Return the diagnosis.

    Parameters
    ----------
    alarms : Alarms
    bank : Bank
        The bank that the alarms come from.
    """
    implementable = implementable_isolability(bank)
    model = bank.system.structure()
    grid = fault_grid(alarms)
    ended = endings(alarms)
    findings: tuple[Finding, ...] = ()
    consequences: tuple[Consequence, ...] = ()
    cleared: tuple[RuledOut, ...] = ()
    undecided: tuple[Open, ...] = ()
    flew = bool(np.any(alarms.residuals.signals.state.airborne))
    untested = not_testable(alarms, bank, implementable, flew=flew)
    if alarms.use.accuse:
        findings, consequences = _accuse(alarms)
        named = {f.component for f in findings} | {c.component for c in consequences}
        named |= {name for f in findings for name in f.inseparable_from}
        cleared = ruled_out(alarms, bank, named | _marked(grid) | bank.system.curtailed)
        told = named | {one.component for one in cleared} | {one.component for one in untested}
        undecided = left_open(alarms, told)
    tests = count_tests(alarms)
    return Diagnosis(
        verdict=verdict(findings, consequences, ended, tests, alarms),
        outlook=outlook(findings, ended, tests, alarms),
        endings=ended,
        findings=findings,
        consequences=consequences,
        ruled_out=cleared,
        open=undecided,
        not_testable=untested,
        grid=grid,
        implementable=implementable,
        structural=structural_isolability(bank.system),
        decomposition=structure.decompose(model),
        graph_components=len(structure.graph_components(model)),
    )


def _accuse(alarms: Alarms) -> tuple[tuple[Finding, ...], tuple[Consequence, ...]]:
    causes, effects = _explained(alarms)
    findings = tuple(
        _finding(rank, number, span, cause, alarms)
        for rank, (number, span, cause) in enumerate(causes, 1)
    )
    return findings, _consequences(effects, findings)


def strongest(alarms: Alarms) -> list[tuple[str, float, float]]:
    """Return component, onset, s, and greatest strength of every finding by tests of noise.

    How far a limit is violated says nothing about noise: limits and equalities are left out.
    """
    bank = alarms.residuals.bank
    kinds = [bank.system.equations[generator.residual].kind for generator in bank.generators]
    return [
        (
            cause.component,
            cause.runs[0].onset,
            max(
                (r.peak for r in cause.runs if kinds[r.row] not in (Kind.LIMIT, Kind.EQUALITY)),
                default=0.0,
            ),
        )
        for _, _, cause in _explained(alarms)[0]
    ]


def accusations(alarms: Alarms) -> list[tuple[int, str]]:
    """Return the number of the flight and the component of every finding."""
    return [(number, cause.component) for number, _, cause in _explained(alarms)[0]]


def _explained(
    alarms: Alarms,
) -> tuple[list[tuple[int, tuple[float, float], Cause]], list[Effect]]:
    """Return the causes with the number and the span, s, of their flight, and what follows."""
    causes: list[tuple[int, tuple[float, float], Cause]] = []
    effects: list[Effect] = []
    for number, (start, end) in enumerate(time_in_air(alarms.residuals.signals)):
        own, follows = _of_flight(alarms, find_runs(alarms, start, end), end)
        causes += [(number, (start, end), cause) for cause in own]
        effects += follows
    causes.sort(key=lambda item: (item[2].runs[0].onset, -item[2].share, item[2].component))
    fatal = [item for item in causes if _led_to_the_end(item, alarms)]
    return [*fatal, *(item for item in causes if item not in fatal)], effects


def _led_to_the_end(item: tuple[int, tuple[float, float], Cause], alarms: Alarms) -> bool:
    """Return whether a cause still stood when the last flight that went wrong did."""
    bad = [one for one in alarms.residuals.signals.ends if one.is_bad]
    number, _, cause = item
    return bool(bad) and led_to(bad[-1], number, max(run.end for run in cause.runs))


def _of_flight(alarms: Alarms, runs: Sequence[Run], end: float) -> tuple[list[Cause], list[Effect]]:
    """Return the causes of a flight's runs, and what follows.

    From what is no failure nothing follows: the rest is explained without it.
    """
    while True:
        causes: list[Cause] = []
        effects: list[Effect] = []
        for episode in episodes(runs):
            found, following = explain_episode(alarms, episode)
            causes += found
            effects += following
        causes = _merged(causes)
        dropped = {
            run for cause in causes if is_no_failure(cause, end, alarms) for run in cause.runs
        }
        if not dropped:
            return causes, effects
        runs = [run for run in runs if run not in dropped]


def _merged(causes: list[Cause]) -> list[Cause]:
    """Return the causes with those of one component that nearly touch made one."""
    result: list[Cause] = []
    for cause in causes:
        earlier = next(
            (
                i
                for i, known in enumerate(result)
                if known.component == cause.component
                and cause.runs[0].onset - max(run.end for run in known.runs) <= MERGE_S
            ),
            None,
        )
        if earlier is None:
            result.append(cause)
            continue
        known = result[earlier]
        result[earlier] = Cause(
            known.component,
            tuple(dict.fromkeys((*known.faults, *cause.faults))),
            tuple(sorted((*known.runs, *cause.runs), key=lambda run: (run.onset, run.row))),
            known.share,
            known.inseparable,
        )
    return result


def _finding(
    rank: int, number: int, span: tuple[float, float], cause: Cause, alarms: Alarms
) -> Finding:
    over = max(run.end for run in cause.runs)
    onset = cause.runs[0].onset
    soon = [run.row for run in cause.runs if run.onset <= onset + WEIGHING_S]
    size = size_of(alarms, cause.component, soon, onset, span)
    shown = evidence(cause, alarms)
    grounds = grounds_of(cause, concerns(alarms.residuals.bank))
    if size is not None:
        shown = replace(shown, text=f"{shown.text}; {size_in_words(size)}")
    return Finding(
        rank=rank,
        flight=number,
        component=cause.component,
        faults=_named(cause.faults, cause.runs, alarms),
        kind=kind_of(cause, alarms),
        onset=onset,
        alarm=min(run.known for run in cause.runs),
        end=None if over >= span[1] else over,
        confidence=load_confidence().confidence(grounds),
        inseparable_from=cause.inseparable,
        evidence=shown,
        grounds=grounds,
        size=size,
    )


def _named(faults: tuple[str, ...], runs: tuple[Run, ...], alarms: Alarms) -> tuple[str, ...]:
    """Return faults by the names of the system; a statement stands for what its tests hold."""
    generators = alarms.residuals.bank.generators
    plain = [fault for fault in faults if not fault.startswith("@")]
    if len(plain) < len(faults):
        plain += [fault for run in runs for fault in generators[run.row].faults]
    return tuple(dict.fromkeys(plain))


def _consequences(effects: list[Effect], findings: tuple[Finding, ...]) -> tuple[Consequence, ...]:
    result = []
    for effect in effects:
        onset = effect.cause.runs[0].onset
        name = effect.cause.component
        cause = max(
            (f for f in findings if f.component == name and f.onset <= onset),
            key=lambda f: f.onset,
        )
        first = min(run.onset for run in effect.runs)
        later = first - cause.onset
        when = f"{abs(later):.1f} s {'after' if later >= 0 else 'before'} {name}"
        text = f"{effect.component} shows it {when}"
        faults = tuple(fault for fault in effect.faults if not fault.startswith("@"))
        result.append(Consequence(effect.component, faults, first, cause.rank, text))
    return tuple(sorted(result, key=lambda item: (item.onset, item.component)))


def _marked(grid: FaultGrid) -> set[str]:
    """Return the components of which a fault is marked at any time."""
    marked = (grid.marks == MARKED).any(axis=1)
    return {name for name, seen in zip(grid.components, marked, strict=True) if seen}
