"""Who is accused where an estimator's height is off, and no sensor's?

    .venv/bin/python benchmarks/heights.py LABELS.json ... [--workers 2]

LABELS.json names flights, as `fdi evaluate` takes it. Into each recorded DataFlash log without a
fault, of 40 s in the air or more, that has a test of the estimator's height, steps and a drift of
it are put from the middle of its longest flight on: into all records of the estimator's height, and
nothing else (its speed does not follow). Prints who is accused then who is not of the flight as it
was, and how often it is a sensor of height, which none of them is to blame for.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from fdi import Analysis, analyze
from fdi.evaluation import load_labels
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import parse_fault
from fdi.telemetry import Log, read

HEIGHTS: Final = {"POS.Alt": 1, "CTUN.Alt": 1, "XKF1.PD": -1, "NKF1.PD": -1, "EKF1.PD": -1}
"""Records of it, and which way is up."""
COURSES: Final = (("bias", 6.0), ("bias", -6.0), ("bias", 10.0), ("drift", 0.3))
SENSORS: Final = frozenset({"barometer", "gps"})
LEAST_S: Final = 40.0
TEST: Final = "alt_3"

Row = tuple[str, str, list[str]]


def is_asked(found: Analysis) -> bool:
    """Return whether a test of the estimator's height judged the flight."""
    equations = found.system.equations
    return any(
        (found.alarms.state[row] >= 0).any()
        and any(equations[i].name == TEST for i in generator.equations)
        for row, generator in enumerate(found.bank.generators)
    )


def courses(log: Log, at: float) -> Iterator[tuple[str, bytes]]:
    """Yield the logs that are made of one, by the name of what is put in."""
    shown = [
        (name, up)
        for name, up in HEIGHTS.items()
        if (part := name.split("."))[0] in log.messages and part[1] in log.messages[part[0]]
    ]
    for kind, size in COURSES:
        faults = [parse_fault(f"{name}:{kind}={up * size}@{at:.2f}") for name, up in shown]
        yield f"{kind} {size:+g}", injected(log, *faults)


def look(path: Path) -> list[Row]:
    """Return for each course who is newly accused."""
    log = read(path)
    flown = [flight.airborne for flight in log.flights if flight.flew]
    low, high = max(flown, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
    if high - low < LEAST_S:
        return []
    whole = analyze(path)
    if not is_asked(whole):
        return []
    known = {one.component for one in whole.findings}
    rows = []
    with TemporaryDirectory(prefix="fdi-") as folder:
        made = Path(folder) / path.name
        for name, data in courses(log, (low + high) / 2):
            made.write_bytes(data)
            new = [one for one in analyze(made).findings if one.component not in known]
            rows.append((path.name, name, [f"{one.component} {one.confidence:.0%}" for one in new]))
    return rows


def main() -> int:
    """Print who is accused, and how many sensors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("labels", nargs="+", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    paths = [
        one.path
        for file in asked.labels
        for one in load_labels(file)
        if one.use == "diagnosis" and not one.faults and one.origin == "recorded"
        if one.path.suffix.lower() == ".bin"
    ]
    tried, blamed = Counter(), Counter()
    with ProcessPoolExecutor(asked.workers) as pool:
        for rows in pool.map(look, paths):
            for flight, course, new in rows:
                tried[course] += 1
                blamed[course] += any(one.split()[0] in SENSORS for one in new)
                print(f"{flight}, {course}: {', '.join(new) or '-'}", flush=True)
    for course, count in tried.items():
        print(f"{course}: a sensor is accused on {blamed[course]} of {count}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
