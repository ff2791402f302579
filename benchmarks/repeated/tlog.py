"""How does a small telemetry log become a large one?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fdi.telemetry.dialect import definition, frame_checks
from fdi.telemetry.formats.tlog.frames import Frames, find_frames

GAP_US = 200_000  # between two repetitions


def repeated(base: bytes, size: int) -> Iterator[bytes]:
    """Yield the pieces of a log of at least that size."""
    frames = find_frames(np.frombuffer(base, np.uint8), frame_checks())
    count = -(-size // len(base))
    block = np.frombuffer(base, np.uint8)[: int(frames.payload[-1]) + int(frames.length[-1]) + 2]
    stamps = frames.stamp_us.astype(np.int64)
    period_us = int(stamps.max() - stamps.min()) + GAP_US
    sent = {
        sender: int((senders(frames) == sender).sum()) for sender in set(senders(frames).tolist())
    }
    step = np.array([sent[s] for s in senders(frames).tolist()])
    sequence_at = frames.start + np.where(frames.version == 2, 12, 10)
    for i in range(count):
        part = block.copy()
        put(part, frames.start, (stamps + i * period_us).astype(">u8"))
        put(part, sequence_at, ((frames.sequence + i * step) % 256).astype(np.uint8))
        shift_times(part, frames, i * period_us)
        renew_checksums(part, frames)
        yield part.tobytes()


def senders(frames: Frames) -> np.ndarray:
    return frames.system.astype(np.int64) << 8 | frames.component


def put(data: np.ndarray, at: np.ndarray, values: np.ndarray) -> None:
    rows = values.view(np.uint8).reshape(at.size, values.itemsize)
    data[at[:, None] + np.arange(rows.shape[1])] = rows


def shift_times(data: np.ndarray, frames: Frames, shift_us: int) -> None:
    """Move the vehicle's own times on, where the payload holds them whole."""
    for number in np.unique(frames.number).tolist():
        for field in definition(number).fields:
            unit = {"time_boot_ms": 1000, "time_usec": 1, "time_unix_usec": 1}.get(field.name)
            if unit is None:
                continue
            width = np.dtype(field.dtype).itemsize
            rows = (frames.number == number) & (frames.length >= field.offset + width)
            at = frames.payload[rows] + field.offset
            old = data[at[:, None] + np.arange(width)].view(field.dtype).reshape(-1)
            put(data, at, old + np.array(shift_us // unit).astype(field.dtype) * (old > 0))


def renew_checksums(data: np.ndarray, frames: Frames) -> None:
    one = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        one = np.where(one & 1, (one >> 1) ^ np.uint16(0x8408), one >> 1)
    size = frames.payload - frames.start - 9 + frames.length
    for length in np.unique(size).tolist():
        rows = size == length
        at = frames.start[rows] + 9
        crc = np.full(at.size, 0xFFFF, np.uint16)
        extra = frame_checks().extra[frames.number[rows]].astype(np.uint16)
        for step in range(length + 1):
            byte = data[at + step] if step < length else extra
            crc = (crc >> 8) ^ one[(crc ^ byte) & 0xFF]
        put(data, at + length, crc.astype("<u2"))
