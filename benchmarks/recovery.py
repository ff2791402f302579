"""How far off is a position that `fdi heading --recover` makes, at many moments of all flights?

    .venv/bin/python benchmarks/recovery.py [LABELS.json...]

LABELS are files of labelled flights; by default those of `../shared/flights`. On every flight the
receiver is assumed to fail every `EVERY_S` in the air, as `--assume satellite@T` does, as long as
no labelled fault has begun; what it read afterwards is the truth. Prints a table in Markdown by
what carries the vehicle and where the flight comes from: median error, its share of the way, and
how many are within two of their own sigmas.
"""

import json
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from heading import checked, position_errors

from fdi.errors import FdiError
from fdi.methods.heading import recover

ROOT = Path(__file__).parents[1]
LABELS = ROOT.parent / "shared" / "flights" / "labels.json"
EVERY_S = 15.0
AFTER_S = (5, 10, 30)
LEARNT_S = 40.0
"""In the air before a receiver fails."""
Error = tuple[float, float, float]


def flights(labels: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    for name, label in json.loads(labels.read_text(encoding="utf-8"))["flights"].items():
        if label["use"] == "diagnosis":
            yield labels.parent / name, label


def moments(air: tuple[float, float], label: dict[str, Any]) -> np.ndarray:
    onsets = [fault["onset"] for fault in label["faults"]]
    until = min([air[1], *onsets, label.get("evaluate_until") or np.inf])
    return np.arange(air[0] + LEARNT_S, until - max(AFTER_S), EVERY_S)


def main() -> None:
    errors: dict[tuple[str, int], list[Error]] = defaultdict(list)
    counts: dict[str, set[Path]] = defaultdict(set)
    for labels in [Path(name) for name in sys.argv[1:]] or [LABELS]:
        for path, label in flights(labels):
            found = checked(path)
            if found is None or found[1].ride.fixes is None:
                continue
            log, check = found
            origin = "recorded" if label["origin"] == "recorded" else "simulated"
            group = f"{'wings' if check.ride.has_wings else 'rotors'}, {origin}"
            for since in moments(check.ride.air, label):
                try:
                    recovery = recover(log, check, "satellite", float(since))
                except FdiError:
                    continue
                for after, *rest in position_errors(recovery, check.ride.fixes):
                    if after in AFTER_S:
                        errors[group, after].append(tuple(rest))
                        counts[group].add(path)
    print("| vehicle, flights | " + " | ".join(f"{x} s | within 2 sigma" for x in AFTER_S) + " |")
    print("| --- |" + " --- | --- |" * len(AFTER_S))
    for group in sorted(counts):
        cells = []
        for after in AFTER_S:
            error, sigma, way = np.array(errors[group, after]).T
            share = 100 * np.median(error[way > 5.0] / way[way > 5.0])
            cells.append(f"{np.median(error):.1f} m, {share:.1f} % ({error.size})")
            cells.append(f"{100 * np.mean(error <= 2 * sigma):.0f} %")
        print(f"| {group} ({len(counts[group])}) | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
