"""What was set otherwise on the vehicle, and what did the model identify with each log?"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import isclose, isfinite

from fdi.comparison.values import Identified, Setting
from fdi.residuals.between import tells
from fdi.result import Analysis
from fdi.shown import Rows
from fdi.telemetry.counters import is_counter

EXACT = 1e-6
"""Relative: parameters are single precision, and text logs write seven digits."""


def settings_of(analyses: Sequence[Analysis], healthy: Collection[int]) -> Rows[Setting]:
    """Return the parameters that two logs hold with different values, counters left out.

    First those that are the same in all ``healthy`` logs (by number), then those with few values:
    what has another value in every log was seldom set by a person, but measured by the vehicle.
    """
    names = sorted({n for one in analyses for n in one.log.parameters if not is_counter(n)})
    found = []
    for name in names:
        values = tuple(one.log.parameters.get(name) for one in analyses)
        known = [value for value in values if value is not None and isfinite(value)]
        if known and not all(
            isclose(value, known[0], rel_tol=EXACT, abs_tol=1e-12) for value in known
        ):
            told = tuple(
                value if value is not None and isfinite(value) else None for value in values
            )
            found.append(Setting(name, told))

    def rank(one: Setting) -> tuple[bool, int, str]:
        sound = {one.values[i] for i in healthy} - {None}
        return len(sound) > 1, len(set(one.values)), one.name

    return Rows(sorted(found, key=rank))


def identified_of(analyses: Sequence[Analysis]) -> Rows[Identified]:
    """Return what the logs tell of the parameters that the model identifies."""
    first = analyses[0].system.parameters
    found = []
    for name, parameter in first.items():
        own = [one.system.parameters.get(name) for one in analyses]
        told = [value for value in own if value is not None]
        if parameter.bounds is None or len(told) < len(own):
            continue
        if any(tells(value) for value in told):
            values = tuple(value.value if tells(value) else None for value in told)
            stds = tuple(value.std if tells(value) else None for value in told)
            found.append(Identified(name, parameter.unit, values, stds))
    return Rows(found)
