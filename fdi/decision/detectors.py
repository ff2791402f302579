"""When is a residual beyond what health explains? The ways to decide, one function each.

``predicted_spread``: |residual - centre| beyond the tolerance plus a number of standard deviations
that the stated accuracies predict at that very sample, widened by what the calm part shows; a
trigger that persists is an alarm, and the stronger it is the sooner. What is small but lasts shows
in the trailing mean, whose threshold is what means of that length reach in this flight.

``rank``: the published threshold, the sample of a given rank, so that 3 % of the samples trigger
whatever happens; every trigger is an alarm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.decision.alarms import QUIET, TRIGGERED, UNKNOWN, Alarms, Use
from fdi.decision.noise import (
    airborne_mask,
    centres,
    reference_mask,
    settled_mask,
    spread_factors,
    trailing_mean,
)
from fdi.model.evaluate import wrap
from fdi.model.parts import Kind
from fdi.residuals import Residuals

SOONER: Final = ((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))
"""(strength, share of the persistence that is enough beyond it)."""
CLIP: Final = 5.0
"""Standard deviations; more in one sample counts as much in a mean."""
KNOWN_SHARE: Final = 0.7
"""Of the samples of a mean."""
STANDING: Final = 0.8
"""A limit violated for this share of the flight's beginning is a condition."""
CALM_SHARE: Final = 0.4
"""Quantile of the means that tells the flight's own level: a fault may fill half of the flight."""
ROUGHER: Final = 3.0
"""So much more than in its first third a healthy flight may shake later."""
BEGUN: Final = 0.5
"""Share of a mean beyond its threshold that marks where it began."""


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
    mean_s: float = 10.0
    mean_least: float = 1.0
    mean_most: float = 4.0
    mean_levels: float = 5.0
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
    # A residual is right minus left: below zero where the left side is above.
    for row, equation in enumerate(equations):
        if equation.side:
            size[row] = np.maximum(-off[row] if equation.side == "above" else off[row], 0.0)
            off[row] = np.where(np.isfinite(off[row]), size[row], np.nan)
    deviation = np.maximum(size - tolerance, 0.0)
    block = max(3, round(recipe.block_s * signals.rate_hz))
    calm = airborne_mask(signals)
    factor = spread_factors(deviation, spread, calm, block)
    factor = np.clip(np.nan_to_num(factor, nan=1.0), recipe.least_factor, recipe.most_factor)
    factor = np.where(bounded, 1.0, factor)
    with np.errstate(invalid="ignore"):
        unfit = spread_factors(deviation, spread, reference, block) > recipe.most_factor
    unfit = np.where(bounded, _stands(size, reference), unfit)
    threshold = tolerance + recipe.sigmas * factor[:, None] * spread
    settled = settled_mask(signals)
    mean, mean_threshold, beyond = _means(
        off, tolerance, spread, settled, bounded, recipe, signals.rate_hz
    )
    state = _states(size, threshold)
    state[unfit] = UNKNOWN
    mean[unfit] = np.nan
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        fast = np.where(state == UNKNOWN, np.nan, size / threshold)
        slow = np.abs(mean) / mean_threshold
    least = max(recipe.least_samples, round(recipe.persistence_s * signals.rate_hz))
    # without a stated spread nothing says how much beyond a threshold is much
    graded = np.where(spread > 0, fast, np.minimum(fast, SOONER[1][0]))
    sudden, known_sudden = _sudden(graded, state, least)
    lasting, known_lasting = _lasting(beyond, slow, mean, round(recipe.mean_s * signals.rate_hz))
    state[lasting & (state == QUIET)] = TRIGGERED
    strength = np.fmax(fast, slow)
    strength = np.where(state == TRIGGERED, np.minimum(strength, 1e6), strength)
    return _frozen(
        residuals,
        use,
        threshold=threshold,
        centre=centre,
        state=state,
        alarm=sudden | lasting,
        strength=strength,
        certain=known_sudden | known_lasting,
        delay_s=residuals.delay_s.copy(),
        unfit=unfit,
        mean=mean,
        mean_threshold=mean_threshold,
    )


