"""Which residuals are beyond what noise and the model explain, and since when?

In: residuals and doubts of a flight, and which of its rows are calm. Out: `Limits`, which the calm
part tells once and for all, so that they serve records that come later as well: the centre of each
residual (a model that is a little off, or a steady wind, looks like a constant) and its noise. A
residual is beyond where it is off its centre by more than so many deviations and its doubt; that is
an alarm once it has lasted for longer than an outlier is remembered.

The statistic of noise is that of ``fdi.decision.noise``; its masks are not: they take the first
seconds in the air, in which a multicopter climbs, and its drag in the climb would be the centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.methods.observer.gain import POLES
from fdi.methods.observer.states import PSI, RESIDUALS, STATES, VELOCITY
from fdi.methods.observer.vehicle import GRAVITY
from fdi.telemetry.message import Floats
from fdi.windows import runs_of

SIGMAS: Final = 5.0
"""Deviations within which a residual is quiet, as in the default policy."""
RESOLUTION: Final = np.array([*3 * (5e-3,), *3 * (5e-3,), *3 * (2e-3,), *3 * (1e-3,), 5e-3])
"""Least deviation: steps of records and of their times, m, m/s, rad/s; of angles rad, by which an
estimator corrects a gyroscope that is off by 0.25 degrees/s."""
SAG: Final = 1.0 / 3.0 / 600.0
"""Share of its thrust that a command loses per second: a third as a battery empties in 10 min."""
MOST_SAG: Final = 1.0 / 3.0
LASTS_S: Final = 2.0 / float(np.abs(POLES).min())
"""An outlier is remembered: after two time constants 14 % of it is left."""
RECORDS: Final = 3
"""An alarm is of so many records at least."""
_NINETY: Final = 1.645
_VZ: Final = STATES.index("vz")


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """What calm rows say of every residual.

    Attributes
    ----------
    centre, deviation : (13,) float
    swing : (13,) float
        What made the centre of a velocity's residual, wind above all, may be gone at another place.
    since : float
        s, the middle of the calm rows.
    """

    centre: Floats
    deviation: Floats
    swing: Floats
    since: float

    def off(self, value: Floats) -> Floats:
        """Return residuals, (13,) or (13, n), off their centres, and the speed of those."""
        off = (value.T - self.centre).T
        off[PSI] = np.arctan2(np.sin(off[PSI]), np.cos(off[PSI]))
        off[-1] = np.hypot(off[3], off[4])
        return off

    def threshold(self, t: Floats, doubt: Floats) -> Floats:
        """Return thresholds at times, (n,) s, for doubts, (13, n)."""
        found = (SIGMAS * self.deviation + self.swing + doubt.T).T
        sag = np.clip(SAG * (t - self.since), 0.0, MOST_SAG)
        found[_VZ] += sag * GRAVITY / abs(float(POLES[_VZ]))
        return np.asarray(found)


class Alarm(NamedTuple):
    """A residual beyond its threshold.

    Attributes
    ----------
    residual : str
    start, end : float
        s, the first record beyond and the last.
    peak : float
        How far off its centre it was at most, with its sign.
    threshold : float
        Its threshold then.
    """

    residual: str
    start: float
    end: float
    peak: float
    threshold: float


def learn(t: Floats, value: Floats, calm: NDArray[np.bool_]) -> Limits:
    """Return the limits that calm rows tell, of residuals (13, n) at t (n,).

    A residual of which too few are known has the least deviation.
    """
    centre, deviation, swing = np.zeros(len(RESIDUALS)), RESOLUTION.copy(), np.zeros(len(RESIDUALS))
    for row, own in enumerate(value[:-1]):
        known = own[calm & np.isfinite(own)]
        if known.size:
            centre[row] = np.median(known)
    swing[VELOCITY] = *2 * [np.hypot(*centre[VELOCITY][:2])], abs(centre[_VZ])
    swing[-1] = swing[VELOCITY][0]
    limits = Limits(centre, deviation, swing, float(t[calm].mean()))
    period = float(np.median(np.diff(t)))
    for row, own in enumerate(np.abs(limits.off(value))):
        known = own[calm & np.isfinite(own)]
        if known.size:
            found = float(np.quantile(known, 0.9)) / _NINETY * _unsure(known.size * period)
            deviation[row] = max(deviation[row], found)
    return limits


def _unsure(length: float) -> float:
    """Return by how much a deviation may be larger than it was seen to be over so long, s (95 %).

    A residual remembers for a time constant: only so often it is seen anew.
    """
    from scipy.special import chdtri

    count = max(length * float(np.abs(POLES).min()), 2.0)
    return float(np.sqrt(count / chdtri(count, 0.95)))


def alarms_of(t: Floats, off: Floats, threshold: Floats) -> tuple[Alarm, ...]:
    """Return the alarms of residuals, (13, n), by time.

    Parameters
    ----------
    t : (n,) float
    off, threshold : (13, n) float
        NaN is unknown: it ends no alarm and counts for none.
    """
    found = []
    for name, own, limit in zip(RESIDUALS, off, threshold, strict=True):
        known = np.flatnonzero(np.isfinite(own) & np.isfinite(limit))
        over = np.abs(own[known]) > limit[known]
        for begins, ends in runs_of(over):
            first, last = known[begins], known[ends - 1]
            if ends - begins >= RECORDS and t[last] - t[first] >= LASTS_S:
                part = slice(first, last + 1)
                peak = first + int(np.nanargmax(np.abs(own[part]) / limit[part]))
                alarm = Alarm(
                    name, float(t[first]), float(t[last]), float(own[peak]), float(limit[peak])
                )
                found.append(alarm)
    return tuple(sorted(found, key=lambda a: (a.start, RESIDUALS.index(a.residual))))
