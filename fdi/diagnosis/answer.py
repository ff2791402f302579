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
from fdi.diagnosis.agreement import agreements
from fdi.diagnosis.alarm_runs import Run
from fdi.diagnosis.clearing import ruled_out
from fdi.diagnosis.ending import endings, led_to
from fdi.diagnosis.episodes import joined
from fdi.diagnosis.explain import evidence, size_in_words
from fdi.diagnosis.features import SIMULTANEOUS_S
from fdi.diagnosis.hypotheses import WINDOW_S, Inquiry, inquire
from fdi.diagnosis.isolability import implementable_isolability, structural_isolability
from fdi.diagnosis.kind import kind_of
from fdi.diagnosis.likelihood import Fitted, load_fitted
from fdi.diagnosis.marking import fault_grid
from fdi.diagnosis.naming import Cause, Effect, doubted, name
from fdi.diagnosis.others import others
from fdi.diagnosis.plain import the_part
from fdi.diagnosis.size import size_of
from fdi.diagnosis.together import together
from fdi.diagnosis.undecided import left_open, not_testable
from fdi.diagnosis.values import (
    MARKED,
    Consequence,
    Diagnosis,
    FaultGrid,
    Finding,
    RuledOut,
)
from fdi.diagnosis.verdict import count_tests, outlook, stayed_down, verdict
from fdi.model.naming import component_words
from fdi.residuals import Bank
from fdi.telemetry.ends import gravest


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
    ended = endings(alarms)
    tests = count_tests(alarms)
    untested = not_testable(alarms, bank, implementable, flew=not stayed_down(alarms))
    accuses = alarms.use.accuse
    inquiries, fitted = inquire(alarms) if accuses else (), load_fitted()
    causes, effects = named_in(inquiries, fitted)
    findings = tuple(
        _finding(rank, cause, inquiries[cause.flight], alarms)
        for rank, cause in enumerate(causes, 1)
    )
    consequences = _consequences(effects, causes, inquiries)
    kept = doubted(causes, effects, inquiries, fitted)
    accused = {f.component for f in findings} | {c.component for c in consequences}
    # one may be seen by how the vehicle answers, though no channel shows it
    untested = tuple(one for one in untested if one.component not in accused)
    cleared = tuple(o for o in clearable(alarms) if o.component not in kept) if accuses else ()
    told = accused | {one.component for one in cleared}
    told |= {one.component for one in untested}
    told |= {name for f in findings for name in f.inseparable_from}
    return Diagnosis(
        verdict=verdict(findings, consequences, ended, tests, alarms),
        outlook=outlook(findings, ended, tests, alarms),
        endings=ended,
        findings=findings,
        consequences=consequences,
        ruled_out=cleared,
        open=left_open(alarms, told) if accuses else (),
        not_testable=untested,
        together=tuple(together(inquiries, causes, effects)),
        methods=agreements(inquiries, causes, bank),
        grid=fault_grid(alarms),
        implementable=implementable,
        structural=structural_isolability(bank.system),
        decomposition=structure.decompose(model),
        graph_components=len(structure.graph_components(model)),
    )


def named_in(inquiries: Sequence[Inquiry], fitted: Fitted) -> tuple[list[Cause], list[Effect]]:
    """Return the causes of all flights of a log, ranked, and what follows from them.

    A component is a cause once in a flight (`joined`). What still stood when the flight went
    wrong that ended worst goes first; then the order of time.
    """
    causes: list[Cause] = []
    effects: list[Effect] = []
    for inquiry in inquiries:
        own, following = joined(*name(inquiry, fitted), inquiry)
        causes += own
        effects += following
    bad = gravest([i.ending for i in inquiries if i.ending is not None])
    causes.sort(
        key=lambda one: (
            not (bad and led_to(bad, one.flight, one.end)),
            one.onset,
            -one.probability,
            one.component,
        )
    )
    return causes, effects


def clearable(alarms: Alarms) -> tuple[RuledOut, ...]:
    """Return the components that the data speak for, whoever is accused or likely."""
    bank = alarms.residuals.bank
    return ruled_out(alarms, bank, _marked(fault_grid(alarms)) | bank.system.curtailed)


def causes_of(alarms: Alarms) -> list[Cause]:
    """Return who is accused, in the order of rank."""
    causes, _ = named_in(inquire(alarms), load_fitted())
    return causes


