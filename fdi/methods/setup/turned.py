"""By what angle is a compass turned about the vertical axis of its vehicle?

In: a log. Out: an `Interval` for each compass, or None. The heading in a log usually comes from
that very compass, so no heading is used: roll and pitch are gravity's, yaw is the gyroscopes', of
which no more is taken than how it changes, with a drift of its own for every two minutes. With
readings r, body axes seen from the earth's T (turned by an unknown yaw), the field of the World
Magnetic Model's vertical part z, an unknown horizontal part e and the compass' own constant o

    turn(psi) r = T e + T z + o,    turn(psi) r = a (x, y, 0) + b (-y, x, 0) + (0, 0, z)

is linear in a = cos psi, b = sin psi, e, its drift, and o. What tells psi is how the steep field
tips into the horizontal axes as the vehicle leans. Where nothing shows it a and b shrink together
towards nothing: noise in r does that, and does not turn them.

Hand-fitted offsets do not matter (o is free), nor does an attitude whose yaw is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.methods.setup.interval import PARTS, SURE, Interval
from fdi.methods.setup.records import Series, attitude, body_rates, spins, stretches
from fdi.methods.setup.rotations import to_earth
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

FITS: Final = np.radians(22.5)
"""Half of the 45 degrees that orientations are apart: a compass off by less is not turned."""
_LATE: Final = FITS / 2 / 0.1
"""rad/s: turning faster, a reading that is a tenth of a second late (EK3_MAG_DELAY has 60 ms, and
records come in between) is off by half of that."""
_WINDOW_S: Final = 120.0
"""Over which a gyroscope's bias is constant; twice as much or half changes nothing that is told."""
_WINDOWS: Final = 50
"""Longer ones where a flight has more: the unknowns are four for each."""
_MOST: Final = 3000
"""Readings, evenly thinned from more."""
_FEW: Final = 30
_GAP_S: Final = 0.5
_FIELD: Final = 0.5
"""Of a and b together: below, more of what is read is noise than field."""
_OTHERS: Final = ((1, -1, -1), (1, -1, 1), (1, 1, -1))
"""Signs of the axes upside down, and with one reversed: what fits better so is not turned alone."""
_TURN: Final = 2  # unknowns a, b
_EACH: Final = 4  # of a window: e, its drift


class _Equations(NamedTuple):
    """``a`` (n, 3, k) and ``b`` (n, 3): a @ unknowns = b, reading by reading, in Earth's fields."""

    a: Floats
    b: Floats


def turned_about_the_vertical(log: Log, readings: Series, model: Floats) -> Interval | None:
    """Return the angle by which a compass reads too little, rad, right-handed about down.

    Parameters
    ----------
    log : Log
    readings : Series
        (3, n) T, of the compass.
    model : (3,) float
        The Earth's field, north, east, down, T.

    Returns
    -------
    Interval or None
        What its readings still need to be turned by. None where the vehicle turns and leans too
        little, or not the same angle holds all along.
    """
    windows = list(_windows(log, readings))
    if sum(t.size for t, _, _ in windows) < _FEW:
        return None
    upright = _equations(windows, model)
    found = _angle(upright)
    if found is None:
        return None
    left = _left(upright)
    if any(_left(_equations(windows, model, signs)) < left for signs in _OTHERS):
        return None
    half = len(upright.b) // 2
    for part in (slice(None, half), slice(half, None)):
        own = _solved(_Equations(upright.a[part], upright.b[part]))
        if np.hypot(*own[:_TURN]) > _FIELD and abs(_apart(own, found.value)) > FITS:
            return None
    return found


