"""Which components failed first, what follows, what is ruled out, what was not testable?

The diagnose stage: ``Alarms`` + ``Bank`` -> ``Diagnosis``. Only alarms that begin in flight count,
between take-off and landing, and never after an impact: what breaks then is no cause.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fdi import structure
from fdi.decision import Alarms
from fdi.decision.accusing import WEIGHING_S
from fdi.decision.concerns import concerns
from fdi.decision.noise import airborne_mask
from fdi.diagnosis.confidence import grounds_of, load_confidence
from fdi.diagnosis.episodes import Run, episodes, find_runs
from fdi.diagnosis.explain import channels_of, evidence, kind_of, size_in_words, verdict
from fdi.diagnosis.isolability import implementable_isolability, structural_isolability
from fdi.diagnosis.marking import fault_grid
from fdi.diagnosis.passing import is_no_failure
from fdi.diagnosis.ranking import Cause, Effect, explain_episode
from fdi.diagnosis.size import size_of
from fdi.diagnosis.values import (
    MARKED,
    Consequence,
    Diagnosis,
    FaultGrid,
    Finding,
    Isolability,
    NotTestable,
    RuledOut,
)
from fdi.model.parts import Kind
from fdi.residuals import Bank
from fdi.telemetry.airtime import time_in_air

MERGE_S = 15.0
"""A component accused again within this time is one finding: its alarms merely paused."""
KNOWN_SHARE = 0.8
KNOWN_S = 2.0
"""A test rules out only if it was known for at least this share of the time in the air, and this
long: an alarm needs 1.5 s."""


def diagnose(alarms: Alarms, bank: Bank) -> Diagnosis:
    """Return the diagnosis.

    Parameters
    ----------
    alarms : Alarms
    bank : Bank
        The bank that the alarms come from.
    """
    implementable = implementable_isolability(bank)
    structural = structural_isolability(bank.system)
    model = bank.system.structure()
    grid = fault_grid(alarms)
    findings: tuple[Finding, ...] = ()
    consequences: tuple[Consequence, ...] = ()
    ruled_out: tuple[RuledOut, ...] = ()
    if alarms.use.accuse:
        findings, consequences = _accuse(alarms)
        named = {f.component for f in findings} | {c.component for c in consequences}
        named |= {name for f in findings for name in f.inseparable_from}
        ruled_out = _ruled_out(alarms, bank, named | _marked(grid) | bank.system.curtailed)
    raised = int(alarms.alarm.any(axis=1).sum())
    testable = int((alarms.state != -1).any(axis=1).sum())
    flew = bool(np.any(alarms.residuals.signals.state.airborne))
    return Diagnosis(
        verdict=verdict(
            findings,
            accuses=alarms.use.accuse,
            testable=testable,
            tests=len(alarms.state),
            raised=raised,
            flew=flew,
        ),
        findings=findings,
        consequences=consequences,
        ruled_out=ruled_out,
        not_testable=_not_testable(alarms, bank, implementable, flew=flew),
        grid=grid,
        implementable=implementable,
        structural=structural,
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
    return causes, effects


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
        cause = next(f for f in reversed(findings) if f.component == name and f.onset <= onset)
        first = min(run.onset for run in effect.runs)
        later = first - cause.onset
        when = f"{abs(later):.1f} s {'after' if later >= 0 else 'before'} {name}"
        text = f"{effect.component} shows it {when}"
        faults = tuple(fault for fault in effect.faults if not fault.startswith("@"))
        result.append(Consequence(effect.component, faults, first, cause.rank, text))
    return tuple(sorted(result, key=lambda item: (item.onset, item.component)))


def _ruled_out(alarms: Alarms, bank: Bank, named: set[str]) -> tuple[RuledOut, ...]:
    """Return the components all of whose testable faults have a test that ran and stayed quiet."""
    signals = alarms.residuals.signals
    flying = airborne_mask(signals)
    known = (alarms.state[:, flying] != -1).sum(axis=1)
    least = max(KNOWN_SHARE * flying.sum(), KNOWN_S * signals.rate_hz)
    quiet = (known >= least) & ~alarms.alarm.any(axis=1)
    holds = bank.incidence
    result = []
    for component, columns in _by_component(bank).items():
        testable = [c for c in columns if holds[:, c].any()]
        tests = [np.flatnonzero(holds[:, c] & quiet) for c in testable]
        if component in named or not tests or not all(len(rows) for rows in tests):
            continue
        rows = list(dict.fromkeys(int(row) for own in tests for row in own[:2]))
        channels = dict.fromkeys(
            channel for row in rows for channel in channels_of(bank, bank.generators[row])
        )
        shown = ", ".join(list(channels)[:4]) + (" ..." if len(channels) > 4 else "")
        text = f"every testable fault has a test that ran and raised no alarm ({shown})"
        result.append(RuledOut(component, text, tuple(bank.generators[row].id for row in rows)))
    return tuple(sorted(result, key=lambda item: item.component))


def _marked(grid: FaultGrid) -> set[str]:
    """Return the components of which a fault is marked at any time."""
    marked = (grid.marks == MARKED).any(axis=1)
    return {name for name, seen in zip(grid.components, marked, strict=True) if seen}


def _by_component(bank: Bank) -> Mapping[str, list[int]]:
    found: dict[str, list[int]] = {}
    for column, fault in enumerate(bank.system.faults):
        found.setdefault(fault.component, []).append(column)
    return found


def _not_testable(
    alarms: Alarms, bank: Bank, implementable: Isolability, *, flew: bool
) -> tuple[NotTestable, ...]:
    system = bank.system
    present = _by_component(bank)
    ran = (alarms.state != -1).any(axis=1)
    concerned: dict[str, list[int]] = {}
    for row, generator in enumerate(bank.generators):
        whom = system.equations[generator.residual].component
        if whom is not None:
            concerned.setdefault(whom, []).append(row)
    result = []
    for name in system.components:
        columns = present.get(name, [])
        seen = [c for c in columns if implementable.detectable[c]]
        if name == "outside_model" or (not columns and ran[concerned.get(name, [])].any()):
            continue
        if not columns and name not in concerned:
            text = "no channel in this log shows it"
        elif columns and not seen:
            names = ", ".join(system.faults[c].name for c in columns[:4])
            text = f"its channels are in no test that this telemetry allows ({names})"
        elif not any((bank.incidence[:, c] & ran).any() for c in seen):
            text = "its tests never had all their inputs"
            text += "" if flew else ", or hold in the air only"
        else:
            continue
        result.append(NotTestable(name, text))
    return tuple(result)
