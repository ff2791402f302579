"""What did a test do, and why was it judged or not? The text of ``fdi analyze --explain TEST``.

In: an analysis and a test: the id of a residual generator, the name of the statement that it leaves
over, a component, ``all``, or ``facts``: what stood out, how a log begins in the air and what the
safety net lacks, with the records it rests on. Out: a table of the tests meant, and for up to
`MOST_TOLD` of them everything that the decision went by.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from fdi.decision.alarms import UNKNOWN
from fdi.decision.scatter import SCATTER_S
from fdi.diagnosis.concerns import Concerns, concerns
from fdi.diagnosis.safety_net import safety_net
from fdi.diagnosis.values import runs
from fdi.errors import UsageError
from fdi.report.stood_out import stood_out_lines
from fdi.report.words import clean
from fdi.residuals.bank import SURE
from fdi.telemetry.airtime import when_in_air
from fdi.telemetry.motion import motion_of
from fdi.units import customary

if TYPE_CHECKING:
    from fdi.result import Analysis
    from fdi.telemetry import Log

FACTS: Final = "facts"
_MOTION: Final = {
    "height": ("height above the take-off or home that the autopilot knows", " m"),
    "climb": ("climb", " m/s"),
    "speed": ("speed over ground", " m/s"),
    "throttle": ("throttle", ""),
    "landed_state": ("landed state (MAVLink; 1: on the ground, 2: in the air)", ""),
}
MOST_TOLD: Final = 5
MOST_ALARMS: Final = 10


def explained(analysis: Analysis, test: str) -> str:
    """Return what a test did, as text.

    Raises
    ------
    UsageError
        There is no such test in this analysis.
    """
    if test == FACTS:
        return "\n".join(_facts(analysis)) + "\n"
    whom = concerns(analysis.bank)
    rows = _meant(analysis, whom, test)
    lines = ["| test | statement | concerns | judged | largest, of its threshold | alarms |"]
    lines.append("| --- | --- | --- | --- | --- | --- |")
    lines += [f"| {' | '.join(_cells(row, analysis, whom))} |" for row in rows]
    if len(rows) > MOST_TOLD:
        lines += [
            "",
            "Of one of these, by its id, more is told: its equations, thresholds and alarms.",
        ]
    else:
        for row in rows:
            lines += ["", *_details(row, analysis, whom)]
    return "\n".join(lines) + "\n"


def _facts(analysis: Analysis) -> Iterator[str]:
    """Yield what stood out, each with the records on which it rests."""
    if not analysis.stood_out:
        yield "Nothing stood out in this log."
    numbers = {check.name: check.numbers for check in analysis.setup}
    for fact, line in zip(analysis.stood_out, stood_out_lines(analysis), strict=True):
        yield clean(line)
        for record in fact.records:
            yield f"  rests on {clean(record)}"
        for name, value in numbers.get(fact.about, {}).items():
            yield f"  {clean(name)}: {value:.4g}"
    for number, flight in enumerate(analysis.log.flights, 1):
        if flight.flew and flight.takeoff is None:
            yield f"flight {number}: in the air from its first record on"
            yield from _first_records(analysis.log, flight.airborne[0])
    for gap in safety_net(analysis.log):
        yield clean(f"safety net, {gap.word}: {gap.words()}")
        yield clean(f"  rests on {gap.parameter}, as the log has it first; {gap.source}")


def _first_records(log: Log, start: float) -> Iterator[str]:
    """Yield what a flight's first second shows of how the vehicle moves."""
    motion = motion_of(log.messages)
    rows = motion.rows(start, start + 1.0)
    for name, (words, unit) in _MOTION.items():
        told = getattr(motion, name)[rows]
        if np.isfinite(told).any():
            yield f"  rests on {words} at log {start:.1f} s: {np.nanmedian(told):.4g}{unit}"


def _meant(analysis: Analysis, whom: Concerns, test: str) -> list[int]:
    equations = analysis.bank.system.equations
    found = [
        row
        for row, generator in enumerate(analysis.bank.generators)
        if test in ("all", generator.id, equations[generator.residual].name) or test in whom.of(row)
    ]
    if not found:
        ids = ", ".join(generator.id for generator in analysis.bank.generators[:3])
        raise UsageError(
            f"there is no test {test!r} in this analysis",
            hint=f"give an id such as {ids}, a statement, a component, {FACTS}, or all",
        )
    return found


