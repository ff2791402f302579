"""Where a recording stops in flight, or the autopilot: was power there, and what else may it be?

In: a log. Out: a `Fact` for each, or none; one more where a log begins in the air with a restart.
Power is told by the voltages of the last seconds against those before; what a recorder of this kind
stops for is told as what it may be, no more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Final, NamedTuple

import numpy as np

from fdi.diagnosis.stood_out import ENDING, Fact
from fdi.telemetry import Log
from fdi.telemetry.airtime import begun_in_air
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.events import Event
from fdi.telemetry.log import Recording, recorder_of
from fdi.telemetry.meaning.restarts import NEW_S, program_stopped
from fdi.telemetry.message import Floats
from fdi.telemetry.supply import LAST_S, Supply, supplies

YOUNG_S: Final = 10.0
"""Since boot, in which nobody takes off: the sensors settle, gyroscopes are calibrated."""
MOST_TEXTS: Final = 3
COMPUTER: Final = "autopilot_computer"
_KIB: Final = 1024.0  # bytes, the unit of LOG_FILE_BUFSIZE
_MINUTE_S: Final = 60.0
_SYNC_S: Final = 1.0
_OPEN: Final = ("in_air", "control_lost")
"""Ends without the ground."""
_KINDS: Final = {
    "tlog": "a telemetry log stops as well when the link is lost or the ground station stops",
    "dataflash": "a log on board stops as well when its recorder is stopped",
    "ulog": "a log on board stops as well when its recorder is stopped",
}


class _Held(NamedTuple):
    """What a recorder's buffer held in the last minute, by which message; bytes, and a second.

    ``unsafe_s``: so long what is written may stay where a loss of power takes it.
    """

    by: str
    since: float
    until: float
    rate: float
    size: float
    usual: float
    most: float
    unsafe_s: float


def recording_end(log: Log) -> tuple[Fact, ...]:
    """Return what is known of why an autopilot ceased or the recording does, in flight."""
    ceased = (*_begun_anew(log), *(_ceased(log, end) for end in log.ends if end.how == "restarted"))
    stopped = tuple(_stopped(log))
    if not any(end.how in _OPEN for end in log.ends[-1:]):
        return (*ceased, *stopped)
    stop = log.span[1]
    told = supplies(log.messages, stop)
    power = _power(told)
    form = recorder_of(_last(log.recordings).format if log.recordings else log.format)
    other = _KINDS.get(form, "")
    off = any(e.kind == "disarm" and e.t > stop - LAST_S for e in log.events)
    if off:
        other = "the autopilot had just been disarmed, at which recorders stop"
    crash = program_stopped(log.events, stop)
    leads = crash is not None or not all(one.kept for one in told)
    if crash is not None:
        power = f"the autopilot's program stopped ({_short(crash)})"
    if leads:
        other = ""
    text = f"the recording stops in flight (log {stop:.1f} s): {power}"
    unwritten, *buffered = _unwritten(log, form, stop) or ("",)
    text = "; ".join(filter(None, (text, other, _all_stop(log), unwritten)))
    records = (*(one.record() for one in told), *buffered, *_reported(crash))
    about = ENDING if crash is None else COMPUTER
    return (*ceased, *stopped, Fact(about, text, leads, leads, records))


def _short(report: Event) -> str:
    """Return how what an autopilot says of a program that stopped begins."""
    return f'"{report.text.partition(":")[0]}"'


def _reported(report: Event | None) -> tuple[str, ...]:
    return () if report is None else (f'text at log {report.t:.1f} s: "{report.text}"',)


def begins_anew(log: Log) -> tuple[float, float] | None:
    """Return from when on, s, and how long after its boot, s, a log begins in the air, or None.

    A vehicle in the air just after its boot did not take off since.
    """
    start = begun_in_air(log.flights)
    since = None if start is None else log.clock.boot(start)
    if start is None or since is None or start - log.span[0] >= YOUNG_S:
        return None
    return (start, since) if 0 <= since < YOUNG_S else None


def _begun_anew(log: Log) -> Iterator[Fact]:
    """Yield that a log begins with a restart in the air."""
    found = begins_anew(log)
    if found is None:
        return
    t, since = found
    report = program_stopped(log.events, log.span[0])
    why = "why, is not told"
    if report is not None:
        why = f"its program had stopped ({_short(report)})"
    text = (
        f"the log begins with a restart in the air: it flies {since:.1f} s after the autopilot's "
        f"boot; {why}"
    )
    records = (f"time since boot at log {t:.1f} s: {since:.1f} s", *_reported(report))
    yield Fact(ENDING if report is None else COMPUTER, text, True, True, records)


def _stopped(log: Log) -> Iterator[Fact]:
    """Yield each of several recordings that stops in flight while another one goes on.

    But one that ends as the autopilot does, of which `_ceased` tells.
    """
    ceased = [end.at for end in log.ends if end.how == "restarted"]
    for one in log.recordings:
        last = _last(log.recordings)
        on = last.end - one.end
        if on <= LAST_S + one.uncertainty + last.uncertainty or not _flies(log, one.end):
            continue
        if any(abs(at - one.end) <= LAST_S for at in ceased):
            continue
        records = tuple(f"{each.name}: last record at log {each.end:.1f} s" for each in (one, last))
        why = "the link or the ground station" if one.format == "tlog" else "its recorder"
        text = (
            f"the recording {one.name} stops in flight (log {one.end:.1f} s), and {last.name} goes "
            f"on for {on:.1f} s: {why} stopped, and the vehicle flew on"
        )
        yield Fact(ENDING, text, records=records)


def _last(recordings: Sequence[Recording]) -> Recording:
    return max(recordings, key=lambda one: one.end)


def _flies(log: Log, t: float) -> bool:
    return any(f.flew and f.airborne[0] <= t < f.airborne[1] - LAST_S for f in log.flights)


def _all_stop(log: Log) -> str:
    """Return what it says that recorders of several kinds stop at once."""
    if len(log.recordings) < 2:
        return ""
    ends = [one.end for one in log.recordings]
    unsure = max(one.uncertainty for one in log.recordings)
    kinds = {one.format == "tlog" for one in log.recordings}
    if len(kinds) < 2 or max(ends) - min(ends) > LAST_S + unsure:
        return ""
    return (
        f"the recording on board and that of the telemetry stop within {max(ends) - min(ends):.1f} "
        "s of each other: both need the autopilot and its power"
    )


def _unwritten(log: Log, form: str, stop: float) -> tuple[str, str] | None:
    """Return how much an autopilot's recorder had not written yet, and the records that tell it."""
    told_by = _HELD.get(form)
    held = None if told_by is None else told_by(log, stop - _MINUTE_S, stop)
    if held is None:
        return None
    as_a_rule = held.usual / held.rate + held.unsafe_s / 2
    most = held.most / held.rate + held.unsafe_s
    return (
        f"if power went, what the recorder had not written yet is missing: {as_a_rule:.1f} s as a "
        f"rule, {most:.1f} s at most in the minute before",
        f"{held.by} from log {held.since:.1f} to {held.until:.1f} s: {held.rate:.0f} bytes a "
        f"second, in the buffer of {held.size:.0f} {held.usual:.0f} as a rule, "
        f"{held.most:.0f} at most"
        + (f"; the file is made safe every {held.unsafe_s:.0f} s" if held.unsafe_s else ""),
    )


