"""When, on the clock of one log, did another begin?

In: two logs. Out: what has to be added to the times of the second, how well that is known and by
which clue; or an error, where they are not of one flight.

The time since boot, where both logs know it, is the vehicle's own and exact; so is UTC by satellite
to some hundredths of a second. Either is believed when signals and place agree at that shift,
because two flights on one day begin at similar times since boot. Without these clocks the shift is
the one at which the signals agree best (`agreement.py`), but none of two logs of which satellite
time says that they were recorded one after the other. Logs that do not overlap, or in which nothing
moved, have no signals to compare: they belong together where both know both clocks and these name
the same moment of booting, or where one begins, by satellite time, within a minute of the other's
end: the two files of an autopilot that started anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from fdi.errors import UsageError
from fdi.telemetry.log import Log
from fdi.telemetry.meaning.restarts import SILENT_S
from fdi.telemetry.together.agreement import (
    ALIKE,
    ALIKE_IN_PLACE,
    LEAST_OVERLAP_S,
    SAME_PLACE_M,
    Agreement,
    agreement,
    best_agreement,
    distance,
    is_confirmed,
    shared,
)

Clue = Literal["boot", "signals", "utc"]

_SAME_BOOT_S: Final = 5.0  # between two clocks' moments of booting: less than a reboot takes
_CONFIRMS_S: Final = 0.3  # the signals' own shift may differ so much: a link's delay
_MOST_SHIFTS: Final = 100  # a log of noise may seem to boot a thousand times
_UTC_WITHIN_S: Final = 1.0
_BOOT_UNCERTAINTY_S: Final = 0.002  # both say milliseconds


@dataclass(frozen=True, slots=True)
class Placement:
    """How one log lies on another's clock.

    Attributes
    ----------
    offset : float
        s; t of the first log = t of the second + offset.
    uncertainty : float
        s, 95 %.
    clue : Clue
        By what.
    agreement : Agreement or None
        How well the signals agree there; None where they could not be compared.
    """

    offset: float
    uncertainty: float
    clue: Clue
    agreement: Agreement | None


def place(first: Log, second: Log) -> Placement:
    """Return how the second log lies on the clock of the first.

    Raises
    ------
    UsageError
        The two are not of one flight, or nothing tells how they lie.
    """
    pairs = shared(first, second)
    for clue, offset in _by_clocks(first, second):
        within = _CONFIRMS_S if clue == "boot" else _UTC_WITHIN_S
        found = agreement(pairs, offset, within)
        if found is not None and is_confirmed(found, distance(first, second, found)):
            if clue == "boot":
                return Placement(offset, _BOOT_UNCERTAINTY_S, "boot", found)
            return Placement(found.offset, found.uncertainty, "signals", found)
    in_turn = _in_turn(first, second)
    best = best_agreement(pairs) if in_turn is None else None
    apart = None if best is None else distance(first, second, best)
    if best is not None and is_confirmed(best, apart):
        return Placement(best.offset, best.uncertainty, "signals", best)
    for offset in _of_same_boot(first, second):
        if not _fly_together(first, second, offset) or not pairs:
            return Placement(offset, _BOOT_UNCERTAINTY_S, "boot", None)
    if in_turn is not None:
        return Placement(_anew(first, second, in_turn), _UTC_WITHIN_S, "utc", None)
    if best is None:
        raise UsageError(
            f"cannot be put on the clock of {first.name}: they share no signals of the same time, "
            "and their clocks do not name the same moment of booting",
            where=second.name,
            hint="analyse them one by one",
        )
    raise UsageError(
        f"is of another flight than {first.name}, or of another time of it: "
        f"{_why_not(best, apart)}",
        where=second.name,
        hint="analyse them one by one",
    )


def _why_not(best: Agreement, apart: float | None) -> str:
    needed = ALIKE if apart is None else ALIKE_IN_PLACE
    told = f"correlation {best.r:.2f} at best, {needed:g} is needed"
    if apart is None or best.r < needed:
        return f"no shift in time makes their signals agree ({told})"
    return (
        f"where their signals agree best ({told}), they are {apart:.1f} m apart "
        f"({SAME_PLACE_M:g} m at most)"
    )


def _by_clocks(first: Log, second: Log) -> Iterator[tuple[str, float]]:
    """Yield the shifts at which the logs' clocks agree and the logs overlap, boot time first."""
    a, b = first.clock, second.clock
    found = [
        *(("boot", float(x)) for x in np.unique(b.boot_offset[:, None] - a.boot_offset)),
        *(("utc", float(x)) for x in np.unique(b.utc_offset[:, None] - a.utc_offset)),
    ]
    for clue, offset in found[:_MOST_SHIFTS]:
        if np.isfinite(offset) and _overlap(first, second, offset) >= LEAST_OVERLAP_S:
            yield clue, offset


def _of_same_boot(first: Log, second: Log) -> Iterator[float]:
    """Yield the shifts by boot time of boots that began at the same UTC in both logs."""
    a, b = first.clock, second.clock
    booted_a, booted_b = a.utc_offset - a.boot_offset, b.utc_offset - b.boot_offset
    for i in range(booted_a.size):
        for k in range(booted_b.size):
            if abs(booted_a[i] - booted_b[k]) <= _SAME_BOOT_S:
                yield float(b.boot_offset[k] - a.boot_offset[i])


def _in_turn(first: Log, second: Log) -> float | None:
    """Return the shift by satellite time of logs that were recorded in turn; None for others."""
    a, b = first.clock, second.clock
    if {a.utc_source, b.utc_source} != {"vehicle"}:
        return None
    offset = float(np.nanmedian(b.utc_offset) - np.nanmedian(a.utc_offset))
    return offset if _overlap(first, second, offset) <= _UTC_WITHIN_S else None


def _anew(first: Log, second: Log, offset: float) -> float:
    """Return the shift of two logs between which an autopilot started anew.

    It was not started before the earlier one ended: satellite time is moved as far as that asks.

    Raises
    ------
    UsageError
        Too much time lies between them, or the later one's autopilot was started long before.
    """
    is_later = second.span[0] + offset > first.span[0]
    if is_later:
        least = first.span[1] + _since_boot(second) - second.span[0]
        moved = max(least - offset, 0.0)
    else:
        most = first.span[0] - _since_boot(first) - second.span[1]
        moved = max(offset - most, 0.0)
    between = -_overlap(first, second, offset)
    if between > SILENT_S:
        why = f"by satellite time {between:.0f} s lie between them"
    elif moved > _SAME_BOOT_S:
        why = f"the later one's autopilot ran already {moved:.0f} s before the earlier one ends"
    else:
        return offset + moved if is_later else offset - moved
    raise UsageError(
        f"is of another flight than {first.name}: {why}",
        where=second.name,
        hint="analyse them one by one",
    )


def _since_boot(log: Log) -> float:
    return max(log.clock.boot(log.span[0]) or 0.0, 0.0)


def _overlap(first: Log, second: Log, offset: float) -> float:
    low = max(first.span[0], second.span[0] + offset)
    return min(first.span[1], second.span[1] + offset) - low


def _fly_together(first: Log, second: Log, offset: float) -> bool:
    """Return whether either log shows a vehicle in the air while both are recorded."""
    low = max(first.span[0], second.span[0] + offset)
    high = min(first.span[1], second.span[1] + offset)
    return any(
        min(flight.airborne[1] + shift, high) - max(flight.airborne[0] + shift, low)
        >= LEAST_OVERLAP_S
        for log, shift in ((first, 0.0), (second, offset))
        for flight in log.flights
    )
