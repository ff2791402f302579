"""What does a MAVLink telemetry log (`.tlog`) hold?

In: the bytes of the file. Out: a `Log`. Frames are found by `mavlink_frames`, columns made by
`mavlink_columns`; this file chooses the vehicle, gives every record a time and puts the log
together.

The vehicle is the sender whose heartbeat names an autopilot and no ground station, with most
frames; ``system`` decides otherwise. Its autopilot component's messages make the log; other
components of the same system, and radios, add messages that it does not send itself. Ground
stations are only counted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError, UsageError
from fdi.telemetry.catalogue import mavlink_autopilot, mavlink_firmware, mavlink_vehicle
from fdi.telemetry.clock import Timeline, make_clock, timeline
from fdi.telemetry.dialect import definition, frame_checks
from fdi.telemetry.formats.mavlink_columns import Payloads, columns
from fdi.telemetry.formats.mavlink_events import firmware, log_events, parameters
from fdi.telemetry.formats.mavlink_frames import Frames, find_frames
from fdi.telemetry.formats.mavlink_quality import (
    damage_records,
    duplicate_record,
    gap_records,
    link_records,
    lost_frames,
)
from fdi.telemetry.formats.mavlink_repeats import without_repeats
from fdi.telemetry.formats.mavlink_signs import vertical_speed_down
from fdi.telemetry.log import Log, Source
from fdi.telemetry.message import Message
from fdi.telemetry.quality import QualityRecord

Ints = NDArray[np.int64]
Groups = Mapping[tuple[int, int, int], Payloads]  # (system, component, message number)

Identities = Mapping[tuple[int, int], tuple[int, int] | None]  # sender: (type, autopilot)

_SNIFF: Final = 1 << 20  # bytes looked at a time when the format is in question
_ENOUGH: Final = 3  # frames with a right checksum: by chance one comes in some 80 MB of noise
_GROUND_STATION: Final = 6  # MAV_TYPE_GCS
_NO_AUTOPILOT: Final = 8  # MAV_AUTOPILOT_INVALID
_RADIO: Final = (51, 68)  # system and component of SiK radios
_HEARTBEAT: Final = 0
_WRAP_US: Final = 2**32 / 1e6  # s: 32-bit microseconds, and micros() of ArduPilot until 2019
_WRAP_MS: Final = 2**32 / 1e3
_OWN_TIME_SLACK_S: Final = 2.0  # a record's own time further from its neighbours' is another's
_STALE_FIX_S: Final = 1.0  # a repeated fix older than this says that there is no new one
_APART_S: Final = 1e-6
_UTC_US: Final = 1e15  # larger time_usec values are UTC, smaller ones count from boot


@dataclass(frozen=True, slots=True)
class _Vehicle:
    system: int
    component: int
    vehicle: str
    autopilot: str


def is_tlog(data: NDArray[np.uint8]) -> bool:
    """Return whether the bytes hold MAVLink frames with right checksums."""
    checks = frame_checks()
    for low in range(0, data.size, _SNIFF):
        frames = find_frames(data[low : low + _SNIFF], checks)
        starts_with_one = frames.start.size > 0 and low == 0 and frames.start[0] == 0
        if starts_with_one or frames.start.size >= _ENOUGH:
            return True
    return False


def read_tlog(path: Path, data: NDArray[np.uint8], *, system: int | None = None) -> Log:
    """Return the log.

    Parameters
    ----------
    path : Path
        Only its name is used.
    data : (n,) uint8
        The file's bytes.
    system : int, optional
        The MAVLink system to take instead of the one with most frames.

    Raises
    ------
    LogError
        There is no MAVLink message in it.
    UsageError
        There is no such system in it.
    """
    frames = find_frames(data, frame_checks())
    if not frames.start.size:
        raise LogError("holds no MAVLink message with a right checksum", where=path.name)
    frames, repeats = without_repeats(frames)
    groups = _group(frames)
    known = {sender: _identity(groups, sender) for sender in _senders(groups)}
    vehicle = _choose(groups, known, system)
    line = _timeline(groups, frames, vehicle)
    messages = _messages(groups, frames, line, vehicle)
    messages, repaired = vertical_speed_down(messages)
    own = {
        number: payloads
        for (sender, component, number), payloads in groups.items()
        if (sender, component) == (vehicle.system, vehicle.component)
    }
    values, changes, named = parameters(own, line, vehicle.autopilot)
    events = log_events(own, line, vehicle.autopilot, vehicle.vehicle) + named
    is_own = (frames.system == vehicle.system) & (frames.component == vehicle.component)
    span = float(line.created[is_own].min()), float(line.created[is_own].max())
    quality = [
        *damage_records(frames, line),
        *line.quality,
        *repaired,
        *gap_records(messages),
        *link_records(frames, is_own, line),
        *repeats,
        *duplicate_record(messages),
    ]
    utc_rows, utc = _utc(own)
    stamps = frames.stamp_us
    return Log(
        path,
        "tlog",
        data,
        _duration(line),
        span,
        MappingProxyType(messages),
        MappingProxyType(values),
        changes,
        tuple(sorted(events, key=lambda e: (e.t, e.kind))),
        tuple(sorted(quality, key=_place)),
        make_clock(line, utc_rows, utc, stamps),
        vehicle.vehicle,
        vehicle.autopilot,
        firmware(own, events, mavlink_firmware(vehicle.autopilot, vehicle.vehicle)),
        vehicle.system,
        tuple(_sources(groups, frames, known, vehicle)),
    )


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text


def _duration(line: Timeline) -> float:
    return max(float(line.created.max()), 0.0)


def _group(frames: Frames) -> Groups:
    """Return the payloads per sender and message, ascending by sender and number."""
    key = frames.system.astype(np.int64) << 32
    key |= frames.component.astype(np.int64) << 24
    key |= frames.number
    distinct, place = np.unique(key, return_inverse=True)
    order = np.argsort(place.astype(np.int16 if distinct.size < 2**15 else np.int64), kind="stable")
    bounds = np.searchsorted(place[order], np.arange(distinct.size + 1))
    groups = {}
    for i, code in enumerate(distinct.tolist()):
        meaning = definition(code & 0xFFFFFF)
        if meaning is not None:
            rows = order[bounds[i] : bounds[i + 1]]
            sender = code >> 32, code >> 24 & 0xFF, code & 0xFFFFFF
            groups[sender] = Payloads(meaning, frames, rows)
    return groups


def _senders(groups: Groups) -> dict[tuple[int, int], int]:
    """Return the number of frames per (system, component)."""
    count: dict[tuple[int, int], int] = {}
    for (system, component, _), payloads in groups.items():
        count[system, component] = count.get((system, component), 0) + payloads.rows.size
    return count


def _identity(groups: Groups, sender: tuple[int, int]) -> tuple[int, int] | None:
    """Return (MAV_TYPE, MAV_AUTOPILOT) that a sender's heartbeats name most often."""
    beats = groups.get((*sender, _HEARTBEAT))
    if beats is None:
        return None
    both = beats.field("type").astype(np.int64) << 8 | beats.field("autopilot")
    most = int(np.argmax(np.bincount(both)))
    return most >> 8, most & 0xFF


