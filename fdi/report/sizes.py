"""How large must each fault be on this flight to be seen, and to be told from all others?

In: the residuals of a flight. Out: the smallest sizes of steps, found within 5 s at one false
alarm an hour with a probability of 90 %, as a table and as plain values. Windows stand at a
quarter, a half and three quarters of the time in the air, and their median counts: a fault shows
more or less by what is flown.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fdi.errors import UsageError
from fdi.report.text import heading, table, text
from fdi.report.words import clean
from fdi.residuals import Residuals
from fdi.residuals.distinguish import (
    Distinguishability,
    at_smallest,
    distinguishability,
    smallest_size,
)
from fdi.residuals.window import window_of
from fdi.shown import Shown
from fdi.telemetry.airtime import time_in_air
from fdi.units import customary, two_digits

if TYPE_CHECKING:
    from rich.console import RenderableType

LENGTH_S: Final = 5.0
PER_HOUR: Final = 1.0
POWER: Final = 0.9
ALPHA: Final = PER_HOUR * LENGTH_S / 3600
"""Of a false alarm in one window."""
ALIKE: Final = 1.02
"""Times the size that is seen: told from this on, a fault is as easily told as seen."""
PLACES: Final = (0.25, 0.5, 0.75)


@dataclass(frozen=True, slots=True, eq=False)
class Sizes(Shown):
    """Smallest sizes of faults, in the units of ``found``.

    Attributes
    ----------
    found : Distinguishability
        The median of the windows.
    seen, told : (f,) float
        To be detected, and told from every other fault; infinite where no size is enough, NaN
        where not known.
    nearest : tuple of str
        The fault that is hardest to tell from, "" where none is known.
    """

    found: Distinguishability
    seen: np.ndarray[tuple[int], np.dtype[np.float64]]
    told: np.ndarray[tuple[int], np.dtype[np.float64]]
    nearest: tuple[str, ...]


def sizes_of(residuals: Residuals) -> Sizes:
    """Return the smallest sizes of all faults on a flight, by its residuals.

    Raises
    ------
    UsageError
        The flight is too short for any window.
    """
    start, end = max(time_in_air(residuals.signals), key=lambda span: span[1] - span[0])
    each = []
    for place in PLACES:
        try:
            window = window_of(residuals, start + place * (end - start), LENGTH_S)
        except UsageError:  # so near the flight's end that no derivative is known
            continue
        each.append(distinguishability(at_smallest(window, residuals, ALPHA, POWER)))
    if not each:
        raise UsageError(
            f"no {LENGTH_S:g} s of the flight are whole", where=residuals.signals.log_name
        )
    first = each[0]
    found = Distinguishability(
        first.names,
        first.units,
        np.median([one.detected for one in each], axis=0),
        np.median([one.told for one in each], axis=0),
    )
    others = np.where(np.eye(len(found.names), dtype=bool), np.inf, found.told)
    # from a fault that shows nothing there is nothing to be told
    others[:, found.detected == 0] = np.inf
    worst = np.where(np.isnan(others), np.inf, others)
    nearest = tuple(
        found.names[int(row.argmin())] if np.isfinite(row.min()) else "" for row in worst
    )
    distance = np.where(np.isfinite(worst.min(axis=1)), worst.min(axis=1), found.detected)
    return Sizes(
        found,
        smallest_size(found.detected, ALPHA, POWER),
        smallest_size(np.where(np.isnan(found.detected), np.nan, distance), ALPHA, POWER),
        nearest,
    )


def sizes_document(sizes: Sizes) -> dict[str, Any]:
    """Return the sizes as plain values; a size that no fault is large enough for is null."""
    return {
        "within_s": LENGTH_S,
        "false_alarms_per_hour": PER_HOUR,
        "probability": POWER,
        "faults": [
            {
                "fault": name,
                "unit": unit,
                "known": bool(np.isfinite(seen) or np.isinf(seen)),
                "seen": float(seen) if np.isfinite(seen) else None,
                "told": float(told) if np.isfinite(told) else None,
                "nearest": near or None,
            }
            for name, unit, seen, told, near in zip(
                sizes.found.names,
                sizes.found.units,
                sizes.seen,
                sizes.told,
                sizes.nearest,
                strict=True,
            )
        ],
    }


def sizes_summary(sizes: Sizes) -> Iterator[RenderableType]:
    """Yield what a terminal shows of the sizes."""
    yield heading(
        f"Smallest step that is seen within {LENGTH_S:g} s, by the stated noise "
        f"({PER_HOUR:g} false alarm an hour, {POWER:.0%} found)"
    )
    made = table("fault", "seen from", "told from all others from", "hardest to tell from")
    hidden, unstated = 0, 0
    for name, unit, seen, told, near in zip(
        sizes.found.names, sizes.found.units, sizes.seen, sizes.told, sizes.nearest, strict=True
    ):
        hidden, unstated = hidden + bool(np.isinf(seen)), unstated + bool(np.isnan(seen))
        if np.isfinite(seen):
            made.add_row(
                text(clean(name)),
                text(_sized(float(seen), unit)),
                text(_sized(float(told), unit) if np.isfinite(told) else "no size"),
                text(clean(near) if told > ALIKE * seen else "–"),
            )
    yield made
    if hidden:
        yield text(f"{hidden} faults move no test by a step here (limits, or what was unknown)")
    if unstated:
        yield text(
            f"{unstated} show in what no noise is stated of, or what noise itself makes unknown: "
            "no size is known"
        )


def _sized(value: float, unit: str) -> str:
    shown = customary(unit)
    size = value * shown.scale
    number = two_digits(size) if 1e-3 <= abs(size) < 1e6 else f"{size:.1e}"
    return number if shown.unit == "1" else f"{number} {shown.unit}".strip()
