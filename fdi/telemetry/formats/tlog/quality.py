"""What was lost on the way into a tlog?

In: the frames and their damage, the messages. Out: quality records, long lists told as one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.clock import Timeline
from fdi.telemetry.dialect import definition
from fdi.telemetry.formats.bounds import SINGLE
from fdi.telemetry.formats.tlog.frames import Damage, Frames
from fdi.telemetry.message import Message, is_outside
from fdi.telemetry.quality import QualityRecord

_SEQUENCE_STEP: Final = 64  # a longer step in the sequence is a second link or a restart
_WORTH_TELLING: Final = 0.005  # share of lost frames


def damage_records(frames: Frames, line: Timeline) -> Iterator[QualityRecord]:
    """Yield what lies between the good frames, with offsets and byte counts."""
    by_kind: dict[str, list[Damage]] = {}
    for damage in frames.damage:
        by_kind.setdefault(damage.kind, []).append(damage)
    for found in by_kind.values():
        if len(found) <= SINGLE:
            for damage in found:
                yield _told(damage, frames, line)
            continue
        first, last = found[0], found[-1]
        total = sum(d.size for d in found)
        text = f"{_WORDS[first.kind]}: {len(found)} places, {total} bytes in all, first at byte "
        text += f"{first.offset}, last at byte {last.offset}"
        start, end = _moment(first, frames, line), _moment(last, frames, line)
        count = total if first.kind in ("lost_bytes", "truncated") else len(found)
        yield QualityRecord(first.kind, None, start, end, count, text)


_WORDS: Final = {
    "lost_bytes": "bytes that belong to no message",
    "bad_checksum": "messages with a wrong checksum",
    "unknown_message": "messages of unknown number",
    "truncated": "the file ends in the middle of a message",
}


def _told(damage: Damage, frames: Frames, line: Timeline) -> QualityRecord:
    meaning = None if damage.number is None else definition(damage.number)
    name = None if meaning is None else meaning.name
    what = f", {name or f'number {damage.number}'}" if damage.number is not None else ""
    text = f"{_WORDS[damage.kind]}: {damage.size} bytes at byte {damage.offset}{what}"
    at = _moment(damage, frames, line)
    count = damage.size if damage.kind in ("lost_bytes", "truncated") else 1
    return QualityRecord(damage.kind, name, at, at, count, text)


def _moment(damage: Damage, frames: Frames, line: Timeline) -> float:
    before = max(int(np.searchsorted(frames.start, damage.offset)) - 1, 0)
    return float(line.created[before])


def lost_frames(sequence: NDArray[np.uint8]) -> int:
    """Return how many frames are missing in a sequence that counts modulo 256."""
    step = sequence[1:] - sequence[:-1]
    gaps = step[(step > 1) & (step < _SEQUENCE_STEP)]
    return int((gaps - 1).sum())


def link_records(arrived: int, lost: int, span: tuple[float, float]) -> Iterator[QualityRecord]:
    """Yield the share of the vehicle's frames that never arrived, where it is worth telling."""
    sent = lost + arrived
    if lost > _WORTH_TELLING * sent:
        text = f"{lost} of {sent} messages ({lost / sent:.1%}) did not arrive, by their numbers"
        yield QualityRecord("gap", None, *span, lost, text)


def duplicate_record(messages: Mapping[str, Message]) -> Iterator[QualityRecord]:
    """Yield how many records share their time with another one, or repeat an old fix."""
    left_out = {key: m.stamp.size - len(m) for key, m in messages.items() if m.stamp.size > len(m)}
    if left_out:
        most = sorted(left_out, key=lambda key: (-left_out[key], key))[:3]
        names = ", ".join(f"{key} {left_out[key]}" for key in most)
        total = sum(left_out.values())
        count = "1 record has" if total == 1 else f"{total} records have"
        text = f"{count} the time of another one: the last is kept ({names})"
        yield QualityRecord("duplicate", None, None, None, total, text)


def invalid_records(messages: Mapping[str, Message]) -> Iterator[QualityRecord]:
    """Yield, field by field, the values that are impossible: no numbers, or beyond any limit."""
    for key, message in messages.items():
        for name, column in message.columns.items():
            if column.range is None:
                continue
            raw = message.raw(name)
            wrong = is_outside(raw, column.range)
            if not wrong.any():
                continue
            for sentinel in column.invalid:
                wrong &= raw != sentinel
            rows = np.flatnonzero(wrong)
            if rows.size:
                yield _impossible(f"{key}.{name}", message, column.range, rows)


def _impossible(
    channel: str, message: Message, limits: tuple[float, float], rows: NDArray[np.int64]
) -> QualityRecord:
    times = message.t[np.isin(message.kept, rows)]
    start, end = (float(times[0]), float(times[-1])) if times.size else (None, None)
    low, high = (f"{limit:g}" for limit in limits)
    text = f"{rows.size} of {message.stamp.size} values are no numbers or not in {low} .. {high} "
    text += "on the wire: unknown"
    return QualityRecord("invalid_values", channel, start, end, int(rows.size), text)
