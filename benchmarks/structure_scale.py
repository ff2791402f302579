"""What does a structural model of thousands of equations cost?

    .venv/bin/python benchmarks/structure_scale.py [--figure docs/images/structure_scale.png]

CPU seconds of one process, on random models of one graph component (``random_models.py``), for
matching, equivalence classes and isolability together; for a small bank of tests that isolates all
that structure allows; for the same where 2 % of the entries cannot be solved along, every test
needs a valid matching, and some pairs may remain undecided. Each bank is checked: its tests
together isolate what the selection says and, where structure decides, what structure promises.

    .venv/bin/python benchmarks/structure_scale.py --stream

The matching beside those of scipy and networkx, and the stream of MSO sets: CPU seconds until the
first set and for the first 1,000, the sets of 5 s, how late an alarm is served, and the most memory
of the process. Each model has a process of its own; compiled code is loaded before the clock starts
but not used where it would take too much memory (``fdi/structure/search.py``).
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from random_models import random_model

from fdi.structure import Model, Rules, classes, isolability, mso_sets, select_tests
from fdi.structure.matching import match

T = TypeVar("T")
SIZES = ((125, 4, 19), (250, 8, 38), (500, 15, 75), (1000, 30, 150), (2000, 60, 300))
LARGEST = (5000, 150, 500)
BOUNDS = {2000: (0.1, 5.0), 5000: (None, 30.0)}  # s: structure, bank
STREAMED = ((1000, 30, 150), (4000, 120, 300), (10_000, 300, 500), (50_000, 1500, 500))
FIRST_SET = {10_000: (2.0, 500.0)}  # s, MB
STOP_S = 0.1
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


class AlarmError(Exception):
    """The alarm was served."""


def until_alarm(model: Model, after: float) -> tuple[int, float]:
    """Return how many sets come until a CPU alarm, and how many CPU seconds late that is served."""

    def served(*_: object) -> None:
        raise AlarmError

    count = 0
    signal.signal(signal.SIGPROF, served)
    start = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, after)
    try:
        for _ in mso_sets(model):
            count += 1
    except AlarmError:
        pass
    return count, time.process_time() - start - after


def matchings(model: Model) -> dict[str, float]:
    """Return the CPU seconds of a maximum matching by fdi, scipy and networkx, graphs given."""
    import networkx as nx
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    rows, n = model.rows, len(model.unknowns)
    where = [(e, u) for e, row in enumerate(rows) for u in row]
    places = tuple(np.array(where).T)
    sparse = csr_matrix((np.ones(len(where), dtype=np.int8), places), shape=(len(rows), n))
    graph = nx.Graph((("e", e), ("u", u)) for e, u in where)
    top = [("e", e) for e, row in enumerate(rows) if row]
    return {
        "fdi": cpu(lambda: match(rows, n), RUNS)[0],
        "scipy": cpu(lambda: maximum_bipartite_matching(sparse, perm_type="column"), RUNS)[0],
        "networkx": cpu(lambda: nx.bipartite.hopcroft_karp_matching(graph, top))[0],
    }


def stream(equations: int, redundancy: int, faults: int, band: int) -> dict[str, float]:
    """Return the figures of the stream of one model, in a process that has done nothing else."""
    model = random_model(equations, redundancy, faults, band=band or None)
    list(mso_sets(Model.from_matrix([[1]] * 4), compiled=True))  # load it
    start = time.process_time()
    next(mso_sets(model))
    first = time.process_time() - start
    late = 0.0
    for after in (0.05, 0.7, 5.0):
        count, lateness = until_alarm(model, after)
        late = max(late, lateness)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"first": first, "sets": count, "late": late, "MB": memory, **matchings(model)}


def print_streams() -> bool:
    """Print a line for each model, and return whether every bound is kept."""
    print("model    equations  first set s  sets in 5 s  stops after s    MB", end="")
    print("  matching: fdi s   scipy  networkx")
    met = True
    for size in STREAMED:
        for band in (0, BAND):
            command = [sys.executable, __file__, "--one", json.dumps([*size, band])]
            told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            row = json.loads(told)
            print(
                f"{'banded' if band else 'uniform':8} {size[0]:9} {row['first']:12.3f} "
                f"{row['sets']:12} {row['late']:14.3f} {row['MB']:5.0f} {row['fdi']:16.4f} "
                f"{row['scipy']:7.4f} {row['networkx']:9.3f}",
                flush=True,
            )
            seconds, megabytes = FIRST_SET.get(size[0], (1e9, 1e9))
            met &= row["first"] < seconds and row["MB"] < megabytes and row["late"] < STOP_S
    return met


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
    parser.add_argument("--stream", action="store_true")
    parser.add_argument("--one", type=json.loads, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(stream(*options.one)))
        return 0
    if options.stream:
        return 0 if print_streams() else 1
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
