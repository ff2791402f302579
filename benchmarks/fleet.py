"""What does the page of a fleet cost beside the analyses, and how large is it?

    .venv/bin/python benchmarks/fleet.py [FOLDER] [--every N]

CPU seconds, in this process, of analysing each log and of what the page needs of it (trends,
curves, who it is), then of making the page from the rows. Without an argument the logs are those of
../shared/flights beside the repository; with ``--every 5`` each fifth of them. The page is made a
second time from as many copies of the rows as make 200 logs.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import asdict
from pathlib import Path

from fdi.analysis import analyze
from fdi.errors import FdiError
from fdi.fleet import Job, failed, lost, told
from fdi.report.fleet.document import fleet_page
from fdi.report.fleet.sparks import curves_of
from fdi.telemetry.identity import identity_of
from fdi.telemetry.search import find_logs
from fdi.trends import trends_of

FLIGHTS = Path(__file__).resolve().parents[2] / "shared" / "flights"
FLEET = 200
MOST_BYTES = 6_000_000
BOUND = 0.1  # of the analyses' CPU


def main() -> int:
    """Print the figures; return 1 where the page costs or holds more than its bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=FLIGHTS)
    parser.add_argument("--every", type=int, default=1)
    given = parser.parse_args()
    if not given.folder.is_dir():
        print(f"skipped: {given.folder} is not here")
        return 0
    rows, analyses, parts = [], 0.0, 0.0
    for path in find_logs([str(given.folder)])[:: given.every]:
        try:
            start = time.process_time()
            found = analyze(path)
            found.document()
            middle = time.process_time()
            trends, curves, identity = (
                trends_of(found),
                curves_of(found.log),
                identity_of(found.log),
            )
            done = time.process_time()
        except FdiError as error:
            rows.append(failed(Job(path), error))
            continue
        analyses, parts = analyses + middle - start, parts + done - middle
        rows.append({**lost(Job(path), ""), **told(found), "error": None, "error_kind": None})
        print(
            f"{Path(path).name}: {middle - start:.2f} s, {done - middle:.3f} s for "
            f"{len([asdict(one) for one in trends])} trends and {len(curves)} curves, "
            f"{identity.kind}",
            flush=True,
        )
    start = time.process_time()
    page = fleet_page(rows, "fleet.parquet")
    made = time.process_time() - start
    many = [rows[i % len(rows)] for i in range(FLEET)]
    size = len(fleet_page(many, "fleet.parquet").encode())
    share = (parts + made) / analyses
    print(f"{len(rows)} logs: analyses {analyses:.1f} s CPU, rows {parts:.2f}, page {made:.2f}")
    print(f"measured: {share:.4f} of the analyses' CPU (bound {BOUND:g})")
    print(f"page: {len(page.encode()) / 1e3:.0f} kB; of {FLEET} such logs {size / 1e6:.2f} MB")
    return 0 if share < BOUND and size < MOST_BYTES else 1


if __name__ == "__main__":
    sys.exit(main())
