"""How do the residuals of the shipped models behave while nothing is wrong?

    .venv/bin/python benchmarks/model_residuals.py [--closed-loop DIR] [--write]

In: the flights of ../shared beside the repository, those of the archive of closed loops among them;
of these the ``.tlog`` flights that are labelled without a fault, for diagnosis, by a quadcopter, an
aeroplane or a VTOL, and ``.ulg`` flights until their first fault: only these say where a VTOL's
motors are, and how fast motors turn. Out: the Markdown tables of ``docs/models.md``, for each model
what its residuals and its limits show over all these flights, and whom the default policy accuses.
A VTOL is judged as an aeroplane too: its tables hold what the aeroplane's do not. With ``--write``
they replace what ``docs/models.md`` holds between its two marks.

Everything is taken in flight: from take-off to landing, impact, a fault or the label's
``evaluate_until``. A residual is counted after its centre is taken off, as the policy does. For a
limit the residual is zero inside the bound and says nothing, so the second table shows how much is
left to the bound.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from evaluation import LABELS, ROOT, closed_loop, missing, put
from numpy.typing import NDArray

import fdi
from fdi.diagnosis.alarm_runs import find_runs
from fdi.model import Airframe, System
from fdi.model.dimensions import dimension, dimension_of
from fdi.model.evaluate import wrap
from fdi.model.expression import Apply, Number
from fdi.model.parts import Kind
from fdi.residuals import Bank, Generator
from fdi.result import Analysis
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air
from fdi.units import customary

DOCUMENT = ROOT / "docs" / "models.md"
ORIGINS = ("simulated", "recorded")
VEHICLES = ("quad", "plane", "vtol")
EXTENDED = {"vtol": "fixed_wing"}
"""Models by those whose statements they hold as well."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal variable over its median absolute deviation."""

Floats = NDArray[np.float64]


@dataclasses.dataclass(slots=True)
class Pool:
    """What one residual, or one limit, showed over all flights."""

    unit: str
    values: list[Floats] = dataclasses.field(default_factory=list)
    thresholds: list[Floats] = dataclasses.field(default_factory=list)
    centres: list[float] = dataclasses.field(default_factory=list)
    held: dict[str, list[float]] = dataclasses.field(default_factory=lambda: defaultdict(list))
    flights: set[str] = dataclasses.field(default_factory=set)
    samples: int = 0
    alarms: int = 0


def healthy_flights(folders: Iterable[Path]) -> Iterator[tuple[Path, str, float | None]]:
    """Yield path, origin and until when, s, of the healthy flights, in the order of their paths."""
    for folder in folders:
        labels = json.loads((folder / LABELS.name).read_text(encoding="utf-8"))["flights"]
        for path, label in sorted(labels.items()):
            ends = [fault["onset"] for fault in label["faults"]]
            wanted = path.endswith(".ulg") or (path.endswith(".tlog") and not ends)
            if label["evaluate_until"] is not None:
                ends.append(label["evaluate_until"])
            if wanted and label["use"] == "diagnosis" and label["vehicle"] in VEHICLES:
                yield folder / path, label["origin"], min(ends, default=None)


def name_of(generator: Generator, system: System) -> str:
    """Return a residual by its equations: the one left over, then the others, without inputs."""
    names = [system.equations[generator.residual].name]
    for number in generator.equations:
        equation = system.equations[number]
        if equation.kind is not Kind.INPUT and equation.name not in names:
            names.append(equation.name)
    return " ".join(f"`{name}`" for name in names)


def unit_of(bank: Bank, generator: Generator) -> str:
    """Return the SI unit of a residual: its own, or one that the model uses for such a quantity."""
    system = bank.system
    equation = system.equations[generator.residual]
    unit = equation.unit
    if unit:
        return unit
    named = {name: v.unit for name, v in (*system.variables.items(), *system.parameters.items())}
    units = {name: dimension(text) for name, text in named.items()}
    own = dimension_of(equation.left, units) or dimension_of(equation.right, units)
    fitting = (text for name, text in named.items() if own and units[name].fits(own))
    return next(fitting, "1")


def held(level: Floats, least: int) -> float:
    """Return the highest level that a column kept up over ``least`` known samples in a row."""
    known = level[np.isfinite(level)]
    if len(known) < least:
        return float("nan")
    return float(np.lib.stride_tricks.sliding_window_view(known, least).min(axis=1).max())


