"""What does a structural model of thousands of equations cost?

    .venv/bin/python benchmarks/structure_scale.py [--figure docs/images/structure_scale.png]

CPU seconds of one process, on random models of one graph component (``random_models.py``), for
matching, equivalence classes and isolability together; for a small bank of tests that isolates all
that structure allows; for the same where 2 % of the entries cannot be solved along, every test
needs a valid matching, and some pairs may remain undecided. Each bank is checked: its tests
together isolate what the selection says and, where structure decides, what structure promises.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from random_models import random_model

from fdi.structure import Model, Rules, classes, isolability, select_tests
from fdi.structure.matching import match

T = TypeVar("T")
SIZES = ((125, 4, 19), (250, 8, 38), (500, 15, 75), (1000, 30, 150), (2000, 60, 300))
LARGEST = (5000, 150, 500)
BOUNDS = {2000: (0.1, 5.0), 5000: (None, 30.0)}  # s: structure, bank
BAND = 40
NONSOLVABLE = 0.02
RUNS = 3


class Row(NamedTuple):
    """One model's figures, s of CPU."""

    kind: str
    equations: int
    structure: float
    bank: float
    tests: int
    valid_bank: float
    valid_tests: int
    undecided: int
    right: bool


def cpu(work: Callable[[], T], runs: int = 1) -> tuple[float, T]:
    """Return the least CPU seconds of some runs, and the answer."""
    best = float("inf")
    for _ in range(runs):
        start = time.process_time()
        answer = work()
        best = min(best, time.process_time() - start)
    return best, answer


def isolated(model: Model, reacts: np.ndarray) -> np.ndarray:
    """Return which fault some test tells from which, from the signatures alone."""
    n = len(model.faults)
    found = np.zeros((n, n), dtype=bool)
    for row in reacts:
        found[np.ix_(row, ~row)] = True
    return found


def measure(equations: int, redundancy: int, faults: int, band: int | None) -> Row:
    model = random_model(equations, redundancy, faults, band=band)
    structure, (_, _, isolable) = cpu(
        lambda: (match(model.rows, len(model.unknowns)), classes(model), isolability(model)), RUNS
    )
    bank, selection = cpu(lambda: select_tests(model))
    ruled = random_model(equations, redundancy, faults, band=band, nonsolvable=NONSOLVABLE)
    valid_bank, valid = cpu(lambda: select_tests(ruled, Rules(), assumptions=()))
    right = bool((isolated(model, selection.reacts) == isolable).all())
    right &= bool((isolated(ruled, valid.reacts) == valid.isolable).all())
    kind = "banded" if band else "uniform"
    tests = len(selection.tests), len(valid.tests)
    return Row(
        kind,
        equations,
        structure,
        bank,
        tests[0],
        valid_bank,
        tests[1],
        int(valid.undecided.sum()),
        right,
    )


def figure(rows: list[Row], path: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    fig, axis = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
    for kind, line in (("uniform", "-"), ("banded", "--")):
        own = [row for row in rows if row.kind == kind]
        size = [row.equations for row in own]
        for values, name, colour in (
            ([row.bank for row in own], "bank of tests", "C0"),
            ([row.valid_bank for row in own], "bank, 2 % not solvable", "C1"),
            ([row.structure for row in own], "matching, classes, isolability", "C2"),
        ):
            axis.loglog(size, values, line, color=colour, marker="o", label=f"{name} ({kind})")
    sizes = sorted({row.equations for row in rows})
    axis.set_xticks(sizes, [str(size) for size in sizes])
    axis.minorticks_off()
    axis.set_xlabel("equations (redundancy 3 %, one graph component)")
    axis.set_ylabel("CPU seconds")
    axis.grid(visible=True, alpha=0.3)
    axis.legend(fontsize=7)
    fig.savefig(path, dpi=110)


def main() -> int:
    """Print the figures; return 1 where a bound is missed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    head = ("model", "equations", "structure s", "bank s", "tests", "valid bank s", "tests")
    print("{:8} {:>9} {:>11} {:>8} {:>6} {:>12} {:>6} undecided".format(*head))
    rows, met = [], True
    for size in (*SIZES, LARGEST):
        for band in (None, BAND):
            row = measure(*size, band)
            rows.append(row)
            print(
                f"{row.kind:8} {row.equations:9} {row.structure:11.4f} {row.bank:8.2f} "
                f"{row.tests:6} {row.valid_bank:12.2f} {row.valid_tests:6} {row.undecided:9}"
                + ("" if row.right else "  wrong"),
                flush=True,
            )
            most, most_bank = BOUNDS.get(row.equations, (None, None))
            met &= row.right and row.structure < (most or 1e9) and row.bank < (most_bank or 1e9)
    if options.figure:
        figure(rows, options.figure)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
