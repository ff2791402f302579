"""What do the numbers decide that somebody chose? Each of them halved and doubled.

    .venv/bin/python benchmarks/chosen.py [--write] [--every K] [--closed-loop DIR] [LABELS ...]

In: the labelled flights of ../shared/flights, the closed-loop ones, and those of further LABELS.
Tried are the parameters of the shipped models whose source says that they were chosen or read off
flights, and the tolerances in ``TOLERANCES``; an angle is not doubled beyond a right one, and of
what stands for a share the distance from one counts. A number is tried on the flights that have a
test which reads it, with the log read once. Out: for each number how many these are, on how many of
them somebody else is accused or ruled out than with the number as it is, and what that means by the
labels: components that failed and are named first, accusations that are wrong, parts that failed
and are ruled out. With ``--write`` it goes between the markers of docs/evaluation.md.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Final, NamedTuple

from evaluation import LABELS, add_options, closed_loop, missing, put

from fdi import residuals_of
from fdi.chain import Chain
from fdi.diagnosis import Diagnosis, diagnose
from fdi.errors import FdiError
from fdi.evaluation import Label, load_labels
from fdi.evaluation.score import score
from fdi.model import Airframe
from fdi.model.load import load_airframe, shipped_models
from fdi.residuals import Bank
from fdi.telemetry import read

COMMAND: Final = "benchmarks/chosen.py --write"
WEAK: Final = re.compile(r"\b(?:chosen|simulated|recorded|few)\b")
NAMED: Final = ("air_warmer", "charge_most", "hover_calm")
"""Further parameters: docs/evaluation.md says that flights were in sight when they were stated."""
TOLERANCES: Final = (
    "vibration_grown", "engine_gives_less_thrust", "engine_gives_less", "engine_lets_energy_go",
    "aileron_far_from_trim", "elevator_far_from_trim", "rudder_far_from_trim",
    "side_force_in_straight_flight", "gps_position_strays",
)  # fmt: skip
FACTORS: Final = (0.5, 2.0)
SHARE: Final = (0.5, 1.5)
"""A number without a unit in here stands for a share of what ought to be one."""


class Number(NamedTuple):
    """A parameter, or the tolerance of an equation of that name."""

    name: str
    is_tolerance: bool
    value: float
    unit: str


class Change(NamedTuple):
    """What a flight shows with a number changed: more than with it as it is, or fewer."""

    number: str
    tried: float
    differs: bool
    named: int
    wrong: int
    cleared: int


def numbers(airframe: Airframe) -> Iterator[Number]:
    """Yield the numbers of a model that are tried."""
    for one in airframe.parameters.values():
        if one.value and (WEAK.search(one.source) or one.name in NAMED):
            yield Number(one.name, False, one.value, one.unit)
    for equation in airframe.equations:
        if equation.name in TOLERANCES:
            yield Number(equation.name, True, equation.tolerance, equation.unit)


def times(number: Number, factor: float) -> float:
    """Return what a number is halved or doubled."""
    low, high = SHARE
    if number.unit == "1" and not number.is_tolerance and low < number.value < high:
        return 1.0 + (number.value - 1.0) * factor
    return number.value * factor


def changed(airframe: Airframe, number: Number, value: float) -> Airframe:
    """Return a model with another value of a number."""
    if number.is_tolerance:
        equations = tuple(
            replace(one, tolerance=value) if one.name == number.name else one
            for one in airframe.equations
        )
        return replace(airframe, equations=equations)
    own = replace(airframe.parameters[number.name], value=value)
    return replace(airframe, parameters={**airframe.parameters, number.name: own})


def is_read(number: Number, bank: Bank) -> bool:
    """Return whether a test of a bank reads a number."""
    used = {i for generator in bank.generators for i in generator.equations}
    equations = [bank.system.equations[i] for i in used]
    if number.is_tolerance:
        return any(equation.name == number.name for equation in equations)
    return any(f"name='{number.name}'" in repr(equation) for equation in equations)


def tried(label: Label) -> tuple[Change, ...]:
    """Return what changes on a flight with each number that its tests read."""
    try:
        log = read(label.path)
        base = residuals_of(log)
    except FdiError:
        return ()
    own = said(base)
    was = scored(label, own)
    rows = []
    for number in numbers(base.airframe):
        if not is_read(number, base.bank):
            continue
        for factor in FACTORS:
            value = times(number, factor)
            now = said(residuals_of(log, changed(base.airframe, number, value)))
            counts = (n - w for n, w in zip(scored(label, now), was, strict=True))
            rows.append(Change(number.name, value, names(now) != names(own), *counts))
    return tuple(rows)


def said(chain: Chain) -> Diagnosis:
    """Return who is accused and who is ruled out."""
    return diagnose(chain.policy.decide(chain.residuals), chain.bank)


def names(found: Diagnosis) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return who is accused, by rank, and who is ruled out."""
    accused = tuple(one.component for one in found.findings)
    return accused, tuple(sorted(one.component for one in found.ruled_out))


