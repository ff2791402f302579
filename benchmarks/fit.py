"""Which weights suit the labelled flights, and how much hangs on the numbers that are not fitted?

    .venv/bin/python benchmarks/fit.py [--write] [--sensitivity] [--closed-loop DIR] [--workers N]

Does what ``fdi fit`` does on ../shared/flights beside the repository, the closed-loop flights among
them, and prints the weights with their intervals. With ``--write`` they go into
fdi/diagnosis/likelihood.json and between the markers of docs/evaluation.md. To be done after every
change of what alarms, of the features or of `affects`, before ``benchmarks/evaluation.py --write``.

With ``--sensitivity`` it asks instead what the flights score, out of sample by recording, where a
stated number of the mechanism is half and twice what it is; ``--write`` then writes that table
alone.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Final

from evaluation import ROOT, add_options, evaluated, missing, progress, put

from fdi.diagnosis import features, hypotheses, likelihood, naming
from fdi.evaluation import fitting
from fdi.evaluation.fitting import Flown, fit, fit_text, fitted_document, lessons_of
from fdi.evaluation.totals import totals
from fdi.evaluation.unseen import unseen
from fdi.report.json_text import json_text

DATA: Final = ROOT / "fdi" / "diagnosis" / likelihood.FILE
COMMAND: Final = "benchmarks/fit.py"
MODULES: Final = (features, hypotheses, likelihood, naming, fitting)
"""All that reads a stated number by its name; one that another imports is there twice."""
STATED: Final[Mapping[str, tuple[ModuleType, tuple[float, float]]]] = {
    "WINDOW_S": (hypotheses, (5.0, 20.0)),
    "SIMULTANEOUS_S": (hypotheses, (1.0, 4.0)),
    "LINKED_S": (naming, (7.5, 30.0)),
    "ENOUGH": (naming, (0.35, 0.7)),  # a probability: twice it would accuse nobody
    "PENALTY": (fitting, (0.5, 2.0)),
    "AFTER": (fitting, (3, 12)),
    "MOST": (features, (2.5, 10.0)),
    "WELL": (features, (0.25, 1.0)),
}
"""Where each number is stated, and what is tried instead of it."""


@contextmanager
def instead(name: str, value: float) -> Iterator[None]:
    """Let a stated number be another one for a while, wherever it is read."""
    before = {module: getattr(module, name) for module in MODULES if hasattr(module, name)}
    try:
        for module in before:
            setattr(module, name, value)
        yield
    finally:
        for module, own in before.items():
            setattr(module, name, own)


def scored(flown: Sequence[Flown]) -> list[str]:
    """Return what the flights of each labels file score by weights that have not seen them."""
    found = unseen(flown, "recording")
    cells = []
    for source in dict.fromkeys(one.label.source for one in flown):
        pairs = zip(flown, found.scores, strict=True)
        value = totals([score for one, score in pairs if one.label.source == source])
        cells += [f"{value.named.hits}/{value.named.of}", str(value.wrong), str(value.false)]
    return cells


def sensitivity(flown: Sequence[Flown]) -> str:
    """Return the table of scores where each stated number is another one."""
    head = ["number", "is", "tried"]
    for what in ("labelled", "closed loop"):
        head += [f"{what}: named first", "wrong", "false"]
    rows = [["as stated", "", "", *scored(flown)]]
    tried = [(name, value) for name, (_, values) in STATED.items() for value in values]
    for done, (name, value) in enumerate(tried, 1):
        stated = getattr(STATED[name][0], name)
        with instead(name, value):
            rows.append([f"`{name}`", f"{stated:g}", f"{value:g}", *scored(flown)])
        progress(f"{name} {value:g}", done / len(tried))
    lines = [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]
    return f"`{COMMAND} --sensitivity` printed:\n\n" + "\n".join(lines) + "\n"


def main() -> int:
    """Print the weights, or what the stated numbers do, and write them where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="into the package and the page")
    parser.add_argument("--sensitivity", action="store_true", help="of the stated numbers instead")
    add_options(parser)
    given = parser.parse_args()
    if reason := missing(given.closed_loop):
        print(f"skipped: {reason}")
        return 0
    flown = evaluated(given.closed_loop, given.workers).flown
    if given.sensitivity:
        text = sensitivity(flown)
        print(text)
        if given.write:
            put(text, "sensitivity")
        return 0
    found = fit(lessons_of(flown))
    text = fit_text(found)
    print(text)
    if given.write:
        DATA.write_text(json_text(fitted_document(found)), "utf-8")
        put(f"`{COMMAND} --write` printed:\n\n{text}", "weights")
    return 0


if __name__ == "__main__":
    sys.exit(main())
