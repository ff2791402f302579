"""What do several logs of one flight hold together?

In: logs of one vehicle, in the order given. Out: one `Log` on the clock of the first, whose t = 0
stays at the first log's first record. `placing.py` finds how the others lie on that clock,
`messages.py` which log's records stand for each message, `happenings.py` what happened. Flights are
found anew. The log's `recordings` and its quality say what came from where.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Final

import numpy as np

from fdi.errors import UsageError
from fdi.telemetry.clock import Clock
from fdi.telemetry.events import Event
from fdi.telemetry.log import Log, Recording
from fdi.telemetry.meaning import LINK, RESTART, link_of, with_restarts
from fdi.telemetry.meaning.restarts import heard_again
from fdi.telemetry.message import Message
from fdi.telemetry.quality import ANEW, QualityRecord
from fdi.telemetry.together.happenings import (
    CHANGE_S,
    differing,
    merged_events,
    merged_parameters,
)
from fdi.telemetry.together.messages import Taken, shifted, united
from fdi.telemetry.together.placing import Placement, place

_SYSTEM_PARAMETERS: Final = ("SYSID_THISMAV", "MAV_SYSID", "MAV_SYS_ID")
_ONE_FLIGHT: Final = "several logs have to be of one flight, by one autopilot"
_FEW: Final = 8  # names that a line tells
_LEAST_DIFFERENT: Final = 10
_MOST_DIFFERENT: Final = 0.05
"""Share of the shared parameters that may differ: counters, and what was set between two reads."""


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    log: Log
    placement: Placement | None  # None for the first

    @property
    def offset(self) -> float:
        return 0.0 if self.placement is None else self.placement.offset


def join(logs: Sequence[Log]) -> Log:
    """Return several logs of one flight as one.

    Parameters
    ----------
    logs : sequence of Log
        The first one's clock is that of the result.

    Raises
    ------
    UsageError
        They are not of one vehicle, or not of one flight.
    """
    if not logs:
        raise UsageError("no log is given")
    if len(logs) == 1:
        return logs[0]
    placed = [_Placed(logs[0], None)]
    for log in logs[1:]:
        placed.append(_Placed(log, _place_among(placed, log)))
    pairs = [(one.log, one.offset) for one in placed]
    spans = [(log.span[0] + offset, log.span[1] + offset) for log, offset in pairs]
    span = min(low for low, _ in spans), max(high for _, high in spans)
    vehicle = _known([log.vehicle for log in logs])
    old = [(f.start + offset, f.end + offset) for log, offset in pairs for f in log.flights]
    messages, taken = _messages(placed, old or [span])
    values, changes, differ = merged_parameters(pairs)
    recordings = tuple(_recordings(placed, taken, messages))
    events = merged_events(pairs)
    anew = _anew(placed, events)
    if anew:
        events = sorted([*events, *anew], key=lambda e: (e.t, e.kind))
        messages = with_restarts({k: m for k, m in messages.items() if k != RESTART}, events)
    first, end = logs[0], max(log.duration + offset for log, offset in pairs)
    sources = [source for log in logs for source in log.sources]
    return replace(
        first,
        duration=end - min(0.0, *(one.offset for one in placed)),
        span=span,
        messages=MappingProxyType(messages),
        parameters=MappingProxyType(values),
        parameter_changes=changes,
        reported=tuple(events),
        quality=(*_told(placed, recordings, differ), *_quality(placed)),
        clock=_clock(placed),
        vehicle=vehicle,
        autopilot=_known([log.autopilot for log in logs]),
        firmware=next((log.firmware for log in logs if log.firmware), None),
        sources=tuple(dict.fromkeys(sources)),
        recordings=recordings,
        defaults=MappingProxyType({k: v for log in logs[::-1] for k, v in log.defaults.items()}),
        judge=lambda: tuple(one for log in logs for one in log.judge()),
        _cache={},
    )


def _anew(placed: Sequence[_Placed], events: Sequence[Event]) -> list[Event]:
    """Return the restarts between logs that were recorded in turn, which no other one saw."""
    order = sorted(placed, key=lambda one: one.log.span[0] + one.offset)
    found = []
    for one, later in pairwise(order):
        if "utc" not in {each.placement.clue for each in (one, later) if each.placement}:
            continue
        end, start = one.log.span[1] + one.offset, later.log.span[0]
        heard = heard_again(later.log.messages.values(), start) + later.offset
        is_told = any(e.kind == "reboot" and end <= e.t <= heard + CHANGE_S for e in events)
        if end <= start + later.offset and not is_told:
            found.append(Event(heard, "reboot", ANEW))
    return found


def _known(names: Sequence[str]) -> str:
    return next((name for name in names if name != "other"), names[0])


def _place_among(placed: Sequence[_Placed], log: Log) -> Placement:
    """Return how a log lies on the first one's clock, by any of those that lie on it already."""
    refusal = None
    for one in placed:
        _check_vehicle(one.log, log)
    for one in placed:
        try:
            found = place(one.log, log)
        except UsageError as error:
            refusal = refusal or error
            continue
        known = 0.0 if one.placement is None else one.placement.uncertainty
        return replace(
            found, offset=found.offset + one.offset, uncertainty=found.uncertainty + known
        )
    raise refusal or UsageError("cannot be placed", where=log.name)


