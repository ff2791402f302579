"""When were the records of a DataFlash log made?

In: the tables of a log. Out: for each table the times of its records, and the log's `Clock`.

``TimeUS`` (``TimeMS`` before 2015, ``T`` in their GPS) counts from the start of the vehicle and is
the log's own clock: a record has that time, less the first one's. The table with it that is spread
widest over the file, of several the most frequent, is the track: it tells where in the file the
vehicle started anew, which was no earlier than its last record before. Where it leaps by more than
an hour, a minute is left of it; a run of its records that was thrown far off is put back. Records
without a time of their own, and those whose time is damaged, have the time of their place
in the file, between the records around them. Damaged is a time off the track by more than 2 s;
beyond its ends by more than 10 minutes from both neighbours, or behind its end by more than 2 s
where a later record says that it was earlier.

Copter 3.0 logs no time but the GPS's week milliseconds: the track then, and boot time is not known.
Where not even these are at hand, attitude is taken to come at 10 Hz, as it did; that is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.clock import (
    PAUSE_S,
    SHORT_PAUSE_S,
    Clock,
    last_boot,
    pace_of,
    pause_text,
    told_as_one,
    told_thrown,
)
from fdi.telemetry.formats.dataflash.layouts import Field, Layout
from fdi.telemetry.formats.dataflash.tables import Table, Tables, columns
from fdi.telemetry.quality import ANEW, QualityRecord
from fdi.telemetry.thrown import put_back

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_LARGEST_US: Final = 2**42  # 50 days since boot: more is noise, and the record has no time
_REBOOT_US: Final = 1_000_000  # time stepping back by more, and staying back
_SPIKE_US: Final = 1_000_000  # a record of the track this far from the median of five is damaged
_SLACK_S: Final = 2.0  # records of one moment are written this far apart at most
_FAR_S: Final = 600.0
_APART_S: Final = 1e-3  # between two starts, at least
_PARTS: Final = 64  # of a file, to tell what is written all along
_NOMINAL_S: Final = 0.1  # Copter 3.0 wrote attitude and throttle in its 10 Hz loop
_MOST_POINTS: Final = 1 << 16  # of the track
_WEEK_MS: Final = 604_800_000
_WEEK_S: Final = 604_800.0
_GPS_EPOCH: Final = 315964800  # s since 1970: 6 January 1980
_FIRST_WEEK: Final = 1560  # December 2009: no such log is older, the receiver's week wrapped
_LEAPS: Final = ((0, 14), (1230768000, 15), (1341100800, 16), (1435708800, 17), (1483228800, 18))
_FIX_3D: Final = 3


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where in the file it was when.

    Attributes
    ----------
    start, t : (m,)
        Records that tell the time: first byte, ascending, and s of the log's clock.
    boots : (k,) int
        The byte from which each start of the vehicle holds, the first one 0.
    began : (k,) float, s
        The first time that each of them tells.
    offset : (k,) float, s
        t = seconds since boot + offset; NaN where these are not known.
    quality : tuple of QualityRecord
    restarts : tuple of float, s
        When the vehicle started anew.
    """

    start: Ints
    t: Floats
    boots: Ints
    began: Floats
    offset: Floats
    quality: tuple[QualityRecord, ...] = ()
    restarts: tuple[float, ...] = ()

    @property
    def has_pause(self) -> bool:
        """Whether the records of the track are far apart somewhere."""
        return bool(np.any(np.diff(self.t[1:]) > _SLACK_S))  # the first may be another table's

    def at(self, start: NDArray[np.integer]) -> Floats:
        """Return the times of places in the file, (n,) s: between those of the track's records."""
        found: Floats = np.interp(start, self.start, self.t)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Times:
    """Of one table: t (n,) s of the log's clock, the stamps as they are in the file."""

    t: Floats
    stamp: Floats
    is_own: bool  # the records say it themselves
    is_ascending: bool  # strictly
    damaged: int = 0  # how many say something else than their place does


def _clock_field(one: Layout) -> Field | None:
    """Return the field with the time since boot."""
    field = one.field("TimeUS") or one.field("TimeMS")
    if one.name == "GPS" and one.field("TimeUS") is None:
        field = one.field("T")  # TimeMS is the week's there
    return field if field is not None and field.character in "IQ" else None


