"""When did it happen: on the log's clock, since boot, and in UTC?

In: the recorder's stamps of all records, and what the vehicle's own clock said in some of them.
Out: a `Timeline` (a time for every record) and the log's `Clock`.

The log's clock is in seconds and 0 at the file's first record. A record that says when the vehicle
made it has that time plus one constant per boot: the lower envelope of (stamp - boot), which is the
fastest way through the link. For the others the delay of the records around them in the file is
taken off their stamps, so that a slow or bursting link does not shift one message against another.

Repaired and reported: single wrong stamps, runs of records that a clock threw far off
(`thrown.py`), backward steps, steps of the recorder's clock that the vehicle's clock does not
share, leaps of the vehicle's by more than an hour that the recorder's does not share, reboots, and
pauses of more than an hour (shortened: between two recordings in one file, or made by damage).
Drift between the two clocks (some 50 ppm) is left in.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.shown import Shown
from fdi.telemetry.quality import ANEW, Kind, QualityRecord
from fdi.telemetry.thrown import STEP_S, Thrown, put_back

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SPIKE_S: Final = 1.0  # a stamp this far from the median of its neighbours is wrong
REBOOT_S: Final = 1.0  # boot time stepping back by more (formats.md 1.3)
_FEW_OF_A_BOOT: Final = 3  # records; a damaged one or two are none
PAUSE_S: Final = 3600.0  # a longer one lies between two recordings, or is none
SHORT_PAUSE_S: Final = 60.0  # what is left of it
_ENVELOPE: Final = 50  # records on either side that decide whether a delay is there to stay
_BLOCK: Final = 1 << 15  # records looked at together: they stay in the cache
_FAR_US: Final = 3 * 86_400_000_000  # from the rest of the file: no stamp of this recording
_SINGLE: Final = 20  # more findings of one kind are told as one
_LARGEST_US: Final = 2**61  # stamps beyond (year 75,000) only have to stay in range
_MOST_JUMPS: Final = 1000  # of the recorder's clock; each costs a pass over the file
_UTC_RANGE: Final = (946684800.0, 4102444800.0)  # 2000 to 2100: stamps outside are no UTC


_CLOCK_OFF: Final = 0.005
"""Crystals keep to 0.0001; a board whose clock is divided otherwise than meant is off by per cents
(13/12 on early Linux boards)."""
_TOLD_LATE_S: Final = 1.0
"""A receiver's time is recorded a few tenths of a second late, by no constant delay."""
_MOST_PACE: Final = 2.0
"""What runs faster than that tells no time."""


