"""How many times faster than pyulog is a ULog read, every field decoded?

    .venv/bin/python benchmarks/read_ulog.py BASE.ulg [--megabytes 50] [--runs 5]

The file is made by repeating the data of a real log, its definitions once; the time since boot goes
on from repetition to repetition.

Ours is `fdi.read` and every field of every topic as it is stored, once with numpy alone and once
with the extra ``fast`` (its machine code kept from an earlier run). The other one is
``pyulog.ULog``, which decodes all fields when it opens the file. CPU seconds of one process, the
best of several runs; peak memory is the resident set of a process of its own, beyond what it had
before the file was opened, the file itself included.
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
from fdi.telemetry.formats.ulog_records import find_records
from fdi.telemetry.formats.ulog_walk import words

NUMPY_TIMES, FAST_TIMES = 6, 11
NUMPY_MEMORY, FAST_MEMORY = 6.0, 4.0
HEADER = 16
GAP_US = 100_000  # between two repetitions

PEAK = """
import re, sys
import numpy, fdi
fdi.read
from fdi.telemetry import reading
def most():  # getrusage would tell the largest of the process that started this one, too
    return int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1])
before = most()
log = fdi.read(sys.argv[1])
for message in log.messages.values():
    if message.made_from is None:
        for field in message.fields:
            message.raw(field)
print((most() - before) * 1024)
"""


def repeated(base: bytes, size: int) -> bytes:
    """Return a log of at least that size: the base, and then its data again and again."""
    data = np.frombuffer(base, np.uint8)
    rows = find_records(data, [(HEADER, data.size)]).rows
    start = np.sort(np.concatenate([one.at for one in rows])) - 5
    length = 3 + words(data, "<u2")[start].astype(np.int64)
    place = np.append(0, np.cumsum(length))  # in the block of data messages alone
    inside = np.arange(place[-1]) - np.repeat(place[:-1], length)
    block = data[np.repeat(start, length) + inside]
    stamps = []
    for one in rows:
        stamp = one.layout.field("timestamp")
        if stamp is not None:
            stamps.append(place[np.searchsorted(start, one.at - 5)] + 5 + stamp.offset)
    at = np.concatenate(stamps)[:, None] + np.arange(8)
    first = block[at].view("<u8").reshape(-1)
    likely = first[first < 2 * np.median(first)]  # a few stamps are not of this flight
    period = int(likely.max() - np.quantile(likely, 0.01)) + GAP_US
    parts = [data]
    for i in range(1, -(-size // block.size)):
        part = block.copy()
        part[at] = (first + np.uint64(i * period)).view(np.uint8).reshape(-1, 8)
        parts.append(part)
    return np.concatenate(parts).tobytes()


def ours(path: Path) -> int:
    log = fdi.read(path)
    fields = 0
    for message in log.messages.values():
        if message.made_from is None:
            for field in message.fields:
                fields += message.raw(field).size
    return fields


def theirs(path: Path) -> int:
    from pyulog import ULog

    return sum(len(values) for one in ULog(str(path)).data_list for values in one.data.values())


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
    arguments.add_argument("--runs", type=int, default=5)
    wanted = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.ulg"
        path.write_bytes(repeated(wanted.base.read_bytes(), int(wanted.megabytes * 1e6)))
        size = path.stat().st_size
        print(f"{size / 1e6:.1f} MB, {sum(s.frames for s in fdi.read(path).sources)} messages")
        limits = {"0": (NUMPY_TIMES, NUMPY_MEMORY), "1": (FAST_TIMES, FAST_MEMORY)}
        slow = cpu(theirs, path, wanted.runs)
        print(f"pyulog          {slow:7.3f} s")
        for fast, (times, memory) in limits.items():
            os.environ["FDI_FAST"] = fast
            ours(path)
            took, most = cpu(ours, path, wanted.runs), peak(path, fast)
            name = "numpy and numba" if fast == "1" else "numpy          "
            print(
                f"{name} {took:7.3f} s, {slow / took:5.1f} times (wanted {times}), "
                f"memory {most / size:.1f} times the file (wanted {memory:g})"
            )


if __name__ == "__main__":
    main()
