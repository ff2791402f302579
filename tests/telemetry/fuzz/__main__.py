"""Tries many inputs in several processes; keeps one small input of every failure; returns 1 then.

PYTHONPATH=tests python -m telemetry.fuzz [--count N] [--first N] [--workers N] [--out FOLDER]
                                         [--reader tlog|bin|log|ulg]... [--analyze] [--clocks]
"""

from __future__ import annotations

import argparse
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from . import mutations
from .mutations import Input
from .smaller import smaller
from .worker import CLOCKS, FLIGHTS, MAKERS, WHOLE

SOAK: Final = 200_000
PORTION: Final = 2000  # numbers of one worker: what a crash or a hang costs at most
SILENT_S: Final = 120  # wall time of one input, on a busy machine; the CPU limit is the worker's
BEGIN_S: Final = 600  # the same until a worker has compiled what it needs
_NAMED: Final = 10  # numbers told of each kind of failure
# One thread a worker: memory is limited by address space, which threads take in large pieces.
ALONE: Final = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "1",
    "PYTHONHASHSEED": "0",
}

Failure = dict[str, Any]
Cost = tuple[str, float, float, float]
"""What was done, s of CPU, this over that of the undamaged log (NaN: not taken), and MB at most."""


def try_numbers(
    first: int, last: int, readers: Sequence[str] = (), costs: list[Cost] | None = None
) -> Iterator[Failure]:
    """Yield the failures among inputs ``first`` to before ``last``, in processes that may die.

    What every input took is appended to ``costs``.
    """
    is_made = bool(readers) and readers[0] in MAKERS
    asked, others = (readers[:1], readers[1:]) if is_made else ([], readers)
    while first < last:
        worker = subprocess.Popen(
            [sys.executable, "-m", "telemetry.fuzz.worker", *asked, str(first), str(last), *others],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **ALONE},
        )
        trying, stopped = first - 1, None
        assert worker.stdout is not None
        while True:
            patience = SILENT_S if trying >= first else BEGIN_S
            ready, _, _ = select.select([worker.stdout], [], [], patience)
            if not ready:
                worker.kill()
                stopped = "hangs"
                break
            line = worker.stdout.readline()
            if not line:
                break
            said = json.loads(line)
            if "trying" in said:
                trying = said["trying"]
            elif "done" in said:
                trying = last
            elif "cost" in said:
                if costs is not None:
                    costs.append(tuple(said["cost"]))
            else:
                yield said
        _, complaint = worker.communicate()
        if trying == last:
            return
        assert trying >= first, complaint.decode()[-2000:]
        what = stopped or f"dies with exit code {worker.returncode}"
        text = complaint.decode("utf-8", "replace")[-2000:]
        yield {
            "number": trying,
            "what": what,
            "text": text,
            "bytes": len(_input(trying, readers).data),
        }
        first = trying + 1


def _input(number: int, readers: Sequence[str]) -> Input:
    make = MAKERS.get(readers[0], mutations.make_input) if readers else mutations.make_input
    return make(number)


def run(
    first: int,
    count: int,
    workers: int,
    readers: Sequence[str] = (),
    costs: list[Cost] | None = None,
) -> list[Failure]:
    """Return all failures, telling the progress where somebody watches."""
    size = min(PORTION, -(-count // workers))
    found: list[Failure] = []

    def portion(low: int) -> list[Failure]:
        return list(try_numbers(low, min(low + size, first + count), readers, costs))

    with ThreadPoolExecutor(workers) as pool:
        for i, failures in enumerate(pool.map(portion, range(first, first + count, size)), 1):
            found += failures
            if sys.stderr.isatty():
                print(
                    f"\r{min(i * size, count)} inputs, {len(found)} failures",
                    end="",
                    file=sys.stderr,
                )
    return found


def tell(costs: Sequence[Cost]) -> None:
    """Print what the inputs took at most: one row for each thing that was done."""
    print("done        inputs   CPU s    times undamaged   MB")
    for what in sorted({cost[0] for cost in costs}):
        rows = [cost[1:] for cost in costs if cost[0] == what]
        seconds, times, memory = (max(column) for column in zip(*rows, strict=True))
        print(f"{what:10} {len(rows):7} {seconds:7.2f} {times:18.1f} {memory:4.0f}")


def keep(found: list[Failure], folder: Path, readers: Sequence[str] = ()) -> None:
    """Write one input of every kind of failure, as small as it gets."""
    folder.mkdir(parents=True, exist_ok=True)
    first = {failure["what"]: failure for failure in reversed(found)}
    for i, (what, failure) in enumerate(sorted(first.items())):
        data = _input(failure["number"], readers).data
        is_whole = bool({WHOLE, FLIGHTS} & set(readers))
        if not is_whole and what != "hangs" and not what.startswith("dies"):
            with tempfile.TemporaryDirectory() as name:
                data = smaller(data, what, failure["number"], Path(name))
        stem = folder / f"{i:02d}_{failure['number']}"
        stem.with_suffix(".input").write_bytes(data)
        stem.with_suffix(".txt").write_text(f"{what}\n{failure['text']}\n")
        print(f"{what}: {len(data)} bytes in {stem}.input\n{failure['text']}")


def main() -> int:
    """Try the numbers that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=SOAK)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"))
    parser.add_argument(
        "--reader",
        action="append",
        default=[],
        choices=("tlog", "bin", "log", "ulg"),
        help="leave out the numbers of other readers' inputs; several times for several",
    )
    parser.add_argument(
        "--analyze",
        action="store_true",
        help="let definitions and metadata that are wrong go through the whole analysis instead",
    )
    parser.add_argument(
        "--clocks",
        action="store_true",
        help="damage the clocks instead; with --analyze those of whole flights, for all commands",
    )
    asked = parser.parse_args()
    readers = asked.reader
    if asked.clocks:
        readers = [FLIGHTS if asked.analyze else CLOCKS]
    elif asked.analyze:
        readers = [WHOLE]
    started = time.perf_counter()
    costs: list[Cost] = []
    found = run(asked.first, asked.count, asked.workers, readers, costs)
    print(
        f"{asked.count} inputs from number {asked.first} on, {len(found)} failures, "
        f"{time.perf_counter() - started:.0f} s"
    )
    for what, count in Counter(failure["what"] for failure in found).most_common():
        numbers = [str(failure["number"]) for failure in found if failure["what"] == what]
        print(f"{count:8}  {what}: {', '.join(numbers[:_NAMED])}")
    tell(costs)
    keep(found, asked.out, readers)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
