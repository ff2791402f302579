"""How many times faster than the reference readers are logs read, and in how much memory?

    .venv/bin/python benchmarks/read.py [--megabytes 50] [--runs 5] [--only NAME] [--large]

Real logs, in ../shared beside the repository, are repeated to a large one. Ours is `fdi.read` and
every field of every message of the log itself as it is on the wire (checksums checked), once with
numpy alone and once with the extra ``fast``, whose machine code is kept from the run before. Theirs
is the usual loop that decodes every message and reads its fields: ``recv_match()`` and
``to_dict()``, of a ULog ``pyulog.ULog``. CPU seconds in this process, the best of several runs in
turn (theirs again while it has taken less than 10 s), because what else runs on the machine slows
both. Memory is the largest resident set of a process of its own beyond what it had with everything
imported, the file's own bytes included.

``--large`` instead: a DataFlash log of 1 GB, `fdi info` and one channel, in wall seconds and the
largest memory that is not the file (RssAnon). Returns 1 where a bound is missed.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from repeated import dataflash, tlog, ulog

import fdi

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared"
MEMORY = {"0": 6.0, "1": 4.0}  # times the file's size, without and with the extra ``fast``
LARGE_MB, INFO_S, CHANNEL_S, ANONYMOUS_MB = 1000, 10.0, 10.0, 500.0
THEIRS_S = 10.0  # CPU seconds of theirs after which it is not run again
CHANNEL = "IMU.AccX"


@dataclass(frozen=True, slots=True)
class Case:
    """A log to be repeated, and how many times faster than theirs ours has to be."""

    name: str
    source: str
    repeat: Callable[[bytes, int], Iterator[bytes]]
    theirs: Callable[[Path], int]
    numpy_times: float
    fast_times: float


def pymavlink_telemetry(path: Path) -> int:
    from pymavlink import mavutil

    reader = mavutil.mavlogfile(str(path))
    count = 0
    while (message := reader.recv_match()) is not None:
        message.to_dict()
        count += 1
    return count


def pymavlink_dataflash(path: Path) -> int:
    from pymavlink import DFReader

    reader = DFReader.DFReader_binary(str(path))
    count = 0
    while (message := reader.recv_match()) is not None:
        message.to_dict()
        count += 1
    return count


def pyulog(path: Path) -> int:
    from pyulog import ULog

    return sum(len(topic.data["timestamp"]) for topic in ULog(str(path)).data_list)


PLANE = "flights/sitl/plane/p01_rect_calm"
CASES = (
    Case("tlog, MAVLink 2", PLANE + ".tlog", tlog.repeated, pymavlink_telemetry, 45, 110),
    Case(
        "tlog, MAVLink 1 and 2",
        "flights/alfa/no_failure.tlog",
        tlog.repeated,
        pymavlink_telemetry,
        45,
        110,
    ),
    Case(
        "bin, Copter 4.7",
        "telemetry/samples/copter_sitl_4.7.bin",
        dataflash.repeated,
        pymavlink_dataflash,
        100,
        160,
    ),
    Case("bin, Plane 4.6", PLANE + ".BIN", dataflash.repeated, pymavlink_dataflash, 100, 160),
    Case("ulg, PX4 of 2017", "flights/odd/sitl_2017.ulg", ulog.repeated, pyulog, 6, 11),
    Case("ulg, PX4 1.15", "flights/crash/motors_cut_in_air.ulg", ulog.repeated, pyulog, 6, 11),
)

# VmHWM, not ru_maxrss: that begins with the largest size of the process that started this one.
PEAK = """
import pathlib, sys
import fdi
path, base = map(pathlib.Path, sys.argv[1:])
def peak():
    lines = pathlib.Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))
def all_columns(log):
    for message in log.messages.values():
        for field in message.fields if message.made_from is None else ():
            message.raw(field)
