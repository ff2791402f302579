"""Which fault is marked when? From the states of residuals to the fault grid.

``all_residuals``: the published rule, exoneration: every generator that holds the fault triggers.
``majority``: at least one generator that holds the fault is in alarm, and at least half of those
that are known; a test that did not see a fault does not exonerate it alone, because its power may
be too small. An undetectable fault is never marked; a fault none of whose generators is known is
unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.diagnosis.values import MARKED, QUIET, UNKNOWN, FaultGrid

Grid = NDArray[np.int8]
SHARE: Final = 0.5


def fault_grid(alarms: Alarms) -> FaultGrid:
    """Return the marks of every fault of the system over time."""
    bank = alarms.residuals.bank
    holds = bank.incidence
    mark = MARKINGS[alarms.use.marking]
    marks = np.full((holds.shape[1], len(alarms.residuals.t)), UNKNOWN, dtype=np.int8)
    for column in range(holds.shape[1]):
        rows = holds[:, column]
        if rows.any():
            marks[column] = mark(alarms.state[rows], alarms.alarm[rows])
    marks.flags.writeable = False
    faults = bank.system.faults
    return FaultGrid(
        alarms.residuals.t,
        tuple(fault.name for fault in faults),
        tuple(fault.component for fault in faults),
        tuple(fault.group for fault in faults),
        marks,
    )


def _all_residuals(state: Grid, alarm: NDArray[np.bool_]) -> Grid:
    unknown = (state == -1).all(axis=0)
    marks = np.where((state == 1).all(axis=0), MARKED, QUIET)
    return np.where(unknown, UNKNOWN, marks).astype(np.int8)


def _majority(state: Grid, alarm: NDArray[np.bool_]) -> Grid:
    known = (state != -1).sum(axis=0)
    raised = (alarm & (state != -1)).sum(axis=0)
    marks = np.where((raised > 0) & (raised >= SHARE * known), MARKED, QUIET)
    return np.where(known == 0, UNKNOWN, marks).astype(np.int8)


MARKINGS: Final[Mapping[str, Callable[[Grid, NDArray[np.bool_]], Grid]]] = {
    "all_residuals": _all_residuals,
    "majority": _majority,
}
