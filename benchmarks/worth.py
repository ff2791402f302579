"""How often are accusations right, by where a flight comes from? What every report quotes.

    .venv/bin/python benchmarks/worth.py LABELS.json... [--without PATTERN] [--write] [--workers N]

Counts the accusations given at least so much, and the right ones among them, on flights that the
weights were not fitted to, though tests and tolerances were made with the recorded ones in sight;
``--write`` replaces ``fdi/diagnosis/worth.json``. Recorded flights are
those of `real2` and `real3` in ../shared/flights, ``--without 'real2/rfly/*'``: 36 flights of one
vehicle, all with the same failure, would be half of the figure. Simulated ones need weights fitted
without their origin: that row is the closed loop's of ``benchmarks/evaluation.py``
(docs/evaluation.md), and is kept.
"""

from __future__ import annotations

import argparse
import json
from fnmatch import fnmatchcase
from pathlib import Path

from fdi.diagnosis.worth import AT_LEAST, FILE
from fdi.evaluation.calibration import stated
from fdi.evaluation.labels import load_labels
from fdi.evaluation.run import evaluate

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("labels", nargs="+")
    parser.add_argument("--without", default="", metavar="PATTERN")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    labels = [
        one
        for path in asked.labels
        for one in load_labels(path)
        if one.origin == "recorded" and not fnmatchcase(one.key, asked.without)
    ]
    pairs = stated(evaluate(labels, workers=asked.workers))
    sure = [right for confidence, right in pairs if confidence >= AT_LEAST]
    print(f"{sum(sure)} of {len(sure)} accusations given {AT_LEAST:.0%} or more were right")
    print(f"{sum(right for _, right in pairs)} of {len(pairs)} of all")
    if asked.write:
        path = ROOT / "fdi" / "diagnosis" / FILE
        tree = json.loads(path.read_text("utf-8"))
        tree["recorded"] = {"right": sum(sure), "given": len(sure)}
        path.write_text(json.dumps(tree, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
