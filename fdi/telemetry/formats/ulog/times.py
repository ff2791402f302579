"""When was each record of a ULog made?

In: the stamps of every topic (us since boot) and where its records stand in the file. Out: `Times`:
t of every record, s of the log's clock, 0 at the header's own stamp; the clock; what was repaired.

The vehicle has one clock, so a topic whose stamps ascend and end with the file is right as it is.
The others are held against their place in the file, for which the topic with most records gives the
time: a stamp that contradicts it (a bit error, another clock, a stamp that never moves) gives way.
What was published before the log began, and is written at its beginning, stands at t = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.clock import Clock, pace_of, timeline
from fdi.telemetry.formats.gaps import GAP_S
from fdi.telemetry.message import Floats
from fdi.telemetry.quality import Kind, QualityRecord

Ints = NDArray[np.int64]
Stamps = NDArray[np.uint64]

SLACK_S: Final = (
    5.0  # records are written up to seconds after they were made (rate limits, dropouts)
)
_SAMPLES: Final = 5_000  # of the topic that gives the time to places in the file
_NAMED: Final = 4  # topics that a finding names
_ASCENDING: Final = 0.8  # share of forward steps among all that move


@dataclass(frozen=True, slots=True, eq=False)
class Stamped:
    """The records of a topic: their places in the file and stamps, (n,) each."""

    name: str
    at: Ints
    stamp: Stamps


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Time by place in the file.

    ``at``, ``t``: (m,) float64 places and s of the log's clock; ``first``: (k,) where boots begin;
    ``offset``: (k,) s, t = seconds since boot + offset.
    """

    at: Floats
    t: Floats
    first: Floats
    offset: Floats
    quality: tuple[QualityRecord, ...]

    @property
    def has_pause(self) -> bool:
        """Whether the topic that gives the time was silent for as long as a gap lasts."""
        return bool(np.any(np.diff(self.t) > GAP_S))

    def expected(self, at: Ints | Floats) -> Floats:
        """Return the time that a place in the file suggests, (n,)."""
        if not self.at.size:
            return np.zeros(at.size)
        t: Floats = np.interp(at, self.at, self.t)
        return t

    def said(self, at: Ints, stamp: Stamps) -> Floats:
        """Return the time that stamps state, (n,)."""
        seconds: Floats = stamp / 1e6
        if self.first.size == 1:
            seconds += self.offset[0]
        else:
            boot = np.searchsorted(self.first, at, side="right") - 1
            seconds += self.offset[np.maximum(boot, 0)]
        return seconds

    def at_place(self, at: int) -> float:
        """Return the time that the records around a place suggest, not before the log began."""
        return max(float(self.expected(np.array([at]))[0]), 0.0)

    def of_stamp(self, stamp: int, at: int) -> float:
        """Return the time of a single stamp, that of its place where it lies after that."""
        expected = float(self.expected(np.array([at]))[0])
        said = float(self.said(np.array([at]), np.array([stamp], np.uint64))[0])
        return max(said if said <= expected + SLACK_S else expected, 0.0)


