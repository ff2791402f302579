"""What does a way to decide take from a policy? One value for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Literal


@dataclass(frozen=True, slots=True)
class Learned:
    """What healthy flights of a vehicle say about a test.

    ``scale`` times its threshold of noise; ``stray``: how far it may stray at least, in its unit,
    beyond what the model states; ``centre``: between which constants its own lies.
    """

    scale: float = 1.0
    stray: float = 0.0
    centre: tuple[float, float] = (-inf, inf)


@dataclass(frozen=True, slots=True)
class PredictedSpread:
    """Thresholds from stated accuracies; see ``policies/default.yaml`` for each number.

    What a policy leaves out is as there, but for ``scatter_most`` and ``budget_per_hour``: without
    them scatter is not judged, and thresholds are not scaled. ``usual``: whether a test may stray
    as healthy vehicles were measured to (``straying.py``).
    """

    sigmas: float = 5.0
    persistence_s: float = 1.5
    least_samples: int = 5
    least_factor: float = 0.2
    most_factor: float = 4.0
    reference_s: float = 20.0
    block_s: float = 5.0
    mean_s: float = 10.0
    mean_least: float = 1.2
    mean_most: float = 4.0
    mean_levels: float = 6.0
    scatter_most: float | None = None
    budget_per_hour: float | None = None
    least_scale: float = 1.0
    most_scale: float = 3.0
    usual: bool = True
    learned: Mapping[str, Learned] = field(default_factory=dict, hash=False)
    method: Literal["predicted_spread"] = "predicted_spread"

    def alarm_samples(self, rate_hz: float) -> int:
        """Return how many triggers in a row are an alarm, where they are hardly beyond."""
        return max(self.least_samples, round(self.persistence_s * rate_hz))

    def mean_samples(self, rate_hz: float) -> int:
        """Return of how many samples a mean is taken."""
        return max(2, round(self.mean_s * rate_hz))


@dataclass(frozen=True, slots=True)
class Rank:
    """The published threshold: the sample of rank floor(quantile * n) of |residual|."""

    quantile: float = 0.97
    negligible: float = 2.2e-16
    method: Literal["rank"] = "rank"
