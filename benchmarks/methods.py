"""What do the columns of the methods add, as docs/methods.md says?

    .venv/bin/python benchmarks/methods.py [--write] [--closed-loop DIR] [--workers N]

Analyses ../shared/flights beside the repository, the closed-loop flights among them, with the
methods of the default policy and without, and scores both by weights that were fitted without the
recording. With ``--write`` the table goes between the markers of docs/methods.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from evaluation import ROOT, add_options, evaluated, missing, put

from fdi.evaluation.score import Score
from fdi.evaluation.totals import Rate, plain, totals
from fdi.evaluation.unseen import unseen

PAGE: Final = ROOT / "docs" / "methods.md"
GROUPS: Final = {
    "GPS, compass, barometer, airspeed": ("gps", "compass", "barometer", "airspeed"),
    "gyroscope, accelerometer": ("gyroscope", "accelerometer"),
    "all faults": None,
}
HEAD: Final = "| flights of | columns | failed | named first | timely | healthy clean | false/h |"


def lines(scores: Sequence[Score], columns: str) -> Iterator[str]:
    """Yield the rows of a table, by labels file and group of components."""
    for source in dict.fromkeys(one.label.source for one in scores):
        own = [one for one in scores if one.label.source == source]
        name = "/".join(Path(source).parts[-2:])
        for group, components in GROUPS.items():
            found = totals(one for one in own if _is_of(one, components))
            healthy = f"{share(found.clean)} | {found.false_per_hour or 0.0:.2f}"
            tail = healthy if components is None else " | "
            yield (
                f"| {name} | {columns} | {group} | {share(found.named)} | {share(found.timely)} "
                f"| {tail} |"
            )


def _is_of(one: Score, components: tuple[str, ...] | None) -> bool:
    failed = {plain(fault.component) for fault in one.label.faults}
    return components is None or bool(failed & set(components))


def share(rate: Rate) -> str:
    """Return a share as counts."""
    return f"{rate.hits}/{rate.of}"


def main() -> int:
    """Print the table, and write it where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put it into docs/methods.md")
    add_options(parser)
    given = parser.parse_args()
    if reason := missing(given.closed_loop):
        print(f"skipped: {reason}")
        return 0
    rows = [HEAD, "|" + " --- |" * HEAD.count(" | ") + " --- |"]
    for methods, name in ((None, "with"), ((), "without")):
        found = evaluated(given.closed_loop, given.workers, methods=methods)
        rows += lines(unseen(found.flown, "recording").scores, name)
    text = "\n".join(rows)
    print(text)
    if given.write:
        put(text, "methods", PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
