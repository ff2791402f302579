"""What does a MAVLink telemetry log (`.tlog`) hold?

In: the bytes of the file. Out: a `Log`. Frames are found by `mavlink_frames`, columns made by
`mavlink_columns`, the vehicle chosen by `mavlink_vehicle`; this file puts the log together.

The messages of the vehicle's autopilot make the log; other components of the same system, and
radios, add messages that it does not send itself. Ground stations are only counted.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.catalogue import mavlink_firmware
from fdi.telemetry.clock import Timeline, make_clock
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry.formats.mavlink_columns import Payloads, columns
from fdi.telemetry.formats.mavlink_events import firmware, log_events, parameters
from fdi.telemetry.formats.mavlink_frames import Frames, find_frames
from fdi.telemetry.formats.mavlink_groups import Groups, frames_by_sender, group_payloads
from fdi.telemetry.formats.mavlink_quality import (
    damage_records,
    duplicate_record,
    gap_records,
    link_records,
)
from fdi.telemetry.formats.mavlink_repeats import without_repeats
from fdi.telemetry.formats.mavlink_signs import vertical_speed_down
from fdi.telemetry.formats.mavlink_times import record_times, vehicle_timeline, vehicle_utc
from fdi.telemetry.formats.mavlink_vehicle import (
    RADIO,
    Vehicle,
    choose_vehicle,
    identities,
    sources,
)
from fdi.telemetry.log import Log
from fdi.telemetry.message import Message
from fdi.telemetry.quality import QualityRecord

_SNIFF: Final = 1 << 20  # bytes looked at a time when the format is in question
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
    senders = frames_by_sender(frames)
    frames, repeats = without_repeats(frames, senders)
    if repeats:
        senders = frames_by_sender(frames)
    groups = group_payloads(frames)
    known = identities(groups, senders)
    vehicle = choose_vehicle(senders, known, system)
    own = {key[2]: payloads for key, payloads in groups.items() if key[:2] == vehicle.sender}
    line = vehicle_timeline(frames.stamp_us, own)
    messages = _messages(groups, frames, line, vehicle)
    messages, repaired = vertical_speed_down(messages)
    values, changes, named = parameters(own, line, vehicle.autopilot)
    events = log_events(own, line, vehicle.autopilot, vehicle.vehicle) + named
    own_rows = senders[vehicle.sender]
    at = line.created[own_rows]
    span = float(at.min()), float(at.max())
    quality = [
        *damage_records(frames, line),
        *line.quality,
        *repaired,
        *gap_records(messages),
        *link_records(frames.sequence[own_rows], span),
        *repeats,
        *duplicate_record(messages),
    ]
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
        make_clock(line, *vehicle_utc(own), frames.stamp_us),
        vehicle.vehicle,
        vehicle.autopilot,
        firmware(own, events, mavlink_firmware(vehicle.autopilot, vehicle.vehicle)),
        vehicle.system,
        tuple(sources(senders, frames, known, vehicle)),
    )


def _place(record: QualityRecord) -> tuple[float, str, str]:
    return (-1.0 if record.start is None else record.start), record.kind, record.text


def _messages(
    groups: Groups, frames: Frames, line: Timeline, vehicle: Vehicle
) -> dict[str, Message]:
    """Return the chosen vehicle's messages by key, ascending."""

    def rank(sender: tuple[int, int, int]) -> tuple[bool, int, int]:
        return sender[:2] != vehicle.sender, sender[0], sender[1]

    made: dict[str, Message] = {}
    taken: set[str] = set()
    zero_us = round(line.zero * 1e6)
    for sender in sorted(groups, key=rank):
        payloads = groups[sender]
        name, system = payloads.definition.name, sender[0]
        is_radio = sender[:2] == RADIO and name in ("RADIO", "RADIO_STATUS")
        if (system != vehicle.system and not is_radio) or name in taken:
            continue
        taken.add(name)
        for instance, part in _instances(payloads):
            is_own = sender[:2] == vehicle.sender
            t, kept = record_times(part, line, own=is_own)
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
    distinct = np.unique(numbers).tolist()
    for number in distinct:
        yield number or None, payloads if len(distinct) == 1 else payloads.of(numbers == number)
