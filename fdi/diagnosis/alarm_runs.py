"""Which alarms does a flight hold?

In: alarms over time. Out: a ``Run`` for each of them, in the order of onset.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

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
        for first, stop in runs_of(mask):
            delay = float(alarms.delay_s[row])
            over = float(t[stop - 1]) + step
            begin, whole = _whole(alarms.alarm[row], first, stop)
            sure = np.flatnonzero(alarms.certain[row, begin:whole]) + begin - first
            # of one that stands when the time begins, as much must be left as makes an alarm
            if begin < first:
                sure = sure[:1] + (first - begin)
            if not len(sure) or (begin < first and sure[0] >= stop - first):
                continue
            known = float(t[first + sure[0]]) + delay
            # a centred window feels a change before it is in its middle
            onset = min(float(t[first]) + AHEAD * delay, known, float(t[stop - 1]))
            onset = max(onset - _lasted(alarms.residuals, int(row), int(first)), min(onset, start))
            peak = float(np.nanmax(alarms.strength[row, first:stop]))
            found.append(Run(int(row), int(first), int(stop), onset, known, over, peak))
    return sorted(found, key=lambda run: (run.onset, run.row))


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


def _whole(alarm: NDArray[np.bool_], first: int, stop: int) -> tuple[int, int]:
    """Return the bounds of the alarm that a part of it belongs to."""
    quiet_before = np.flatnonzero(~alarm[:first])
    quiet_after = np.flatnonzero(~alarm[stop:])
    begin = int(quiet_before[-1]) + 1 if len(quiet_before) else 0
    return begin, stop + (int(quiet_after[0]) if len(quiet_after) else len(alarm) - stop)