def reference(topics: Sequence[Stamped], start_us: int) -> Reference:
    """Return the time by place in the file, 0 at the header's stamp where that can be."""
    best = max(topics, key=_worth, default=None)
    if best is None or not _worth(best):
        return Reference(np.empty(0), np.empty(0), np.zeros(1), np.zeros(1), ())
    step = -(-best.at.size // _SAMPLES)
    at, stamp = best.at[::step].astype(np.float64), best.stamp[::step]
    rows = np.arange(at.size)
    line = timeline(stamp, rows, (stamp // np.uint64(1000)).astype(np.int64), rows)
    seconds = stamp / 1e6
    apart = line.created - seconds
    offset = np.array([np.median(apart[line.boot == k]) for k in range(line.first.size)])
    zero = float(line.created[0]) - float(offset[0])  # the first stamp, unless that was damaged
    if abs(start_us / 1e6 - zero) <= SLACK_S:
        zero = start_us / 1e6
    # exact for the first boot: the timeline knows the time since boot to the millisecond
    shift = -zero - offset[0]
    return Reference(at, line.created + shift, at[line.first], offset + shift, line.quality)


def _worth(topic: Stamped) -> int:
    """Return how well a topic can give the time: its steps, 0 where its stamps do not ascend.

    A step of nothing, as of records that were written twice, tells nothing.
    """
    forward = int(np.count_nonzero(topic.stamp[1:] > topic.stamp[:-1]))
    if forward < _ASCENDING * topic.stamp.size:  # else there is no need to look for the others
        moving = int(np.count_nonzero(topic.stamp[1:] != topic.stamp[:-1]))
        return forward if forward >= _ASCENDING * moving else 0
    return forward


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """When the records of a topic were made.

    Attributes
    ----------
    t : (m,) float64, s
        Strictly ascending.
    kept : (m,) int or None
        The records that it belongs to: of those with the same time the last one; None for all.
    stamp : (n,) float64, s
        As the records state it.
    wrong : int
        How many have their time from their place in the file, because ...
    is_still : bool
        ... their stamps stand still; else, because they contradict it.
    """

    t: Floats
    kept: Ints | None
    stamp: Floats
    wrong: int = 0
    is_still: bool = False


def placed(topic: Stamped, known: Reference) -> Placed:
    """Return when the records of a topic were made."""
    stamp = known.said(topic.at, topic.stamp)
    ends = known.expected(topic.at[[0, -1]]) + SLACK_S
    is_still = stamp.size > 1 and bool(topic.stamp[0] == topic.stamp[-1])
    if not is_still and stamp[0] <= ends[0] and stamp[-1] <= ends[1]:
        if stamp[0] >= 0 and np.all(stamp[1:] > stamp[:-1]):
            return Placed(stamp, None, stamp)
        if np.all(stamp[1:] >= stamp[:-1]):
            return Placed(*_ascending(np.maximum(stamp, 0.0)), stamp)
    expected = known.expected(topic.at)
    wrong = np.abs(stamp - expected) > SLACK_S
    wrong[0] = stamp[0] > ends[0]  # the first one may be of long ago
    if is_still and np.ptp(topic.stamp) == 0:
        wrong[:] = True
    if not wrong.all():  # between two right records of the topic, else by all records
        among = np.interp(topic.at, topic.at[~wrong], stamp[~wrong], left=np.nan, right=np.nan)
        expected = np.where(np.isnan(among), expected, among)
    t, kept = _ascending(np.maximum(np.where(wrong, expected, stamp), 0.0))
    return Placed(t, kept, stamp, int(wrong.sum()), is_still)


def _ascending(t: Floats) -> tuple[Floats, Ints | None]:
    """Return t, strictly ascending, and the records that it belongs to."""
    if np.all(t[1:] > t[:-1]):
        return t, None
    rows = np.arange(t.size)
    if not np.all(t[1:] >= t[:-1]):
        rows = np.argsort(t, kind="stable")
        t = t[rows]
    is_last = np.append(t[1:] > t[:-1], True)
    return t[is_last], rows[is_last]


def time_records(found: Sequence[tuple[Stamped, Placed]]) -> list[QualityRecord]:
    """Return which topics have other times than they state, and which records share one."""
    early = {s.name: int(np.count_nonzero(p.stamp < 0)) - 1 for s, p in found}
    told: list[tuple[Kind, str, dict[str, int]]] = [
        (
            "repaired",
            "have stamps that contradict their place in the file, which decides",
            {s.name: p.wrong for s, p in found if not p.is_still},
        ),
        (
            "repaired",
            "have stamps that stand still: their place in the file decides",
            {s.name: p.wrong for s, p in found if p.is_still},
        ),
        (
            "duplicate",
            "were published before the log began: the last one of each topic stands at t = 0",
            early,
        ),
        (
            "duplicate",
            "have the time of another one: the last is kept",
            {s.name: p.stamp.size - p.t.size - max(early[s.name], 0) for s, p in found},
        ),
    ]
    made = []
    for kind, words, counts in told:
        some = sorted((-count, name) for name, count in counts.items() if count > 0)
        if some:
            total = -sum(count for count, _ in some)
            names = ", ".join(f"{name} {-count}" for count, name in some[:_NAMED])
            more = f" and {len(some) - _NAMED} more topics" if len(some) > _NAMED else ""
            text = f"{total} records {words} ({names}{more})"
            made.append(QualityRecord(kind, None, None, None, total, text))
    return made


def clock(known: Reference, t: Floats, utc: Floats) -> Clock:
    """Return the log's clock; at times t (m,) a receiver tells UTC, s since 1970."""
    start = known.expected(known.first)
    start[:1] = -np.inf
    piece = np.searchsorted(start, t, side="right") - 1
    gap = utc - t
    parts = [gap[piece == k] for k in range(start.size)]
    offset = np.array([np.median(part) if part.size else np.nan for part in parts])
    late = np.abs(gap - offset[piece])
    uncertainty = float(np.quantile(late, 0.95)) if late.size > 1 else np.nan
    boot = -known.offset if known.at.size else np.full(start.size, np.nan)
    source = "vehicle" if late.size else "none"
    boot_uncertainty = 0.0 if known.at.size else np.nan
    pace = pace_of(t, utc, piece)
    return Clock(start, boot, offset, boot_uncertainty, uncertainty, source, pace)