def _choose(groups: Groups, known: Identities, system: int | None) -> _Vehicle:
    count = _senders(groups)
    wanted = {s for s in count if system is None or s[0] == system}
    if not wanted:
        present = ", ".join(str(s) for s in sorted({s for s, _ in count}))
        raise UsageError(f"the log has no system {system}", hint=f"it has {present}")

    def rank(sender: tuple[int, int]) -> tuple[bool, bool, int]:
        kind = known[sender]
        flies = kind is not None and kind[0] != _GROUND_STATION and kind[1] != _NO_AUTOPILOT
        is_ground = (kind is not None and kind[0] == _GROUND_STATION) or sender == _RADIO
        return flies, not is_ground, count[sender]

    sender = max(sorted(wanted), key=rank)
    kind = known[sender]
    if kind is None:
        return _Vehicle(*sender, "other", "other")
    return _Vehicle(*sender, mavlink_vehicle(kind[0]), mavlink_autopilot(kind[1]))


def _sources(
    groups: Groups, frames: Frames, known: Identities, vehicle: _Vehicle
) -> Iterator[Source]:
    rows: dict[tuple[int, int], list[Ints]] = {}
    for (system, component, _), payloads in groups.items():
        rows.setdefault((system, component), []).append(payloads.rows)
    for sender, parts in sorted(rows.items()):
        kind = known[sender]
        own = np.sort(np.concatenate(parts))
        yield Source(
            *sender,
            own.size,
            lost_frames(frames.sequence[own]),
            None if kind is None or kind[0] == _GROUND_STATION else mavlink_vehicle(kind[0]),
            None if kind is None or kind[1] == _NO_AUTOPILOT else mavlink_autopilot(kind[1]),
            sender == (vehicle.system, vehicle.component),
        )


def _timeline(groups: Groups, frames: Frames, vehicle: _Vehicle) -> Timeline:
    timed = [
        payloads
        for (system, component, _), payloads in groups.items()
        if (system, component) == (vehicle.system, vehicle.component)
        and payloads.has("time_boot_ms")
    ]
    if not timed:
        none = np.empty(0, np.int64)
        return timeline(frames.stamp_us, none, none, none)
    rows = np.concatenate([p.rows for p in timed])
    boot_ms = np.concatenate([p.field("time_boot_ms").astype(np.int64) for p in timed])
    which = np.concatenate([np.full(p.rows.size, i) for i, p in enumerate(timed)])
    order = np.argsort(rows, kind="stable")
    main = int(np.argmax([p.rows.size for p in timed]))
    return timeline(
        frames.stamp_us, rows[order], boot_ms[order], np.flatnonzero(which[order] == main)
    )