def _stands(excess: NDArray[np.float64], reference: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which limits are violated from the beginning of the flight on."""
    early = excess[:, reference]
    with np.errstate(invalid="ignore"):
        over = (early > 0).sum(axis=1)
    return np.asarray((over > 0) & (over >= STANDING * early.shape[1]))


def _sudden(
    strength: NDArray[np.float64], state: NDArray[np.int8], least: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the triggers that persist, and from where on that is certain."""
    unknown = state == UNKNOWN
    alarm, certain = np.zeros(state.shape, bool), np.zeros(state.shape, bool)
    for over, share in SOONER:
        count = max(2, round(share * least))
        for row, own in enumerate(strength > over):
            found, sure = persistent(own, unknown[row], count)
            alarm[row] |= found
            certain[row] |= sure
    return alarm, certain


def _means(
    off: NDArray[np.float64],
    tolerance: NDArray[np.float64],
    spread: NDArray[np.float64],
    settled: NDArray[np.bool_],
    bounded: list[bool],
    recipe: PredictedSpread,
    rate_hz: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the trailing means in the air and their thresholds, and what they are means of.

    A mean is taken of the residual over its predicted spread, clipped, so that neither a single
    outlier nor a manoeuvre, in which residuals and spread swell together, decides.
    """
    beyond = np.sign(off) * np.maximum(np.abs(off) - tolerance, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.clip(np.where(spread > 0, beyond / spread, np.nan), -CLIP, CLIP)
    ratio[:, ~settled] = np.nan
    ratio[np.array(bounded, bool)] = np.nan
    count = max(2, round(recipe.mean_s * rate_hz))
    mean = trailing_mean(ratio, count, round(KNOWN_SHARE * count))
    scale = trailing_mean(np.where(np.isfinite(ratio), spread, np.nan), count, 1)
    bound = np.full(len(ratio), np.nan)
    for row, own in enumerate(np.abs(mean)):
        known = own[np.isfinite(own)]
        if len(known):
            first = known[: max(count, len(known) // 3)]
            level, early = (float(np.quantile(part, CALM_SHARE)) for part in (known, first))
            level, early = recipe.mean_levels * level, recipe.mean_levels * early
            # A fault may fill most of the flight, but not its first third as well: there means as
            # large as this are the test's nature, and no mean is judged.
            if early <= recipe.mean_most:
                level = min(level, ROUGHER * early)
                bound[row] = np.clip(level, recipe.mean_least, recipe.mean_most)
    return mean * scale, bound[:, None] * scale, beyond


def _lasting(
    beyond: NDArray[np.float64],
    strength: NDArray[np.float64],
    mean: NDArray[np.float64],
    count: int,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where a mean is beyond its threshold, from beginning to end, and where certainly."""
    with np.errstate(invalid="ignore"):
        over = strength > 1.0
    alarm, certain = np.zeros(over.shape, bool), np.zeros(over.shape, bool)
    for row in np.flatnonzero(over.any(axis=1)):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], over[row], [False]]).astype(int)))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            # half of what the mean has reached, seen over a short while, bounds it on both sides
            low = max(0, start - 2 * count)
            side = np.sign(mean[row, start]) * beyond[row, low:stop]
            short = trailing_mean(side[None], max(1, count // 6), 1)[0]
            is_there = short > BEGUN * abs(mean[row, start])
            before = np.flatnonzero(~is_there[: start - low + 1])
            first = low + (int(before[-1]) + 1 if len(before) else 0)
            there = np.flatnonzero(is_there[start - low :])
            last = int(start + there[-1] if len(there) else start)
            alarm[row, min(first, last) : last + 1] = True
            certain[row, start : last + 1] = True
    return alarm, certain


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
    raised = state == TRIGGERED
    unknown = np.full(size.shape, np.nan)
    return _frozen(
        residuals,
        use,
        threshold=threshold,
        centre=np.zeros(len(size)),
        state=state,
        alarm=raised,
        strength=strength,
        certain=raised,
        delay_s=np.zeros(len(size)),
        unfit=np.zeros(len(size), bool),
        mean=unknown,
        mean_threshold=unknown,
    )


def _states(size: NDArray[np.float64], threshold: NDArray[np.float64]) -> NDArray[np.int8]:
    unknown = ~np.isfinite(size) | ~np.isfinite(threshold)
    state = np.where(size > threshold, TRIGGERED, QUIET)
    return np.where(unknown, UNKNOWN, state).astype(np.int8)


def persistent(
    triggered: NDArray[np.bool_], unknown: NDArray[np.bool_], least: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the triggers that belong to a run of at least ``least``, and those that complete one.

    Parameters
    ----------
    triggered, unknown : (n,) bool
        An unknown sample neither ends a run nor counts for it.
    least : int

    Examples
    --------
    >>> on = np.array([1, 1, 0, 1, 1, 1, 1], bool)
    >>> run, complete = persistent(on, np.zeros(7, bool), 3)
    >>> run.astype(int).tolist(), complete.astype(int).tolist()
    ([0, 0, 0, 1, 1, 1, 1], [0, 0, 0, 0, 0, 1, 1])
    """
    known = np.flatnonzero(~unknown)
    result, complete = np.zeros(len(triggered), bool), np.zeros(len(triggered), bool)
    on = triggered[known]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(np.int8)))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start >= least:
            result[known[start] : known[end - 1] + 1] = True
            complete[known[start + least - 1] : known[end - 1] + 1] = True
    return result, complete


def _frozen(residuals: Residuals, use: Use, **arrays: Any) -> Alarms:
    for array in arrays.values():
        array.flags.writeable = False
    return Alarms(residuals, use, **arrays)


@dataclass(frozen=True, slots=True)
class Detector:
    """A way to decide: the recipe it takes from a policy, and the function."""

    recipe: type[PredictedSpread] | type[Rank]
    decide: Callable[..., Alarms]


DETECTORS: Final[Mapping[str, Detector]] = {
    "predicted_spread": Detector(PredictedSpread, by_predicted_spread),
    "rank": Detector(Rank, by_rank),
}
