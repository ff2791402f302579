"""What does a way to decide take from a policy? One value for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


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
    budget_per_hour: float | None = None
    least_scale: float = 1.0
    most_scale: float = 3.0
    method: Literal["predicted_spread"] = "predicted_spread"


@dataclass(frozen=True, slots=True)
class Rank:
    """The published threshold: the sample of rank floor(quantile * n) of |residual|."""

    quantile: float = 0.97
    negligible: float = 2.2e-16
    method: Literal["rank"] = "rank"
