"""How well does a component explain the alarms of an episode?

In: a component and the alarms that followed an onset. Out: a `Weight`, a sum over tests.

An alarm speaks for a component by how the two are tied: fully where the test holds one of its
faults, less where the model only suspects it, still less where it merely disturbs what the test
holds; an early alarm that a candidate does not explain speaks against it. A test that holds a fault
and stayed quiet speaks against it too, if it could have seen it: the size that the alarms imply,
carried through the residuals' responses, must lie well above the quiet test's threshold. Nothing
follows from the quiet where another part of the same component, or something that the component
disturbs, may have gone along with the fault: both barometers drift, the estimator follows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.decision.concerns import SUSPECTED, Concerns
from fdi.diagnosis.episodes import Run

UNEXPLAINED_EARLY: Final = 0.5
UNEXPLAINED_LATE: Final = 0.15
QUIET: Final = 0.6
QUIET_UNSURE: Final = 0.2
"""What a quiet test takes away, where its power is known, and where it is not."""
POWER: Final = 1.5
"""So far above its threshold a fault of the implied size must move a test that is to clear it."""
MOST_PEAK: Final = 20.0


@dataclass(frozen=True, slots=True)
class Weight:
    """The sum, the faults that explain, and how much of it is evidence of the component itself.

    ``alone``: a test that concerns no other component is among it; ``nearly``: none but computed
    ones.
    """

    score: float
    faults: tuple[str, ...]
    own: float
    alone: bool
    nearly: bool


def weigh(
    component: str, early: Sequence[Run], soon: Sequence[Run], alarms: Alarms, bank: Concerns
) -> Weight:
    """Return how well a component explains the alarms soon after an onset.

    Parameters
    ----------
    component : str
    early, soon : sequence of Run
        The alarms that began with the onset, and those within a longer while (early ones included).
    """
    by_row = {run.row: run for run in reversed(soon)}
    window = slice(soon[0].first, max(run.first for run in soon) + 1)
    chosen, quiet = _chosen(component, by_row, alarms, bank, window)
    score, own, support, alone, nearly = -quiet, 0.0, 0.0, False, False
    begins = {run.row for run in early}
    said: set[int] = set()
    alike = _alike(component, chosen, by_row, alarms, bank, window)
    explained = set(chosen)
    for row, run in by_row.items():
        share = bank.share(component, row, frozenset(chosen))
        if set(bank.faults[row]) & alike:
            if bank.residual[row] in said:
                continue  # sensors that agree with each other say the same twice
            said.add(bank.residual[row])
        strength = _strength(run)
        if share:
            score += share * strength
        else:
            score -= strength * (UNEXPLAINED_EARLY if row in begins else UNEXPLAINED_LATE)
        if share >= SUSPECTED:
            explained |= {
                fault
                for fault in bank.faults[row]
                if fault in bank.suspected and bank.component[fault] == component
            }
            if row in bank.supporting:
                support += share * strength
                continue
            own += share * strength
            others = bank.of(row) - {component}
            alone |= not others
            nearly |= all(bank.components[name].computed for name in others)
    own += support if own else 0.0
    return Weight(score, tuple(sorted(explained)), own, alone, nearly)


def _chosen(
    component: str,
    by_row: Mapping[int, Run],
    alarms: Alarms,
    bank: Concerns,
    window: slice,
) -> tuple[list[str], float]:
    """Return the faults of a component that the tests do not speak against, and what they cost."""
    chosen: list[str] = []
    cost = 0.0
    counted: set[int] = set()
    for fault, name in bank.component.items():
        if name != component or fault in bank.suspected:
            continue
        rows = [row for row, faults in enumerate(bank.faults) if fault in faults]
        hit = [row for row in rows if row in by_row]
        if not hit:
            continue
        against = {
            row: power
            for row in rows
            if row not in by_row and (power := _power(fault, row, hit, alarms, bank, window))
        }
        if sum(against.values()) > QUIET * len(hit):
            continue
        chosen.append(fault)
        cost += sum(power for row, power in against.items() if row not in counted)
        counted.update(against)
    return chosen, cost


def _alike(
    component: str,
    chosen: Sequence[str],
    by_row: Mapping[int, Run],
    alarms: Alarms,
    bank: Concerns,
    window: slice,
) -> frozenset[str]:
    """Return the chosen faults of parts that agree with each other."""
    found: set[str] = set()
    for row, faults in enumerate(bank.faults):
        same = [f for f in faults if bank.component[f] == component and f not in bank.suspected]
        if len(same) < 2 or row in by_row or bank.of(row) != {component}:
            continue
        if (alarms.state[row, window] != -1).mean() > 0.5:
            found.update(same)
    return frozenset(found & set(chosen))


def _power(
    fault: str, row: int, hit: Sequence[int], alarms: Alarms, bank: Concerns, window: slice
) -> float:
    """Return what the quiet of a test takes away from a fault, 0 where nothing follows from it."""
    if (alarms.state[row, window] == -1).mean() > 0.5:
        return 0.0
    component = bank.component[fault]
    others = bank.of(row) - {component}
    same = sum(bank.component[f] == component for f in bank.faults[row])
    if same > 1 or any(o in bank.components[component].affects for o in others):
        return 0.0
    place = bank.column.get(fault)
    if place is None:
        return QUIET_UNSURE
    response = alarms.residuals.response
    own = response[row, place]
    implied = [
        _size(alarms, other, window) / response[other, place]
        for other in hit
        if response[other, place] > 0
    ]
    if not implied or not own > 0:
        return QUIET_UNSURE
    bound = _bound(alarms, row, window)
    return QUIET if float(np.median(implied)) * own > POWER * bound else 0.0


def _size(alarms: Alarms, row: int, window: slice) -> float:
    """Return how large a residual's mean gets, or itself where no mean is judged."""
    mean = np.abs(alarms.mean[row, window])
    if np.isfinite(mean).any():
        return float(np.nanmax(mean))
    off = np.abs(alarms.residuals.values[row, window] - alarms.centre[row])
    return float(np.nanmedian(off)) if np.isfinite(off).any() else 0.0


def _bound(alarms: Alarms, row: int, window: slice) -> float:
    bound = alarms.mean_threshold[row, window]
    if np.isfinite(bound).any():
        return float(np.nanmedian(bound))
    threshold = alarms.threshold[row, window]
    return float(np.nanmedian(threshold)) if np.isfinite(threshold).any() else np.inf


def _strength(run: Run) -> float:
    return 1.0 + float(np.log(min(max(run.peak, 1.0), MOST_PEAK)))