def _held_by_ardupilot(log: Log, low: float, high: float) -> _Held | None:
    """Return what the buffer held by ``DSF``, once a second.

    Bytes that were written, and what was free, on average and at least
    (AP_Logger_Backend.cpp, ``Write_AP_Logger_Stats_File``).
    """
    size = _KIB * log.parameters.get("LOG_FILE_BUFSIZE", 0.0)
    found = _late(log, "DSF", ("Bytes", "FAv", "FMn"), low, high)
    if found is None:
        return None
    (since, until), (written, usual, least) = found
    used = size - float(np.median(usual)), size - float(least.min())
    return _sane(_Held("DSF", since, until, float(np.median(written)), size, *used, 0.0))


def _held_by_px4(log: Log, low: float, high: float) -> _Held | None:
    """Return what the buffer held by ``logger_status``, once a second.

    What was written is brought to the card once a second (log_writer_file.cpp, ``run``).
    """
    fields = ("write_rate_kb_s", "buffer_size_bytes", "buffer_used_bytes")
    found = _late(log, "logger_status", fields, low, high)
    if found is None:
        return None
    (since, until), (rate, size, used) = found
    mean, room = _KIB * float(np.median(rate)), float(size.max())
    most = float(np.median(used)), float(used.max())
    return _sane(_Held("logger_status", since, until, mean, room, *most, _SYNC_S))


_HELD: Final[Mapping[str, Callable[[Log, float, float], _Held | None]]] = {
    "dataflash": _held_by_ardupilot,
    "ulog": _held_by_px4,
}


def _late(
    log: Log, key: str, fields: tuple[str, ...], low: float, high: float
) -> tuple[tuple[float, float], list[Floats]] | None:
    """Return the first and last time of a message in a while, and its fields there."""
    told = log.messages.get(key)
    if told is None or any(name not in told for name in fields):
        return None
    late = (told.t > low) & (told.t <= high)
    if not late.any():
        return None
    t = told.t[late]
    return (float(t[0]), float(t[-1])), [told.raw(name)[told.kept][late] for name in fields]


def _sane(held: _Held) -> _Held | None:
    """Return what a buffer can hold, or None."""
    return held if held.rate > 0 and 0 <= held.usual <= held.most <= held.size else None


def _power(told: Sequence[Supply]) -> str:
    """Return what the last voltages say."""
    if not told:
        return "no voltage in the log tells whether power was there"
    state = "there" if all(one.kept for one in told) else "going"
    return f"power was {state} at its last records ({' and '.join(one.words() for one in told)})"


def _ceased(log: Log, end: FlightEnd) -> Fact:
    """Return that an autopilot ceased, with the records that tell it."""
    anew = log.flights[end.flight].restart
    told = supplies(log.messages, end.at)
    assert anew is not None  # that is how it ended
    said = [e for e in log.events if e.kind == "text" and end.at < e.t < anew + NEW_S]
    records = (
        f"the last record before: log {end.at:.1f} s",
        f"time since boot: begins anew at log {anew:.1f} s",
        *chain.from_iterable(_reported(e) for e in said[:MOST_TEXTS]),
        *(one.record() for one in told),
    )
    return Fact(ENDING, _restart(log, end, told), records=records)


def _restart(log: Log, end: FlightEnd, told: Sequence[Supply]) -> str:
    """Return from when to when an autopilot gave nothing, and what is known of its supply."""
    anew = log.flights[end.flight].restart
    report = None if anew is None else program_stopped(log.events, anew)
    is_last = end.flight == len(log.flights) - 1
    after = " and ".join(f"{s.name} {s.after:.1f} V" for s in told if s.after is not None)
    return (
        f"the autopilot gave nothing from log {end.at:.1f} to {anew:.1f} s, and then its clock "
        f"began anew: {_power(told)}"
        + ("" if report is None else f"; its program had stopped ({_short(report)})")
        + (f", and {after} at the first ones after" if after else "")
        + ("; what became of the vehicle the log does not show" if is_last else "")
    )
