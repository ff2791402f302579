"""Are identified parameters as sure as they say, and left alone by later faults?

    .venv/bin/python benchmarks/identify.py

In: the telemetry of one simulated quadcopter and of one simulated aeroplane in ../shared beside the
repository. Flights whose fault begins within the stretch that parameters are fitted to are left
out. Out: for each parameter its median over the flights, how far the flights differ, the median of
the standard errors that are stated, on how many flights the median is within two of them, and on
how many the value differs by more than one of them if the log is cut off where the fault begins.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from evaluation import LABELS

import fdi
from fdi.decision import load_policy
from fdi.residuals.between import STRETCH_S
from fdi.telemetry.events import SETTLING_S

VEHICLES = ("sitl/copter", "sitl/plane")
HEAD = ("parameter", "flights", "median", "spread", "stated", "within two", "changed by a fault")

Values = dict[str, tuple[float, float, float]]


def identified(log: fdi.Log, onset: float | None) -> Values:
    """Return the identified parameters of a flight: value, standard error, change by its fault.

    The change is NaN for a flight without one.
    """
    chain = fdi.residuals_of(log)
    before = chain.system.parameters
    if onset is not None:  # on the same grid
        window = (float(chain.signals.t[0]), onset)
        policy = load_policy("default").resample(window=window, rate_hz=None)
        before = fdi.residuals_of(log, policy=policy).system.parameters
    lasting = 0.0 if onset is not None else np.nan
    return {
        name: (value.value, value.std or 0.0, value.value - before[name].value + lasting)
        for name, value in chain.system.parameters.items()
        if value.source == "identified"
    }


def flights(vehicle: str) -> list[Values]:
    """Return what each flight of a vehicle tells."""
    labels = json.loads(LABELS.read_text(encoding="utf-8"))["flights"]
    found = []
    for name, label in sorted(labels.items()):
        path = Path(name)
        if str(path.parent) != vehicle or path.suffix != ".tlog":
            continue
        log = fdi.read(LABELS.parent / path)
        onset = min((fault["onset"] for fault in label["faults"]), default=None)
        start = min((flight.airborne[0] for flight in log.flights), default=np.inf)
        if onset is None or onset - start > SETTLING_S + STRETCH_S:
            found.append(identified(log, onset))
    return found


def table(told: list[Values]) -> str:
    """Return the table of a vehicle, with what all its parameters tell together."""
    lines = [f"| {' | '.join(HEAD)} |", "| --- " * len(HEAD) + "|"]
    all_held, all_changed = [], []
    for name in dict.fromkeys(name for flight in told for name in flight):
        value, std, change = np.array([flight[name] for flight in told if name in flight]).T
        middle = float(np.median(value))
        held = np.abs(value - middle) <= 2 * std
        changed = (np.abs(change) > std)[np.isfinite(change)]
        all_held.append(held)
        all_changed.append(changed)
        cells = (f"{middle:.5f}", f"{value.std():.5f}", f"{np.median(std):.5f}")
        counts = f"{held.mean():.0%} | {changed.sum()} of {changed.size}"
        lines.append(f"| `{name}` | {len(value)} | {' | '.join(cells)} | {counts} |")
    held, changed = np.concatenate(all_held), np.concatenate(all_changed)
    together = f"Together {held.mean():.0%}; {changed.sum()} of {changed.size} changed by a fault."
    return "\n".join([*lines, "", together])


def main() -> int:
    """Print the tables."""
    if not LABELS.is_file():
        print(f"skipped: {LABELS} is not here")
        return 0
    for vehicle in VEHICLES:
        told = flights(vehicle)
        print(f"{vehicle}, {len(told)} flights:\n\n{table(told)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
