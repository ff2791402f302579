"""Which records does each topic of a ULog have, and what was lost?

In: the bytes. Out: `Records`: the data messages that `walk` finds, by subscription. Data of an
id that nobody subscribed are read where one format of the file alone, which nobody uses, fits them
by its size and by stamps that ascend.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.bytes.compiled import compiled
from fdi.telemetry.formats.ulog.definitions import Bytes, Layout, Subscription, extent, resolve
from fdi.telemetry.formats.ulog.kernels import sort_messages
from fdi.telemetry.formats.ulog.walk import MOST_OTHERS, Other, Run, Walk

Ints = NDArray[np.int64]
Stamps = NDArray[np.uint64]

_IDS: Final = 1 << 16
_HEADER: Final = 5  # bytes before the fields
_EVIDENCE: Final = 3  # data messages that must ascend before their topic is guessed
_MOST_PAIRS: Final = 100_000  # of ids and formats that are tried
_MOST_ALIKE: Final = 8  # formats of the same size; more tell nothing
_LARGEST_US: Final = 2**45  # a year since boot


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The data messages of one subscription, in file order.

    ``at``, ``stamp``: (n,) first bytes of the fields, and stamps (us since boot; zeros where the
    topic has none). ``is_guess``: nobody subscribed them, the topic is the only one that fits.
    """

    layout: Layout
    instance: int
    at: Ints
    stamp: Stamps
    is_guess: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """What a ULog consists of.

    Attributes
    ----------
    rows : tuple of Rows
    others : tuple of Other
        All other messages, in file order.
    opaque : tuple of (int, int, int)
        First byte, size and message id of data that nobody defines, in file order.
    undefined : tuple of str
        Topics that are subscribed and whose format is missing, circular or too large.
    lost : tuple of (int, int)
        Byte ranges that belong to no message.
    unknown : tuple of (int, int, int)
        First byte, size and type of whole messages of an unknown type.
    cut : tuple of (int, int)
        Byte ranges of messages that the end of the file, or of a part, cuts.
    left_out : Mapping
        How many other messages of a type are left out, because no vehicle has so many.
    """

    rows: tuple[Rows, ...]
    others: tuple[Other, ...]
    opaque: tuple[tuple[int, int, int], ...]
    undefined: tuple[str, ...]
    lost: tuple[tuple[int, int], ...]
    unknown: tuple[tuple[int, int, int], ...]
    cut: tuple[tuple[int, int], ...]
    left_out: Mapping[str, int]


def find_records(data: Bytes, parts: Sequence[tuple[int, int]]) -> Records:
    """Return the messages of these parts of the bytes, (from, to) each."""
    walk = Walk.over(data)
    for start, limit in parts:
        walk.part(start, limit)
    rows, left = _grouped(walk.found.messages, walk.subscriptions, data.size)
    guessed, left = _guessed(walk, left)
    opaque = [
        (at - _HEADER, walk.end(at - _HEADER), one)
        for one, places in left
        for at in places.tolist()
    ]
    return Records(
        (*rows, *guessed),
        tuple(sorted((*walk.others, *walk.late), key=lambda other: other.start)),
        tuple((low, high - low, one) for low, high, one in sorted(opaque)),
        tuple(sorted({one.topic for one in walk.waiting.values()})),
        tuple(walk.lost),
        tuple(walk.unknown),
        tuple(walk.cut),
        {kind: walk.left_out(kind) for kind in MOST_OTHERS},
    )


def _grouped(
    run: Run, subscriptions: Sequence[tuple[Subscription, Layout | None]], size: int
) -> tuple[list[Rows], list[tuple[int, Ints]]]:
    """Return the data messages by subscription, and those of ids without one."""
    bounds, starts, stamps = _sorted(run, size)
    of_number: dict[int, list[tuple[Subscription, Layout | None]]] = {}
    for pair in subscriptions:
        of_number.setdefault(pair[0].number, []).append(pair)
    rows, opaque = [], []
    for one in np.flatnonzero(np.diff(bounds)).tolist():
        here = slice(bounds[one], bounds[one + 1])
        at, stamp = starts[here], stamps[here]
        asked = of_number.get(one, [])
        split = np.searchsorted(at, [pair[0].since for pair in asked]).tolist()
        if split[:1] != [0]:  # before its first subscription, or without any
            opaque.append((one, at[: split[0]] if split else at))
        for (subscription, layout), low, high in zip(
            asked, split, [*split[1:], at.size], strict=bool(asked)
        ):
            if high == low:
                continue
            if layout is None:
                opaque.append((one, at[low:high]))
                continue
            said = stamp[low:high] if layout.stamp else np.zeros(high - low, np.uint64)
            rows.append(Rows(layout, subscription.instance, at[low:high], said))
    return rows, opaque


def _sorted(run: Run, size: int) -> tuple[Ints, Ints, Stamps]:
    """Return where the messages of each id begin; their fields' first bytes and stamps by id."""
    sort = compiled(sort_messages, size)
    if sort is not None:
        places = np.zeros(_IDS + 1, np.int64), np.empty_like(run.at), np.empty_like(run.stamp)
        sort(run.number, run.at, run.stamp, _HEADER, places)
        return places
    bounds = np.append(0, np.cumsum(np.bincount(run.number, minlength=_IDS)))
    # numpy sorts numbers of a byte in half the time; few logs have larger ids
    smallest = np.min_scalar_type(run.number.max(initial=0))
    order = np.argsort(run.number.astype(smallest), kind="stable")
    starts = run.at[order]
    starts += _HEADER
    return bounds, starts, run.stamp[order]


def _guessed(
    walk: Walk, opaque: Sequence[tuple[int, Ints]]
) -> tuple[list[Rows], list[tuple[int, Ints]]]:
    """Return the opaque data that one unused format alone fits, and the others."""
    used = {one.topic for one, _ in walk.subscriptions}
    used |= {one.topic for one in walk.waiting.values()}
    used |= {member.kind for one in walk.formats.values() for member in one.members}
    free = [name for name in sorted(walk.formats) if name not in used] if opaque else []
    if len(free) * len(opaque) > _MOST_PAIRS:
        return [], list(opaque)
    extents = [(name, some) for name in free if (some := extent(name, walk.formats))]
    fitting = [_fitting(walk, at, extents) for _, at in opaque]
    claims = Counter(layout.topic for fit in fitting for layout, _ in fit)
    found, left = [], []
    for (number, at), fit in zip(opaque, fitting, strict=True):
        if len(fit) == 1 and claims[fit[0][0].topic] == 1:
            found.append(Rows(fit[0][0], 0, at, fit[0][1], is_guess=True))
        else:
            left.append((number, at))
    return found, left


def _fitting(
    walk: Walk, at: Ints, extents: Sequence[tuple[str, tuple[int, int]]]
) -> list[tuple[Layout, Stamps]]:
    """Return the layouts that data can have, by their size and stamps that ascend."""
    size = walk.word[at - _HEADER] - 2
    low, high = int(size.min()), int(size.max())
    names = [name for name, (least, most) in extents if least <= low and high <= most]
    found = []
    for name in names if at.size >= _EVIDENCE and len(names) <= _MOST_ALIKE else ():
        layout = resolve(name, walk.formats)
        if layout is not None and layout.stamp is not None:
            stamp: Stamps = walk.long[at + layout.stamp.offset]
            if np.all(stamp[1:] > stamp[:-1]) and stamp[-1] < _LARGEST_US:
                found.append((layout, stamp))
    return found
