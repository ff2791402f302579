"""What does a MAVLink telemetry log (`.tlog`) hold?

In: the bytes of the file. Out: a `Log`. Frames are found by `frames`, columns made by `columns`,
the vehicle chosen by `vehicle`; this file puts the log together.

The messages of the vehicle's autopilot make the log; other components of the same system, and
radios, add messages that it does not send itself. Ground stations are only counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.airframes import frame_of
from fdi.telemetry.catalogue import mavlink_firmware
from fdi.telemetry.clock import Timeline, make_clock
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.gaps import gap_records
from fdi.telemetry.formats.tlog.columns import Payloads, columns
from fdi.telemetry.formats.tlog.events import (
    firmware,
    log_events,
    parameters,
    told_too_much,
    with_mavlink_severities,
    with_orders,
)
from fdi.telemetry.formats.tlog.frames import Frames, find_frames
from fdi.telemetry.formats.tlog.groups import (
    Groups,
    Key,
    Sender,
    frames_by_sender,
    group_payloads,
    without_senders,
)
from fdi.telemetry.formats.tlog.quality import (
    damage_records,
    duplicate_record,
    invalid_records,
    link_records,
    lost_frames,
)
from fdi.telemetry.formats.tlog.repeats import without_repeats
from fdi.telemetry.formats.tlog.signs import vertical_speed_down, wind_from
from fdi.telemetry.formats.tlog.times import record_times, vehicle_timeline, vehicle_utc
from fdi.telemetry.formats.tlog.vehicle import (
    RADIO,
    Sent,
    Vehicle,
    by_parameters,
    choose_vehicle,
    identities,
    sources,
)
from fdi.telemetry.log import Log
from fdi.telemetry.meaning import (
    as_ardupilot,
    with_link,
    with_motors,
    with_outputs,
    with_restarts,
)
from fdi.telemetry.message import Column, Message
from fdi.telemetry.quality import QualityRecord

Floats = NDArray[np.float64]

_SNIFF: Final = 1 << 20  # bytes looked at a time when the format is in question
_BLOCK: Final = 1 << 16  # frames at a time: less memory, and that stays in the cache
_ENOUGH: Final = 3  # frames with a right checksum: by chance one comes in some 80 MB of noise


def is_tlog(data: NDArray[np.uint8]) -> bool:
    """Return whether the bytes hold MAVLink frames with right checksums."""
    checks = frame_checks()
    for low in range(0, data.size, _SNIFF):
        frames = find_frames(data[low : low + _SNIFF], checks)
        starts_with_one = frames.start.size > 0 and low == 0 and frames.start[0] == 0
        if starts_with_one or frames.start.size >= _ENOUGH:
            return True
    return False


def _of_others(
    groups: Groups, created: Mapping[Key, Floats], sender: tuple[int, int]
) -> dict[int, list[tuple[Payloads, Floats]]]:
    """Return what others than the autopilot sent by message number, with the times.

    A companion computer is another component of the same system.
    """
    found: dict[int, list[tuple[Payloads, Floats]]] = {}
    for key, sent in groups.payloads.items():
        if key[:2] != sender:
            found.setdefault(key[2], []).append((sent, created[key]))
    return found


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
    frames, senders, repeats = _counted(frames, system)
    groups = group_payloads(frames)
    known = identities(groups.payloads)
    vehicle = choose_vehicle(senders, known, system)
    own = {key[2]: made for key, made in groups.payloads.items() if key[:2] == vehicle.sender}
    line = vehicle_timeline(frames.stamp_us, own)
    values, changes, named, beyond = parameters(own, line, vehicle.autopilot)
    vehicle = by_parameters(vehicle, values)
    created = groups.of_each(line.created)
    span = _span([t for key, t in created.items() if key[:2] == vehicle.sender])
    clock = make_clock(line, *vehicle_utc(own), frames.stamp_us)
    stamps = groups.of_each(_stamps(frames, line))
    read = partial(
        columns, autopilot=vehicle.autopilot, vehicle=vehicle.vehicle, recorded=clock.utc(0.0)
    )
    messages = _messages(groups, created, stamps, line, vehicle, read)
    messages, up = vertical_speed_down(messages)
    messages, upwind = wind_from(messages, clock.utc(0.0))
    events = log_events(own, line, vehicle.autopilot, vehicle.vehicle) + named
    events = with_orders(events, _of_others(groups, created, vehicle.sender), vehicle.system)
    named_firmware = firmware(own, events, mavlink_firmware(vehicle.autopilot, vehicle.vehicle))
    events = with_mavlink_severities(events, vehicle.autopilot, named_firmware, clock.utc(0.0))
    texts = (event.text for event in events if event.kind == "text")
    kind = (known[vehicle.sender] or (0, 0))[0]
    frame = frame_of(vehicle.vehicle, values, texts, autopilot=vehicle.autopilot, mav_type=kind)
    quality = [
        *damage_records(frames, line),
        *line.quality,
        *up,
        *upwind,
        *gap_records(messages),
        *invalid_records(messages),
        *link_records(*senders[vehicle.sender], span),
        *repeats,
        *told_too_much(own, beyond),
        *duplicate_record(messages),
    ]
    messages = with_restarts(with_link(messages), events)
    if vehicle.autopilot == "px4":
        messages = as_ardupilot(messages, vehicle.vehicle)
    messages = with_outputs(messages, values, vehicle.autopilot, vehicle.vehicle)
    messages = with_motors(messages, values, vehicle.autopilot, frame.vehicle)
    return Log(
        path,
        "tlog",
        data,
        max(float(line.created.max()), 0.0),
        span,
        MappingProxyType(messages),
        MappingProxyType(values),
        changes,
        tuple(sorted(events, key=lambda e: (e.t, e.kind))),
        tuple(sorted(quality, key=_place)),
        clock,
        frame.vehicle,
        vehicle.autopilot,
        named_firmware,
        vehicle.system,
        tuple(sources(senders, known, vehicle)),
        frame=frame.name,
    )


def _counted(
    frames: Frames, system: int | None
) -> tuple[Frames, dict[Sender, Sent], list[QualityRecord]]:
    """Return the frames without repeats, how many every sender sent, and what was left out."""
    frames, others = without_senders(frames, system)
    rows = frames_by_sender(frames)
    frames, repeats = without_repeats(frames, rows)
    if repeats:
        rows = frames_by_sender(frames)
    sent = {
        sender: Sent(part.size, lost_frames(frames.sequence[part])) for sender, part in rows.items()
    }
    return frames, sent, others + repeats


def _span(times: list[Floats]) -> tuple[float, float]:
    return min(float(t.min()) for t in times), max(float(t.max()) for t in times)


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text


def _messages(
    groups: Groups,
    created: Mapping[Key, Floats],
    stamps: Mapping[Key, Floats],
    line: Timeline,
    vehicle: Vehicle,
    read: Callable[[Payloads], dict[str, Column]],
) -> dict[str, Message]:
    """Return the chosen vehicle's messages by key, ascending."""

    def rank(sender: tuple[int, int, int]) -> tuple[bool, int, int]:
        return sender[:2] != vehicle.sender, sender[0], sender[1]

    made: dict[str, Message] = {}
    taken: set[str] = set()
    every = np.arange(max(times.size for times in created.values()))
    for sender in sorted(groups.payloads, key=rank):
        payloads = groups.payloads[sender]
        name, system = payloads.definition.name, sender[0]
        is_radio = sender[:2] == RADIO and name in ("RADIO", "RADIO_STATUS")
        if (system != vehicle.system and not is_radio) or name in taken:
            continue
        taken.add(name)
        for instance, part, rows in _instances(payloads):
            is_own = sender[:2] == vehicle.sender
            t, kept = record_times(part, created[sender][rows], line, every, own=is_own)
            stamp = stamps[sender][rows]
            for array in (t, kept, stamp):
                array.flags.writeable = False
            message = Message(name, instance, t, stamp, kept, MappingProxyType(read(part)))
            made[message.key] = message
    return dict(sorted(made.items()))


def _stamps(frames: Frames, line: Timeline) -> Floats:
    """Return the recorder's stamps as they are, s since the file's first record."""
    since, zero = np.empty(frames.stamp_us.size), round(line.zero * 1e6)
    for low in range(0, since.size, _BLOCK):
        here = slice(low, low + _BLOCK)
        signed = np.minimum(frames.stamp_us[here], np.uint64(2**62)).view(np.int64)
        since[here] = (signed - zero) / 1e6
    return since


def _instances(
    payloads: Payloads,
) -> Iterator[tuple[int | None, Payloads, slice | NDArray[np.bool_]]]:
    """Yield the payloads per instance, and which they are; instance 0 is None.

    Named instances stay together.
    """
    field = payloads.definition.instance_field
    numbers = None if field is None else payloads.field(field)
    if numbers is None or numbers.dtype.kind not in "iu":
        yield None, payloads, slice(None)
        return
    distinct = np.unique(numbers).tolist()
    if len(distinct) == 1:
        yield distinct[0] or None, payloads, slice(None)
        return
    for number in distinct:
        here = numbers == number
        yield number or None, payloads.of(here), here
