"""What of several analyses can be compared? The same tests of their flights, from take-off on.

Two tests are the same where they use the same equations and leave the same one over; their numbers
in two banks may differ, since the telemetry does.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fdi.comparison.values import Compared, Course, Test
from fdi.errors import LogError, UsageError
from fdi.result import Analysis
from fdi.telemetry.airtime import time_in_air

Key = tuple[str, tuple[str, ...]]
LEAST_S = 5.0
"""In the air; less is no flight to compare."""


def check(analyses: Sequence[Analysis]) -> None:
    """Refuse what is not of one vehicle and model.

    Raises
    ------
    UsageError
        The analyses are of several vehicles, models or policies, or one log is there twice.
    """
    if not analyses:
        raise UsageError("there is nothing to compare", hint="give two flights or more")
    first = analyses[0]
    seen: dict[str, str] = {}
    for other in analyses:
        for what, own, another in (
            ("vehicle", first.log.vehicle, other.log.vehicle),
            ("model", first.airframe.name, other.airframe.name),
            ("policy", first.policy.name, other.policy.name),
        ):
            if own != another:
                raise UsageError(
                    f"has another {what} ({another}) than {first.log.name} ({own})",
                    where=other.log.name,
                    hint="compare flights of one vehicle",
                )
        if other.log.sha256 in seen:
            raise UsageError(
                f"is the same log as {seen[other.log.sha256]}", where=str(other.log.path)
            )
        seen[other.log.sha256] = str(other.log.path)


def log_names(analyses: Sequence[Analysis]) -> tuple[str, ...]:
    """Return names that tell the logs apart: with their folder where two are called alike."""
    names = [one.log.name for one in analyses]
    return tuple(
        str(Path(one.log.path.parent.name) / name) if names.count(name) > 1 else name
        for one, name in zip(analyses, names, strict=True)
    )


def flights_of(
    analyses: Sequence[Analysis], names: Sequence[str], healthy: Sequence[bool] | None
) -> list[Compared]:
    """Return the flights in the order of the logs; ``healthy``: by log, None where nobody said.

    Raises
    ------
    LogError
        A log holds no flight.
    """
    found = []
    for number, analysis in enumerate(analyses):
        signals = analysis.signals
        spans = [
            (i, start, min(end, float(signals.t[-1])))
            for i, (start, end) in enumerate(time_in_air(signals))
            if not signals.flights or signals.flights[i].flew
        ]
        own = [(i, low, high) for i, low, high in spans if high - low >= LEAST_S]
        if not own:
            raise LogError(
                f"has no flight of {LEAST_S:g} s or more that could be compared",
                where=names[number],
                hint="leave it out",
            )
        for i, start, end in own:
            flight = signals.flights[i] if signals.flights else None
            accused = tuple(dict.fromkeys(f.component for f in analysis.findings if f.flight == i))
            is_sound = not accused and (flight is None or flight.impact is None)
            found.append(
                Compared(
                    name=f"{names[number]}#{i + 1}" if len(own) > 1 else names[number],
                    log=number,
                    flight=i,
                    start=start,
                    has_takeoff=flight is not None and flight.takeoff is not None,
                    seconds=end - start,
                    accused=accused,
                    is_healthy=is_sound if healthy is None else healthy[number],
                )
            )
    return found


def tests_of(analyses: Sequence[Analysis], flights: Sequence[Compared]) -> tuple[Test, ...]:
    """Return the tests that all have, in the order of the first bank.

    Raises
    ------
    UsageError
        There is none.
    """
    rows = [_rows(one) for one in analyses]
    common = [key for key in rows[0] if all(key in other for other in rows[1:])]
    if not common:
        raise UsageError(
            "the logs have no test in common", hint="their telemetry holds different channels"
        )
    first = analyses[0]
    made = []
    for key in common:
        equation = first.system.equations[first.bank.generators[rows[0][key]].residual]
        ids = tuple(analyses[one.log].bank.generators[rows[one.log][key]].id for one in flights)
        made.append(
            Test(key[0], equation.text or equation.name, key[1], equation.unit, ids, equation.way)
        )
    return tuple(made)


def _rows(analysis: Analysis) -> dict[Key, int]:
    equations = analysis.system.equations
    return {
        (
            equations[own.residual].name,
            tuple(sorted(equations[number].name for number in own.equations)),
        ): row
        for row, own in enumerate(analysis.bank.generators)
    }


def course_of(analysis: Analysis, flight: Compared, tests: Sequence[Test], place: int) -> Course:
    """Return the residuals of a flight; ``place``: which of the flights it is."""
    alarms, residuals = analysis.alarms, analysis.alarms.residuals
    number = {generator.id: row for row, generator in enumerate(analysis.bank.generators)}
    rows = [number[test.ids[place]] for test in tests]
    t = residuals.t - flight.start
    inside = (t >= 0) & (t < flight.seconds)
    centre = np.nan_to_num(alarms.centre[rows])
    values = residuals.values[rows][:, inside] - centre[:, None]
    equations = analysis.system.equations
    for i, row in enumerate(rows):
        if equations[analysis.bank.generators[row].residual].circular:
            values[i] = (values[i] + np.pi) % (2 * np.pi) - np.pi
    spread = np.nan_to_num(residuals.spread[rows][:, inside])
    floor = spread + np.nan_to_num(residuals.tolerance[rows])[:, None]
    way = np.array([test.way for test in tests], np.int8)
    return Course(t[inside], values, floor, centre, way)
