"""Which residuals are beyond their threshold, and when? The value of the decide stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fdi.residuals import Residuals
from fdi.shown import Shown

QUIET, TRIGGERED, UNKNOWN = 0, 1, -1


Marking = Literal["majority", "all_residuals"]


@dataclass(frozen=True, slots=True)
class Use:
    """What the diagnosis is to make of alarms: when it marks a fault, and whether it accuses.

    ``mean_s``: how long a change must last to show whole, in the means where these are taken.
    ``sigmas``: by how many standard deviations of noise a stated limit must be exceeded.
    """

    marking: Marking
    accuse: bool
    mean_s: float
    sigmas: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Alarms(Shown):
    """For every residual: triggered, quiet or unknown over time; rows as the bank's generators.

    Attributes
    ----------
    use : Use
        The policy's word to the diagnosis.
    threshold : (r, n) float
        In each residual's unit; NaN where it cannot be stated.
    centre : (r,) float
        The constant that was taken off before comparing.
    state : (r, n) int8
        1 triggered, 0 quiet, -1 unknown.
    alarm : (r, n) bool
        Triggers that persisted, from their first sample on.
    strength : (r, n) float
        ``|residual - centre|`` over threshold, or ``|mean|`` or scatter over its own where that is
        more; above one where triggered.
    certain : (r, n) bool
        The samples of an alarm from which on it is certain.
    delay_s : (r,) float
        How long after a sample the data that judging it needs are complete.
    unfit : (r,) bool
        Tests that do not hold from the beginning of the flight on: a condition, not an event. They
        are not judged.
    mean, mean_threshold : (r, n) float
        The trailing mean that shows what is small but lasts, and its threshold, in each residual's
        unit; NaN where it is not judged.
    stray : (r,) float
        In each residual's unit, what it may stray at least, whatever less the model states.
    scatter : (r, n) float
        How much a test has scattered over the last seconds, times what it did at first; NaN where
        that is not judged.
    scatter_most : float
        What that may be.
    scale : float
        Of the thresholds of noise, for the policy's budget of false accusations.
    """

    residuals: Residuals
    use: Use
    threshold: NDArray[np.float64]
    centre: NDArray[np.float64]
    state: NDArray[np.int8]
    alarm: NDArray[np.bool_]
    strength: NDArray[np.float64]
    certain: NDArray[np.bool_]
    delay_s: NDArray[np.float64]
    unfit: NDArray[np.bool_]
    mean: NDArray[np.float64]
    mean_threshold: NDArray[np.float64]
    stray: NDArray[np.float64]
    scatter: NDArray[np.float64]
    scatter_most: float = float("inf")
    scale: float = 1.0

    @property
    def allowed(self) -> NDArray[np.float64]:
        """Return how far each residual may stray for as long as it likes, (r, n), in its unit."""
        return np.maximum(self.residuals.lasting, self.stray[:, None])

    def __repr__(self) -> str:
        raised = int(self.alarm.any(axis=1).sum())
        return f"<Alarms: {raised} of {len(self.alarm)} residuals raised one>"
