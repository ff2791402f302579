"""What does ``fdi info --json`` say about a log?

In: a log. Out: plain values: who recorded it, the flights, messages with counts and rates, events,
how many parameters, and what was lost.
"""

from __future__ import annotations

from typing import Any, Final

from fdi.result import log_facts, number, quality_rows
from fdi.telemetry import Log, Message

SCHEMA_VERSION: Final = 1


def log_document(log: Log) -> dict[str, Any]:
    """Return a log as plain values; numbers are finite or null."""
    return {
        "schema_version": SCHEMA_VERSION,
        "log": log_facts(log),
        "sources": [
            {
                "system": source.system,
                "component": source.component,
                "frames": source.frames,
                "lost": source.lost,
                "vehicle": source.vehicle,
                "autopilot": source.autopilot,
                "chosen": source.chosen,
            }
            for source in log.sources
        ],
        "messages": [
            {
                "name": key,
                "count": len(message),
                "rate_hz": number(rate(message)),
                "start_s": number(float(message.t[0])) if len(message) else None,
                "end_s": number(float(message.t[-1])) if len(message) else None,
                "fields": list(message.fields),
            }
            for key, message in log.messages.items()
        ],
        "parameters": len(log.parameters),
        "events": [
            {
                "t_s": number(event.t),
                "kind": event.kind,
                "text": event.text,
                "severity": event.severity,
                "value": number(event.value),
            }
            for event in log.events
        ],
        "quality": quality_rows(log),
    }


def rate(message: Message) -> float | None:
    """Return records per second over the message's own extent; None with fewer than two."""
    if len(message) < 2:
        return None
    extent = float(message.t[-1] - message.t[0])
    return (len(message) - 1) / extent if extent > 0 else None
