"""Which way to decide does a policy name? The ways, one function each.

``predicted_spread``: beyond what stated accuracies and the flight's own noise explain
(``judging.py``), with thresholds that keep the policy's budget of false accusations
(``budget.py``).

``rank``: the published threshold, the sample of a given rank, so that 3 % of the samples trigger
whatever happens; every trigger is an alarm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from fdi.decision.alarms import QUIET, TRIGGERED, Alarms, Use
from fdi.decision.budget import decide_within_budget
from fdi.decision.judging import frozen, states
from fdi.decision.recipes import PredictedSpread, Rank
from fdi.residuals import Residuals


def by_rank(recipe: Rank, residuals: Residuals, use: Use) -> Alarms:
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
    state = states(size, threshold)
    is_zero = np.nan_to_num(size).max(axis=1, initial=0.0) < recipe.negligible
    state[is_zero[:, None] & (state == TRIGGERED)] = QUIET
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        strength = np.minimum(size / threshold, 1e6)
    raised = state == TRIGGERED
    unknown = np.full(size.shape, np.nan)
    return frozen(
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
        stray=np.zeros(len(size)),
        scatter=unknown,
    )


Recipe = type[PredictedSpread] | type[Rank]

DETECTORS: Final[Mapping[str, tuple[Recipe, Callable[..., Alarms]]]] = {
    "predicted_spread": (PredictedSpread, decide_within_budget),
    "rank": (Rank, by_rank),
}
"""By name the recipe that a way to decide takes from a policy, and the function."""