def _check_vehicle(first: Log, second: Log) -> None:
    """Refuse logs that cannot be of one flight, whatever their times.

    Raises
    ------
    UsageError
        The same file, another vehicle, or other parameters.
    """
    if first.sha256 == second.sha256:
        raise UsageError("is the same file twice", where=f"{first.name}, {second.name}")
    for what, one, other in (
        ("vehicle", first.vehicle, second.vehicle),
        ("autopilot", first.autopilot, second.autopilot),
        ("system", _system(first), _system(second)),
    ):
        if one != other and "other" not in (one, other):
            raise UsageError(
                f"is of another autopilot than {first.name}: {what} {other}, there {one}",
                where=second.name,
                hint=_ONE_FLIGHT,
            )
    count, names = differing(first.parameters, second.parameters)
    if len(names) >= max(_LEAST_DIFFERENT, _MOST_DIFFERENT * count):
        told = ", ".join(names[:3])
        raise UsageError(
            f"is of another autopilot or flight than {first.name}: {len(names)} of the {count} "
            f"parameters that both hold differ ({told}, ...)",
            where=second.name,
            hint=_ONE_FLIGHT,
        )


def _system(log: Log) -> str:
    """Return the vehicle's system number, "other" where the log does not state it."""
    is_stated = log.format == "tlog" or any(name in log.parameters for name in _SYSTEM_PARAMETERS)
    return str(log.system_id) if is_stated else "other"


def _messages(
    placed: Sequence[_Placed], flights: Sequence[tuple[float, float]]
) -> tuple[dict[str, Message], dict[str, Taken]]:
    """Return the joined messages by key, and from which logs they come."""
    held: dict[str, list[tuple[int, Message]]] = {}
    for position, one in enumerate(placed):
        for key, message in one.log.messages.items():
            held.setdefault(key, []).append((position, shifted(message, one.offset)))
    made, taken = {}, {}
    for key in sorted(held):
        made[key], taken[key] = united(held[key], flights)
    if LINK in held:  # what one recorder misses another may have heard
        heard = {position for position, _ in held[LINK]}
        made[LINK] = link_of(m for found in held.values() for p, m in found if p in heard)
    return made, taken


def _recordings(
    placed: Sequence[_Placed], taken: Mapping[str, Taken], messages: Mapping[str, Message]
) -> list[Recording]:
    return [
        Recording(
            name=one.log.name,
            format=one.log.format,
            bytes=one.log.bytes,
            sha256=one.log.sha256,
            offset=one.offset,
            uncertainty=0.0 if one.placement is None else one.placement.uncertainty,
            placed_by="first" if one.placement is None else one.placement.clue,
            end=one.log.span[1] + one.offset,
            messages=tuple(key for key in messages if taken[key].chosen == position),
            added={
                key: taken[key].fields.get(position, ())
                for key in messages
                if position in taken[key].fields or position in taken[key].records
            },
        )
        for position, one in enumerate(placed)
    ]


