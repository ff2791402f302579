"""Which records did damage give a time far off, and by how much?

In: what one clock told, record by record. Out: the same with every run of records put back that was
thrown forward or back and from which the clock returns to where it would have been: the two steps
cancel. A clock that starts anew, is set, or stands through a pause does not return.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FAR_S: Final = 60.0
"""A run thrown by less is left as it is: links and loggers pause for so long, and are set by it."""
STEP_S: Final = 1.0
"""Links deliver in order: an earlier time after a later one by more is a step."""
_MOST: Final = 1000  # steps back that are looked at; each costs a pass over those forward


class Thrown(NamedTuple):
    """Records ``low`` to before ``high`` that tell times later by ``by``, s, than they were."""

    low: int
    high: int
    by: float


def put_back(seconds: Floats) -> tuple[Floats, tuple[Thrown, ...]]:
    """Return the times of a clock with runs that were thrown put back, and these runs.

    Parameters
    ----------
    seconds : (n,) float, s
        As told, file order.

    Examples
    --------
    >>> t, runs = put_back(np.array([0.0, 1.0, 7202.0, 7203.0, 4.0, 5.0]))
    >>> t.tolist(), [(one.low, one.high, one.by) for one in runs]
    ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [(2, 4, 7200.0)])
    """
    steps = np.diff(seconds)
    if not np.any(steps < -FAR_S):
        return seconds, ()
    usual = steps[(steps >= 0) & (steps < FAR_S)]
    slack = STEP_S + 2 * (float(np.median(usual)) if usual.size else 0.0)
    runs: list[Thrown] = []
    seconds = seconds.copy()
    for back in np.flatnonzero(steps < -FAR_S)[:_MOST].tolist():
        ahead = np.flatnonzero(np.abs(steps + steps[back] - slack / 2) <= slack / 2 + STEP_S)
        if not ahead.size:
            continue
        # of those before, the nearest; else the first behind
        place = int(np.searchsorted(ahead, back))
        other = int(ahead[place - 1] if place else ahead[0])
        low, high = sorted((back, other))
        passed = max(float(steps[back] + steps[other]), 0.0) / 2  # at either step, if evenly
        by = float(steps[low]) - passed
        seconds[low + 1 : high + 1] -= by
        steps[[low, high]] = passed
        runs.append(Thrown(low + 1, high + 1, by))
    return seconds, tuple(runs)
