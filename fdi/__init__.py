"""Finds out from a flight's telemetry which component failed first.

``fdi.analyze("flight.tlog")`` is the whole chain; every stage can be used alone. Names are resolved
on first use, so that ``import fdi`` loads nothing but this file.
"""

from __future__ import annotations

TYPE_CHECKING = False  # what `typing` has, without the 8 ms that it takes to load
if TYPE_CHECKING:
    from typing import Any

    from fdi.analysis import analyze
    from fdi.chain import residuals_of
    from fdi.comparison import compare
    from fdi.decision import load_policy
    from fdi.diagnosis import diagnose
    from fdi.errors import FdiError, LogError, ModelError, OutputError, UsageError
    from fdi.methods.voting import vote
    from fdi.model import load_airframe
    from fdi.residuals import build_bank
    from fdi.result import Analysis
    from fdi.telemetry import log_from_columns, read

_HOMES = {
    "Analysis": "fdi.result",
    "FdiError": "fdi.errors",
    "LogError": "fdi.errors",
    "ModelError": "fdi.errors",
    "OutputError": "fdi.errors",
    "UsageError": "fdi.errors",
    "analyze": "fdi.analysis",
    "build_bank": "fdi.residuals",
    "compare": "fdi.comparison",
    "diagnose": "fdi.diagnosis",
    "load_airframe": "fdi.model",
    "load_policy": "fdi.decision",
    "log_from_columns": "fdi.telemetry",
    "read": "fdi.telemetry",
    "residuals_of": "fdi.chain",
    "vote": "fdi.methods.voting",
}

_ROOMS = ("decision", "diagnosis", "methods", "model", "residuals", "structure", "telemetry")
"""What `fdi.structure.Model` and its like are reached by, without an import of their own."""

__version__ = "0.2.0"
__all__ = [
    "Analysis",
    "FdiError",
    "LogError",
    "ModelError",
    "OutputError",
    "UsageError",
    "analyze",
    "build_bank",
    "compare",
    "diagnose",
    "load_airframe",
    "load_policy",
    "log_from_columns",
    "read",
    "residuals_of",
    "vote",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES and name not in _ROOMS:
        raise AttributeError(f"module 'fdi' has no attribute {name!r}")
    from importlib import import_module

    if name in _ROOMS:
        return import_module(f"fdi.{name}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, *_ROOMS, "__version__"])
