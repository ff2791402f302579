"""How many times faster than pymavlink's loop is a telemetry log read, every field decoded?

    .venv/bin/python benchmarks/read_tlog.py BASE.tlog [--megabytes 50] [--boots] [--runs 5]

The file is made by repeating a real log: stamps, sequence numbers and the vehicle's own times go on
from repetition to repetition (one long recording), and checksums are made anew. ``--boots`` shifts
the stamps alone: then every repetition is a boot of its own.

Ours is `fdi.read` and every field of every message as it is on the wire, checksums checked, once
with numpy alone and once with the extra ``fast`` (its machine code kept from an earlier run). The
other one is the usual loop, ``mavutil.mavlogfile``, ``recv_match()`` and ``to_dict()``. CPU seconds
of one process, the best of several runs; peak memory is the resident set of a process of its own,
beyond what it had before the file was opened, the mapped file included.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import fdi
from fdi.telemetry.dialect import definition, frame_checks
from fdi.telemetry.formats.mavlink_frames import Frames, find_frames

NUMPY_TIMES, FAST_TIMES = 45, 110
NUMPY_MEMORY, FAST_MEMORY = 6.0, 4.0
GAP_US = 200_000  # between two repetitions

PEAK = """
import resource, sys
import numpy, fdi
fdi.read
from fdi.telemetry.dialect import frame_checks
from fdi.telemetry import reading
frame_checks()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
log = fdi.read(sys.argv[1])
for message in log.messages.values():
    for field in message.fields:
        message.raw(field)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024)
"""


def repeated(base: bytes, size: int, *, boots: bool) -> bytes:
    """Return a log of at least that size."""
    frames = find_frames(np.frombuffer(base, np.uint8), frame_checks())
    count = -(-size // len(base))
    block = np.frombuffer(base, np.uint8)[: int(frames.payload[-1]) + int(frames.length[-1]) + 2]
    stamps = frames.stamp_us.astype(np.int64)
    period_us = int(stamps.max() - stamps.min()) + GAP_US
    sent = {
        sender: int((senders(frames) == sender).sum()) for sender in set(senders(frames).tolist())
    }
    parts = []
    for i in range(count):
        part = block.copy()
        put(part, frames.start, (stamps + i * period_us).astype(">u8"))
        if not boots:
            at = frames.start + np.where(frames.version == 2, 12, 10)
            step = np.array([sent[s] for s in senders(frames).tolist()])
            put(part, at, ((frames.sequence + i * step) % 256).astype(np.uint8))
            shift_times(part, frames, i * period_us)
            renew_checksums(part, frames)
        parts.append(part)
    return np.concatenate(parts).tobytes()


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


def ours(path: Path) -> int:
    log = fdi.read(path)
    fields = 0
    for message in log.messages.values():
        for field in message.fields:
            fields += message.raw(field).size
    return fields


def theirs(path: Path) -> int:
    from pymavlink import mavutil

    reader = mavutil.mavlogfile(str(path))
    fields = 0
    while (message := reader.recv_match()) is not None:
        fields += len(message.to_dict())
    return fields


def cpu(action: Callable[[Path], int], path: Path, runs: int) -> float:
    best = float("inf")
    for _ in range(runs):
        start = time.process_time()
        action(path)
        best = min(best, time.process_time() - start)
    return best


def peak(path: Path, fast: str) -> int:
    done = subprocess.run(
        [sys.executable, "-c", PEAK, str(path)],
        env={**os.environ, "FDI_FAST": fast},
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("base", type=Path)
    arguments.add_argument("--megabytes", type=float, default=50.0)
    arguments.add_argument("--boots", action="store_true")
    arguments.add_argument("--runs", type=int, default=5)
    wanted = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.tlog"
        data = repeated(wanted.base.read_bytes(), int(wanted.megabytes * 1e6), boots=wanted.boots)
        path.write_bytes(data)
        size = len(data)
        del data
        print(f"{size / 1e6:.1f} MB, {sum(s.frames for s in fdi.read(path).sources)} messages")
        slow = cpu(theirs, path, 1)
        print(f"pymavlink       {slow:7.2f} s")
        limits = {"0": (NUMPY_TIMES, NUMPY_MEMORY), "1": (FAST_TIMES, FAST_MEMORY)}
        for fast, (times, memory) in limits.items():
            os.environ["FDI_FAST"] = fast
            ours(path)
            took, most = cpu(ours, path, wanted.runs), peak(path, fast)
            name = "numpy and numba" if fast == "1" else "numpy          "
            print(
                f"{name} {took:7.3f} s, {slow / took:5.0f} times (wanted {times}), "
                f"memory {most / size:.1f} times the file (wanted {memory:g})"
            )


if __name__ == "__main__":
    main()
