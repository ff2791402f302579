"""Do the intervals of identified parameters hold what is the same on all flights of a vehicle?

    .venv/bin/python benchmarks/identify.py [FOLDER]

In: the telemetry of one simulated quadcopter, by default ../shared/flights/sitl/copter beside the
repository; faults begin on it after the stretch that parameters are fitted to. Out: for each
parameter its median over the flights, how far the flights differ, the median of the standard errors
that are stated, and how many flights have that median within two of theirs.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import fdi

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT.parent / "shared" / "flights" / "sitl" / "copter"
MOST = 40
"""Flights, in the order of their names."""
HEAD = ("parameter", "flights", "median", "spread", "stated", "within two sigmas")


def identified(path: Path) -> dict[str, tuple[float, float]]:
    """Return the identified parameters of a flight with their standard errors."""
    system = fdi.residuals_of(fdi.read(path)).system
    return {
        name: (value.value, value.std or 0.0)
        for name, value in system.parameters.items()
        if value.source == "identified"
    }


def main() -> int:
    """Print the table."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    if not folder.is_dir():
        print(f"skipped: there is no {folder.name} beside the repository")
        return 0
    flights = [identified(path) for path in sorted(folder.glob("*.tlog"))[:MOST]]
    held = []
    print(f"| {' | '.join(HEAD)} |\n| --- | --- | --- | --- | --- | --- |")
    for name in dict.fromkeys(name for flight in flights for name in flight):
        value, std = np.array([flight[name] for flight in flights if name in flight]).T
        middle = float(np.median(value))
        held.append(np.abs(value - middle) <= 2 * std)
        cells = (f"{middle:.5f}", f"{value.std():.5f}", f"{np.median(std):.5f}")
        print(f"| `{name}` | {len(value)} | {' | '.join(cells)} | {held[-1].mean():.0%} |")
    print(f"\nTogether {np.concatenate(held).mean():.0%}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
