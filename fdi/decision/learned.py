"""What do healthy flights of one vehicle say about each test? What a calibrated policy holds.

In: the bounds of healthy flights and their residuals. Out: `Learned` for every test, by its key: by
which factor its threshold of noise is off, how far it may stray beyond the model's statement, and
between which constants its centre lies. A key names the equation left over and the faults, so it is
the same in every log in which the test exists.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision.bounds import Bounds, key_of
from fdi.decision.critical import critical_scales, least_of
from fdi.decision.judging import enough
from fdi.decision.recipes import Learned, PredictedSpread
from fdi.model.evaluate import Floats
from fdi.residuals import Residuals
from fdi.telemetry.airtime import reference_mask

MARGIN: Final = 1.25
"""A threshold stands so far above the most that healthy flights have reached."""
ENOUGH: Final = 3
"""Fewer flights do not lower a threshold."""
LEAST: Final = 0.7
MOST: Final = 5.0
"""What a scale may be."""
WIDER: Final = 0.5
"""Share of the range of the centres by which the range is widened on both sides."""


@dataclass(frozen=True, slots=True)
class Reached:
    """What one test reached on one healthy flight.

    ``scale``: the largest scale at which noise would have alarmed, None where the model states the
    bound; ``size``: there the largest size that lasted, in its unit; ``centre``: its constant, None
    where the model allows none.
    """

    scale: float | None
    size: float
    centre: float | None


def reached(
    residuals: Residuals, bounds: Bounds, air: NDArray[np.bool_], recipe: PredictedSpread
) -> dict[str, Reached]:
    """Return what the tests of a flight reached in the air, by key.

    Parameters
    ----------
    residuals : Residuals
    bounds : Bounds
        Learned from them by a recipe without anything learned before.
    air : (n,) bool
    recipe : PredictedSpread
    """
    signals = residuals.signals
    told = bounds.told
    off, size = told.strayed(residuals.values)
    reference = reference_mask(signals, recipe.reference_s)
    least = recipe.alarm_samples(signals.rate_hz)
    found = {}
    for row, generator in enumerate(residuals.bank.generators):
        known = np.isfinite(off[row]) & air
        if told.unfit[row] or known.sum() < least:
            continue
        scale, most = None, 0.0
        if told.stated[row]:
            own = size[row : row + 1, known]
            # a short alarm counts where it is strong: as judging does
            most = max(float(least_of(own, count).max()) / over for over, count in enough(least))
        else:
            one = slice(row, row + 1)
            critical = critical_scales(off[one], row, bounds, known, recipe, signals.rate_hz)
            scale = max(float(critical.max()), 0.0)
        found[key_of(residuals.bank.system, generator)] = Reached(
            scale, most, _centre(residuals.values[row], residuals.allowance[row], reference)
        )
    return found


def _centre(values: Floats, allowance: Floats, reference: NDArray[np.bool_]) -> float | None:
    known = values[reference & np.isfinite(values)]
    has_constant = (np.nan_to_num(allowance) > 0).any()
    return float(np.median(known)) if len(known) and has_constant else None


def learned_from(flights: Iterable[Mapping[str, Reached]]) -> dict[str, Learned]:
    """Return what healthy flights of one vehicle say about its tests, by key, sorted."""
    given = list(flights)
    result = {}
    for key in sorted({key for flight in given for key in flight}):
        own = [flight[key] for flight in given if key in flight]
        least = LEAST if len(own) >= ENOUGH else 1.0
        scales = [one.scale for one in own if one.scale is not None]
        scale = float(np.clip(MARGIN * max(scales), least, MOST)) if scales else 1.0
        centres = [one.centre for one in own if one.centre is not None]
        low, high = (min(centres), max(centres)) if len(centres) >= ENOUGH else (-np.inf, np.inf)
        wider = WIDER * (high - low) if np.isfinite(low) else 0.0
        result[key] = Learned(
            rounded(scale),
            rounded(MARGIN * max(one.size for one in own)),
            (rounded(low - wider), rounded(high + wider)),
        )
    return result


def rounded(value: float) -> float:
    """Return four significant digits: a person reads the file."""
    return float(f"{value:.4g}")
