"""Which faults can typical logs show, and which can they tell apart?

    .venv/bin/python benchmarks/detectable.py [--write]

In: logs of ../shared/flights beside the repository, one of each format that a vehicle has. Out: a
Markdown table by component: how many of its faults the tests that this log allows can detect, and
from which components no test tells it apart. With ``--write`` it goes between the marks of
docs/models.md. A component that a log brings no fault for is not in its telemetry.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from evaluation import ROOT, put

from fdi.chain import residuals_of
from fdi.diagnosis.isolability import implementable_isolability
from fdi.telemetry import read

FLIGHTS = ROOT.parent / "shared" / "flights"
LOGS = {
    "quadcopter, tlog": "sitl/copter/c01_ref_slow_line.tlog",
    "quadcopter, BIN": "real/forum_13645_7.bin",
    "quadcopter, ulg": "real/pyulog_sample.ulg",
    "fixed wing, tlog": "alfa/no_failure.tlog",
    "fixed wing, BIN": "sitl/plane/p01_rect_calm.BIN",
}
PAGE = ROOT / "docs" / "models.md"


def shown(path: Path) -> dict[str, str]:
    """Return for each component of a log what its tests can do, in words."""
    bank = residuals_of(read(path)).residuals.bank
    found = implementable_isolability(bank)
    faults: dict[str, list[int]] = defaultdict(list)
    for place, fault in enumerate(bank.system.faults):
        faults[fault.component].append(place)
    told = dict[str, str]()
    for component, own in faults.items():
        seen = [place for place in own if found.detectable[place]]
        alike = [
            other
            for other, places in faults.items()
            if other != component
            and seen
            and not any(found.matrix[np.ix_(seen, places)].all(axis=1))
        ]
        text = f"{len(seen)} of {len(own)}"
        told[component] = f"{text}; not from {', '.join(alike)}" if alike else text
    return told


def table(columns: dict[str, dict[str, str]]) -> str:
    """Return the table, a row for each component that one of the logs has."""
    components = sorted({name for column in columns.values() for name in column})
    rows = [
        f"| {name} | " + " | ".join(column.get(name, "–") for column in columns.values()) + " |"
        for name in components
    ]
    head = ["| component | " + " | ".join(columns) + " |", "| --- " * (len(columns) + 1) + "|"]
    logs = ", ".join(f"`{name}`" for name in LOGS.values())
    return "\n".join(
        [f"Printed by `benchmarks/detectable.py --write`, for {logs}:\n", *head, *rows]
    )


def main() -> int:
    """Print the table, and write it where that is asked for."""
    if not FLIGHTS.is_dir():
        print(f"{FLIGHTS} is not here")
        return 1
    text = table({name: shown(FLIGHTS / path) for name, path in LOGS.items()})
    print(text)
    if "--write" in sys.argv[1:]:
        put(text, "detectable", PAGE)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