def without_zero(airframe: Airframe) -> Airframe:
    """Return the model with limits that go on below zero inside their bounds."""

    def opened(equation: Any) -> Any:
        if equation.kind is not Kind.LIMIT:
            return equation
        terms = tuple(t for t in equation.left.arguments if t != Number(0.0))
        left = terms[0] if len(terms) == 1 else Apply("max", terms)
        return dataclasses.replace(equation, left=left)

    return dataclasses.replace(airframe, equations=tuple(map(opened, airframe.equations)))


def spans(log: Log, t: Floats, until: float | None) -> list[tuple[float, float]]:
    """Return from when to when, s, the vehicle flew and its label holds."""
    last = float("inf") if until is None else until
    found = [in_air(flight) for flight in log.flights] or [(float(t[0]), float(t[-1]))]
    return [(start, min(end, last)) for start, end in found]


def flying(t: Floats, within: list[tuple[float, float]]) -> NDArray[np.bool_]:
    """Return which samples lie in one of the spans."""
    return np.any([(t >= start) & (t < end) for start, end in within], axis=0)


def add_residuals(
    analysis: Analysis, within: list[tuple[float, float]], pools: dict[str, Pool], origin: str
) -> None:
    """Add a flight's residuals to the pools."""
    alarms, residuals, bank = analysis.alarms, analysis.residual_values, analysis.bank
    inside = flying(residuals.t, within)
    rows = [run.row for span in within for run in find_runs(alarms, *span)]
    for row, generator in enumerate(bank.generators):
        pool = pools.setdefault(name_of(generator, bank.system), Pool(unit_of(bank, generator)))
        own = (residuals.values[row] - alarms.centre[row])[inside]
        if bank.system.equations[generator.residual].circular:
            own = wrap(own)
        pool.samples += len(own)
        pool.flights.add(analysis.log.sha256)
        pool.values.append(own[np.isfinite(own)])
        pool.thresholds.append(alarms.threshold[row, inside][np.isfinite(own)])
        pool.centres.append(float(alarms.centre[row]))
        pool.held[origin].append(held(alarms.strength[row, inside], least_samples(analysis)))
        pool.alarms += rows.count(row)


def least_samples(analysis: Analysis) -> int:
    """Return how many samples a trigger must last to be an alarm."""
    recipe: Any = analysis.policy.decision
    return max(recipe.least_samples, round(recipe.persistence_s * analysis.signals.rate_hz))


def add_limits(
    analysis: Analysis, within: list[tuple[float, float]], pools: dict[str, Pool], origin: str
) -> None:
    """Add how much a flight's limited quantities leave to their bounds to the pools."""
    system = without_zero(analysis.airframe).observe(analysis.log)
    bank = fdi.build_bank(system, analysis.policy.tests)
    values = bank.evaluate(analysis.signals, analysis.policy.differentiation).values
    inside = flying(analysis.signals.t, within)
    for row, generator in enumerate(bank.generators):
        equation = system.equations[generator.residual]
        if equation.kind is Kind.LIMIT:
            pool = pools.setdefault(
                f"`{equation.name}`: {equation.text}", Pool(unit_of(bank, generator))
            )
            spare = values[row, inside]  # a residual is right minus left: 0 - (quantity - bound)
            pool.values.append(spare[np.isfinite(spare)])
            pool.held[origin].append(held(-spare, least_samples(analysis)))
            pool.samples += len(spare)
            pool.flights.add(analysis.log.sha256)


def figure(value: float) -> str:
    """Return a number for a table; what is smaller than any accuracy is zero."""
    if not np.isfinite(value):
        return "–"
    return f"{0.0 if abs(value) < 5e-4 else value:.3g}".replace("e+0", "e")


def unit_label(unit: str) -> str:
    """Return a unit for a table; a plain number has none."""
    return "" if unit == "1" else unit


def worst(pool: Pool, sign: float = 1.0) -> list[float]:
    """Return the highest level that flights of each origin held, NaN where none is known."""
    known = [[level for level in pool.held[o] if np.isfinite(level)] for o in ORIGINS]
    return [sign * max(levels, default=float("nan")) for levels in known]


