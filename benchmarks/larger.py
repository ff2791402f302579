"""Are larger faults detected at least as often as smaller ones?

    .venv/bin/python benchmarks/larger.py [--only PART] [--kinds K ...] [--moments N] [--workers N]

In: the healthy flights in examples. Into the first channel of each of their sensors that can be
written anew, faults of three sizes are put, each at some moments of the flight, and each log is
analysed. Out: a table by flight, channel and kind, how many were detected (somebody is accused who
is not on the healthy flight) and named, and the lines in which a larger fault was detected less
often than a smaller one. Ends with 1 where there is such a line.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Final, get_args

from fdi.evaluation import load_labels
from fdi.evaluation.curves import Curve, CurveKind, curves, sensors, sized
from fdi.telemetry import read

LABELS: Final = Path(__file__).resolve().parents[1] / "examples" / "healthy_logs" / "labels.json"
STEPS: Final = (4.0, 16.0, 64.0)
"""Sizes, in accuracies of the channel."""


def first_channels(path: Path) -> list[str]:
    """Return a channel of every sensor of a flight."""
    found: dict[str, str] = {}
    for one in sensors(read(path)):
        found.setdefault(one.component, one.channel)
    return list(found.values())


def falls(curve: Curve) -> bool:
    """Return whether a larger fault was detected less often than a smaller one."""
    hits = [point.detected.hits for point in sorted(curve.points, key=lambda p: p.size)]
    return any(later < earlier for earlier, later in pairwise(hits))


def lines(found: list[tuple[CurveKind, Curve]]) -> Iterator[str]:
    """Yield the table, a line for each curve."""
    yield f"| flight | channel | kind | {' | '.join(f'{s:g} accuracies' for s in STEPS)} | |"
    yield "| --- " * (4 + len(STEPS)) + "|"
    for kind, one in found:
        cells = [
            f"{sized(p.size, one.unit, kind)}: "
            f"{p.detected.hits} ({p.named.hits}) of {p.detected.of}"
            for p in sorted(one.points, key=lambda p: p.size)
        ]
        told = "less often" if falls(one) else ""
        yield f"| {one.flight} | {one.channel} | {kind} | {' | '.join(cells)} | {told} |"


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="flights whose name contains this")
    parser.add_argument("--kinds", nargs="+", choices=get_args(CurveKind), default=["bias"])
    parser.add_argument("--channels", nargs="+", default=[], help="these instead")
    parser.add_argument("--moments", type=int, default=2)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    found: list[tuple[CurveKind, Curve]] = []
    for label in load_labels(LABELS):
        if options.only in label.key:
            own = options.channels or first_channels(label.path)
            for kind in options.kinds:
                made = curves(
                    [label],
                    kind=kind,
                    moments=options.moments,
                    channels=own,
                    steps=STEPS,
                    workers=options.workers,
                )
                found += [(kind, one) for one in made]
    print("\n".join(lines(found)))
    exceptions = sum(falls(one) for _, one in found)
    print(f"\n{exceptions} of {len(found)} are detected less often when larger.")
    return int(exceptions > 0)


if __name__ == "__main__":
    sys.exit(main())
