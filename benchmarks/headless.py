"""How often is a copter known by what its outputs do, where a log begins in the air without a head?

    .venv/bin/python benchmarks/headless.py FOLDER... [--after 5]

FOLDERs are searched for DataFlash logs (.bin). Of every one of a quadcopter, hexacopter or
octocopter that flew, parameters, texts and all that came before a time after its take-off are left
out, and what is left is read. Prints how many are then the same vehicle, another one, and not
known; and each that is another one.
"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from fdi.errors import FdiError
from fdi.telemetry import Log, read
from fdi.telemetry.writing import Change, rewritten

COPTERS = ("quad", "hexa", "octa")
HEAD = ("PARM", "MSG", "VER")


def main(argv: list[str]) -> int:
    """Print the counts; return 2 where there is no such log."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--after", type=float, default=5.0)
    asked = parser.parse_args(argv)
    paths = sorted(p for f in asked.folders for p in f.rglob("*") if p.suffix.lower() == ".bin")
    counts: Counter[str] = Counter()
    for path in paths:
        told = vehicles(path, asked.after)
        if told is None:
            continue
        was, now = told
        what = "the same" if was == now else "not known" if now == "other" else "another one"
        counts[what] += 1
        if what == "another one":
            print(f"{path}: {now}, was {was}")
    print(", ".join(f"{count} {what}" for what, count in counts.most_common()) or "no such log")
    return 0 if counts else 2


def vehicles(path: Path, after: float) -> tuple[str, str] | None:
    """Return the vehicle of a whole log and of what is left of it, None where it is of no use."""
    try:
        log = read(path)
        flown = next((flight for flight in log.flights if flight.flew), None)
        if log.vehicle not in COPTERS or not log.parameters or flown is None:
            return None
        with tempfile.TemporaryDirectory() as folder:
            left = Path(folder) / "left.bin"
            left.write_bytes(without_head(log, flown.airborne[0] + after))
            return log.vehicle, read(left).vehicle
    except FdiError as error:
        print(f"left out: {error}", file=sys.stderr)
        return None


def without_head(log: Log, since: float) -> bytes:
    """Return a log without parameters and texts, and without what was recorded before a time."""
    own = {key: one for key, one in log.messages.items() if one.made_from is None}
    lost = {
        key: np.full(one.stamp.size, one.name in HEAD) | (one.stamp < since)
        for key, one in own.items()
        if not one.name.startswith(("FMT", "UNIT", "MULT"))
    }
    return rewritten(log, {key: Change({}, which) for key, which in lost.items() if which.any()})


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
