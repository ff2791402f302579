"""What does `fdi estimator` say on labelled flights?

    .venv/bin/python benchmarks/estimator.py [FOLDER]

FOLDER holds flights and their `labels.json`; by default `../shared/flights`. Prints two tables in
Markdown: by quantity how large the mean of 4 s is against the own level on healthy flights, and by
failed component on how many flights the estimator shows anything before or after its onset.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from fdi.errors import FdiError
from fdi.methods.estimator import EstimatorHealth, estimator_health
from fdi.methods.estimator.ratios import GROWN
from fdi.telemetry import read

FOLDER = Path(__file__).parents[2] / "shared" / "flights"
KINDS = ("not fused", "rejected", "rise", "drift", "whipsaw", "consequence")
EARLY_S = 1.0  # labels know onsets to about that


def flights(folder: Path) -> list[tuple[str, dict, EstimatorHealth]]:
    """Return name, label and health of every labelled flight with an estimator."""
    found = []
    for name, label in sorted(json.loads((folder / "labels.json").read_text())["flights"].items()):
        if label.get("use") != "diagnosis" or not (folder / name).exists():
            continue
        try:
            found.append((name, label, estimator_health(read(folder / name))))
        except FdiError as error:
            print(f"left out: {error}", file=sys.stderr)
    return found


def healthy_table(healthy: list[EstimatorHealth]) -> list[str]:
    """Return by quantity quantiles of the largest mean against the level, and rises."""
    largest: dict[str, list[float]] = defaultdict(list)
    for health in healthy:
        for ratio in health.ratios:
            inside = (ratio.t >= health.air[0] + 4.0) & (ratio.t <= health.air[1])
            known = ratio.excess[inside & np.isfinite(ratio.excess)]
            if known.size:
                largest[ratio.quantity].append(float(known.max()))
    lines = [f"| ratio | flights | median | 90 % | largest | beyond {GROWN:g} |", "|---" * 6 + "|"]
    for quantity, values in largest.items():
        middle, high, most = np.quantile(values, [0.5, 0.9, 1.0])
        over = sum(value > GROWN for value in values)
        lines.append(
            f"| {quantity} | {len(values)} | {middle:.1f} | {high:.1f} | {most:.1f} | {over} |"
        )
    return lines


def kinds_table(rows: dict[str, list[tuple[dict, EstimatorHealth]]]) -> list[str]:
    """Return by failed component how many flights show each kind of finding after the onset."""
    lines = ["| failed | flights | " + " | ".join(KINDS) + " |", "|---" * (len(KINDS) + 2) + "|"]
    for component, found in sorted(rows.items()):
        counts = dict.fromkeys(KINDS, 0)
        for label, health in found:
            onset = min((f["onset"] for f in label["faults"]), default=-np.inf) - EARLY_S
            kinds = {one.kind for one in health.findings if one.t >= onset or one.kind == "drift"}
            if "before symptom" in kinds:
                kinds.add("rise")
            for kind in kinds & counts.keys():
                counts[kind] += 1
        told = " | ".join(str(counts[kind]) for kind in KINDS)
        lines.append(f"| {component} | {len(found)} | {told} |")
    return lines


def main(folder: Path) -> None:
    """Print both tables."""
    found = flights(folder)
    healthy = [health for _, label, health in found if not label["faults"]]
    print("\n".join(healthy_table(healthy)), "\n")
    rows: dict[str, list[tuple[dict, EstimatorHealth]]] = defaultdict(list)
    for _, label, health in found:
        names = sorted({fault["component"] for fault in label["faults"]}) or ["nothing"]
        rows[names[0] if len(names) == 1 else "several"].append((label, health))
    print("\n".join(kinds_table(rows)))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