def residual_table(pools: Mapping[str, Pool]) -> str:
    """Return the first table: residuals that compare two quantities."""
    head = (
        "| residual | unit | flights | known | centre | median | robust σ | 99 % of \\|r\\| | "
        "threshold | held, sim. | held, rec. | alarms |\n| --- | --- " + "| ---: " * 10 + "|\n"
    )
    lines = []
    for name, pool in pools.items():
        values = np.concatenate(pool.values)
        if not len(values):
            lines.append(
                f"| {name} | | {len(pool.flights)} | 0 % | – | – | – | – | – | – | – | 0 |"
            )
            continue
        label, scale, _ = customary(pool.unit)
        middle = float(np.median(values))
        cells = [
            float(np.median(pool.centres)),
            middle,
            MAD_TO_SIGMA * float(np.median(np.abs(values - middle))),
            float(np.quantile(np.abs(values), 0.99)),
            float(np.median(np.concatenate(pool.thresholds))),
        ]
        shown = " | ".join(figure(cell * scale) for cell in cells)
        known = f"{100 * len(values) / pool.samples:.0f} %"
        levels = " | ".join(map(figure, worst(pool)))
        lines.append(
            f"| {name} | {unit_label(label)} | {len(pool.flights)} | {known} | {shown} | "
            f"{levels} | {pool.alarms} |"
        )
    return head + "\n".join(lines)


def limit_table(pools: Mapping[str, Pool], alarms: Mapping[str, int]) -> str:
    """Return the second table: limits."""
    head = (
        "| limit | unit | flights | known | median | 1 % | held, sim. | held, rec. | alarms |\n"
        "| --- | --- " + "| ---: " * 7 + "|\n"
    )
    lines = []
    for name, pool in pools.items():
        values = np.concatenate(pool.values)
        label, scale, _ = customary(pool.unit)
        count = alarms.get(name, 0)
        known = f"{100 * len(values) / pool.samples:.0f} %" if pool.samples else "–"
        cells = [float("nan")] * 2
        if len(values):
            cells = [float(np.median(values)), float(np.quantile(values, 0.01))]
        shown = " | ".join(figure(cell * scale) for cell in (*cells, *worst(pool, -1.0)))
        lines.append(
            f"| {name} | {unit_label(label)} | {len(pool.flights)} | {known} | {shown} | {count} |"
        )
    return head + "\n".join(lines)


def tables(folders: Iterable[Path]) -> Iterator[str]:
    """Yield the paragraphs and tables of all models."""
    residuals: dict[str, dict[str, Pool]] = defaultdict(dict)
    limits: dict[str, dict[str, Pool]] = defaultdict(dict)
    accused: dict[str, list[str]] = defaultdict(list)
    hours: dict[str, float] = defaultdict(float)
    count: dict[str, int] = defaultdict(int)
    for path, origin, until in healthy_flights(folders):
        analysis = fdi.analyze(path)
        model = analysis.airframe.name
        within = spans(analysis.log, analysis.signals.t, until)
        add_residuals(analysis, within, residuals[model], origin)
        add_limits(analysis, within, limits[model], origin)
        count[model] += 1
        hours[model] += sum(max(0.0, end - start) for start, end in within) / 3600
        accused[model] += [
            f"`{path.parent.name}/{path.name}` {finding.component} from {finding.onset:.1f} s"
            for finding in analysis.findings
            if until is None or (finding.alarm or finding.onset) < until
        ]
    for model, pools in sorted(residuals.items()):
        names = {name.split(":")[0]: name for name in limits[model]}
        limit_of = {name: names.get(name.split(" ")[0]) for name in pools}
        raised: dict[str, int] = defaultdict(int)
        for name, limit in limit_of.items():
            if limit:
                raised[limit] += pools[name].alarms
        yield f"### {model}"
        yield f"{count[model]} healthy flights, {hours[model]:.2f} h in the air."
        other = EXTENDED.get(model, "")
        known = {*residuals.get(other, {}), *limits.get(other, {})}
        yield residual_table({n: p for n, p in pools.items() if not limit_of[n] and n not in known})
        yield limit_table({n: p for n, p in limits[model].items() if n not in known}, raised)
        yield "Accused: " + ("; ".join(accused[model]) or "nobody") + "."


def main() -> int:
    """Print the tables, and write them where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put them into docs/models.md")
    parser.add_argument("--closed-loop", type=Path, metavar="DIR", help="the archive, unpacked")
    given = parser.parse_args()
    if reason := missing(given.closed_loop):
        print(f"skipped: {reason}")
        return 0
    with closed_loop(given.closed_loop) as others:
        text = "\n\n".join(tables([LABELS.parent, others]))
    print(text)
    if given.write:
        put(text, "residuals", DOCUMENT)
    return 0


if __name__ == "__main__":
    sys.exit(main())
