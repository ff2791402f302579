"""How much faster is ``fdi batch`` with two workers than with one?

    .venv/bin/python benchmarks/batch.py [FOLDER] [--runs N] [--cluster]

Wall and CPU seconds of ``fdi batch`` over a folder of logs with one and with two processes that
compute with one thread each; the caches of both are filled beforehand. Without an argument the logs
are those of ../shared/flights beside the repository.

On a machine that is busy with other things wall seconds say nothing: two processes then get twice
the share of one. So what two free cores would take is told, too: the CPU seconds of the process
that hands out the work, and half of those of the workers. That counts where others are at work.

With ``--cluster`` a local dask cluster of two processes does the same, and its table is held
against that of the local processes, row by row.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FLIGHTS = ROOT.parent / "shared" / "flights"
BOUND = 1.7
QUIET = 0.5  # processes that others keep busy, at the most, where wall seconds count
TIMED = """
import json, os, sys
from fdi.cli import main
code = main()
t = os.times()
json.dump([t.user + t.system, t.children_user + t.children_system], sys.stderr)
sys.exit(code)
"""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


TIMES = {"seconds", "timings_s"}  # columns that differ from run to run


class Run(NamedTuple):
    """Seconds of a run: on the wall, of CPU in the process that was started, and in its workers."""

    wall: float
    own: float
    workers: float
    told: str
    table: Path

    @property
    def on_free_cores(self) -> float:
        """What it would take on two cores that do nothing else."""
        return self.own + self.workers / 2


def measure(folder: Path, scratch: Path, *options: str) -> Run:
    """Return what a run of the command took and said."""
    out = scratch / f"{time.monotonic_ns()}.parquet"
    words = ["batch", str(folder), "--out", str(out), *options]
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", TIMED, *words],
        cwd=ROOT,
        env={**os.environ, **ONE_THREAD, "FDI_CACHE_DIR": str(scratch / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    own, others = json.loads(done.stderr.splitlines()[-1])
    wall = time.perf_counter() - start
    return Run(wall, own, others, done.stdout.strip().replace(str(scratch), "..."), out)


def by_cluster(folder: Path, scratch: Path) -> Path:
    """Return the table of a local cluster."""
    from distributed import LocalCluster

    os.environ.update({**ONE_THREAD, "FDI_CACHE_DIR": str(scratch / "cache")})
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        return measure(folder, scratch, "--cluster", cluster.scheduler_address).table


def differing(one: Path, other: Path) -> list[str]:
    """Return the logs about which two tables say other things, times apart."""
    import pyarrow.parquet as pq

    tables = (pq.read_table(path) for path in (one, other))
    first, second = (t.drop_columns(sorted(TIMES)).to_pylist() for t in tables)
    return [a["path"] for a, b in zip(first, second, strict=True) if a != b]


def main() -> int:
    """Print the figures; return 1 where two workers are not faster by the bound."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=FLIGHTS)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--cluster", action="store_true", help="compare with a local cluster")
    given = parser.parse_args()
    if not given.folder.is_dir():
        print(f"skipped: {given.folder} is not here")
        return 0
    others = os.getloadavg()[0]
    runs: dict[int, list[Run]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as name:
        folder, scratch = given.folder.resolve(), Path(name)
        measure(folder, scratch, "--workers", "2")
        for _ in range(given.runs):
            for workers, own in runs.items():
                own.append(measure(folder, scratch, "--workers", str(workers)))
                wall, cpu, more, told, _ = own[-1]
                print(f"{workers} workers: {wall:.1f} s wall, {cpu + more:.1f} s CPU; {told}")
        others_say = differing(runs[1][0].table, runs[2][0].table)
        print(f"rows that two workers tell otherwise than one: {others_say or 'none'}")
        if given.cluster:
            others_say += differing(runs[2][0].table, by_cluster(folder, scratch))
            print(f"rows that a cluster tells otherwise: {others_say or 'none'}")
    one, two = (min(run.wall for run in runs[workers]) for workers in (1, 2))
    print(f"measured: two workers are {one / two:.2f} times as fast as one")
    free = min(r.own for r in runs[1]) / min(r.on_free_cores for r in runs[2])
    print(f"by CPU seconds, on two free cores: {free:.2f} times (bound {BOUND:g})")
    ratio = one / two
    if others > QUIET:
        print(f"others kept {others:.1f} processes busy, so the wall seconds do not count")
        ratio = free
    return 0 if ratio > BOUND and not others_say else 1


if __name__ == "__main__":
    sys.exit(main())
