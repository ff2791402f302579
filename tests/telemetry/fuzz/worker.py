"""Does every input of a range of numbers keep the limits? One JSON line for each that does not.

A process of its own: an endless loop in compiled code, an abort or a crash costs a worker, and the
one who watches it knows which number it was, because every number is announced before it is tried.
"""

from __future__ import annotations

import json
import math
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random
from types import FrameType
from typing import Any, Final

from fdi.errors import FdiError, LogError
from fdi.telemetry import Log

from . import clocks, definitions
from .exercise import exercise
from .heads import Head
from .mutations import make_input, reader_of

SECONDS_PER_MB: Final = 2.0
START_S: Final = 0.5  # what a file of no size may cost: tables, caches, first use of a library
MEMORY_PER_BYTE: Final = 10
MEMORY: Final = 200_000_000
WHOLE: Final = "analyze"
CLOCKS: Final = "clocks"
FLIGHTS: Final = "flights"
"""Instead of readers: definitions through the whole analysis, short logs with damaged clocks
through the readers, and flights with damaged clocks through the whole analysis."""
MAKERS: Final = {
    WHOLE: definitions.make_input,
    CLOCKS: clocks.make_input,
    FLIGHTS: clocks.make_flight,
}
REPEATS: Final = 2  # of an input that took too long: a busy neighbour costs CPU time, too
COMPARED: Final = 8  # every such number is read by both walks


class TooSlowError(Exception):
    """The CPU time that an input may cost is used up."""


def check(
    data: bytes, number: int, folder: Path, base: Head | None = None
) -> dict[str, Any] | None:
    """Return what is wrong with how an input is dealt with, None where nothing is.

    ``base`` is the undamaged log, to be compared with.
    """
    undamaged = _undamaged_s(base, number % (2 * COMPARED), folder) if base else math.nan
    path = folder / "log"
    path.write_bytes(data)
    walks = 1 if number % COMPARED else 2
    allowed = walks * (START_S + SECONDS_PER_MB * len(data) / 1e6)
    forget_peak()
    limit = used_memory() + MEMORY + MEMORY_PER_BYTE * len(data)
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
    try:
        problem, spent = _attempt(path, number, allowed)
        for _ in range(REPEATS):
            if problem is None and spent > allowed:
                problem, again = _attempt(path, number, allowed)
                spent = min(spent, again)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    tell_cost("read", spent, undamaged)
    if problem is None and spent > allowed:
        problem = ("too slow", f"{spent:.2f} s of CPU for {len(data)} bytes")
    if problem is None:
        return None
    return {"number": number, "what": problem[0], "text": problem[1], "bytes": len(data)}


def _attempt(path: Path, number: int, allowed: float) -> tuple[tuple[str, str] | None, float]:
    """Return what is wrong with how the file is dealt with, and the s of CPU that it took."""
    problem = None
    started = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, 4 * allowed)
    try:
        try:
            _both_walks(path, number)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    except LogError as error:
        if "\n" in str(error):
            problem = ("error of several lines", str(error))
    except TooSlowError:
        problem = ("too slow", "stopped")
    except BaseException as error:  # noqa: BLE001  whatever it is, it is a defect
        problem = described(error)
    return problem, time.process_time() - started


def _check_clock(data: bytes, number: int, folder: Path) -> dict[str, Any] | None:
    return check(data, number, folder, clocks.short_of(number))


@cache
def _undamaged_s(base: Head, number: int, folder: Path) -> float:
    path = folder / "undamaged"
    path.write_bytes(b"".join(base.chunks))
    spent = []
    for _ in range(3):
        began = time.process_time()
        _both_walks(path, number)
        spent.append(time.process_time() - began)
    return min(spent)


def _both_walks(path: Path, number: int) -> None:
    """Try the compiled walk and the other one in turn, now and then both."""
    fast = number % 2 == 0
    os.environ["FDI_FAST"] = str(int(fast))
    log = exercise(path, Random(number))
    if number % COMPARED == 0:
        os.environ["FDI_FAST"] = str(int(not fast))
        assert _summary(log) == _summary(exercise(path, Random(number))), "the walks differ"