def said(table: Table) -> NDArray[np.int64]:
    """Return what the records of a table with a clock say, us since boot; -1 for noise."""
    field = _clock_field(table.layout)
    assert field is not None
    values = np.ascontiguousarray(table.pick(field))
    scale = 1 if field.name == "TimeUS" else 1000
    is_clean = int(values.max()) < _LARGEST_US // scale
    if is_clean and values.dtype == np.uint64 and scale == 1:
        return values.view(np.int64)
    found = values.astype(np.int64) * scale
    found[values >= _LARGEST_US // scale] = -1
    return found


def find_track(tables: Tables) -> tuple[Track, list[Times]]:
    """Return the track of a log, and the times of each table."""
    timed = [table for table in tables if _clock_field(table.layout) is not None]
    end = max((int(table.start[-1]) for table in timed), default=0) + 1
    timed.sort(key=lambda table: (_spread(table, end), table.start.size), reverse=True)
    main = next((table for table in timed if np.any(said(table) >= 0)), None)
    if main is None:
        track = _week_track(tables) or _nominal_track(tables)
        return track, [_in_place(table, track) for table in tables]
    track = _boot_track(timed, main)
    beyond = cache(lambda: _beyond(timed, track))  # of a sound log nobody asks
    # one piece of memory: many small ones cost twice the time to fill
    room, made = np.empty(sum(table.start.size for table in timed)), []
    seen: dict[tuple[int, float, float], Times] = {}
    for table in tables:
        if _clock_field(table.layout) is None:
            made.append(_in_place(table, track))
            continue
        times = _times(table, track, room[: table.start.size], beyond)
        # an estimator writes several messages with one time: one array for all of them
        twin = seen.setdefault((times.t.size, float(times.t[0]), float(times.t[-1])), times)
        if twin is times or not _is_same(twin, times):
            room = room[table.start.size :]
            twin = times
        made.append(twin)
    count = sum(times.damaged for times in made)
    if count:
        text = f"{count} records have a damaged time: they have that of their place in the file"
        found = QualityRecord("repaired", None, None, None, count, text)
        track = replace(track, quality=(*track.quality, found))
    return track, made


def _spread(table: Table, end: int) -> int:
    """Return in how many parts of the file a table has records: all parameters stand in few."""
    edges = np.linspace(0, end, _PARTS + 1).astype(table.start.dtype)
    return int(np.count_nonzero(np.diff(np.searchsorted(table.start, edges))))


def _boot_track(tables: Tables, main: Table) -> Track:
    """Return the track, of tables with a clock."""
    place, whole = _versions(tables, main)
    rare = slice(None, None, -(-whole.size // _MOST_POINTS))
    us, start = whole[rare], place[rare].astype(np.int64)
    late = _last_boot(tables, int(us[-1]), int(start[-1]))
    us, start = np.append(us, late[0]), np.append(start, late[1])
    steps = np.diff(us)
    if us.min() < 0 or (steps.size and steps.min() < 0) or np.any(steps > _FAR_S * 1e6):
        good = (us >= 0) & ~_spikes(us)
        if good.any():
            us, start = us[good], start[good]
        else:
            us, start = whole[whole >= 0], place[whole >= 0].astype(np.int64)
    seconds, thrown = put_back(us / 1e6)
    if thrown:
        us = np.rint(seconds * 1e6).astype(np.int64)
    steps = np.diff(us)
    restarts = {
        i
        for i in np.flatnonzero(steps < -_REBOOT_US).tolist()
        if np.all(us[i + 1 : i + 4] < us[i] - _REBOOT_US)
    }
    leaps = np.flatnonzero(steps > PAUSE_S * 1e6).tolist()
    rows = sorted({*restarts, *leaps})
    boots, lowest, highest = _starts(tables, start, us, rows)
    earliest, first = _first_said(tables)
    if not -_FAR_S * 1e6 <= first - us[0] <= _SLACK_S * 1e6:
        first = int(us[0])  # what the first record says is damaged
    offset = np.empty(boots.size)
    offset[0] = -first / 1e6
    apart = [
        # since it started anew at least the time has gone that its clock tells
        max(low / 1e6, _APART_S) if i in restarts and low <= PAUSE_S * 1e6 else SHORT_PAUSE_S
        for i, low in zip(rows, lowest[1:].tolist(), strict=True)
    ]
    for k in range(1, boots.size):
        offset[k] = highest[k - 1] / 1e6 + offset[k - 1] + apart[k - 1] - lowest[k] / 1e6
    t = us / 1e6 + offset[np.searchsorted(boots, start, side="right") - 1]
    if earliest < start[0]:
        start, t = np.append(earliest, start), np.append(0.0, t)
    began = lowest / 1e6 + offset
    t = np.maximum.accumulate(t)
    quality = _told(rows, restarts, steps / 1e6, began[1:]) + told_thrown(
        thrown, t[-us.size :], "times of the records that tell the time"
    )
    anew = tuple(at for i, at in zip(rows, began[1:].tolist(), strict=True) if i in restarts)
    return Track(start, t, boots, began, offset, tuple(quality), anew)


def _last_boot(tables: Tables, last: int, place: int) -> tuple[NDArray[np.int64], Ints]:
    """Return what records behind the track's last one tell of another boot, us, and their places.

    A vehicle that started anew may write little until the log ends, and none of that table.
    """
    ends = [(table, int(np.searchsorted(table.start, place, side="right"))) for table in tables]
    late = [t.source.part(t, slice(low, None)) for t, low in ends if low < t.start.size]
    if not late:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    told = np.concatenate([said(table) for table in late])
    places = np.concatenate([table.start for table in late])
    order = np.argsort(places, kind="stable")
    told, places = told[order], places[order].astype(np.int64)
    found = last_boot(np.append(last, told) // 1000, 0) - 1
    return told[found], places[found]


def _beyond(tables: Tables, track: Track) -> tuple[Ints, Floats]:
    """Return the places of records behind the track, (b,), and the least time said from each on."""
    places, times = [], []
    for table in tables:
        low = np.searchsorted(table.start, track.start[-1:].astype(table.start.dtype))[0]
        t = said(table)[low:] / 1e6 + track.offset[-1]
        is_later = t >= track.t[-1] - _SLACK_S
        places.append(table.start[low:][is_later].astype(np.int64))
        times.append(t[is_later])
    order = np.argsort(np.concatenate(places))
    least = np.minimum.accumulate(np.concatenate(times)[order][::-1])[::-1]
    return np.concatenate(places)[order], np.append(least, np.inf)


def _told(rows: list[int], restarts: set[int], steps: Floats, began: Floats) -> list[QualityRecord]:
    """Return the findings about new starts and long pauses, that begin at these times."""
    starts, pauses = [], []
    for i, at in zip(rows, began.tolist(), strict=True):
        if i in restarts:
            starts.append(QualityRecord("reboot", None, at, at, 1, ANEW))
        else:
            text = pause_text(float(steps[i]))
            pauses.append(QualityRecord("clock_jump", None, at, at, 1, text))
    return [*told_as_one(starts), *told_as_one(pauses)]


def _versions(tables: Tables, main: Table) -> tuple[NDArray[np.integer], NDArray[np.int64]]:
    """Return where records of a table begin and what they say, with those it has defined anew."""
    one = main.layout.name, main.instance
    same = [table for table in tables if (table.layout.name, table.instance) == one]
    if len(same) == 1:
        return main.start, said(main)
    place = np.concatenate([x.start for x in same])
    order = np.argsort(place, kind="stable")  # two types may have one name
    return place[order], np.concatenate([said(x) for x in same])[order]


def _spikes(us: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which values leave the median of the five around them, or of the last or first."""
    if us.size < 5:
        return np.zeros(us.size, np.bool_)
    middle = np.median(np.lib.stride_tricks.sliding_window_view(us, 5), axis=1)
    far: NDArray[np.bool_] = np.abs(us - np.pad(middle, 2, mode="edge")) > _SPIKE_US
    for ends in (slice(2), slice(-2, None)):  # up to two steps from the middle of theirs
        five = us[:5] if ends.start is None else us[-5:]
        step = np.median(np.abs(np.diff(five)))
        far[ends] = np.abs(us[ends] - np.median(five)) > _SPIKE_US + 4 * step
    return far


def _starts(
    tables: Tables, start: Ints, us: NDArray[np.int64], rows: list[int]
) -> tuple[Ints, NDArray[np.int64], NDArray[np.int64]]:
    """Return where each start of the vehicle begins, its first time and its last one, us.

    ``rows``: records of the track, (``start``, ``us``), after which time steps back or leaps. What
    other tables say between that record and the next tells where exactly.
    """
    places = [0]
    lowest, highest = [int(us[0])], []
    near = [([start[i : i + 2]], [us[i : i + 2]]) for i in rows]
    here = np.array(rows, np.int64)
    for table in tables if rows else ():
        other = said(table)
        lows = np.searchsorted(table.start, start[here].astype(table.start.dtype))
        highs = np.searchsorted(table.start, start[here + 1].astype(table.start.dtype))
        for k in np.flatnonzero(highs > lows).tolist():
            between = slice(int(lows[k]), int(highs[k]))
            is_known = other[between] >= 0
            near[k][0].append(table.start[between][is_known])
            near[k][1].append(other[between][is_known])
    for i, (at, time) in zip(rows, near, strict=True):
        order = np.argsort(np.concatenate(at), kind="stable")
        merged_at, merged = np.concatenate(at)[order], np.concatenate(time)[order]
        step = int(np.argmax(np.diff(merged) * np.sign(us[i + 1] - us[i])))
        places.append(int(merged_at[step + 1]))
        # of the others only what the track bears out: any of them may be damaged
        last, following = merged[: step + 1] - us[i], merged[step + 1 :] - us[i + 1]
        far = _FAR_S * 1e6
        highest.append(int(us[i] + last[np.abs(last) <= far].max(initial=0)))
        lowest.append(int(us[i + 1] + following[np.abs(following) <= far].min(initial=0)))
    highest.append(int(us[-1]))
    return np.array(places), np.array(lowest), np.array(highest)


def _first_said(tables: Tables) -> tuple[int, int]:
    """Return where the first time in the file stands, and what it is, us."""
    place, first = -1, 0
    for table in sorted(tables, key=lambda table: int(table.start[0])):
        if 0 <= place <= table.start[0]:
            break
        us = said(table)
        known = np.flatnonzero(us >= 0)
        if known.size and (place < 0 or table.start[known[0]] < place):
            place, first = int(table.start[known[0]]), int(us[known[0]])
    return place, first


def _times(
    table: Table, track: Track, room: Floats, beyond: Callable[[], tuple[Ints, Floats]]
) -> Times:
    us = said(table)
    stamp = t = np.divide(us, 1e6, out=room)
    stamp += track.offset[0]
    if track.boots.size > 1:
        cuts = np.searchsorted(table.start, track.boots)
        t = us / 1e6 + np.repeat(track.offset, np.diff(cuts, append=us.size))
    least = _least_step(t)
    # nearly all ascend, but for jitter, and end where the track does
    is_near = t[0] >= track.t[0] - _SLACK_S and t[-1] <= track.t[-1] + _SLACK_S
    if t.size < 3 or least < -_SLACK_S or not is_near or us.min() < 0:
        sound = _is_sound(t, table, track, beyond) & (us >= 0)
        t = np.where(sound, t, track.at(table.start))
        return Times(t, stamp, True, _least_step(t) > 0, int((~sound).sum()))
    return Times(t, stamp, True, least > 0)


def _is_same(one: Times, other: Times) -> bool:
    return np.array_equal(one.t, other.t) and np.array_equal(one.stamp, other.stamp)


def _in_place(table: Table, track: Track) -> Times:
    """Return the times of records that tell none."""
    t = track.at(table.start)
    return Times(t, t, False, _least_step(t) > 0)


def _least_step(t: Floats) -> float:
    return float(np.diff(t).min()) if t.size > 1 else np.inf


def _is_sound(
    t: Floats, table: Table, track: Track, beyond: Callable[[], tuple[Ints, Floats]]
) -> NDArray[np.bool_]:
    """Return which times fit their place in the file."""
    behind = np.searchsorted(track.start, table.start)
    last = track.t.size - 1
    before = np.where(behind > 0, track.t[np.maximum(behind - 1, 0)], -np.inf)
    after = np.where(behind <= last, track.t[np.minimum(behind, last)], np.inf)
    fits = (t >= before - _SLACK_S) & (t <= after + _SLACK_S)
    # beyond the track's ends: near it, or near a neighbour of the same type; nothing contradicts
    off = np.abs(t - np.clip(t, track.t[0], track.t[-1]))
    near = off < _FAR_S
    step = np.abs(np.diff(t)) < _FAR_S
    near[1:] |= step
    near[:-1] |= step
    sound: NDArray[np.bool_] = fits & near
    if np.any(off[sound] > _SLACK_S):
        places, least = beyond()
        later = least[np.searchsorted(places, table.start, side="right")]
        sound &= (behind <= last) | (t <= later + _SLACK_S)
    return sound


def _week_track(tables: Tables) -> Track | None:
    """Return the track of a log in which only the GPS tells the time: ms of the week."""
    for name in ("Time", "TimeMS"):
        for i, (ms,) in columns(tables, "GPS", name):
            known = np.flatnonzero(ms > 0)
            if known.size < 2:
                continue
            week = ms[known].astype(np.int64)
            week += np.cumsum(np.diff(week, prepend=week[:1]) < -_WEEK_MS // 2) * _WEEK_MS
            t: Floats = np.maximum.accumulate((week - week[0]) / 1e3)
            # records before the first fix: at the pace of those behind it
            start = tables[i].start[known].astype(np.int64)
            start, t = _with_pauses(start, t)
            pace = (t[-1] - t[0]) / max(int(start[-1] - start[0]), 1)
            first = min(int(one.start[0]) for one in tables)
            last = max(int(one.start[-1]) for one in tables)
            start = np.concatenate(([first], start, [last]))
            lead = (start[1] - first) * pace
            end = float(t[-1]) + lead + (last - start[-2]) * pace
            whole: Floats = np.array([0.0, *(t + lead).tolist(), end])
            count = sum(one.start.size for one in tables) - known.size
            text = f"only GPS tells the time: {count} other records are spread between its records"
            made = QualityRecord("repaired", None, None, None, count, text)
            return Track(
                start, whole, np.zeros(1, np.int64), np.zeros(1), np.array([np.nan]), (made,)
            )
    return None


def _with_pauses(start: Ints, t: Floats) -> tuple[Ints, Floats]:
    """Return a track of places and times with the pauses of the whole recorder.

    Where less than half of what is usual was written between two points nothing was recorded for
    the rest of the time: what there is belongs to both ends, at the usual pace. Spread over all of
    it, it would show a receiver that is silent while the others go on.
    """
    took, wrote = np.diff(t), np.diff(start)
    writing = wrote * np.median(took / np.maximum(wrote, 1))
    pauses = np.flatnonzero(2 * writing < took)
    half = writing[pauses] / 2
    middle = start[pauses] + wrote[pauses] // 2
    places = np.concatenate([start, middle, middle + 1])
    times = np.concatenate([t, t[pauses] + half, t[pauses + 1] - half])
    order = np.lexsort((times, places))
    return places[order], times[order]


def _nominal_track(tables: Tables) -> Track:
    """Return the track of a log that tells no time."""
    usual = [one for one in tables if one.layout.name in ("ATT", "CTUN")] or list(tables)
    start = max((one.start for one in usual), key=lambda start: start.size).astype(np.int64)
    t: Floats = np.arange(start.size, dtype=np.float64) * _NOMINAL_S
    first = min(int(one.start[0]) for one in tables)
    if first < start[0]:
        start, t = np.append(first, start), np.append(0.0, t + _NOMINAL_S)
    count = sum(one.start.size for one in tables)
    text = f"no record tells the time: {count} records are spread as if ATT came at 10 Hz"
    made = QualityRecord("repaired", None, None, None, count, text)
    return Track(start, t, np.zeros(1, np.int64), np.zeros(1), np.array([np.nan]), (made,))


def make_clock(tables: Tables, track: Track, times: Sequence[Times]) -> Clock:
    """Return the log's clock; UTC from the GPS."""
    start = track.began.copy()
    start[0] = -np.inf
    offset = np.full(track.boots.size, np.nan)
    place, when, told = [np.empty(0, np.int64)], [np.empty(0)], [np.empty(0)]
    for at, t, utc in _utc(tables, times):
        place.append(at)
        when.append(t)
        told.append(utc)
    t, utc = np.concatenate(when), np.concatenate(told)
    apart = utc - t
    boot = np.searchsorted(track.boots, np.concatenate(place), side="right") - 1
    for k in np.unique(boot).tolist():
        offset[k] = np.median(apart[boot == k])
    source = "vehicle" if apart.size else "none"
    uncertainty = 0.0 if apart.size else np.nan
    boot_uncertainty = 0.0 if np.isfinite(track.offset).all() else np.nan
    pace = pace_of(t, utc, boot) if np.isfinite(track.offset).all() else 1.0
    return Clock(start, -track.offset, offset, boot_uncertainty, uncertainty, source, pace)


def _utc(tables: Tables, times: Sequence[Times]) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Yield places in the file where a receiver tells UTC, t there, and UTC, s since 1970."""
    since, leaps = (np.array(column) for column in zip(*_LEAPS, strict=True))
    for names in (("GWk", "GMS"), ("Week", "TimeMS")):
        for i, (status, week, ms) in columns(tables, "GPS", "Status", *names):
            good = (status >= _FIX_3D) & (week > 0)
            weeks = week[good].astype(np.float64)
            weeks[weeks < _FIRST_WEEK] += 1024
            utc = _GPS_EPOCH + weeks * _WEEK_S + ms[good] / 1000
            utc -= leaps[np.searchsorted(since, utc, side="right") - 1]
            yield tables[i].start[good].astype(np.int64), times[i].t[good], utc