def _utc(own: Mapping[int, Payloads]) -> tuple[Ints, NDArray[np.float64]]:
    """Return where the vehicle tells UTC, and what it tells (s since 1970)."""
    pairs = [p for p in own.values() if p.definition.name == "SYSTEM_TIME"]
    if not pairs:
        return np.empty(0, np.int64), np.empty(0)
    utc = pairs[0].field("time_unix_usec").astype(np.float64)
    known = utc > _UTC_US
    return pairs[0].rows[known], utc[known] / 1e6


def _messages(
    groups: Groups, frames: Frames, line: Timeline, vehicle: _Vehicle
) -> dict[str, Message]:
    """Return the chosen vehicle's messages by key, ascending."""

    def rank(sender: tuple[int, int, int]) -> tuple[bool, int, int]:
        return sender[:2] != (vehicle.system, vehicle.component), sender[0], sender[1]

    made: dict[str, Message] = {}
    taken: set[str] = set()
    zero_us = round(line.zero * 1e6)
    for sender in sorted(groups, key=rank):
        payloads = groups[sender]
        name, system = payloads.definition.name, sender[0]
        is_radio = sender[:2] == _RADIO and name in ("RADIO", "RADIO_STATUS")
        if (system != vehicle.system and not is_radio) or name in taken:
            continue
        taken.add(name)
        for instance, part in _instances(payloads):
            is_own = sender[:2] == (vehicle.system, vehicle.component)
            t, kept = _times(part, line, own=is_own)
            stamp = _stamps(frames.stamp_us[part.rows], zero_us)
            fields = columns(part, autopilot=vehicle.autopilot, vehicle=vehicle.vehicle)
            for array in (t, kept, stamp):
                array.flags.writeable = False
            message = Message(name, instance, t, stamp, kept, MappingProxyType(fields))
            made[message.key] = message
    return dict(sorted(made.items()))


def _stamps(stamp_us: NDArray[np.uint64], zero_us: int) -> NDArray[np.float64]:
    """Return the recorder's stamps as they are, s since the file's first record."""
    signed = np.minimum(stamp_us, np.uint64(2**62)).astype(np.int64)
    since: NDArray[np.float64] = (signed - zero_us) / 1e6
    return since


def _instances(payloads: Payloads) -> Iterator[tuple[int | None, Payloads]]:
    """Yield the payloads per instance; instance 0 is None. Named instances stay together."""
    field = payloads.definition.instance_field
    numbers = None if field is None else payloads.field(field)
    if numbers is None or numbers.dtype.kind not in "iu":
        yield None, payloads
        return
    for number in np.unique(numbers).tolist():
        yield number or None, payloads.of(payloads.rows[numbers == number])


def _times(payloads: Payloads, line: Timeline, *, own: bool) -> tuple[NDArray[np.float64], Ints]:
    """Return t, strictly ascending, and the records that it belongs to."""
    t, every = line.created[payloads.rows], np.ones(payloads.rows.size, np.bool_)
    if own and np.isfinite(line.offset).all():
        if payloads.has("time_boot_ms"):
            said = payloads.field("time_boot_ms") / 1000
            t = line.from_boot(payloads.rows, said, wrap=_WRAP_MS, slack=_OWN_TIME_SLACK_S)
        elif payloads.has("time_usec"):
            t, every = _from_microseconds(payloads, line)
    rows = np.flatnonzero(every)
    rows = rows[np.argsort(t[rows], kind="stable")]
    t = t[rows]
    if not (payloads.has("time_boot_ms") or payloads.has("time_usec")):
        # what arrived at one moment (parameters, texts) is not one record: a microsecond apart
        spread = np.arange(t.size) * _APART_S
        t = np.maximum.accumulate(t - spread) + spread
    is_last = np.diff(t, append=np.inf) > 0
    return t[is_last], rows[is_last]


def _from_microseconds(
    payloads: Payloads, line: Timeline
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return t from time_usec, and which records say something new.

    For a GPS it is the time of the last fix: a record that repeats one is left out, until so much
    time has passed that the repetition itself is the news (the fix is lost).
    """
    created = line.created[payloads.rows]
    micros = payloads.field("time_usec")
    is_fix = payloads.definition.name in ("GPS_RAW_INT", "GPS2_RAW")
    said = np.where(micros > _UTC_US, np.nan, micros / 1e6)
    slack = _WRAP_US if is_fix else _OWN_TIME_SLACK_S
    t = line.from_boot(payloads.rows, said, wrap=_WRAP_US, slack=slack)
    if not is_fix:
        return t, np.ones(t.size, np.bool_)
    is_new = np.concatenate(([True], micros[1:] != micros[:-1]))
    since = created - created[np.maximum.accumulate(np.where(is_new, np.arange(t.size), 0))]
    is_stale = np.maximum(created - t, since) > _STALE_FIX_S
    return np.where(is_new & ~is_stale, t, created), is_new | is_stale
