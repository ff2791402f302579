"""Do the compasses of a vehicle point the same way?

In: a log. Out: a `Check` for each compass but the first, against the first one. Needs neither a
place nor a flight: what bends the field on the ground bends it for all of them alike, so that a
vehicle that stands shows it, before its first take-off. Levelled by the attitude, of which the
heading does not matter.

Which of two is wrong it does not tell; `turned.py` and `compass.py` do, where the vehicle turns.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from fdi.methods.setup.compass import all_readings, as_used, is_used
from fdi.methods.setup.interval import Interval, by_parts, in_degrees, numbers_of, verdict_of
from fdi.methods.setup.records import Series, attitude, stretches
from fdi.methods.setup.rotations import to_earth
from fdi.methods.setup.values import Check
from fdi.model.evaluate import wrap
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

MOST: Final = np.radians(60.0)
"""Farther apart ArduPilot does not arm (AP_Compass.h, ``AP_COMPASS_MAX_XY_ANG_DIFF``)."""
FINE: Final = np.radians(22.5)
"""Half of the 45 degrees that orientations are apart."""
APART: Final = "apart_deg"
"""Of the numbers of a check, by what angle two compasses point away from each other."""
_FEW: Final = 20


def check_agreement(log: Log) -> Iterator[Check]:
    """Yield for each compass but the first in use whether it points where that one does."""
    known, found = attitude(log), all_readings(log)
    used = [number for number in found if is_used(log, number)]
    if known is None or not used:
        return
    until = min((part.start for part in stretches(log)), default=np.inf)
    for number in sorted(found.keys() - used[:1]):
        one = _apart(number, found[number], used[0], found[used[0]], known, until)
        yield as_used(one, log, number)


def _apart(
    number: int, own: Series, other: int, others: Series, known: Series, until: float
) -> Check:
    """Return how far apart two compasses point before the first take-off, or else all along."""
    name = f"agreement of compass {number}"
    low = max(own.t[0], others.t[0], known.t[0])
    high = min(own.t[-1], others.t[-1], known.t[-1])
    inside = (own.t >= low) & (own.t <= high)
    stands = inside & (own.t < until)
    where = "before take-off" if np.count_nonzero(stands) >= _FEW else "all along"
    some = stands if where == "before take-off" else inside
    if np.count_nonzero(some) < _FEW:
        return Check(name, "not known", "the log holds too few readings of both at a time")
    t = own.t[some]
    same = np.array([np.interp(t, others.t, row) for row in others.values])
    levelled = to_earth(*(np.interp(t, known.t, np.unwrap(row)) for row in known.values))
    apart = wrap(_heading(levelled, own.values[:, some]) - _heading(levelled, same))
    middle = float(np.angle(np.exp(1j * apart).mean()))
    off = by_parts(
        lambda part: float(abs(middle + np.median(wrap(apart[part] - middle)))), t.size, 0.0
    )
    most = Interval(off.value, min(off.least, np.pi), min(off.most, np.pi))
    words = f"{where} it points {in_degrees(most)} away from compass {other}"
    verdict = verdict_of(most, fine=FINE, bad=MOST)
    if verdict == "wrong":
        words += ", and ArduPilot arms up to 60: one of both is turned, or far from calibrated"
    return Check(name, verdict, words, numbers_of(APART, most, float(np.degrees(1))))


def _heading(levelled: Floats, readings: Floats) -> Floats:
    """Return where readings (3, n) point, (n,) rad, in earth axes (n, 3, 3)."""
    north, east, _ = np.einsum("nij,jn->in", levelled, readings)
    return np.asarray(np.arctan2(east, north))