def _judged(row: int, analysis: Analysis) -> str:
    """Return whether a test was judged, or why not."""
    alarms = analysis.alarms
    air = when_in_air(alarms.residuals.signals)
    if alarms.unfit[row]:
        return "no: violated from the beginning of the flight on, or its constant is not known"
    if not np.isfinite(alarms.residuals.values[row]).any():
        if analysis.bank.system.equations[analysis.bank.generators[row].residual].taught:
            return "no: asked where a flight departs from those that a policy was learned from"
        return "no: never known with this telemetry, or its condition never held"
    known = (alarms.state[row, air] != UNKNOWN).mean() if air.any() else 0.0
    if not known:
        return "no: not known in the air"
    return f"{known:.0%} of the time in the air"


def _cells(row: int, analysis: Analysis, whom: Concerns) -> list[str]:
    generator, alarms = analysis.bank.generators[row], analysis.alarms
    strength = alarms.strength[row]
    top = float(strength[np.isfinite(strength)].max(initial=0.0))
    raised = len(runs(alarms.residuals.t, alarms.alarm[row]))
    return [
        generator.id,
        clean(analysis.bank.system.equations[generator.residual].name),
        clean(", ".join(sorted(whom.of(row))) or "nobody"),
        _judged(row, analysis),
        f"{top:.2f}",
        str(raised),
    ]


def _details(row: int, analysis: Analysis, whom: Concerns) -> Iterator[str]:
    bank, alarms = analysis.bank, analysis.alarms
    generator, residuals = bank.generators[row], alarms.residuals
    equations = bank.system.equations
    unit, scale, _ = customary(equations[generator.residual].unit)
    unit = "" if unit == "1" else f" {unit}"
    yield f"{generator.id}: {clean(bank.describe(generator))}"
    for number in generator.equations:
        yield f"  {clean(equations[number].name)}: {clean(equations[number].text or 'a channel')}"
    yield f"  reads: {clean(', '.join(map(str, bank.channels(generator))))}"
    holds = whom.held_by(row)
    yield f"  holds: {clean(', '.join(sorted(holds)) or 'nobody')}"
    yield f"  suspects: {clean(', '.join(sorted(whom.of(row) - holds)) or 'nobody')}"
    yield f"  judged: {_judged(row, analysis)}"
    yield f"  constant taken off: {alarms.centre[row] * scale:.4g}{unit}"
    tolerance = max(residuals.tolerance[row], alarms.stray[row]) * scale
    yield f"  tolerance of the statement: {tolerance:.4g}{unit}"
    unsure = residuals.unsure[row][residuals.unsure[row] > 0]
    if len(unsure):
        allowed = SURE * float(np.median(unsure)) * scale
        yield f"  and for parameters that are known so well only: {allowed:.4g}{unit} (median)"
    for what, values in (
        ("stated standard deviation", residuals.spread[row]),
        ("threshold of a sample", alarms.threshold[row]),
        ("threshold of a long mean", alarms.mean_threshold[row]),
    ):
        known = values[np.isfinite(values)]
        if len(known):
            low, middle, high = np.quantile(known, (0.05, 0.5, 0.95)) * scale
            yield f"  {what}: {middle:.4g}{unit} (5 to 95 %: {low:.4g} to {high:.4g})"
    scatter = alarms.scatter[row][np.isfinite(alarms.scatter[row])]
    if len(scatter):
        top = float(scatter.max())
        yield f"  scatter over {SCATTER_S:g} s, times what it was at first: up to {top:.2f}"
    yield f"  scale of the thresholds, for the false-alarm budget: {alarms.scale:.3g}"
    raised = runs(residuals.t, alarms.alarm[row])
    for start, end in raised[:MOST_ALARMS]:
        inside = (residuals.t >= start) & (residuals.t < end)
        top = float(np.nanmax(alarms.strength[row, inside]))
        yield f"  alarm from {start:z.1f} to {end:.1f} s, up to {top:.2f} of its threshold"
    if len(raised) > MOST_ALARMS:
        yield f"  and {len(raised) - MOST_ALARMS} more alarms, to {raised[-1][1]:.1f} s"
