"""Which component explains an episode of alarms, and which alarms only follow from it?

In: the alarms of one flight as runs over time. Out: causes, in order, with the runs each explains,
and consequences. An episode is a stretch of alarms without a pause. Its earliest alarms are
conflicts; a component that hits them all, alone if one does, is a candidate, and the candidates are
weighed by the alarms they explain soon after the onset, against the tests that hold the very same
faults and stayed quiet. What the cause does not explain is a consequence when it concerns a
component that the cause is known to disturb (``affects`` in the model), else a cause of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.diagnosis.hitting import minimal_hitting_sets
from fdi.model.parts import Component, Kind
from fdi.residuals import Bank

EPISODE_GAP_S: Final = 5.0
"""Alarms with a longer pause between them belong to different episodes."""
SIMULTANEOUS_S: Final = 2.0
"""Alarms this close together are not ordered: persistence and sampling blur onsets by as much."""
WEIGHING_S: Final = 10.0
"""Alarms within this time after the onset are weighed for the cause."""
QUIET_WEIGHT: Final = 0.25
"""A quiet test counts a quarter of a trigger: its power at that moment is not known."""
DISTURBED_WEIGHT: Final = 0.5
"""An alarm that a candidate explains only through what it disturbs counts half."""
TIE: Final = 0.1
"""Candidates whose weight differs by less, relatively, cannot be separated."""
MOST_CAUSES: Final = 3


@dataclass(frozen=True, slots=True)
class Run:
    """An alarm of one residual from onset to end, s; ``known`` is when it became certain."""

    row: int
    first: int
    last: int
    onset: float
    known: float
    end: float
    peak: float


@dataclass(frozen=True, slots=True)
class Cause:
    """A component that explains runs of an episode."""

    component: str
    faults: tuple[str, ...]
    runs: tuple[Run, ...]
    weight: float
    total: float
    inseparable: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Effect:
    """A component whose runs follow from a cause of the same episode."""

    component: str
    faults: tuple[str, ...]
    runs: tuple[Run, ...]
    cause: Cause


@dataclass(frozen=True, slots=True)
class _Concerns:
    """What the search asks of a bank: whom every residual concerns.

    A residual concerns the faults of its signature; one that is a limit or an equality of which the
    model says whom it concerns stands for that statement, ``@name``, instead.
    """

    faults: tuple[tuple[str, ...], ...]
    component: Mapping[str, str]
    components: Mapping[str, Component]
    order: Mapping[str, int]

    def of(self, row: int) -> frozenset[str]:
        """Return the components that a residual concerns."""
        return frozenset(self.component[fault] for fault in self.faults[row])


def _concerns(bank: Bank) -> _Concerns:
    system = bank.system
    component = {fault.name: fault.component for fault in system.faults}
    faults: list[tuple[str, ...]] = []
    for generator in bank.generators:
        left = system.equations[generator.residual]
        stated = left.kind in (Kind.LIMIT, Kind.EQUALITY) and left.component is not None
        own = [] if stated else list(generator.faults)
        for number in generator.equations:
            equation = system.equations[number]
            whom = [equation.component] if stated and number == generator.residual else []
            for name in (*whom, *equation.suspects):
                component[f"@{equation.name}:{name}"] = str(name)
                own.append(f"@{equation.name}:{name}")
        faults.append(tuple(own))
    order = {name: i for i, name in enumerate(system.components)}
    return _Concerns(tuple(faults), component, system.components, order)


def find_runs(alarms: Alarms, start: float, end: float) -> list[Run]:
    """Return the alarms within [start, end), s, in order of onset.

    An alarm that stands when the time begins has its onset there, if what is left of it is long
    enough to be one.
    """
    t = alarms.residuals.t
    inside = (t >= start) & (t < end)
    step = 1.0 / alarms.residuals.signals.rate_hz
    found = []
    for row in np.flatnonzero(alarms.alarm.any(axis=1)):
        mask = alarms.alarm[row] & inside
        edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
        for first, stop in zip(edges[::2], edges[1::2], strict=True):
            onset = float(t[first])
            over = float(t[stop - 1]) + step
            sure = np.flatnonzero(alarms.certain[row, first:stop])
            if not len(sure):  # begins before the time in the air, or ends with it
                continue
            known = float(t[first + sure[0]]) + float(alarms.delay_s[row])
            peak = float(np.nanmax(alarms.strength[row, first:stop]))
            found.append(Run(int(row), int(first), int(stop), onset, known, over, peak))
    return sorted(found, key=lambda run: (run.onset, run.row))


def episodes(found: Sequence[Run]) -> list[list[Run]]:
    """Return the runs cut into episodes."""
    result: list[list[Run]] = []
    end = -np.inf
    for run in found:
        if not result or run.onset > end + EPISODE_GAP_S:
            result.append([])
        result[-1].append(run)
        end = max(end, run.end)
    return result


def explain_episode(alarms: Alarms, found: Sequence[Run]) -> tuple[list[Cause], list[Effect]]:
    """Return the causes of an episode, in order of onset, and what follows from them."""
    bank = _concerns(alarms.residuals.bank)
    causes: list[Cause] = []
    effects: list[Effect] = []
    remaining = list(found)
    while remaining and len(causes) < MOST_CAUSES:
        cause = _cause(remaining, alarms, bank)
        if cause is None:  # nothing explains its first alarm: the rest may still have a cause
            remaining = remaining[1:]
            continue
        causes.append(cause)
        taken = set(cause.runs)
        remaining = [run for run in remaining if run not in taken]
        for effect in _effects(cause, remaining, bank):
            effects.append(effect)
            taken.update(effect.runs)
        remaining = [run for run in remaining if run not in taken]
    return causes, effects


def _cause(found: Sequence[Run], alarms: Alarms, bank: _Concerns) -> Cause | None:
    onset = found[0].onset
    early = [run for run in found if run.onset <= onset + SIMULTANEOUS_S]
    soon = [run for run in found if run.onset <= onset + WEIGHING_S]
    conflicts = [bank.of(run.row) for run in early]
    diagnoses = minimal_hitting_sets(c for c in conflicts if c)
    # More independent failures at once than are searched together: each alone is a candidate.
    candidates = sorted(frozenset().union(*(diagnoses or conflicts)))
    if not candidates:
        return None
    single = {next(iter(d)) for d in diagnoses if len(d) == 1}
    pool = single or set(candidates)
    # What disturbs a candidate and shows itself soon after may have been seen later only because
    # its tests are less sensitive.
    around = {name for run in soon for name in bank.of(run.row)}
    upstream = {n for n in around if any(_only_disturbs(n, m, bank) for m in pool)} | pool
    upstream -= {n for n in upstream if any(_only_disturbs(m, n, bank) for m in single)}
    weights = {name: _weigh(name, early, soon, alarms, bank) for name in sorted(upstream)}
    upstream = {name for name in upstream if weights[name][1]}
    if not upstream:
        return None
    ordered = sorted(upstream, key=lambda name: (-weights[name][0], *_precedence(name, pool, bank)))
    top = weights[ordered[0]][0]
    close = [n for n in ordered if weights[n][0] >= top - TIE * abs(top)]
    if not single and (first := upstream & pool):
        # Several at once, none explains all: what disturbs the others goes first, however strong
        # their alarms are; what it leaves over is accused in turn.
        close = [n for n in ordered if n in first]
    leading = min(close, key=lambda name: _precedence(name, close, bank))
    weight, faults = weights[leading]
    explained = tuple(run for run in found if set(bank.faults[run.row]) & set(faults))
    total = sum(max(w, 0.0) for w, _ in weights.values())
    tied = tuple(sorted(n for n in close if n != leading and weights[n][0] == weight))
    return Cause(leading, faults, explained, weight, total, tied) if explained else None


def _only_disturbs(cause: str, effect: str, bank: _Concerns) -> bool:
    """Return whether one component disturbs the other and is not disturbed by it."""
    components = bank.components
    return effect in affected(cause, components) and cause not in affected(effect, components)


def _precedence(name: str, among: Iterable[str], bank: _Concerns) -> tuple[int, int]:
    """Return a key that puts what disturbs others before what is disturbed."""
    disturbed = sum(name in bank.components[other].affects for other in among if other != name)
    return disturbed, bank.order[name]


def _weigh(
    component: str, early: Sequence[Run], soon: Sequence[Run], alarms: Alarms, bank: _Concerns
) -> tuple[float, tuple[str, ...]]:
    """Return how well a component explains the runs, and by which of its faults.

    A run that holds a fault of the component is explained; one that concerns only what the
    component disturbs is half explained.
    """
    window = slice(soon[0].first, max(run.first for run in soon) + 1)
    raised = {run.row for run in soon}
    chosen: list[str] = []
    quiet: set[int] = set()
    for fault in (f for f, name in bank.component.items() if name == component):
        rows = [row for row, faults in enumerate(bank.faults) if fault in faults]
        hit = [row for row in rows if row in raised]
        still = [row for row in rows if row not in raised and _is_known(alarms, row, window)]
        if hit and len(hit) >= len(still):
            chosen.append(fault)
            quiet.update(still)
    if not chosen:
        return -float(len(early)), ()
    disturbed = affected(component, bank.components)
    weight = -QUIET_WEIGHT * len(quiet)
    for run in {run.row: run for run in soon}.values():
        if set(bank.faults[run.row]) & set(chosen):
            weight += _strength(run)
        elif bank.of(run.row) & disturbed:
            weight += DISTURBED_WEIGHT * _strength(run)
        elif run in early:
            weight -= _strength(run)
    return weight, tuple(chosen)


def _strength(run: Run) -> float:
    return 1.0 + float(np.log(min(max(run.peak, 1.0), 20.0)))


def _is_known(alarms: Alarms, row: int, window: slice) -> bool:
    return bool((alarms.state[row, window] != -1).mean() > 0.5)


def _effects(cause: Cause, remaining: Sequence[Run], bank: _Concerns) -> list[Effect]:
    disturbed = affected(cause.component, bank.components)
    by_component: dict[str, list[Run]] = {}
    for run in remaining:
        concerned = sorted(bank.of(run.row) & disturbed, key=lambda n: bank.order[n])
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