@dataclass(frozen=True, slots=True, eq=False)
class Clock(Shown):
    """Converts the log's clock to seconds since boot and to UTC, piece by piece (one per boot).

    Attributes
    ----------
    start : (k,) float64, s
        From where a piece holds.
    boot_offset, utc_offset : (k,) float64, s
        What is added to t; NaN where unknown.
    boot_uncertainty, utc_uncertainty : float
        s, 95 %; NaN where unknown. The recorder's UTC is only as good as its host's clock.
    utc_source : str
        ``vehicle`` (satellite time), ``recorder`` (host clock) or ``none``.
    pace : float
        Seconds of satellite time that go to one of the vehicle's clock; 1 where that is not told,
        or within what a clock and a receiver's delay are off by.
    """

    start: Floats
    boot_offset: Floats
    utc_offset: Floats
    boot_uncertainty: float
    utc_uncertainty: float
    utc_source: str
    pace: float = 1.0

    @property
    def boot_known(self) -> bool:
        """Whether any time since boot is known."""
        return bool(np.isfinite(self.boot_offset).any())

    @property
    def utc_known(self) -> bool:
        """Whether any UTC is known."""
        return bool(np.isfinite(self.utc_offset).any())

    def boot(self, t: float) -> float | None:
        """Return seconds since boot at t, None where unknown."""
        value = t + float(self.boot_offset[self._piece(t)])
        return value if np.isfinite(value) else None

    def utc(self, t: float) -> str | None:
        """Return UTC at t as an ISO 8601 text to the millisecond, None where unknown."""
        value = t + float(self.utc_offset[self._piece(t)])
        if not np.isfinite(value) or not _UTC_RANGE[0] <= value <= _UTC_RANGE[1]:
            return None
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=value)
        return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")

    def _piece(self, t: float) -> int:
        return max(int(np.searchsorted(self.start, t, side="right")) - 1, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Timeline:
    """A time for every record of the file, (n,) each.

    ``created``: s of the log's clock, the best guess of when the vehicle made the record;
    ``boot``: which piece it belongs to: a boot, or a part of one before or behind a leap of its
    clock or a long pause; ``offset``: (k,) s, t = seconds since boot + offset[boot]; ``first``:
    (k,) the first record of every piece; ``restarts``: of the boots among them but the first;
    ``delay``: s, 95 % of the link's delay; ``zero``: s since 1970 on the recorder's clock at t = 0.
    """

    created: Floats
    boot: Ints
    offset: Floats
    first: Ints
    restarts: Ints
    delay: float
    zero: float
    quality: tuple[QualityRecord, ...]

    def offset_of(self, rows: Ints) -> Floats:
        """Return s, for some of the records: t = seconds since boot + offset."""
        return _offset_of(self.offset, self.boot, rows)


def likely_times(t: Floats, created: Floats, *, wrap: float, slack: float) -> Floats:
    """Return the times that records give themselves, ``created`` where they are unlikely.

    Parameters
    ----------
    t : (m,) float, s
        What they say; may have wrapped at ``wrap`` seconds.
    created : (m,) float, s
        `Timeline.created` of these records.
    slack : float
        s; more than that from the other records' clock is no time of this record.
    """
    far = np.abs(created - t)
    if (far > wrap / 2).any():
        t = t + np.rint((created - t) / wrap) * wrap
        far = np.abs(created - t)
    fits = far <= slack
    return t if fits.all() else np.where(fits, t, created)


def in_order(created: Floats) -> Floats:
    """Return the times of records of one message, in the order in which they were sent.

    The link's delay is guessed between records that tell their time: that alone may set a record
    back behind an earlier one.

    Parameters
    ----------
    created : (m,) float, s
        `Timeline.created` of these records, file order; further back than a link explains, they
        are returned as they are.
    """
    ahead = np.maximum.accumulate(created)
    return ahead if np.all(ahead - created <= STEP_S) else created


def last_boot(boot_ms: Ints, last: int) -> Ints:
    """Return which records behind the trusted message's last one are of another boot.

    A vehicle that started anew may say little until the log ends, and none of that message.

    Parameters
    ----------
    boot_ms : (m,) int
        What the records say, ms since boot, in file order.
    last : int
        The trusted message's last record among them.
    """
    of_this = np.flatnonzero(boot_ms[last:] >= boot_ms[last] - REBOOT_S * 1e3)
    first = last + 1 + int(of_this[-1])
    told = boot_ms[first:]
    ascends = told.size >= _FEW_OF_A_BOOT and bool(np.all(np.diff(told) >= 0))
    # a clock that stands still is none
    starts_anew = ascends and told[-1] > told[0]
    return np.arange(first, boot_ms.size) if starts_anew else np.empty(0, np.int64)


def _offset_of(offset: Floats, boot: Ints, rows: Ints) -> Floats:
    """Return the offset of the boot that records belong to."""
    return offset if offset.size == 1 else offset[boot[rows]]  # one boot: no need to look


def timeline(stamp_us: NDArray[np.uint64], rows: Ints, boot_ms: Ints, main: Ints) -> Timeline:
    """Return a time for every record.

    Parameters
    ----------
    stamp_us : (n,) uint64, us
        The recorder's stamps, file order.
    rows, boot_ms : (m,) int
        Records of the vehicle that say when they were made, in file order, and what they say, ms.
    main : (p,) int
        Which of these m (positions in ``rows``) are of one trusted message: they decide about
        boots.
    """
    zero_us, stamps, arrival, quality = _repair_stamps(stamp_us)
    zero = zero_us / 1e6
    main = np.delete(main, _spikes(boot_ms[main], SPIKE_S * 1e3))
    if not main.size:
        start, none = np.zeros(1, np.int64), np.empty(0, np.int64)
        unknown = np.array([np.nan])
        line = Timeline(
            arrival, _numbered(start, arrival.size), unknown, start, none, np.nan, zero, ()
        )
        return _without_pauses(line, quality)
    at = rows[main]
    told, thrown = put_back(boot_ms[main] / 1000)
    seconds = _unwrapped(told)
    if _tell_nothing(stamp_us, seconds):
        stamps = arrival = np.interp(np.arange(stamp_us.size), at, seconds - seconds[0])
        text = "the record stamps say nothing: times are taken from the time since boot"
        quality = [_finding("repaired", 0.0, int(stamp_us.size), text)]
    every = boot_ms / 1000
    every[main] = seconds
    boots = _first_of_boots(at, seconds, stamps, rows, every)
    leaps = _leaps(arrival, at, seconds)
    first = np.union1d(boots, leaps)
    arrival, jumps = _remove_clock_jumps(arrival, at, seconds, first)
    boot = _numbered(first, stamp_us.size)
    delay = arrival[at] - seconds
    offset = np.minimum.reduceat(delay, np.searchsorted(at, first))
    delay -= _offset_of(offset, boot, at)
    late = arrival[rows]
    late -= boot_ms / 1000
    late -= _offset_of(offset, boot, rows)
    wrapped = np.abs(late) > _MS_WRAP / 2
    if wrapped.any():
        late -= np.rint(late / _MS_WRAP) * _MS_WRAP
    restarts = boots[1:]
    found = [
        told_as_one([_finding("reboot", float(arrival[i]), 1, ANEW) for i in restarts]),
        told_as_one([_finding("clock_jump", float(arrival[i]), 1, _LEAPT) for i in leaps]),
        told_thrown(thrown, arrival[at], "times since boot"),
    ]
    _take_off_delays(arrival, rows, late, np.interp(rows, at, delay), first)
    late_s = float(np.quantile(delay, 0.95))
    line = Timeline(arrival, boot, offset, first, restarts, late_s, zero, ())
    return _without_pauses(line, [*quality, *jumps, *(one for some in found for one in some)])


_LEAPT: Final = "the vehicle's clock leapt forward by more than an hour: the record stamps decide"


def _numbered(first: Ints, count: int) -> Ints:
    """Return for every record the number of its piece."""
    number = np.arange(first.size, dtype=np.min_scalar_type(first.size))
    piece: Ints = np.repeat(number, np.diff(first, append=count))
    return piece


def _leaps(arrival: Floats, at: Ints, seconds: Floats) -> Ints:
    """Return the records from which on the vehicle's clock is ahead by more than any pause.

    No clock leaps by itself, and that the recorder's was set back by just what a pause lasted is
    less likely than damage.
    """
    step = np.diff(seconds)
    rows = np.flatnonzero(step > PAUSE_S)
    rows = rows[np.diff(arrival[at])[rows] < step[rows] - STEP_S]
    return np.array(
        [_widest_step(arrival, int(at[i]), int(at[i + 1])) for i in rows], dtype=np.int64
    )


def told_thrown(runs: tuple[Thrown, ...], t: Floats, what: str) -> list[QualityRecord]:
    """Return what is said of runs of records, of times ``t``, that were thrown and put back."""
    return told_as_one(
        [
            QualityRecord(
                "repaired",
                None,
                float(t[one.low]),
                float(t[one.high - 1]),
                one.high - one.low,
                f"{one.high - one.low} {what} are {one.by:+.1f} s off, and are put back",
            )
            for one in runs
        ]
    )


def _tell_nothing(stamp_us: NDArray[np.uint64], seconds: Floats) -> bool:
    """Return whether the stamps stand still or leap about while the vehicle's own clock runs."""
    if seconds.size < 2 or np.any(seconds[1:] < seconds[:-1]):
        return False
    back = np.flatnonzero(stamp_us[1:] < stamp_us[:-1])
    backward = np.count_nonzero(stamp_us[back] - stamp_us[back + 1] > STEP_S * 1e6)
    run = float(stamp_us.max() - stamp_us.min()) / 1e6
    share = backward / stamp_us.size
    return bool(share > MOST_BACKWARD or run < LEAST_RUN * float(np.ptp(seconds)))


def _take_off_delays(arrival: Floats, rows: Ints, late: Floats, delay: Floats, first: Ints) -> None:
    """Make of arrival when the records were made: less the delay of the timed ones around them.

    ``late`` is the delay of the timed records by the time that they give themselves, ``delay`` what
    the trusted message suggests there; a record that says something else (another clock, a stale
    value) is left out.
    """
    fits = np.abs(late - delay) < 0.5 * SPIKE_S
    if not fits.all():
        rows, late = rows[fits], late[fits]
    for low, high in zip(first.tolist(), [*first[1:].tolist(), arrival.size], strict=True):
        known = slice(*np.searchsorted(rows, [low, high]))
        if rows[known].size:
            _take_off(arrival, low, high, rows[known], late[known])


def _take_off(arrival: Floats, low: int, high: int, rows: Ints, late: Floats) -> None:
    """Take off the delay from records low to high, linear between the rows where it is known."""
    for first in range(low, high, _BLOCK):
        last = min(first + _BLOCK, high)
        near = slice(
            max(int(np.searchsorted(rows, first, side="right")) - 1, 0),
            int(np.searchsorted(rows, last)) + 1,
        )
        arrival[first:last] -= np.interp(np.arange(first, last), rows[near], late[near])


MOST_BACKWARD: Final = 0.05
"""Share of stamps that step back by more than ``STEP_S``; clocks that are set do so a few times."""
LEAST_RUN: Final = 0.01
"""Stamps that run slower than this against the vehicle's clock stand still."""
_MS_WRAP: Final = 2**32 / 1000  # s, 49.7 days: time_boot_ms has 32 bits


def _finding(kind: Kind, t: float, count: int, text: str) -> QualityRecord:
    return QualityRecord(kind, None, t, t, count, text)


def _spikes(values: Ints | Floats, limit: float) -> Ints:
    """Return where values leave the median of the five around them (nowhere while they ascend)."""
    n = values.size
    steps_back = np.flatnonzero(values[1:] < values[:-1])
    if n < 3 or not steps_back.size:
        return np.empty(0, np.int64)
    # away from any step back the five ascend, and the middle one is their median
    rows = np.unique(np.clip(steps_back[:, None] + np.arange(-2, 4), 0, n - 1))
    around = rows[:, None] + np.arange(-2, 3)
    windows = np.asarray(values[np.clip(around, 0, n - 1)], np.float64)
    # beyond the ends, what keeps an ascending sequence its own median
    windows[around < 0], windows[around >= n] = -np.inf, np.inf
    far: Ints = rows[np.abs(values[rows] - np.median(windows, axis=1)) > limit]
    return far


def _repair_stamps(
    stamp_us: NDArray[np.uint64],
) -> tuple[int, Floats, Floats, list[QualityRecord]]:
    """Return the first stamp (us), and from there all in s: without spikes, and ascending."""
    # whole microseconds as long as possible: float64 holds 1.6e15 us to 0.25 us only
    stamps = np.minimum(stamp_us, np.uint64(_LARGEST_US)).view(np.int64)
    wrong = np.union1d(_spikes(stamps, SPIKE_S * 1e6), _far_ends(stamps))
    if 0 < wrong.size < stamps.size:
        right = np.delete(np.arange(stamps.size), wrong)
        stamps[wrong] = np.rint(np.interp(wrong, right, stamps[right])).astype(np.int64)
    zero = min(max(int(stamps[0]), 0), _LARGEST_US) if stamps.size else 0
    stamps -= zero
    seconds, thrown = put_back(stamps / 1e6)
    arrival = seconds
    back = np.flatnonzero(arrival[1:] < arrival[:-1]) + 1
    back = back[arrival[back] - arrival[back - 1] < -STEP_S]
    steps = arrival[back] - arrival[back - 1]
    if back.size:
        shift = np.zeros(arrival.size)
        shift[back] = -steps
        arrival = arrival + np.cumsum(shift)
    quality = []
    if wrong.size:
        text = f"{wrong.size} record stamps are wrong: interpolated"
        first, last = float(arrival[wrong[0]]), float(arrival[wrong[-1]])
        quality.append(QualityRecord("repaired", None, first, last, int(wrong.size), text))
    jumps = [
        _finding(
            "clock_jump",
            float(arrival[row]),
            1,
            f"the recorder's clock stepped back by {-step:.3f} s",
        )
        for row, step in zip(back, steps, strict=True)
    ]
    quality += told_thrown(thrown, arrival, "record stamps")
    return zero, seconds, arrival, [*quality, *told_as_one(jumps)]


def told_as_one(found: list[QualityRecord]) -> list[QualityRecord]:
    """Return the findings, a long list of one kind as a single one."""
    if len(found) <= _SINGLE:
        return found
    first, last = found[0], found[-1]
    text = f"{len(found)} times, the first: {first.text}"
    return [QualityRecord(first.kind, None, first.start, last.start, len(found), text)]


def _far_ends(stamps: Ints) -> Ints:
    """Return the first or last row where its stamp (us) lies days from its neighbour's."""
    if stamps.size < 3:
        return np.empty(0, np.int64)
    is_far = np.array([stamps[1] - stamps[0] > _FAR_US, stamps[-1] - stamps[-2] > _FAR_US])
    rows: Ints = np.array([0, stamps.size - 1])[is_far]
    return rows


def _unwrapped(seconds: Floats) -> Floats:
    step = np.diff(seconds, prepend=seconds[:1])
    whole: Floats = seconds + np.cumsum(np.where(step < -_MS_WRAP / 2, _MS_WRAP, 0.0))
    return whole


def _first_of_boots(at: Ints, seconds: Floats, stamps: Floats, rows: Ints, told: Floats) -> Ints:
    """Return the first record of every boot: where boot time steps back and stays back.

    The trusted message decides whether, at the records ``at``; all that tell their time decide
    where, the records ``rows`` which tell ``told``, s.
    """
    first = [0]
    for i in np.flatnonzero(np.diff(seconds) < -REBOOT_S):
        if np.all(seconds[i + 1 : i + 4] < seconds[i] - REBOOT_S):
            between = slice(*np.searchsorted(rows, at[i : i + 2] + 1))
            is_old = told[between] > (seconds[i] + seconds[i + 1]) / 2
            # the cut at which most of them are on their side; one of them may be wrong
            right = np.cumsum(np.append(0, np.where(is_old, 1, -1)))
            around = np.append(at[i], rows[between])
            cut = int(np.argmax(right))
            first.append(_widest_step(stamps, int(around[cut]), int(around[cut + 1])))
    return np.array(first)


def _widest_step(stamps: Floats, low: int, high: int) -> int:
    """Return the record in (low, high] that follows the longest pause or step of the stamps."""
    return low + 1 + int(np.argmax(np.abs(np.diff(stamps[low : high + 1]))))


def _remove_clock_jumps(
    arrival: Floats, rows: Ints, seconds: Floats, first: Ints
) -> tuple[Floats, list[QualityRecord]]:
    """Return the stamps without the steps that the vehicle's clock does not share."""
    boot = np.searchsorted(first, rows, side="right")
    delay = arrival[rows] - seconds
    same = np.diff(boot) == 0
    found, places, steps = [], [], []
    moved, done = 0.0, 0  # the steps found so far, and how many delays are free of them
    for i in np.flatnonzero((np.abs(np.diff(delay)) > STEP_S) & same)[:_MOST_JUMPS]:
        low, high = max(i + 1 - _ENVELOPE, 0), min(i + 1 + _ENVELOPE, delay.size)
        delay[done:high] -= moved
        done = max(done, high)
        # a link that stalls and then catches up returns to its lower envelope; a clock does not
        before = delay[low : i + 1][boot[low : i + 1] == boot[i]]
        after = delay[i + 1 : high][boot[i + 1 : high] == boot[i]]
        step = float(after.min() - before.min())
        if abs(step) <= STEP_S:
            continue
        at = _widest_step(arrival, int(rows[i]), int(rows[i + 1]))
        delay[i + 1 : done] -= step
        moved += step
        places.append(at)
        steps.append(step)
        text = f"the recorder's clock jumped by {step:+.3f} s against the vehicle's"
        found.append(_finding("clock_jump", float(arrival[at] - moved), 1, text))
    if places:
        shift = np.zeros(arrival.size)
        np.add.at(shift, places, steps)
        arrival = arrival - np.cumsum(shift)
    return arrival, told_as_one(found)


def _without_pauses(line: Timeline, quality: list[QualityRecord]) -> Timeline:
    """Return a timeline with its findings, and pauses of more than an hour shortened.

    However it came about: nothing was recorded in it, and every grid would have to go through it.
    The time since boot stays as it is told, for each side of a pause is a piece of its own.
    """
    step = np.diff(line.created)
    rows = np.flatnonzero(step > PAUSE_S) + 1
    if not rows.size:
        return replace(line, quality=tuple(quality))
    shift = np.zeros(line.created.size)
    shift[rows] = step[rows - 1] - SHORT_PAUSE_S
    total = np.cumsum(shift)
    created = line.created - total
    first = np.union1d(line.first, rows)
    piece = np.searchsorted(line.first, first, side="right") - 1
    ends, earlier = np.maximum.accumulate(line.created[rows]), np.append(0.0, total[rows])

    def moved(one: QualityRecord) -> QualityRecord:
        told = (
            None if t is None else t - float(earlier[np.searchsorted(ends, t, side="right")])
            for t in (one.start, one.end)
        )
        start, end = told
        return replace(one, start=start, end=end)

    pauses = [
        _finding("clock_jump", float(created[i - 1]), 1, pause_text(float(step[i - 1])))
        for i in rows
    ]
    return replace(
        line,
        created=created,
        boot=_numbered(first, created.size),
        offset=line.offset[piece] - total[first],
        first=first,
        quality=(*(moved(one) for one in quality), *told_as_one(pauses)),
    )


def pause_text(pause: float) -> str:
    """Return what is said of a pause, s, that is shortened."""
    return (
        f"nothing is recorded for {pause / 3600:.1f} h (two recordings, or a clock that is "
        f"damaged): shown as {SHORT_PAUSE_S:g} s"
    )


def make_clock(line: Timeline, utc_rows: Ints, utc: Floats, stamp_us: NDArray[np.uint64]) -> Clock:
    """Return the log's clock.

    Parameters
    ----------
    utc_rows, utc : (m,)
        Records that give the vehicle's UTC, and what they say, s since 1970.
    """
    created, first = line.created, line.first
    gap = _median_per_boot(utc_rows, utc - created[utc_rows], first)
    source, uncertainty = "vehicle", line.delay
    if not np.isfinite(gap).any():
        stamps = stamp_us.astype(np.float64) / 1e6
        gap = _median_per_boot(np.arange(stamps.size), stamps - created, first)
        with np.errstate(invalid="ignore"):
            is_utc = (gap >= _UTC_RANGE[0]) & (gap <= _UTC_RANGE[1])
        gap = np.where(is_utc, gap, np.nan)
        source, uncertainty = ("recorder" if is_utc.any() else "none"), np.nan
    start = created[line.first].copy()
    start[0] = -np.inf
    boot = np.searchsorted(first, utc_rows, side="right")
    pace = pace_of(created[utc_rows], utc, boot)
    return Clock(start, -line.offset, gap, line.delay, uncertainty, source, pace)


def pace_of(t: Floats, utc: Floats, piece: Ints) -> float:
    """Return how many seconds of satellite time go to one of the vehicle's clock.

    By Theil's incomplete method: the median slope of pairs half of the records apart.

    Parameters
    ----------
    t, utc : (m,) float
        When satellite time was recorded, and what it was, s.
    piece : (m,) int
        Which boot each belongs to; the one with the most records counts.

    Examples
    --------
    >>> t = np.arange(0.0, 100.0)
    >>> pace_of(t, 1.5e9 + 13 / 12 * t, np.zeros(100, np.int64)).__round__(4)
    1.0833
    >>> pace_of(t, 1.5e9 + 1.0001 * t, np.zeros(100, np.int64))
    1.0
    """
    if not t.size:
        return 1.0
    own = piece == np.bincount(piece).argmax()
    t, utc = t[own], utc[own]
    half = t.size // 2
    apart = t[half:] - t[: t.size - half]
    if not half or not (apart > 0).all():
        return 1.0
    pace = float(np.median((utc[half:] - utc[: t.size - half]) / apart))
    off = abs(pace - 1)
    is_wrong = off > _CLOCK_OFF and off * (t[-1] - t[0]) > _TOLD_LATE_S
    return pace if is_wrong and 1 / _MOST_PACE < pace < _MOST_PACE else 1.0


def _median_per_boot(rows: Ints, values: Floats, first: Ints) -> Floats:
    bounds = [*np.searchsorted(rows, first).tolist(), rows.size]
    parts = [values[low:high] for low, high in pairwise(bounds)]
    return np.array([np.median(part) if part.size else np.nan for part in parts])
