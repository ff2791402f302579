"""What does ``fdi check --json`` say?

In: a log and its `Check`s. Out: plain values: the log, and for each check its name, verdict,
sentence, numbers and what to do about it. Numbers are finite or null. The JSON Schema is
``check.schema.json`` beside this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from fdi import __version__
from fdi.diagnosis.advising import about_check
from fdi.diagnosis.safety_net import safety_net
from fdi.methods.setup import Check
from fdi.report.advice_text import advice_rows
from fdi.report.json_text import number
from fdi.report.log_document import log_facts
from fdi.telemetry import Log

SCHEMA_VERSION: Final = 1


def check_document(log: Log, checks: Sequence[Check]) -> dict[str, Any]:
    """Return a checked set-up as plain values."""
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "log": log_facts(log),
        "checks": [
            row | {"advice": advice_rows(about_check(check, log))}
            for row, check in zip(check_rows(checks), checks, strict=True)
        ],
        "safety_net": net_rows(log),
    }


def net_rows(log: Log) -> list[dict[str, Any]]:
    """Return the settings that would not have helped as plain values."""
    return [
        {
            "word": gap.word,
            "parameter": gap.parameter,
            "value": number(gap.value),
            "means": gap.means,
            "source": gap.source,
            "address": gap.address,
        }
        for gap in safety_net(log)
    ]


def check_rows(checks: Sequence[Check]) -> list[dict[str, Any]]:
    """Return the checks of a set-up as plain values."""
    return [
        {
            "name": check.name,
            "verdict": check.verdict,
            "strikes": check.stands_out,
            "text": check.text,
            "numbers": {name: number(value) for name, value in check.numbers.items()},
        }
        for check in checks
    ]