all_columns(fdi.read(base))  # imports, tables, machine code
before = peak()
log = fdi.read(path)
all_columns(log)
print(peak() - before)
"""


def ours(path: Path) -> int:
    log = fdi.read(path)
    count = 0
    for message in log.messages.values():
        for field in message.fields if message.made_from is None else ():
            count += message.raw(field).size
    return count


def cpu(action: Callable[[Path], int], path: Path) -> float:
    """Return the CPU seconds that it takes."""
    start = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):
        action(path)
    return time.process_time() - start


def compete(case: Case, path: Path, runs: int) -> tuple[float, dict[str, float]]:
    """Return the CPU seconds of the fastest run of theirs, and of ours by ``FDI_FAST``."""
    theirs, mine = [], dict.fromkeys(MEMORY, np.inf)
    for _ in range(runs):
        if sum(theirs) < THEIRS_S:
            theirs.append(cpu(case.theirs, path))
        for fast in MEMORY:
            os.environ["FDI_FAST"] = fast
            mine[fast] = min(mine[fast], cpu(ours, path), cpu(ours, path))
    return min(theirs), mine


def peak(path: Path, base: Path, fast: str) -> float:
    done = subprocess.run(
        [sys.executable, "-c", PEAK, str(path), str(base)],
        env={**os.environ, "FDI_FAST": fast, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)


def write(case: Case, size: int, path: Path) -> None:
    with path.open("wb") as file:
        for piece in case.repeat((SHARED / case.source).read_bytes(), size):
            file.write(piece)


def measure(case: Case, size: int, runs: int, path: Path) -> bool:
    """Print the figures of one log; return whether all bounds are kept."""
    write(case, size, path)
    bytes_ = path.stat().st_size
    os.environ["FDI_FAST"] = "0"
    count = sum(source.frames for source in fdi.read(path).sources)
    slow, mine = compete(case, path, runs)
    print(f"{case.name}: {bytes_ / 1e6:.1f} MB, {count} records; theirs {slow:.2f} s")
    kept = True
    for fast, times, name in (("0", case.numpy_times, "numpy"), ("1", case.fast_times, "numba")):
        took = mine[fast]
        memory = peak(path, SHARED / case.source, fast) / bytes_
        print(
            f"    {name} {took:6.3f} s, {bytes_ / took / 1e6:4.0f} MB/s, {slow / took:5.1f} times "
            f"(wanted {times:g}), memory {memory:.1f} times the file (at most {MEMORY[fast]:g})"
        )
        kept = kept and slow / took >= times and memory <= MEMORY[fast]
    return kept


def watch(command: list[str]) -> tuple[float, float, float, int]:
    """Return wall s, CPU s, largest anonymous memory in MB and the exit code of a command."""
    start, most = time.perf_counter(), 0.0
    process = subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.DEVNULL
    )
    status = Path(f"/proc/{process.pid}/status")
    while True:
        ended, code, usage = os.wait4(process.pid, os.WNOHANG)
        if ended:
            break
        for line in status.read_text().splitlines():
            if line.startswith("RssAnon"):
                most = max(most, int(line.split()[1]) / 1e3)
        time.sleep(0.005)
    process.returncode = os.waitstatus_to_exitcode(code)
    wall = time.perf_counter() - start
    return wall, usage.ru_utime + usage.ru_stime, most, process.returncode


def measure_large(path: Path) -> bool:
    """Print the figures of a log of 1 GB; return whether all bounds are kept."""
    os.environ.pop("FDI_FAST", None)
    case = next(c for c in CASES if c.repeat is dataflash.repeated)
    write(case, LARGE_MB * 1_000_000, path)
    channel = f"import fdi; print(fdi.read({str(path)!r}).channel({CHANNEL!r}).value.size)"
    info = "import sys; from fdi.cli import main; sys.exit(main())"
    kept = True
    print(f"{case.name}: {path.stat().st_size / 1e6:.0f} MB")
    for name, command, bound in (
        ("fdi info", ["-c", info, "info", str(path)], INFO_S),
        (f"one channel ({CHANNEL})", ["-c", channel], CHANNEL_S),
    ):
        wall, used, memory, code = watch([sys.executable, *command])
        print(
            f"    {name}: {wall:.1f} s wall (bound {bound:g}), {used:.1f} s CPU, "
            f"{memory:.0f} MB of anonymous memory (bound {ANONYMOUS_MB:g}), exit code {code}"
        )
        kept = kept and wall < bound and memory < ANONYMOUS_MB and code == 0
    return kept


def main() -> int:
    """Print the figures; return 1 where a bound is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--megabytes", type=float, default=50.0)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", default="", help="part of the name of a log")
    parser.add_argument("--large", action="store_true", help="one log of 1 GB instead")
    asked = parser.parse_args()
    passed = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.log"
        for case in CASES[2:3] if asked.large else CASES:
            if not (SHARED / case.source).is_file():
                print(f"{case.name}: skipped, {SHARED / case.source} is not here")
            elif asked.large:
                passed.append(measure_large(path))
            elif asked.only in case.name:
                passed.append(measure(case, int(asked.megabytes * 1e6), asked.runs, path))
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