def scored(label: Label, found: Diagnosis) -> tuple[int, int, int]:
    """Return whether who failed is named first, how many are wrong, how many ruled out wrongly."""
    row = {
        "findings": [
            {"component": f.component, "rank": f.rank, "onset_s": f.onset, "alarm_s": f.alarm}
            for f in found.findings
        ],
        "ruled_out": [one.component for one in found.ruled_out],
        "consequences": [],
        "not_testable": [],
        "airborne_s": 0.0,
        "error": None,
    }
    points = score(label, row)
    return int(points.named), len(points.wrong), len(points.cleared)


def table(known: Mapping[str, Number], rows: Sequence[Change]) -> Iterator[str]:
    """Yield the lines of the table."""
    by_try: dict[tuple[str, float], list[Change]] = defaultdict(list)
    for row in rows:
        by_try[row.number, row.tried].append(row)
    yield "| number | is | tried | flights | differ | named first | wrong | cleared wrongly |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for (name, value), own in sorted(by_try.items()):
        number = known[name]
        unit = "" if number.unit == "1" else f" {number.unit}"
        sums = [sum(one) for one in zip(*(row[3:] for row in own), strict=True)]
        yield (
            f"| `{name}` | {number.value:.3g}{unit} | {value:.3g} | {len(own)} | "
            f"{sum(row.differs for row in own)} | " + " | ".join(f"{one:+d}" for one in sums) + " |"
        )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_options(parser)
    parser.add_argument("labels", nargs="*", type=Path, help="further files of labels")
    parser.add_argument("--write", action="store_true", help="put it into docs/evaluation.md")
    parser.add_argument("--every", type=int, default=1, help="only every so manieth flight")
    options = parser.parse_args()
    if why := missing(options.closed_loop):
        print(f"benchmarks/chosen.py: {why}", file=sys.stderr)
        return 0
    with closed_loop(options.closed_loop) as folder:
        files = (LABELS, folder / LABELS.name, *options.labels)
        labels = [one for path in files for one in load_labels(path) if one.use == "diagnosis"]
        with get_context("spawn").Pool(options.workers) as pool:
            found = pool.map(tried, labels[:: options.every], chunksize=1)
    known = {one.name: one for name in shipped_models() for one in numbers(load_airframe(name))}
    text = "\n".join(table(known, [row for rows in found for row in rows]))
    print(text)
    if options.write:
        command = COMMAND if options.every == 1 else f"{COMMAND} --every {options.every}"
        also = ", ".join(f"`{path.parent.name}`" for path in options.labels)
        also = f" with the labels of {also}" if also else ""
        put(f"`{command}`{also} printed:\n\n{text}", "chosen")
    return 0


if __name__ == "__main__":
    sys.exit(main())