def _told(
    placed: Sequence[_Placed], recordings: Sequence[Recording], differ: Sequence[str]
) -> list[QualityRecord]:
    """Return what the joining did, as findings about the data."""
    told = []
    shared = {
        key
        for key in {key for one in placed for key in one.log.messages}
        if sum(key in one.log.messages for one in placed) > 1
    }
    for one, recording in zip(placed, recordings, strict=True):
        chosen = [key for key in recording.messages if key in shared]
        text = f"{recording.name}: {_placement_text(one.placement, placed[0].log.name)}; "
        text += f"of {len(shared)} messages that several logs hold {len(chosen)} are taken from it"
        text += f": {_some(chosen)}" if chosen else ""
        if recording.added:
            text += f"; fields or records are added to {_some(list(recording.added))}"
        told.append(QualityRecord("joined", None, None, None, len(recording.messages), text))
    if differ:
        text = f"the logs differ about {len(differ)} parameters ({_some(differ)}): the value is "
        text += "that of the log that began first"
        told.append(QualityRecord("joined", None, None, None, len(differ), text))
    return told


def _placement_text(placement: Placement | None, first: str) -> str:
    if placement is None:
        return "its clock counts"
    how = {
        "boot": "by the time since boot",
        "signals": "by the signals",
        "utc": "by satellite time",
    }
    found = placement.agreement
    agreed = (
        f"confirmed by {found.quantities} signals, r = {found.r:.2f}"
        if found is not None
        else "not confirmed by signals: they are not in the air at one time"
    )
    return (
        f"its t + {placement.offset:.3f} s is that of {first} (to {placement.uncertainty:.3f} s, "
        f"{how[placement.clue]}, {agreed})"
    )


def _some(names: Sequence[str]) -> str:
    more = len(names) - _FEW
    return ", ".join(names[:_FEW]) + (f" and {more} more" if more > 0 else "")


def _quality(placed: Sequence[_Placed]) -> list[QualityRecord]:
    """Return the findings about the single logs, on the common clock, with the log's name."""
    moved = [
        replace(
            record,
            start=None if record.start is None else record.start + one.offset,
            end=None if record.end is None else record.end + one.offset,
            text=f"{one.log.name}: {record.text}",
        )
        for one in placed
        for record in one.log.quality
    ]
    return sorted(moved, key=lambda r: (-np.inf if r.start is None else r.start, r.kind, r.text))


def _clock(placed: Sequence[_Placed]) -> Clock:
    """Return the clock: boot time from the first log that knows it, UTC from the best source.

    Of logs that were recorded in turn each tells the time since its own boot.
    """
    knowing = [one for one in placed if one.log.clock.boot_known] or [placed[0]]
    order = sorted(placed, key=lambda one: one.log.clock.utc_source != "vehicle")
    by_utc = next((one for one in order if one.log.clock.utc_known), placed[0])
    since = knowing[:1]
    if any(one.placement is not None and one.placement.clue == "utc" for one in knowing):
        since = sorted(knowing, key=lambda one: one.log.span[0] + one.offset)
    begins = [one.log.span[0] + one.offset for one in since[1:]]
    starts = [one.log.clock.start + one.offset for one in (*since, by_utc)]
    start = np.unique(np.concatenate([*starts, begins]))
    by_boot = [since[k] for k in np.searchsorted(begins, start, side="right")]
    utc = by_utc.log.clock
    return Clock(
        start,
        np.array([_at(one, "boot_offset", t) for one, t in zip(by_boot, start, strict=True)]),
        np.array([_at(by_utc, "utc_offset", t) for t in start]),
        since[0].log.clock.boot_uncertainty,
        utc.utc_uncertainty,
        utc.utc_source,
        max((one.log.clock.pace for one in placed), key=lambda pace: abs(pace - 1)),
    )


def _at(one: _Placed, what: str, t: float) -> float:
    """Return what a log's own clock adds to the common time t, s."""
    clock = one.log.clock
    piece = max(int(np.searchsorted(clock.start + one.offset, t, side="right")) - 1, 0)
    return float(getattr(clock, what)[piece]) - one.offset
