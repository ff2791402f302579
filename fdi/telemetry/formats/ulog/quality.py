"""What was lost on the way into a ULog?

In: the messages and what lies between them. Out: quality records, long lists told as one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from fdi.telemetry.formats.bounds import MOST_NAMES, MOST_TEXTS, left_out
from fdi.telemetry.formats.ulog.records import Records
from fdi.telemetry.formats.ulog.times import Reference
from fdi.telemetry.quality import Kind, QualityRecord

_SINGLE: Final = 20  # more findings of one kind are told as one


def damage_records(records: Records, known: Reference) -> Iterator[QualityRecord]:
    """Yield what belongs to no message, with offsets and byte counts."""
    lost = [(low, high - low) for low, high in records.lost]
    yield from _told("lost_bytes", "bytes that belong to no message", lost, known)
    unknown = [(at, size) for at, size, _ in records.unknown]
    kinds = ", ".join(sorted({chr(kind) for _, _, kind in records.unknown}))
    yield from _told("unknown_message", f"messages of the unknown type {kinds}", unknown, known)
    for low, high in records.cut:
        text = f"the file, or a part of it, ends in the middle of a message: {high - low} bytes "
        t = known.at_place(low)
        yield QualityRecord("truncated", None, t, t, high - low, f"{text}at byte {low}")


def _told(
    kind: Kind, words: str, found: Sequence[tuple[int, int]], known: Reference
) -> Iterator[QualityRecord]:
    if len(found) > _SINGLE:
        (first, _), (last, _) = found[0], found[-1]
        total = sum(size for _, size in found)
        text = f"{words}: {len(found)} places, {total} bytes in all, first at byte {first}, "
        text += f"last at byte {last}"
        count = total if kind == "lost_bytes" else len(found)
        start, end = known.at_place(first), known.at_place(last)
        yield QualityRecord(kind, None, start, end, count, text)
        return
    for at, size in found:
        t = known.at_place(at)
        text = f"{words}: {size} bytes at byte {at}"
        yield QualityRecord(kind, None, t, t, size if kind == "lost_bytes" else 1, text)


def definition_records(records: Records, known: Reference) -> Iterator[QualityRecord]:
    """Yield which data nobody defines."""
    numbers = sorted({number for _, _, number in records.opaque})
    words = f"data of ids that the file does not define ({', '.join(map(str, numbers[:_SINGLE]))})"
    if records.undefined:
        topics = ", ".join(records.undefined[:_SINGLE])
        words += f"; subscribed without a usable format: {topics}"
    yield from _told("unknown_message", words, [pair[:2] for pair in records.opaque], known)
    for rows in records.rows:
        if rows.is_guess:
            text = f"{rows.at.size} data messages whose subscription is missing are read as "
            text += f"{rows.layout.topic}, the only format that fits"
            yield QualityRecord("repaired", rows.layout.topic, None, None, rows.at.size, text)


def left_out_records(records: Records) -> Iterator[QualityRecord]:
    """Yield how many parameters, informations and texts are not kept."""
    left = records.left_out
    texts = sum(left[kind] for kind in "LC")
    yield from left_out(texts, f"texts between the first and last {MOST_TEXTS // 2}")
    keys = sum(left[kind] for kind in "PQIM")
    yield from left_out(keys, f"parameters and informations beyond {MOST_NAMES} of a kind")


def dropout_records(records: Records, known: Reference) -> Iterator[QualityRecord]:
    """Yield the times in which the logger could not write."""
    found = [
        (known.at_place(other.start), int.from_bytes(other.content, "little") / 1000)
        for other in records.others
        if other.kind == "O" and isinstance(other.content, bytes)
    ]
    if len(found) > _SINGLE:
        total, longest = sum(d for _, d in found), max(d for _, d in found)
        text = f"the logger dropped data {len(found)} times, {total:.2f} s in all, at most "
        text += f"{longest:.2f} s"
        start, end = found[0][0], found[-1][0] + found[-1][1]
        yield QualityRecord("gap", None, start, end, len(found), text)
        return
    for t, duration in found:
        text = f"the logger dropped data for {duration:.3f} s"
        yield QualityRecord("gap", None, t, t + duration, 1, text)
