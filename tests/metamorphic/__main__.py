"""Prints which relation holds on how many flights, and every one that does not; 1 where any fails.

python -m metamorphic [--workers N] [RELATION...]
"""

import argparse
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

from flights import SHARED

from .asking import Outcome, ask
from .relations import RELATIONS


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("relations", nargs="*", default=list(RELATIONS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    if not SHARED.is_dir():
        print("skipped: no ../shared")
        return 0
    with tempfile.TemporaryDirectory(prefix="fdi-cache-") as cache:
        os.environ.setdefault("FDI_CACHE_DIR", cache)
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ[name] = "1"
        with ProcessPoolExecutor(given.workers, get_context("spawn")) as pool:
            tasks = [
                pool.submit(ask, name, flight)
                for name in given.relations
                for flight in RELATIONS[name].flights
            ]
            found = []
            for task in as_completed(tasks):
                found.append(task.result())
                if found[-1].failure:
                    print("fails: {}: {}: {}".format(*found[-1]), flush=True)
    return told(found)


def told(found: list[Outcome]) -> int:
    """Print the table."""
    order = list(RELATIONS)
    found.sort(key=lambda one: (order.index(one.relation), one.flight))
    print(f"{'relation':18}{'flights':>8}{'hold':>6}{'fail':>6}{'CPU s':>8}")
    for name in dict.fromkeys(one.relation for one in found):
        own = [one for one in found if one.relation == name and one.failure != ""]
        held = sum(one.failure is None for one in own)
        seconds = sum(one.seconds for one in own)
        print(f"{name:18}{len(own):8}{held:6}{len(own) - held:6}{seconds:8.0f}")
    return 1 if any(one.failure for one in found) else 0


if __name__ == "__main__":
    sys.exit(main())
