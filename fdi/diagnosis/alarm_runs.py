"""Which alarms does a flight hold?

In: alarms over time. Out: a ``Run`` for each of them, in the order of onset.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.residuals import Residuals
from fdi.windows import runs_of

AHEAD: Final = 0.75
"""Share of a window's look-ahead by which its alarm begins before the change."""


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


def find_runs(alarms: Alarms, start: float, end: float, since: float = -np.inf) -> list[Run]:
    """Return the alarms within [start, end), s, in order of onset.

    An alarm that stands when the time begins has its onset there, if what is left of it is long
    enough to be one; that of a statement which holds always (`Equation.always`) where it began, and
    not before ``since``, s, when the flight before was over.
    """
    t = alarms.residuals.t
    low, high = np.searchsorted(t, [start, end]).tolist()
    step = 1.0 / alarms.residuals.signals.rate_hz
    found = []
    for row in np.flatnonzero(alarms.alarm[:, low:high].any(axis=1)).tolist():
        delay = float(alarms.delay_s[row])
        for begin, over in runs_of(alarms.alarm[row]):
            first, stop = max(begin, low), min(over, high)
            sure = np.flatnonzero(alarms.certain[row, begin:over])
            # of one that stands when the time begins, as much must be left as makes an alarm
            if first >= stop or not len(sure) or (begin < first and sure[0] >= stop - first):
                continue
            known = float(t[first + sure[0]]) + delay
            onset = min(onset_of(alarms, row, first, stop), known)
            onset = max(onset - _lasted(alarms.residuals, row, first), min(onset, start))
            if begin < first and _always(alarms.residuals, row):
                onset = max(float(t[begin]), min(since, onset))
            peak = float(np.nanmax(alarms.strength[row, first:stop]))
            found.append(Run(row, first, stop, onset, known, float(t[stop - 1]) + step, peak))
    return sorted(found, key=lambda run: (run.onset, run.row))


def onset_of(alarms: Alarms, row: int, first: int, stop: int) -> float:
    """Return when what a test shows from sample ``first`` to before ``stop`` began, s.

    A centred window feels a change before it is in its middle.
    """
    t = alarms.residuals.t
    return min(float(t[first]) + AHEAD * float(alarms.delay_s[row]), float(t[stop - 1]))


def _always(residuals: Residuals, row: int) -> bool:
    """Return whether a test speaks of what holds on the ground as in the air."""
    bank = residuals.bank
    return bank.system.equations[bank.generators[row].residual].always


def _lasted(residuals: Residuals, row: int, sample: int) -> float:
    """Return for how long, s, there had been what a test counts the seconds of, else 0.

    What stands still or is silent failed when that began, not when it had lasted too long.
    """
    equations = residuals.bank.system.equations
    generator = residuals.bank.generators[row]
    if not equations[generator.residual].elapsed:
        return 0.0
    shown = [equations[number].measurement for number in generator.equations]
    columns = [residuals.signals.columns.get(m.channel) for m in shown if m is not None]
    counted = [float(column[sample]) for column in columns if column is not None]
    return max((seconds for seconds in counted if np.isfinite(seconds)), default=0.0)