def _summary(log: Log) -> tuple[object, ...]:
    rows = {key: (m.stamp.tobytes(), m.t.tobytes()) for key, m in log.messages.items()}
    return rows, log.quality, log.events, log.flights, dict(log.parameters), log.sources


def described(error: BaseException) -> tuple[str, str]:
    """Return what makes two failures the same, and what was raised."""
    return _place(error), "".join(traceback.format_exception(error)[-6:])


def _place(error: BaseException) -> str:
    """Return kind and innermost place in our code: what makes two failures the same."""
    frames = [
        f for f in traceback.extract_tb(error.__traceback__) if f"{os.sep}fdi{os.sep}" in f.filename
    ]
    where = (
        f"{Path(frames[-1].filename).name}:{frames[-1].name}"
        if frames
        else str(error).partition(":")[0]
    )
    return f"{type(error).__name__} in {where}"


CLOCK_S = 0.01
"""A step of the kernel's account of CPU time."""


def used_memory() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


def forget_peak() -> None:
    """Let `tell_cost` count the memory from here on."""
    Path("/proc/self/clear_refs").write_text("5")


def tell_cost(what: str, seconds: float, undamaged: float = math.nan) -> None:
    """Say what an input took: s of CPU, this over that of the undamaged log, and memory in MB."""
    status = Path("/proc/self/status").read_text()
    peak = int(status.partition("VmHWM:")[2].split()[0]) / 1000
    least = max(undamaged, CLOCK_S)  # what takes no step of the clock took up to one
    cost = [what, round(seconds, 3), round(seconds / least, 2), round(peak)]
    print(json.dumps({"cost": cost}), flush=True)


def stop(number: int, frame: FrameType | None) -> None:
    """End an input that costs far too much (handler of the timer's signal)."""
    raise TooSlowError


def warm_up(folder: Path) -> None:
    """Import and compile what the first file of each format needs, outside the limits."""
    from .heads import heads

    for fast in "01":
        os.environ["FDI_FAST"] = fast
        for head in heads()[:6]:
            (folder / "log").write_bytes(b"".join(head.chunks))
            try:
                exercise(folder / "log", Random(0))
            except FdiError:
                continue


def inputs(words: list[str]) -> Iterator[tuple[int, bytes]]:
    """Yield what the command line asks for: from the first to before the last number, or files.

    One of `MAKERS` before the numbers asks for inputs of another kind.
    Behind the numbers may stand readers: the inputs of the others are left out then. A file whose
    failure hangs on what is asked of it carries the number that it had: ``name.number.input``.
    """
    if words[0] in MAKERS:
        for number in range(int(words[1]), int(words[2])):
            yield number, MAKERS[words[0]](number).data
    elif words[0].isdecimal():
        for number in range(int(words[0]), int(words[1])):
            if not words[2:] or reader_of(number) in words[2:]:
                yield number, make_input(number).data
    else:
        for path in map(Path, words):
            number = path.stem.rpartition(".")[2]
            yield int(number) if number.isdecimal() else 0, path.read_bytes()


def main() -> None:
    """Try what the command line asks for."""
    warnings.simplefilter("error", RuntimeWarning)
    signal.signal(signal.SIGPROF, stop)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        attempt = _check_clock if sys.argv[1] == CLOCKS else check
        if sys.argv[1] in (WHOLE, FLIGHTS):
            from . import whole

            attempt = whole.check if sys.argv[1] == WHOLE else whole.check_clock
        warm_up(folder)
        for number, data in inputs(sys.argv[1:]):
            print(json.dumps({"trying": number}), flush=True)
            found = attempt(data, number, folder)
            if found:
                print(json.dumps(found), flush=True)
    print(json.dumps({"done": True}), flush=True)


if __name__ == "__main__":
    main()
