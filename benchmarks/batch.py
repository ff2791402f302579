"""How much faster is ``fdi batch`` with two workers than with one?

    .venv/bin/python benchmarks/batch.py [FOLDER] [--runs N]

Wall and CPU seconds of ``fdi batch`` over a folder of logs with one and with two processes that
compute with one thread each; the caches of both are filled beforehand. Without an argument the logs
are those of ../shared/flights beside the repository. On a machine that is busy with other things
the wall seconds say little; the CPU
seconds and the load are printed too.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FLIGHTS = ROOT.parent / "shared" / "flights"
BOUND = 1.7
FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def measure(folder: Path, workers: int, scratch: Path) -> tuple[float, float, str]:
    """Return wall s, CPU s and what the command said."""
    out = scratch / f"{workers}_{time.monotonic_ns()}.parquet"
    words = ["batch", str(folder), "--out", str(out), "--workers", str(workers)]
    start, before = time.perf_counter(), os.times()
    done = subprocess.run(
        FDI + words,
        cwd=ROOT,
        env={**os.environ, **ONE_THREAD, "FDI_CACHE_DIR": str(scratch / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    after = os.times()
    cpu = after.children_user + after.children_system
    cpu -= before.children_user + before.children_system
    return time.perf_counter() - start, cpu, done.stdout.strip()


def main() -> int:
    """Print the figures; return 1 where two workers are not faster by the bound."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=FLIGHTS)
    parser.add_argument("--runs", type=int, default=1)
    given = parser.parse_args()
    if not given.folder.is_dir():
        print(f"skipped: {given.folder} is not here")
        return 0
    best: dict[int, float] = {}
    with tempfile.TemporaryDirectory() as name:
        measure(given.folder, 2, Path(name))
        for _ in range(given.runs):
            for workers in (1, 2):
                wall, cpu, told = measure(given.folder.resolve(), workers, Path(name))
                best[workers] = min(wall, best.get(workers, wall))
                told = told.replace(name, "...")
                load = os.getloadavg()[0]
                took = f"{wall:.1f} s wall, {cpu:.1f} s CPU, load {load:.1f}"
                print(f"{workers} workers: {took}; {told}")
    ratio = best[1] / best[2]
    print(f"two workers are {ratio:.2f} times as fast as one (bound {BOUND:g})")
    return 0 if ratio > BOUND else 1


if __name__ == "__main__":
    sys.exit(main())
