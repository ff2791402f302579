"""When is a residual beyond what health explains? The ways to decide, one function each.

``predicted_spread``: |residual - centre| beyond the tolerance plus a number of standard deviations
that the stated accuracies predict at that very sample, widened by what the calm part shows; a
trigger that persists is an alarm. ``rank``: the published threshold, the sample of a given rank, so
that 3 % of the samples trigger whatever happens; every trigger is an alarm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.decision.alarms import QUIET, TRIGGERED, UNKNOWN, Alarms, Use
from fdi.decision.noise import airborne_mask, centres, reference_mask, spread_factors
from fdi.model.evaluate import wrap
from fdi.model.parts import Kind
from fdi.residuals import Residuals


@dataclass(frozen=True, slots=True)
class PredictedSpread:
    """Thresholds from stated accuracies; see ``policies/default.yaml`` for each number."""

    sigmas: float = 4.0
    persistence_s: float = 1.5
    least_samples: int = 3
    least_factor: float = 0.3
    most_factor: float = 4.0
    reference_s: float = 20.0
    block_s: float = 5.0
    method: Literal["predicted_spread"] = "predicted_spread"


@dataclass(frozen=True, slots=True)
class Rank:
    """The published threshold: the sample of rank floor(quantile * n) of |residual|."""

    quantile: float = 0.97
    negligible: float = 2.2e-16
    method: Literal["rank"] = "rank"


def by_predicted_spread(residuals: Residuals, recipe: PredictedSpread, use: Use) -> Alarms:
    """Return the alarms of residuals that leave their predicted spread."""
    signals = residuals.signals
    values, spread = residuals.values, residuals.spread
    tolerance = residuals.tolerance[:, None]
    reference = reference_mask(signals, recipe.reference_s)
    equations = [residuals.bank.system.equations[g.residual] for g in residuals.bank.generators]
    # A limit states its bound itself, and within it the residual is zero: nothing to learn there.
    bounded = [equation.kind is Kind.LIMIT for equation in equations]
    centre = np.where(bounded, 0.0, centres(values, residuals.allowance, reference))
    off = values - centre[:, None]
    circular = np.array([equation.circular for equation in equations], dtype=bool)
    off[circular] = wrap(off[circular])
    size = np.abs(off)
    deviation = np.maximum(size - tolerance, 0.0)
    block = max(3, round(recipe.block_s * signals.rate_hz))
    calm = airborne_mask(signals)
    factor = spread_factors(deviation, spread, calm, block, recipe.least_factor, recipe.most_factor)
    factor = np.where(bounded, 1.0, factor)
    threshold = tolerance + recipe.sigmas * factor[:, None] * spread
    state = _states(size, threshold)
    least = max(recipe.least_samples, round(recipe.persistence_s * signals.rate_hz))
    alarm = np.array([persistent(row == TRIGGERED, row == UNKNOWN, least) for row in state], bool)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        strength = size / threshold
    strength = np.where(state == TRIGGERED, np.minimum(strength, 1e6), strength)
    confirm = residuals.delay_s + (least - 1) / signals.rate_hz
    return _alarms(residuals, use, threshold, centre, state, alarm, strength, confirm)


def by_rank(residuals: Residuals, recipe: Rank, use: Use) -> Alarms:
    """Return the alarms of residuals beyond the sample of a given rank, as published.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, section IV: a residual triggers above the 97th
    percentile of its own absolute value over the window.
    """
    size = np.abs(residuals.values)
    threshold = np.full(size.shape, np.nan)
    for row, own in enumerate(size):
        known = np.sort(own[np.isfinite(own)])
        if len(known):
            rank = max(1, int(np.floor(recipe.quantile * len(known))))
            threshold[row] = known[rank - 1]
    state = _states(size, threshold)
    is_zero = np.nan_to_num(size).max(axis=1, initial=0.0) < recipe.negligible
    state[is_zero[:, None] & (state == TRIGGERED)] = QUIET
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        strength = np.minimum(size / threshold, 1e6)
    zero = np.zeros(len(size))
    return _alarms(
        residuals, use, threshold, zero, state, state == TRIGGERED, strength, zero.copy()
    )


def _states(size: NDArray[np.float64], threshold: NDArray[np.float64]) -> NDArray[np.int8]:
    unknown = ~np.isfinite(size) | ~np.isfinite(threshold)
    state = np.where(size > threshold, TRIGGERED, QUIET)
    return np.where(unknown, UNKNOWN, state).astype(np.int8)


def persistent(
    triggered: NDArray[np.bool_], unknown: NDArray[np.bool_], least: int
) -> NDArray[np.bool_]:
    """Return the triggers that belong to a run of at least ``least``.

    Parameters
    ----------
    triggered, unknown : (n,) bool
        An unknown sample neither ends a run nor counts for it.
    least : int

    Examples
    --------
    >>> on = np.array([1, 1, 0, 1, 1, 1], bool)
    >>> persistent(on, np.zeros(6, bool), 3).astype(int).tolist()
    [0, 0, 0, 1, 1, 1]
    """
    known = np.flatnonzero(~unknown)
    result = np.zeros(len(triggered), dtype=bool)
    on = triggered[known]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(np.int8)))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start >= least:
            result[known[start] : known[end - 1] + 1] = True
    return result


def _alarms(
    residuals: Residuals,
    use: Use,
    threshold: NDArray[np.float64],
    centre: NDArray[np.float64],
    state: NDArray[np.int8],
    alarm: NDArray[np.bool_],
    strength: NDArray[np.float64],
    confirm: NDArray[np.float64],
) -> Alarms:
    alarm = alarm.reshape(state.shape)
    for array in (threshold, centre, state, alarm, strength, confirm):
        array.flags.writeable = False
    return Alarms(residuals, use, threshold, centre, state, alarm, strength, confirm)


@dataclass(frozen=True, slots=True)
class Detector:
    """A way to decide: the recipe it takes from a policy, and the function."""

    recipe: type[PredictedSpread] | type[Rank]
    decide: Callable[..., Alarms]


DETECTORS: Final[Mapping[str, Detector]] = {
    "predicted_spread": Detector(PredictedSpread, by_predicted_spread),
    "rank": Detector(Rank, by_rank),
}
