"""How many standard deviations of its own calm noise is the threshold of every test?

    .venv/bin/python benchmarks/thresholds.py [--write] [--every K] [--closed-loop DIR]

In: the labelled flights of ../shared/flights, the closed-loop ones among them. Out: a table by test
whose bound is one of noise: how often it is judged, the threshold of a single sample over
the standard deviation of the residual in the first seconds in the air (median of the flights, and
the largest tenth), the same of that part of the threshold which is noise (the rest is tolerance:
what is constant or slow, and what the model states), and on how many flights the threshold is more
than ``MOST``. With ``--write`` it goes between the markers of docs/evaluation.md.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Final

import numpy as np
from evaluation import LABELS, add_options, closed_loop, missing, put

import fdi
from fdi.decision import load_policy
from fdi.decision.bounds import learn
from fdi.errors import FdiError
from fdi.evaluation import load_labels
from fdi.telemetry.airtime import reference_mask

COMMAND: Final = "benchmarks/thresholds.py --write"
MOST: Final = 8.0
LEAST: Final = 1e-12
"""Of the threshold: a residual that does not move has no noise."""
Found = tuple[tuple[str, float, float], ...]
"""Of a flight: name of the test, threshold and its part that is noise, standard deviations."""


def thresholds(path: Path, policy: str = "default") -> Found:
    """Return by test how many standard deviations of its own its threshold is, and its noise."""
    try:
        chain = fdi.residuals_of(fdi.read(path), policy=policy)
    except FdiError:
        return ()
    residuals, recipe = chain.residuals, load_policy(policy).decision
    bounds = learn(residuals, recipe)
    reference = reference_mask(residuals.signals, recipe.reference_s)
    off = bounds.told.strayed(residuals.values)[0]
    equations = residuals.bank.system.equations
    found = []
    for row, generator in enumerate(residuals.bank.generators):
        own = off[row, reference & np.isfinite(off[row])]
        noise = bounds.noise[row, reference]
        bound = bounds.tolerance[row, reference] + noise
        known = np.isfinite(bound)
        if bounds.told.stated[row] or bounds.told.unfit[row] or len(own) < 10 or not known.any():
            continue
        threshold, part = (float(np.median(one[known])) for one in (bound, noise))
        deviation = float(own.std())
        if deviation > LEAST * threshold:
            name = equations[generator.residual].name
            found.append((name, threshold / deviation, part / deviation))
    return tuple(found)


def table(flights: Sequence[Found]) -> Iterator[str]:
    """Yield the lines of the table, the widest test first."""
    by_test: dict[str, list[float]] = defaultdict(list)
    noise: dict[str, list[float]] = defaultdict(list)
    for flight in flights:
        for name, ratio, part in flight:
            by_test[name].append(ratio)
            noise[name].append(part)
    yield f"| test | judged | median, sd | largest tenth, sd | noise alone | above {MOST:g} sd |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name, own in sorted(by_test.items(), key=lambda item: -float(np.median(item[1]))):
        above = sum(ratio > MOST for ratio in own)
        yield (
            f"| `{name}` | {len(own)} | {np.median(own):.1f} | {np.quantile(own, 0.9):.1f} | "
            f"{np.median(noise[name]):.1f} | {above / len(own):.0%} |"
        )
    wide, loud = (sum(np.median(own) > MOST for own in each.values()) for each in (by_test, noise))
    yield ""
    yield f"{wide} of {len(by_test)} tests are above {MOST:g} sd on half of their flights or more; "
    yield f"by the part that is noise alone, {loud}."


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_options(parser)
    parser.add_argument("--write", action="store_true", help="put it into docs/evaluation.md")
    parser.add_argument("--every", type=int, default=1, help="only every so manieth flight")
    options = parser.parse_args()
    if why := missing(options.closed_loop):
        print(f"benchmarks/thresholds.py: {why}", file=sys.stderr)
        return 0
    with closed_loop(options.closed_loop) as folder:
        labels = [*load_labels(LABELS), *load_labels(folder / LABELS.name)]
        paths = [label.path for label in labels if label.use == "diagnosis"]
        paths = paths[:: options.every]
        with get_context("spawn").Pool(options.workers) as pool:
            flights = pool.map(thresholds, paths, chunksize=4)
    text = "\n".join(table(flights))
    print(text)
    if options.write:
        command = COMMAND if options.every == 1 else f"{COMMAND} --every {options.every}"
        put(f"`{command}` printed:\n\n{text}", "thresholds")
    return 0


if __name__ == "__main__":
    sys.exit(main())
