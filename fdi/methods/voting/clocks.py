"""Are several logs of one flight, and how do their clocks lie to each other?

In: logs of autopilots that fly one vehicle. Out: for each what has to be added to its times to have
those of the first. Which shift it is says `fdi.telemetry.together`: the clocks suggest it and the
motion confirms it, because two tests of one day begin at the same time since boot. Three estimators
of one vehicle agree like two recorders of one: r = 0.998 in the published test; 0.30 to 0.50
between logs of two tests.

The motion alone can be deceived: two simulated flights of one plan were flown so much alike that r
was 0.91. So where both logs know UTC by satellite, they also have to agree about it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from fdi.errors import UsageError
from fdi.methods.voting.flags import number_of
from fdi.telemetry import Log
from fdi.telemetry.together.placing import place

_UTC_APART_S: Final = 2.0
"""So far apart may two receivers tell the same moment: whole seconds, told late."""
_HINT: Final = "give vote the logs of the autopilots of one vehicle and one flight"


def offsets(logs: Sequence[Log]) -> tuple[float, ...]:
    """Return for every log what is added to its times to have those of the first, s.

    Raises
    ------
    UsageError
        Two are the same file, of different flights or of one autopilot, or no clock is common.
    """
    found = [0.0]
    for place_in_line, log in enumerate(logs[1:], 1):
        for other in logs[:place_in_line]:
            if other.sha256 == log.sha256:
                raise UsageError(f"{other.path} and {log.path} are the same log", hint=_HINT)
        found.append(_offset(logs[0], log))
    _check_numbers(logs)
    return tuple(found)


def _offset(first: Log, log: Log) -> float:
    try:
        placed = place(first, log)
    except UsageError as error:
        raise UsageError(
            f"{error.message}{_in_utc(first, log)}", where=str(log.path), hint=_HINT
        ) from error
    offset = placed.offset
    if placed.clue == "utc":
        raise UsageError(
            f"was not recorded while {first.name} was, by satellite time{_in_utc(first, log)}",
            where=str(log.path),
            hint=_HINT,
        )
    apart = _utc_apart(first, log, offset)
    if apart is not None and apart > _UTC_APART_S:
        raise UsageError(
            f"is of another flight than {first.name}: where their motion agrees, their satellite "
            f"times are {apart:.1f} s apart{_in_utc(first, log)}",
            where=str(log.path),
            hint=_HINT,
        )
    return offset


def _utc_apart(first: Log, log: Log, offset: float) -> float | None:
    """Return by how much two logs differ about UTC, s, None where a receiver does not tell both."""
    clocks = first.clock, log.clock
    if any(clock.utc_source != "vehicle" for clock in clocks):
        return None
    found = np.abs(log.clock.utc_offset[:, None] - offset - first.clock.utc_offset)
    return None if np.isnan(found).all() else float(np.nanmin(found))


def _in_utc(first: Log, log: Log) -> str:
    """Return when two logs began, where both know it: that tells two flights at a glance."""
    started, other = first.clock.utc(first.span[0]), log.clock.utc(log.span[0])
    if started is None or other is None:
        return ""
    return f"; it begins at {other[:19]} UTC, {first.path} at {started[:19]}"


def _check_numbers(logs: Sequence[Log]) -> None:
    by_number: dict[int, Log] = {}
    for log in logs:
        number = number_of(log)
        if number in by_number:
            raise UsageError(
                f"{by_number[number].path} and {log.path} both say that they are of autopilot "
                f"{number} (MAV_SYS_ID)",
                hint="give each autopilot a number of its own",
            )
        by_number[number] = log
