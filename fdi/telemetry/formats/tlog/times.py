"""When was a record of a tlog made, by what it says itself?

In: the payloads of the vehicle's messages. Out: the `Timeline` of the whole file, and for every
message the times of its records. ``time_boot_ms`` and ``time_usec`` are the vehicle's own times;
both wrap, and a wrong one is taken from the neighbours instead (`clock.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.clock import Timeline, in_order, last_boot, likely_times, timeline
from fdi.telemetry.formats.tlog.columns import Payloads

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

_WRAP_US: Final = 2**32 / 1e6  # s: 32-bit microseconds, and micros() of ArduPilot until 2019
_WRAP_MS: Final = 2**32 / 1e3
_OWN_TIME_SLACK_S: Final = 2.0  # a record's own time further from its neighbours' is another's
_STALE_FIX_S: Final = 1.0  # a repeated fix older than this says that there is no new one
_HELD_UP_S: Final = 10.0  # longer no link holds a packet back
_APART_S: Final = 1e-6
_UTC_US: Final = 1e15  # larger time_usec values are UTC, smaller ones count from boot


def vehicle_timeline(stamp_us: NDArray[np.uint64], own: Mapping[int, Payloads]) -> Timeline:
    """Return a time for every frame of the file, from the vehicle's own messages."""
    timed = [payloads for payloads in own.values() if payloads.has("time_boot_ms")]
    # not one that always says the same: who has no clock fills in 0
    passes = [int(np.count_nonzero(np.diff(one.field("time_boot_ms")))) for one in timed]
    if not any(passes):
        none = np.empty(0, np.int64)
        return timeline(stamp_us, none, none, none)
    rows, boot_ms = _boot_times(stamp_us.size, timed)
    main = np.searchsorted(rows, timed[int(np.argmax(passes))].rows)
    return timeline(stamp_us, rows, boot_ms, np.append(main, last_boot(boot_ms, int(main[-1]))))


def _boot_times(count: int, timed: list[Payloads]) -> tuple[Ints, Ints]:
    """Return which of so many frames say when they were made, and what they say, ms."""
    # laid out over all frames, so that the file's order needs no sorting
    said, says = np.empty(count, np.uint32), np.zeros(count, np.bool_)
    for payloads in timed:
        said[payloads.rows], says[payloads.rows] = payloads.field("time_boot_ms"), True
    rows = np.flatnonzero(says)
    return rows, said[rows].astype(np.int64)


def vehicle_utc(own: Mapping[int, Payloads]) -> tuple[Ints, Floats]:
    """Return which frames tell UTC, and what they tell (s since 1970)."""
    pairs = [p for p in own.values() if p.definition.name == "SYSTEM_TIME"]
    if not pairs:
        return np.empty(0, np.int64), np.empty(0)
    utc = pairs[0].field("time_unix_usec").astype(np.float64)
    known = utc > _UTC_US
    return pairs[0].rows[known], utc[known] / 1e6


def record_times(
    payloads: Payloads, created: Floats, line: Timeline, every: Ints, *, own: bool
) -> tuple[Floats, Ints]:
    """Return t, strictly ascending, and the records of the message that it belongs to.

    Parameters
    ----------
    created : (m,) float, s
        `Timeline.created` of these records.
    every : int
        0, 1, ... as far as any message needs it: most keep all records, and need no copy of it.
    own : bool
        The vehicle itself sent them, so that their time is on the vehicle's clock.
    """
    t, is_new = created, None
    has_time = payloads.has("time_boot_ms") or payloads.has("time_usec")
    if own and has_time and np.isfinite(line.offset).all():
        if payloads.has("time_boot_ms"):
            said = payloads.field("time_boot_ms") / 1000
            offset = line.offset_of(payloads.rows)
            t = likely_times(said + offset, created, wrap=_WRAP_MS, slack=_OWN_TIME_SLACK_S)
        else:
            t, is_new = _from_microseconds(payloads, created, line)
    rows = every[: t.size] if is_new is None else np.flatnonzero(is_new)
    t = t if is_new is None else t[rows]
    if (t[1:] - t[:-1] > (0.0 if has_time else _APART_S)).all():
        return t, rows
    if not has_time:
        t = in_order(t)
    order = np.argsort(t, kind="stable")
    t, rows = t[order], rows[order]
    if not has_time:
        # what arrived at one moment (parameters, texts) is not one record: a microsecond apart
        spread = np.arange(t.size) * _APART_S
        t = np.maximum.accumulate(t - spread) + spread
    is_last = np.diff(t, append=np.inf) > 0
    return t[is_last], rows[is_last]


def _from_microseconds(
    payloads: Payloads, created: Floats, line: Timeline
) -> tuple[Floats, NDArray[np.bool_] | None]:
    """Return t from time_usec, and which records say something new; None: all do.

    For a GPS it is the time of the last fix: a record that repeats one is left out, until so much
    time has passed that the repetition itself is the news (the fix is lost). One that the next
    record does not repeat was new, however long the link held it up.
    """
    micros = payloads.field("time_usec")
    is_fix = payloads.definition.name in ("GPS_RAW_INT", "GPS2_RAW")
    said = micros / 1e6
    is_utc = micros > _UTC_US
    if is_utc.any():
        said[is_utc] = np.nan
    slack = _WRAP_US if is_fix else _OWN_TIME_SLACK_S
    t = likely_times(said + line.offset_of(payloads.rows), created, wrap=_WRAP_US, slack=slack)
    if not is_fix:
        return t, None
    is_new = np.concatenate(([True], micros[1:] != micros[:-1]))
    since = created - created[np.maximum.accumulate(np.where(is_new, np.arange(t.size), 0))]
    age = created - t
    is_stale = np.maximum(age, since) > _STALE_FIX_S
    if np.median(age[is_new]) <= _STALE_FIX_S:  # else its clock is none of the vehicle's
        is_next_newer = np.append(micros[1:] > micros[:-1], False)
        is_stale &= ~(is_new & is_next_newer & (age < _HELD_UP_S))
    return np.where(is_new & ~is_stale, t, created), is_new | is_stale
