"""Where a recording stops in flight, or the autopilot: was power there, and what else may it be?

In: a log. Out: a `Fact` for each, or none. Power is told by the voltages of the last seconds
against those before; what a recorder of this kind stops for is told as what it may be, no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from fdi.diagnosis.stood_out import ENDING, Fact
from fdi.telemetry import Log
from fdi.telemetry.ends import FlightEnd
from fdi.telemetry.supply import LAST_S, Supply, supplies

NEW_S: Final = 10.0
"""After a restart, in which an autopilot greets."""
MOST_TEXTS: Final = 3
_KIB: Final = 1024.0  # bytes, the unit of LOG_FILE_BUFSIZE
_MINUTE_S: Final = 60.0
_OPEN: Final = ("in_air", "control_lost")
"""Ends without the ground."""
_KINDS: Final = {
    "tlog": "a telemetry log stops as well when the link is lost or the ground station stops",
    "dataflash": "a log on board stops as well when its recorder is stopped",
    "ulog": "a log on board stops as well when its recorder is stopped",
}


def recording_end(log: Log) -> tuple[Fact, ...]:
    """Return what is known of why an autopilot ceased or the recording does, in flight."""
    ceased = tuple(_ceased(log, end) for end in log.ends if end.how == "restarted")
    if not any(end.how in _OPEN for end in log.ends[-1:]):
        return ceased
    stop = log.span[1]
    told = supplies(log.messages, stop)
    power = _power(told)
    other = _KINDS.get(log.format, "")
    off = any(e.kind == "disarm" and e.t > stop - LAST_S for e in log.events)
    if off:
        other = "the autopilot had just been disarmed, at which recorders stop"
    text = f"the recording stops in flight (log {stop:.1f} s): {power}"
    unwritten, *buffered = _unwritten(log, stop) or ("",)
    text = "; ".join(filter(None, (text, other, unwritten)))
    return (*ceased, Fact(ENDING, text, records=(*(one.record() for one in told), *buffered)))


def _unwritten(log: Log, stop: float) -> tuple[str, str] | None:
    """Return how much the recorder of ArduPilot had in its buffer, and the records that tell it.

    ``DSF``, once a second: bytes that were written, and what was free of the buffer, on average and
    at least (AP_Logger_Backend.cpp, ``Write_AP_Logger_Stats_File``).
    """
    size = _KIB * log.parameters.get("LOG_FILE_BUFSIZE", 0.0)
    told = log.messages.get("DSF")
    if log.format != "dataflash" or size <= 0 or told is None:
        return None
    if any(name not in told for name in ("Bytes", "FAv", "FMn")):
        return None
    late = (told.t > stop - _MINUTE_S) & (told.t <= stop)
    written, usual, least = (told.raw(n)[told.kept][late] for n in ("Bytes", "FAv", "FMn"))
    rate = float(np.median(written)) if late.any() else 0.0
    if rate <= 0 or not 0 <= least.min() <= usual.max() <= size:
        return None
    as_a_rule, most = (size - float(np.median(usual))) / rate, (size - float(least.min())) / rate
    return (
        f"if power went, what the recorder had not written yet is missing: {as_a_rule:.1f} s as a "
        f"rule, {most:.1f} s at most in the minute before",
        f"DSF from log {told.t[late][0]:.1f} to {told.t[late][-1]:.1f} s: {rate:.0f} bytes a "
        f"second, free of the buffer of {size:.0f} on average {np.median(usual):.0f}, at least "
        f"{least.min():.0f}",
    )


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
    said = [e for e in log.events if e.kind == "text" and 0 <= e.t - anew < NEW_S]
    records = (
        f"the last record before: log {end.at:.1f} s",
        f"time since boot: begins anew at log {anew:.1f} s",
        *(f'text at log {e.t:.1f} s: "{e.text}"' for e in said[:MOST_TEXTS]),
        *(one.record() for one in told),
    )
    return Fact(ENDING, _restart(log, end, told), records=records)


def _restart(log: Log, end: FlightEnd, told: Sequence[Supply]) -> str:
    """Return from when to when an autopilot gave nothing, and what is known of its supply."""
    anew = log.flights[end.flight].restart
    is_last = end.flight == len(log.flights) - 1
    after = " and ".join(f"{s.name} {s.after:.1f} V" for s in told if s.after is not None)
    return (
        f"the autopilot gave nothing from log {end.at:.1f} to {anew:.1f} s, and then its clock "
        f"began anew: {_power(told)}"
        + (f", and {after} at the first ones after" if after else "")
        + ("; what became of the vehicle the log does not show" if is_last else "")
    )
