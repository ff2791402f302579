"""What does ``fdi compare --json`` say? Plain values; numbers are finite or null."""

from __future__ import annotations

from typing import Any, Final

from fdi import __version__
from fdi.comparison import Comparison
from fdi.report.json_text import number

SCHEMA_VERSION: Final = 1


def comparison_document(found: Comparison) -> dict[str, Any]:
    """Return a comparison as plain values."""
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "vehicle": found.vehicle,
        "model": found.model,
        "logs": list(found.logs),
        "flights": [
            {
                "name": one.name,
                "log": one.log,
                "flight": one.flight,
                "start_s": number(one.start),
                "has_takeoff": one.has_takeoff,
                "seconds": number(one.seconds),
                "accused": list(one.accused),
                "healthy": one.is_healthy,
            }
            for one in found.flights
        ],
        "tests": [
            {
                "statement": test.statement,
                "text": test.text,
                "equations": list(test.equations),
                "unit": test.unit,
                "ids": list(test.ids),
                "way": test.way,
                "constants": [number(float(one.constant[row])) for one in found.courses],
            }
            for row, test in enumerate(found.tests)
        ],
        "differences": [
            {
                "test": one.test,
                "flight": one.flight,
                "bands": number(one.bands),
                "since_s": number(one.since),
                "at_s": number(one.at),
                "value": number(one.value),
                "band": [number(one.middle - one.half), number(one.middle + one.half)],
            }
            for one in found.differences
        ],
        "parameters": [
            {"name": one.name, "values": [number(value) for value in one.values]}
            for one in found.settings
        ],
        "identified": [
            {
                "name": one.name,
                "unit": one.unit,
                "values": [number(value) for value in one.values],
                "stds": [number(value) for value in one.stds],
            }
            for one in found.identified
        ],
        "notes": list(found.notes),
    }