def _finding(rank: int, cause: Cause, inquiry: Inquiry, alarms: Alarms) -> Finding:
    soon = [run.row for run in cause.runs if run.onset <= cause.onset + WINDOW_S]
    span = (inquiry.start, inquiry.end)
    size = size_of(alarms, cause.component, soon, cause.onset, span)
    shown = evidence(cause, alarms)
    if size is not None:
        shown = replace(shown, text=f"{shown.text}; {size_in_words(size)}")
    return Finding(
        rank=rank,
        flight=cause.flight,
        component=cause.component,
        faults=_faults_of(cause, inquiry, alarms),
        kind=kind_of(cause, size, alarms),
        onset=_since(cause, inquiry, alarms),
        alarm=cause.alarm,
        end=None if cause.end >= inquiry.end else cause.end,
        confidence=cause.probability,
        inseparable_from=cause.inseparable,
        evidence=shown,
        because=cause.because,
        rivals=cause.rivals,
        others=others(cause, inquiry, alarms.residuals.bank),
        size=size,
        earlier=cause.earlier,
    )


def _since(cause: Cause, inquiry: Inquiry, alarms: Alarms) -> float:
    """Return since when, s: as the test that was first tells it, where it speaks of this very part.

    A test that only suspects a part dates what it is made for, and not what that part did.
    """
    first, residuals = cause.runs[0], alarms.residuals
    ago = residuals.ago.get(first.row)
    statement = residuals.bank.system.equations[residuals.bank.generators[first.row].residual]
    if ago is None or statement.component != cause.component:
        return cause.onset
    sample = min(int(np.searchsorted(residuals.t, first.known)), len(residuals.t) - 1)
    began = float(residuals.t[sample] - ago[sample])
    return min(cause.onset, max(began, inquiry.start)) if np.isfinite(began) else cause.onset


def _faults_of(cause: Cause, inquiry: Inquiry, alarms: Alarms) -> tuple[str, ...]:
    """Return the faults of an accused component that its tests hold, by the system's names.

    A statement that concerns it stands for what its tests hold.
    """
    generators = alarms.residuals.bank.generators
    plain, statements = _told_of(cause.component, cause.runs, inquiry)
    faults = [fault for run in statements for fault in generators[run.row].faults]
    return tuple(dict.fromkeys((*plain, *faults)))


def _told_of(component: str, runs: Sequence[Run], inquiry: Inquiry) -> tuple[list[str], list[Run]]:
    """Return the faults of a component that runs hold, and the runs that state something of it."""
    whom = inquiry.whom
    plain: list[str] = []
    statements: list[Run] = []
    for run in runs:
        own = [fault for fault in whom.faults[run.row] if whom.component[fault] == component]
        plain += [fault for fault in own if not fault.startswith("@")]
        if any(fault.startswith("@") for fault in own):
            statements.append(run)
    return plain, statements


def _consequences(
    effects: Sequence[Effect], causes: Sequence[Cause], inquiries: Sequence[Inquiry]
) -> tuple[Consequence, ...]:
    """Return what follows, causes in the order of their rank; who is accused follows nobody.

    Nor does who left health well before its cause did, though the cause explains its tests.
    """
    accused = {(cause.flight, cause.component) for cause in causes}
    runs: dict[tuple[int, str], list[Run]] = {}
    for effect in effects:
        if (effect.cause.flight, effect.component) in accused:
            continue
        rank = 1 + causes.index(effect.cause)
        runs.setdefault((rank, effect.component), []).extend(effect.runs)
    result = []
    for (rank, component), own in runs.items():
        cause = causes[rank - 1]
        first = min(run.onset for run in own)
        later = first - cause.onset
        if later < -SIMULTANEOUS_S:
            continue
        inquiry = inquiries[cause.flight]
        components = inquiry.whom.components
        whom = the_part(cause.component, components)
        when = f"{abs(later):.1f} s {'after' if later >= 0 else 'before'} {whom}"
        faults, _ = _told_of(component, own, inquiry)
        result.append(
            Consequence(
                component,
                tuple(dict.fromkeys(faults)),
                first,
                rank,
                f"{component_words(component, components)} shows it {when}",
            )
        )
    return tuple(sorted(result, key=lambda item: (item.onset, item.component)))


def _marked(grid: FaultGrid) -> set[str]:
    """Return the components of which a fault is marked at any time."""
    marked = (grid.marks == MARKED).any(axis=1)
    return {name for name, seen in zip(grid.components, marked, strict=True) if seen}
