"""Which component explains an episode of alarms, and which alarms only follow from it?

In: the runs of one episode. Out: causes, in order, with the runs each explains, and consequences.
Whatever the earliest alarms concern is a candidate, and so is what disturbs one of these and shows
itself soon after. Candidates are weighed by the alarms they explain soon after the onset, against
the tests that hold the very same faults and stayed quiet. What the cause does not explain is a
consequence when it concerns a component that the cause is known to disturb (``affects`` in the
model), else a cause of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.decision.accusing import EVIDENCE, EVIDENCE_COMPUTED, EVIDENCE_NEARLY, WEIGHING_S
from fdi.decision.concerns import Concerns, concerns
from fdi.diagnosis.episodes import Run
from fdi.diagnosis.weighing import Weight, weigh
from fdi.model.parts import Component

SIMULTANEOUS_S: Final = 2.0
"""Alarms this close together are not ordered: persistence and sampling blur onsets by as much."""
UPSTREAM: Final = 0.6
"""Share of the best score with which a component that disturbs the best one goes before it."""
TIE: Final = 0.05
"""Candidates whose scores differ by less cannot be separated."""
MOST_CAUSES: Final = 3


@dataclass(frozen=True, slots=True)
class Cause:
    """A component that explains runs of an episode; ``share``: of the evidence, 0 to 1."""

    component: str
    faults: tuple[str, ...]
    runs: tuple[Run, ...]
    share: float
    inseparable: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Effect:
    """A component whose runs follow from a cause of the same episode."""

    component: str
    faults: tuple[str, ...]
    runs: tuple[Run, ...]
    cause: Cause


def explain_episode(alarms: Alarms, found: Sequence[Run]) -> tuple[list[Cause], list[Effect]]:
    """Return the causes of an episode, in order of onset, and what follows from them."""
    bank = concerns(alarms.residuals.bank)
    causes: list[Cause] = []
    effects: list[Effect] = []
    remaining = list(found)
    unexplained: list[Run] = []
    while remaining and len(causes) < MOST_CAUSES:
        cause = _cause(remaining, alarms, bank)
        if cause is None:  # nothing explains its first alarm: the rest may still have a cause
            unexplained.append(remaining.pop(0))
            continue
        cause = _with_beginning(cause, unexplained, bank)
        causes.append(cause)
        taken = set(cause.runs)
        remaining = [run for run in remaining if run not in taken]
        for effect in _effects(cause, remaining, bank):
            effects.append(effect)
            taken.update(effect.runs)
        remaining = [run for run in remaining if run not in taken]
    return causes, effects


def _with_beginning(cause: Cause, before: Sequence[Run], bank: Concerns) -> Cause:
    """Return the cause with the alarms, too little to accuse by themselves, that it began with."""
    onset = cause.runs[0].onset
    mine = {f for f, name in bank.component.items() if name == cause.component} - bank.suspected
    own = [run for run in before if run.end >= onset and mine.intersection(bank.faults[run.row])]
    return replace(cause, runs=(*own, *cause.runs))


def _cause(found: Sequence[Run], alarms: Alarms, bank: Concerns) -> Cause | None:
    onset = found[0].onset
    early = [run for run in found if run.onset <= onset + SIMULTANEOUS_S]
    soon = [run for run in found if run.onset <= onset + WEIGHING_S]
    pool = _candidates(early, soon, bank)
    weights = {name: weigh(name, early, soon, alarms, bank) for name in pool}
    scores = _accusable(weights, bank)
    if max(scores.values(), default=0.0) <= 0:
        return None
    leading = _leading(scores, bank)
    weight = weights[leading]
    explained = tuple(run for run in found if set(bank.faults[run.row]) & set(weight.faults))
    if not explained:
        return None
    others = np.array(list(scores.values()))
    share = float(1.0 / (np.exp(others - weight.score).sum() + np.exp(-weight.score)))
    return Cause(leading, weight.faults, explained, share, _tied(leading, weights, soon, bank))


def _candidates(early: Sequence[Run], soon: Sequence[Run], bank: Concerns) -> list[str]:
    """Return whom the early alarms concern, and what disturbs one of them and shows itself soon.

    That may have been seen later only because its tests are less sensitive.
    """
    pool = {name for run in early for name in bank.of(run.row)}
    around = {name for run in soon for name in bank.of(run.row)}
    return sorted(pool | {n for n in around if any(_only_disturbs(n, m, bank) for m in pool)})


def _accusable(weights: Mapping[str, Weight], bank: Concerns) -> dict[str, float]:
    """Return the scores of those that may be accused: what has parts that break, if it explains."""
    able = {n: weight.score for n, weight in weights.items() if _is_enough(n, weight, bank)}
    parts = {n: score for n, score in able.items() if not bank.components[n].computed}
    return parts if any(score > 0 for score in parts.values()) else able


def _leading(scores: Mapping[str, float], bank: Concerns) -> str:
    """Return the heaviest, or what disturbs it and explains as much, or nearly as much."""
    top = max(scores.values())
    close = [name for name, score in scores.items() if score >= top - TIE]
    leading = min(close, key=lambda name: (*_precedence(name, close, bank), -scores[name]))
    upstream = [
        name
        for name, score in scores.items()
        if leading in bank.components[name].affects
        and name not in bank.components[leading].affects
        and score >= UPSTREAM * top
    ]
    return max(upstream, key=lambda name: (scores[name], -bank.order[name]), default=leading)


def _tied(
    leading: str, weights: Mapping[str, Weight], soon: Sequence[Run], bank: Concerns
) -> tuple[str, ...]:
    """Return the others that explain every alarm that the leading one explains."""
    own = set(weights[leading].faults)
    rows = {run.row for run in soon if own.intersection(bank.faults[run.row])}
    return tuple(
        name
        for name, weight in weights.items()
        if name not in (leading, *bank.components[leading].affects)
        and all(set(bank.faults[row]).intersection(weight.faults) for row in rows)
    )


def _is_enough(name: str, weight: Weight, bank: Concerns) -> bool:
    """Return whether the evidence of a component itself allows an accusation."""
    if bank.components[name].computed:
        return weight.own >= EVIDENCE_COMPUTED
    if weight.nearly and weight.own >= EVIDENCE_NEARLY:
        return True
    return weight.alone or weight.own >= EVIDENCE


def _only_disturbs(cause: str, effect: str, bank: Concerns) -> bool:
    """Return whether one component disturbs the other and is not disturbed by it."""
    components = bank.components
    return effect in affected(cause, components) and cause not in affected(effect, components)


def _precedence(name: str, among: Iterable[str], bank: Concerns) -> tuple[int, int]:
    """Return a key that puts what disturbs others before what is disturbed."""
    disturbed = sum(name in bank.components[other].affects for other in among if other != name)
    return disturbed, bank.order[name]


def _effects(cause: Cause, remaining: Sequence[Run], bank: Concerns) -> list[Effect]:
    disturbed = affected(cause.component, bank.components)
    by_component: dict[str, list[Run]] = {}
    for run in remaining:
        stated = {bank.component[f] for f in bank.faults[run.row] if f not in bank.suspected}
        concerned = sorted(
            bank.of(run.row) & disturbed, key=lambda n: (n not in stated, bank.order[n])
        )
        if concerned and run.onset >= cause.runs[0].onset - WEIGHING_S:
            by_component.setdefault(concerned[0], []).append(run)
    return [
        Effect(
            name,
            tuple(
                dict.fromkeys(
                    fault
                    for run in own
                    for fault in bank.faults[run.row]
                    if bank.component[fault] == name
                )
            ),
            tuple(own),
            cause,
        )
        for name, own in by_component.items()
    ]


def affected(component: str, components: Mapping[str, Component]) -> set[str]:
    """Return the components that a failure disturbs, directly or through others."""
    reached: set[str] = set()
    stack = list(components[component].affects) if component in components else []
    while stack:
        name = stack.pop()
        if name not in reached and name != component:
            reached.add(name)
            stack.extend(components[name].affects if name in components else ())
    return reached
