"""How far are the columns of the method `heading` off, before a fault and after it?

    .venv/bin/python benchmarks/odd.py [--closed-loop DIR]

Reads ../shared/flights beside the repository, the closed-loop flights among them, and prints for
every column its largest value over all logs up to the fault (all along without one), and in how
many logs with a failed compass, gyroscope, accelerometer or receiver it goes beyond three
deviations (twins: 12 dB) within a minute of the onset. Then the CPU time of the method.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Final

import numpy as np
from evaluation import LABELS, closed_loop, missing

from fdi.errors import FdiError
from fdi.evaluation import load_labels
from fdi.methods.heading.columns import FIELDS, TWINS, heading_columns
from fdi.telemetry import read

WITHIN_S: Final = 60.0
EARLY_S: Final = 0.5
FAILED: Final = ("compass", "gyroscope", "accelerometer", "gps")


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--closed-loop", type=Path, metavar="DIR", help="the archive, unpacked")
    given = parser.parse_args()
    if reason := missing(given.closed_loop):
        print(f"skipped: {reason}")
        return 0
    before: dict[str, list[float]] = defaultdict(list)
    beyond: dict[tuple[str, str], list[bool]] = defaultdict(list)
    spent: list[float] = []
    with closed_loop(given.closed_loop) as folder:
        for label in (*load_labels(LABELS), *load_labels(folder / LABELS.name)):
            if label.use != "diagnosis":
                continue
            try:
                log = read(label.path)
                start = time.process_time()
                made = heading_columns(log)
            except FdiError:
                continue
            spent.append(time.process_time() - start)
            if isinstance(made, str):
                continue
            onset = min([fault.onset for fault in label.faults], default=np.inf)
            until = label.evaluate_until or np.inf
            early = made.t < min(onset - EARLY_S, until)
            late = (made.t >= onset) & (made.t < min(onset + WITHIN_S, until))
            for name in FIELDS:
                own = made.values[name]
                if np.isfinite(own[early]).any():
                    before[name].append(float(np.nanmax(own[early])))
                for fault in label.faults[:1]:
                    far = own[late] > (12.0 if name == TWINS else 3.0)
                    beyond[name, fault.component].append(bool(far.any()))
    print(f"| column | logs | 99 % | largest | {' | '.join(f'{one} beyond' for one in FAILED)} |")
    print("| --- |" + " --- |" * (3 + len(FAILED)))
    for name in FIELDS:
        own = np.array(before[name])
        cells = [f"{sum(x)}/{len(x)}" for x in (beyond[name, one] for one in FAILED)]
        print(
            f"| `{name}` | {own.size} | {np.quantile(own, 0.99):.1f} | {own.max():.1f} | "
            f"{' | '.join(cells)} |"
        )
    print(f"\nCPU a log: median {np.median(spent):.2f} s, largest {max(spent):.2f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
