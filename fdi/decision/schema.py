"""What shape has a policy file? The spec of ``format: 1``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from fdi.methods.table import METHODS

ITS_OWN: Any = None
"""What a file leaves out: the value that a stage takes knows what that is."""


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


def _known_method(value: str) -> str:
    if value not in METHODS:
        raise ValueError(f"there is no method {value}; there are {', '.join(METHODS)}")
    return value


MethodName = Annotated[str, AfterValidator(_known_method)]


class SamplingEntry(_Entry):
    """How channels become columns on one grid."""

    rate_hz: float | None = Field(default=ITS_OWN, gt=0, le=1000)
    clock: Literal["best", "record"] = ITS_OWN
    equal_stamps: Literal["last", "mean"] = ITS_OWN
    extrapolate: bool = ITS_OWN
    unwrap: bool = ITS_OWN
    hold_discrete: bool = ITS_OWN
    gap_factor: float = Field(default=ITS_OWN, gt=1, allow_inf_nan=True)
    gap_min_s: float = Field(default=ITS_OWN, ge=0)


class DifferentiationEntry(_Entry):
    """How derivatives are taken."""

    method: Literal["local_line", "backward_from_zero"] = ITS_OWN
    window_s: float = Field(default=ITS_OWN, gt=0)
    imaginary: Literal["unknown", "real_part"] = ITS_OWN


class PredictedSpreadEntry(_Entry):
    """Thresholds from stated accuracies."""

    method: Literal["predicted_spread"]
    sigmas: float = Field(default=ITS_OWN, gt=0)
    persistence_s: float = Field(default=ITS_OWN, ge=0)
    least_samples: int = Field(default=ITS_OWN, ge=1)
    least_factor: float = Field(default=ITS_OWN, gt=0, le=1)
    most_factor: float = Field(default=ITS_OWN, ge=1)
    reference_s: float = Field(default=ITS_OWN, gt=0)
    block_s: float = Field(default=ITS_OWN, gt=0)
    mean_s: float = Field(default=ITS_OWN, gt=0)
    mean_least: float = Field(default=ITS_OWN, gt=0)
    mean_most: float = Field(default=ITS_OWN, gt=0)
    mean_levels: float = Field(default=ITS_OWN, gt=0)
    scatter_most: float | None = Field(default=ITS_OWN, gt=1, lt=10)
    budget_per_hour: float | None = Field(default=ITS_OWN, ge=0.01, le=100)
    least_scale: float = Field(default=ITS_OWN, ge=0)
    most_scale: float = Field(default=ITS_OWN, ge=1)
    usual: bool = ITS_OWN


class RankEntry(_Entry):
    """Thresholds by rank, as published."""

    method: Literal["rank"]
    quantile: float = Field(default=ITS_OWN, gt=0, lt=1)
    negligible: float = Field(default=ITS_OWN, ge=0)


class LearnedEntry(_Entry):
    """What healthy flights say about a test; ``centre`` null where they say nothing."""

    scale: float = Field(default=1.0, gt=0, le=100)
    stray: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    centre: tuple[float, float] | None = None


class ParameterEntry(_Entry):
    """What so many flights told of a parameter of the model, and its standard deviation."""

    value: float
    std: float = Field(gt=0)
    flights: int = Field(ge=1)


class CalibrationEntry(_Entry):
    """For which vehicle the tests were learned, and from what."""

    model: str
    vehicle: str
    flights: list[str]
    hours: float = Field(gt=0)
    parameters: dict[str, ParameterEntry] = {}
    tests: dict[str, LearnedEntry]


class PolicyFile(_Entry):
    """A whole file."""

    format: Literal[1]
    name: str
    description: str = ""
    tests: Literal["mtes", "mtes+cross_checks", "selected"]
    sampling: SamplingEntry
    differentiation: DifferentiationEntry
    decision: Annotated[PredictedSpreadEntry | RankEntry, Field(discriminator="method")]
    marking: Literal["majority", "all_residuals"]
    accuse: bool = ITS_OWN
    copies: Literal["dropped", "kept"] = ITS_OWN
    latencies: Literal["estimated", "stated"] = ITS_OWN
    accuracies: Literal["reported", "stated"] = ITS_OWN
    commands: Literal["used", "left_out"] = ITS_OWN
    integrate: bool = ITS_OWN
    methods: list[MethodName] = ITS_OWN
    calibration: CalibrationEntry | None = None
