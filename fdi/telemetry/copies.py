"""Which channels of a log are one source, said twice?

In: the channels that a model asks of a log. Out: `Copy`, a pair of them each: the values of the one
come back in the other, up to a constant, sign, scale, resolution and delay, over the whole log.
What says the same twice is no witness: that the two agree tells nothing about the sensor.

A value of the one is looked for among the values of the other about that time. Two sensors that
measure the same come close, but hit the same step of their resolution by chance only; how often
chance hits is seen at displaced times. A quantity that hardly changes hits all the time: nothing
follows then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final

import numpy as np

from fdi.shown import Shown
from fdi.telemetry.channel import Channel
from fdi.telemetry.signals import (
    Floats,
    Material,
    Records,
    Request,
    Sampling,
    records_of,
    states_at_records,
)

LEAST_RECORDS: Final = 30
"""Of the sparser channel; fewer are no long stretch."""
SHARE: Final = 0.98
"""So many values must come back: the link may have lost records of the other."""
CHANCE: Final = 0.5
"""And at other times so few at the most."""
LATE_S: Final = 1.0
"""A copy is sent at most so much later or earlier, and at most two periods of its own."""
DISPLACED_S: Final = (-31.0, -13.0, 13.0, 31.0)
"""Far from the delay of a copy, and from each other."""
DELAYS_S: Final = tuple(0.05 * step for step in range(-20, 21))
"""At which an offset is looked for."""
ALIKE: Final = 0.9
"""Channels with a smaller correlation are no copies, whatever their delay."""
SMALL: Final = 10.0
"""Times which an offset is smaller than the motion where it is none."""
FITS: Final = 0.25
"""A scale that differs from one by less is one: both are in SI, and lost records change it too."""
EXACT: Final = 1e-9
"""Relative; what a conversion of units leaves: finer than the seventh decimal of a degree."""


@dataclass(frozen=True, slots=True)
class Copy(Shown):
    """A channel, ``of`` which it may be a copy, and how far it is one.

    ``scale`` and ``offset`` lead from ``of`` to ``channel``, ``share`` of the ``records`` values of
    the sparser one come back in the other.
    """

    channel: Channel
    of: Channel
    scale: float
    offset: float
    share: float
    records: int

    @property
    def repeats(self) -> bool:
        """Return whether it is a copy: lost records aside, all values come back."""
        return self.share >= SHARE


def compare_channels(
    material: Material, pairs: Sequence[tuple[Request, Request]]
) -> tuple[Copy, ...]:
    """Return how far the second channel of every pair repeats the first.

    Left out are codes and counts, of which a few values are the same by chance, and channels that
    move too little to tell.
    """
    read: dict[Channel, Records] = {}
    states = states_at_records(material, chain.from_iterable(pairs), Sampling())
    found = []
    for pair in pairs:
        for request in pair:
            if request.channel not in read:
                read[request.channel] = records_of(material, request, Sampling(), states)
        (of, first), (channel, second) = ((r.channel, read[r.channel]) for r in pair)
        if first.is_discrete or second.is_discrete:
            continue
        copy = compare(of, first, channel, second)
        if copy is not None:
            found.append(copy)
    return tuple(found)


def compare(of: Channel, first: Records, channel: Channel, second: Records) -> Copy | None:
    """Return how far one channel repeats another, None where nothing tells."""
    first, second = _known(first), _known(second)
    if min(first.t.size, second.t.size) < LEAST_RECORDS:
        return None
    line = _line(first, second)
    if line is None:
        moves = np.ptp(first.value) > 0 or np.ptp(second.value) > 0
        return Copy(channel, of, 0.0, 0.0, 0.0, second.t.size) if moves else None
    scale, offset = line
    moved = Records(first.t, scale * first.value + offset, first.is_circular)
    steps = [step(moved.value), step(second.value)]
    tolerance = EXACT * float(np.abs(second.value).max()) + 0.5 * max(steps)
    if abs(steps[0] - steps[1]) < 0.1 * max(steps):  # of the same resolution: the same step
        tolerance *= 0.5
    late = min(LATE_S, 2.0 * max(first.period, second.period))
    # the sparser one is looked for in the other
    sparse, dense = sorted((moved, second), key=lambda one: one.t.size)
    share = _share(sparse, dense, 0.0, late, tolerance)
    if share is None:
        return None
    if share < SHARE:
        return Copy(channel, of, scale, offset, share, sparse.t.size)
    others = [_share(sparse, dense, by, late, tolerance) for by in DISPLACED_S]
    chance = [other for other in others if other is not None]
    if not chance or max(chance) > CHANCE:
        return None
    return Copy(channel, of, scale, offset, share, sparse.t.size)


def step(value: Floats) -> float:
    """Return the resolution of values: the smallest difference that is no rounding, 0 for none.

    Examples
    --------
    >>> step(np.array([0.1, 0.3, 0.2, 0.7]))
    0.1
    """
    apart = np.diff(np.unique(value))
    apart = apart[apart > EXACT * np.abs(value).max()]
    return round(float(apart.min()), 12) if apart.size else 0.0


def _known(records: Records) -> Records:
    known = np.isfinite(records.value)
    return Records(records.t[known], records.value[known], records.is_circular)


def _line(first: Records, second: Records) -> tuple[float, float] | None:
    """Return scale and offset from the first to the second, None where they do not go together."""
    inside = (second.t >= first.t[0]) & (second.t <= first.t[-1])
    if inside.sum() < LEAST_RECORDS:
        return None
    x, y = np.interp(second.t[inside], first.t, first.value), second.value[inside]
    if first.is_circular:
        close = np.abs((y - x + np.pi) % (2 * np.pi) - np.pi)
        return (1.0, 0.0) if np.median(close) < np.ptp(y) / 10 else None
    # of the records themselves: between them there is less to see
    spread = [float(np.std(one)) for one in (first.value, second.value)]
    if not min(*spread, float(np.ptp(x)), float(np.ptp(y))) > 0.0:
        return None
    together = float(np.corrcoef(x, y)[0, 1])
    if abs(together) < ALIKE:
        return None
    scale = float(np.sign(together)) * spread[1] / spread[0]
    if abs(abs(scale) - 1.0) < FITS:
        scale = float(np.sign(scale))
    if abs(np.median(y - scale * x)) < spread[1] / SMALL:
        return scale, 0.0
    # of a copy that comes late the offset shows exactly where records are paired by their order
    apart = [y - scale * _nearest(first, second.t[inside] - late) for late in DELAYS_S]
    offset = float(np.median(min(apart, key=_wide)))
    return scale, offset


def _nearest(records: Records, t: Floats) -> Floats:
    after = np.clip(np.searchsorted(records.t, t), 1, records.t.size - 1)
    before = t - records.t[after - 1] < records.t[after] - t
    return np.where(before, records.value[after - 1], records.value[after])


def _wide(values: Floats) -> float:
    return float(np.median(np.abs(values - np.median(values))))


def _share(
    sparse: Records, dense: Records, displaced: float, late: float, tolerance: float
) -> float | None:
    """Return the share of values that come back about their time; None where nothing overlaps."""
    t = sparse.t + displaced
    inside = (t - late >= dense.t[0]) & (t + late <= dense.t[-1])
    if inside.sum() < LEAST_RECORDS:
        return None
    begin = np.searchsorted(dense.t, t[inside] - late)
    end = np.searchsorted(dense.t, t[inside] + late)
    value = sparse.value[inside]
    hit = np.zeros(value.size, bool)
    for k in range(int((end - begin).max())):
        place = np.minimum(begin + k, dense.t.size - 1)
        apart = np.abs(dense.value[place] - value)
        if sparse.is_circular:
            apart = np.minimum(apart, 2 * np.pi - apart)
        hit |= (begin + k < end) & (apart <= tolerance)
    return float(hit.mean())
