"""How does a telemetry log get other values, with every other byte as it was?

A changed frame gets a new checksum and the length that MAVLink 2 would give it; a signature, which
is of other bytes, goes. Frames after one that was left out move up in their sender's numbering, so
that nothing looks lost on the link.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.telemetry.dialect import MessageDefinition, definition_by_name, frame_checks
from fdi.telemetry.formats.change import Change, as_stored
from fdi.telemetry.formats.tlog.frames import Frames, find_frames
from fdi.telemetry.log import Log
from fdi.telemetry.message import Message

Ints = NDArray[np.int64]

_MAGIC_V1: Final = 0xFE
_SIGNED: Final = 13  # bytes of a signature


def write_tlog(log: Log, changes: Mapping[str, Change]) -> bytes:
    """Return the bytes of a log with changes, by key of the message.

    Raises
    ------
    UsageError
        A message came twice, or by several senders.
    """
    frames = find_frames(log.data, frame_checks())
    payloads: dict[int, bytearray] = {}
    lost: set[int] = set()
    for key, change in changes.items():
        meaning, rows = _rows(log, log[key], frames)
        for name, (values, where) in change.values.items():
            offset, kind = _place(meaning, name)
            stored = as_stored(values, kind)
            for record in np.flatnonzero(where).tolist():
                row = int(rows[record])
                full = payloads.setdefault(row, _payload(frames, row, meaning.size))
                full[offset : offset + kind.itemsize] = stored[record].tobytes()
        if change.lost is not None:
            lost.update(rows[change.lost].tolist())
    return _assembled(frames, payloads, lost)


def _rows(log: Log, message: Message, frames: Frames) -> tuple[MessageDefinition, Ints]:
    """Return which frames are the records of a message."""
    meaning = definition_by_name(message.name)
    assert meaning is not None
    is_its = (frames.number == meaning.id) & (frames.system == log.system_id)
    own = next(s.component for s in log.sources if s.chosen)
    senders = sorted(set(frames.component[is_its].tolist()), key=lambda c: (c != own, c))
    rows = (
        np.flatnonzero(is_its & (frames.component == senders[0])) if senders else np.empty(0, int)
    )
    if meaning.instance_field is not None and rows.size:
        offset, kind = _place(meaning, meaning.instance_field)
        if kind.kind in "iu":
            parts = [
                bytes(_payload(frames, row, meaning.size)[offset : offset + kind.itemsize])
                for row in rows.tolist()
            ]
            rows = rows[np.frombuffer(b"".join(parts), kind) == (message.instance or 0)]
    if rows.size != message.stamp.size:
        raise UsageError(f"{message.key} came twice, or by several senders: cannot be rewritten")
    return meaning, rows


def _place(meaning: MessageDefinition, name: str) -> tuple[int, np.dtype[Any]]:
    """Return offset and type of a field, or of an array's entry."""
    base, _, index = name.partition("[")
    field = next(f for f in meaning.fields if f.name == base)
    kind = np.dtype(field.dtype)
    return field.offset + (int(index[:-1]) * kind.itemsize if index else 0), kind


def _payload(frames: Frames, row: int, size: int) -> bytearray:
    at, length = int(frames.payload[row]), int(frames.length[row])
    return bytearray(frames.data[at : at + length].tobytes().ljust(size, b"\0"))


def _assembled(frames: Frames, payloads: Mapping[int, bytearray], lost: set[int]) -> bytes:
    """Return the file with these payloads, and without the lost frames."""
    data = frames.data.tobytes()
    start, ends = frames.start.tolist(), (frames.payload + frames.length).tolist()
    missing: dict[tuple[int, int], int] = {}
    parts, at = [], 0
    for row in range(len(start)):
        sender = int(frames.system[row]), int(frames.component[row])
        if row not in lost and row not in payloads and not missing.get(sender):
            continue
        parts.append(data[at : start[row]])
        at = ends[row] + 2
        if data[start[row] + 8] != _MAGIC_V1 and data[start[row] + 10] & 1:
            at += _SIGNED  # of other bytes than these: it goes
        if row in lost:
            missing[sender] = missing.get(sender, 0) + 1
            continue
        head = bytearray(data[start[row] : int(frames.payload[row])])
        old = data[int(frames.payload[row]) : ends[row]]
        parts.append(_frame(head, payloads.get(row), old, missing.get(sender, 0), frames, row))
    return b"".join([*parts, data[at:]])


def _frame(
    head: bytearray,
    changed: bytearray | None,
    old: bytes,
    missing: int,
    frames: Frames,
    row: int,
) -> bytes:
    """Return a record with stamp, head, payload and checksum."""
    from pymavlink.generator.mavcrc import x25crc

    is_v1 = head[8] == _MAGIC_V1
    payload = old
    if changed is not None:
        payload = bytes(changed[: len(old)]) if is_v1 else bytes(changed).rstrip(b"\0") or b"\0"
    head[9] = len(payload)
    if not is_v1:
        head[10] &= 0xFE
    place = 10 if is_v1 else 12
    head[place] = (head[place] - missing) % 256
    extra = int(frame_checks().extra[frames.number[row]])
    crc: int = x25crc(bytes(head[9:]) + payload + bytes([extra])).crc
    return bytes(head) + payload + crc.to_bytes(2, "little")
