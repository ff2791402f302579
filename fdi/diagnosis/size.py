"""By how much is a sensor wrong?

In: alarms, the residuals in alarm that speak for a sensor, and their onset. Out: a `Size` with its
uncertainty, or None. Of the faults of the sensor that these residuals hold, the one counts that
explains the residuals best (``direction.py``), over the longest time for which a fault of one size
does; its size is given only where it does so well, stays the same from the first to the second
half, and no other fault of the sensor does as well.

Only a sensor reads too high or too low; what else fails has no size here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.diagnosis.direction import (
    BEGAN_S,
    FOLLOWS_S,
    LEAST_DRIFT_S,
    Extent,
    Fit,
    Hypothesis,
    Scene,
    directions,
    fit,
    gain,
    hypotheses,
    scene,
)
from fdi.diagnosis.values import Size
from fdi.model.evaluate import Floats
from fdi.residuals import Bank

Begun = Mapping[Hypothesis, Mapping[float, Floats]]
"""The directions of faults, by when they began."""
LENGTHS: Final = (20.0, 10.0, 6.0, 4.0)
"""s after the onset that may count, in the order of trial."""
ROUGHLY: Final = 4
"""Of the moments at which a fault may have begun every fourth tells which faults to look at, ..."""
FINALISTS: Final = 4
"""... and so many of them are looked at."""
EXPLAINED: Final = 0.8
"""Share of the sum of squares that a fit explains at the least, ..."""
MOSTLY: Final = 0.95
"""... and this share where what is left ..."""
LEFT: Final = 3.0
"""... is more than so many times what health brings."""
SURE: Final = 5.0
"""A size is so many of its sigmas from zero at the least."""
STEADY: Final = 0.2
"""By this share of the size, or two sigmas, the halves may differ from it."""
APART: Final = 6.0
"""By this, after what is left and its memory, a fault must explain more than the next one does:
twice the logarithm of a likelihood ratio."""
RELATIVE: Final = 0.04
"""Share of a size by which sensitivities may be off: scale factors, an atmosphere unlike ISO's,
what is disturbed beginning to follow. Chosen with the simulated flights."""


def size_of(
    alarms: Alarms, component: str, rows: Sequence[int], onset: float, span: tuple[float, float]
) -> Size | None:
    """Return by how much a sensor is wrong.

    Parameters
    ----------
    alarms : Alarms
    component : str
    rows : sequence of int
        The residuals in alarm that speak for it.
    onset : float
        s; when they began.
    span : (float, float)
        s; the flight.
    """
    bank = alarms.residuals.bank
    tried = [h for h in hypotheses(bank, component) if _concerned(h, rows, bank)]
    where = scene(alarms, component, onset, *span) if tried else None
    if where is None:
        return None
    finalists = _finalists(where, tried)
    for length in LENGTHS:
        first = _best(where, finalists, Extent(length, FOLLOWS_S))
        size = _told(first, where)
        if size is None and first:
            # without what is disturbed less is told apart, but it must not say otherwise
            free = _best(where, finalists, Extent(length, 0.0))
            if free and free[0].hypothesis.names == first[0].hypothesis.names:
                size = _told(free, where)
        if size is not None:
            return size
    return None


def _finalists(where: Scene, tried: Sequence[Hypothesis]) -> Begun:
    """Return the faults that explain most, roughly, over the longest or the shortest time."""
    rough = {h: directions(where, h, BEGAN_S[h.shape][::ROUGHLY]) for h in tried}
    found: dict[Hypothesis, None] = {}
    for length in (LENGTHS[0], LENGTHS[-1]):
        extent = Extent(length, FOLLOWS_S)
        gains = {h: gain(where, h, extent, begun) for h, begun in rough.items()}
        found.update(dict.fromkeys(sorted(tried, key=lambda h: -gains[h])[:FINALISTS]))
    return {h: directions(where, h, BEGAN_S[h.shape]) for h in found}


def _best(where: Scene, finalists: Begun, extent: Extent) -> list[Fit]:
    """Return the fits of faults, best first."""
    fits = [
        fit(where, h, extent, begun)
        for h, begun in finalists.items()
        if h.shape == "bias" or extent.length >= LEAST_DRIFT_S
    ]
    return sorted((found for found in fits if found is not None), key=lambda found: -found.gain)


def _told(own: Sequence[Fit], where: Scene) -> Size | None:
    """Return the size by the first fit, if it explains the residuals and no other one does."""
    if not own or not _explains(own[0]):
        return None
    against = _against(own, where)
    return None if against is None else _size(own[0], against, where)


def _concerned(hypothesis: Hypothesis, rows: Sequence[int], bank: Bank) -> bool:
    entered = set(hypothesis.equations)
    return any(entered & set(bank.generators[row].equations) for row in rows)


def _against(own: Sequence[Fit], where: Scene) -> tuple[str, ...] | None:
    """Return the twin that explains as much by the opposite size, () if nothing else does.

    None where a fault of another kind explains as much.
    """
    best = own[0]
    apart = APART * max(1.0, best.left) * where.inflation
    rivals = [
        found
        for found in own[1:]
        if found.hypothesis.names != best.hypothesis.names and best.gain - found.gain < apart
    ]
    if not rivals:
        return ()
    first = rivals[0]
    is_twin = (
        len(rivals) == 1
        and first.hypothesis.field == best.hypothesis.field
        and first.value * best.value < 0
    )
    return first.hypothesis.names if is_twin else None


def _explains(best: Fit) -> bool:
    most = max(STEADY * abs(best.value), 2.0 * _sigma(best))
    return (
        best.explained >= EXPLAINED
        and (best.left <= LEFT or best.explained >= MOSTLY)
        and abs(best.value) >= SURE * best.sigma
        and all(abs(half - best.value) <= most for half in best.halves)
    )


def _sigma(best: Fit) -> float:
    return float(np.hypot(best.sigma, RELATIVE * best.value))


def _size(best: Fit, against: tuple[str, ...], where: Scene) -> Size:
    return Size(
        best.hypothesis.names,
        against,
        best.hypothesis.shape,
        best.value,
        _sigma(best),
        best.hypothesis.unit,
        best.since,
        *_shown(best, where),
    )


def _shown(best: Fit, where: Scene) -> tuple[float | None, str]:
    """Return what the size is in the residual that it moves most, if that has another unit."""
    system = where.bank.system
    moved = np.where(np.isfinite(best.moved) & ~where.rate[:, None], best.moved, 0.0)
    telling = int(np.argmax((moved**2).sum(axis=1)))
    unit = system.equations[where.bank.generators[where.rows[telling]].residual].unit
    own = np.flatnonzero(moved[telling])
    if best.hypothesis.shape == "drift":
        own = own[where.piece.t[own] > best.since]
    if unit == best.hypothesis.unit or not len(own):
        return None, ""
    each = np.abs(moved[telling, own] * where.spread[telling, own])
    if best.hypothesis.shape == "drift":
        each /= where.piece.t[own] - best.since
    return float(np.median(each)), unit
