"""Does placement of sensors answer on every reference model, and is the answer the smallest?

    .venv/bin/python benchmarks/structure_placement.py [MODEL...]

In: the reference models of ../shared/structural beside the repository. Out: for each, the size of
the cheapest set for isolability with its CPU seconds, also where every sensor may fail; beside it
the smallest of all minimal sets where enumeration ends, of all subsets where there are few enough,
and of the sets of faultdiagnosistoolbox where it ends within 10 s and accepts the model.
"""

from __future__ import annotations

import contextlib
import io
import signal
import sys
import time
from collections.abc import Callable
from itertools import combinations
from math import comb
from pathlib import Path
from typing import Any

from structure import MODELS, toolbox_model

from fdi.errors import UsageError
from fdi.structure import Model, cheapest_sensors, load_reference, place_sensors
from fdi.structure.additions import reach
from fdi.structure.placement import add_sensors

LIMIT = 1000
MOST_SUBSETS = 3000
ENUMERATION_S, TOOLBOX_S = 10, 10
BOUND_S = 10
PATIENCE_S = 600
"""On the wall, where another program may have the processor; CPU seconds are what is judged."""


class LateError(Exception):
    """Time is up."""


def within(seconds: int, call: Callable[[], Any]) -> Any:
    """Return what a call returns, or None when it takes longer or fails."""

    def late(*_: object) -> None:
        raise LateError

    signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return call()
    except (
        LateError,
        UsageError,
        TypeError,
        ValueError,
        IndexError,
    ):  # what the toolbox raises: see the docs
        return None
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def toolbox_size(path: Path) -> int | None:
    """Return the size of the smallest set of the toolbox; an empty list stands for none needed."""
    import json

    model = toolbox_model(json.loads(path.read_text(encoding="utf-8")))
    model.PossibleSensorLocations()
    found = within(TOOLBOX_S, model.SensorPlacementIsolability)
    return None if found is None else min(map(len, found[1]), default=0)


def enumerated_size(model: Model) -> int | None:
    found = within(ENUMERATION_S, lambda: place_sensors(model, limit=LIMIT))
    return None if found is None else min(map(len, found))


def brute_force_size(model: Model) -> int | None:
    """Return the size of the smallest set by trying all, as long as these are few."""
    n = len(model.unknowns)
    best = reach(add_sensors(model, range(n)))
    for size in range(n + 1):
        if comb(n, size) > MOST_SUBSETS:
            return None
        for some in combinations(range(n), size):
            have = reach(add_sensors(model, some))
            if (have.seen >= best.seen).all() and (have.told >= best.told).all():
                return size
    return None


def measured(model: Model, faulty: range) -> tuple[str, int, float, bool]:
    start = time.process_time()
    found = cheapest_sensors(model, faulty=faulty, seconds=PATIENCE_S)
    taken = time.process_time() - start
    size = len(found.sets[0])
    return f"{size}{'' if found.proven else f' (>= {found.bound:g})'}", size, taken, found.proven


def main() -> int:
    """Print the table; return 1 where an answer is missing, late, unproven or another one."""
    if not MODELS.is_dir():
        print(f"skipped: {MODELS} is not here")
        return 0
    print("model                    size  CPU s  all may fail  CPU s  enumerated  tried  toolbox")
    met = True
    for path in sorted(MODELS.glob("*.json")):
        if sys.argv[1:] and path.stem not in sys.argv[1:]:
            continue
        model = load_reference(path)
        shown, size, taken, proven = measured(model, range(0))
        shown_2, _, taken_2, proven_2 = measured(model, range(len(model.unknowns)))
        others = (
            enumerated_size(model),
            brute_force_size(model),
            toolbox_size(path) if model.faults else None,
        )
        agrees = all(other in (None, size) for other in others)
        met &= agrees and proven and proven_2 and max(taken, taken_2) < BOUND_S
        told = "  ".join("-" if other is None else str(other) for other in others)
        print(
            f"{path.stem:24} {shown:>4} {taken:6.2f} {shown_2:>13} {taken_2:6.2f}  {told}"
            + ("" if agrees else "  differs"),
            flush=True,
        )
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
