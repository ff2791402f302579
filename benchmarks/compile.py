"""How long does it take from a model file to a compiled bank, cold and from the cache?

    .venv/bin/python benchmarks/compile.py

CPU seconds for the published model with 77 faults, our imports included, beyond the start of the
interpreter and numpy; each run is a process of its own, the median of five counts. The publication
states 163 s for the same task in all (structure, matchings, residual generators).
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MODEL = ROOT / "tests" / "models" / "paper_77.yaml"
PUBLISHED_S = 163.0
RUNS = 5
COLD_S, WARM_S = 3.0, 0.2

CODE = f"""
import time
import numpy
start = time.process_time()
from fdi.model import load_airframe
from fdi.residuals.cache import cached_bank
bank = cached_bank(load_airframe({str(MODEL)!r}).observe(), "mtes")
print(time.process_time() - start, len(bank.generators))
"""


def run(folder: Path) -> tuple[float, int]:
    """Return CPU seconds and generators of one process that keeps its answers in a folder."""
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        cwd=ROOT,
        env={**os.environ, "FDI_CACHE_DIR": str(folder)},
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, generators = done.stdout.split()
    return float(seconds), int(generators)


def main() -> int:
    """Print the figures; return 1 where a bound is missed."""
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name) / str(i) for i in range(RUNS)]
        cold = [run(folder) for folder in folders]
        warm = [run(folder) for folder in folders]
    print(f"{MODEL.name}: {cold[0][1]} residual generators")
    medians = []
    for label, runs, bound in (("cold", cold, COLD_S), ("from the cache", warm, WARM_S)):
        seconds = statistics.median(s for s, _ in runs)
        medians.append(seconds < bound)
        print(
            f"{label + ':':16}{seconds:6.3f} s CPU (bound {bound:g} s), "
            f"1/{PUBLISHED_S / seconds:.0f} of the published {PUBLISHED_S:g} s"
        )
    return 0 if all(medians) else 1


if __name__ == "__main__":
    sys.exit(main())