def _windows(log: Log, readings: Series) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield times (n,), attitudes (n, 3, 3) earth to body at any yaw, and readings (n, 3)."""
    known, rates = attitude(log), body_rates(log)
    if known is None or rates is None:
        return
    roll, pitch = (np.interp(rates.t, known.t, np.unwrap(row)) for row in known.values[:2])
    _, q, r = rates.values
    rate = (q * np.sin(roll) + r * np.cos(roll)) / np.maximum(np.cos(pitch), 0.1)
    step = np.diff(rates.t, prepend=rates.t[0])
    yaw = np.cumsum(np.where(step < _GAP_S, rate * step, 0.0))
    start, end = max(known.t[0], rates.t[0]), min(known.t[-1], rates.t[-1])
    flies = ~spins(log, readings.t, _LATE) & (readings.t >= start) & (readings.t <= end)
    parts = [
        np.flatnonzero(flies & (readings.t >= part.start) & (readings.t <= part.end))
        for part in stretches(log)
    ]
    total = sum(float(np.ptp(readings.t[part])) for part in parts if part.size)
    every = -(-sum(part.size for part in parts) // _MOST) or 1
    length = max(_WINDOW_S, total / _WINDOWS)
    for part in parts:
        t = readings.t[part]
        lasts = float(np.ptp(t)) if t.size else 0.0
        for some in np.array_split(part[::every], int(lasts / length) + 1):
            if some.size > _EACH:
                at = readings.t[some]
                angles = (np.interp(at, rates.t, row) for row in (roll, pitch, yaw))
                turn = np.transpose(to_earth(*angles), (0, 2, 1))
                yield at, turn, readings.values[:, some].T


def _equations(
    windows: list[tuple[Floats, Floats, Floats]],
    model: Floats,
    signs: tuple[int, int, int] = (1, 1, 1),
) -> _Equations:
    strength = float(np.linalg.norm(model))
    count = _TURN + _EACH * len(windows) + 3
    lefts, rights = [], []
    for number, (t, turn, field) in enumerate(windows):
        x, y, z = (field * signs).T / strength
        left = np.zeros((t.size, 3, count))
        left[:, 0, 0], left[:, 1, 0] = x, y
        left[:, 0, 1], left[:, 1, 1] = -y, x
        at = _TURN + _EACH * number
        left[:, :, at : at + 2] = -turn[:, :, :2]
        late = (t - t.mean()) / _WINDOW_S
        left[:, :, at + 2 : at + _EACH] = -turn[:, :, :2] * late[:, None, None]
        left[:, :, -3:] = -np.eye(3)
        right = turn[:, :, 2] * (model[2] / strength)
        right[:, 2] -= z
        lefts.append(left)
        rights.append(right)
    return _Equations(np.concatenate(lefts), np.concatenate(rights))


def _angle(equations: _Equations) -> Interval | None:
    """Return the angle with its interval by leaving parts out (`by_parts`, on a circle)."""
    pieces = np.array_split(np.arange(len(equations.b)), PARTS)
    sums = [_sums(_Equations(equations.a[some], equations.b[some])) for some in pieces]
    a, b = (np.sum(each, axis=0) for each in zip(*sums, strict=True))
    best = _solved_of(a, b)
    if np.hypot(*best[:_TURN]) < _FIELD:
        return None
    angle = float(np.arctan2(best[1], best[0]))
    others = [_apart(_solved_of(a - own_a, b - own_b), angle) for own_a, own_b in sums]
    reach = SURE * float(np.sqrt((len(others) - 1) * np.var(others)))
    return Interval(angle, angle - reach, angle + reach)


def _sums(equations: _Equations) -> tuple[Floats, Floats]:
    a = equations.a.reshape(-1, equations.a.shape[2])
    return a.T @ a, a.T @ equations.b.reshape(-1)


def _solved(equations: _Equations) -> Floats:
    return _solved_of(*_sums(equations))


def _solved_of(a: NDArray[np.float64], b: NDArray[np.float64]) -> Floats:
    """Return the shortest solution of normal equations: what nothing shows is nothing."""
    return np.asarray(np.linalg.lstsq(a, b, rcond=1e-10)[0])


def _left(equations: _Equations) -> float:
    rest = equations.b - equations.a @ _solved(equations)
    return float(np.sum(rest**2))


def _apart(solved: Floats, angle: float) -> float:
    """Return by how much the angle of a solution is larger, the short way round."""
    own = float(np.arctan2(solved[1], solved[0]))
    return (own - angle + np.pi) % (2 * np.pi) - np.pi
