"""What does ``fdi info --json`` say about a log?

In: a log. Out: plain values: who recorded it, the flights, messages with counts and rates, events,
how many parameters, and what was lost.
"""

from __future__ import annotations

import math
from typing import Any, Final

from fdi.telemetry import Log, Message

SCHEMA_VERSION: Final = 1


def log_document(log: Log) -> dict[str, Any]:
    """Return a log as plain values; numbers are finite or null."""
    return {
        "schema_version": SCHEMA_VERSION,
        "log": {
            "name": log.name,
            "sha256": log.sha256,
            "format": log.format,
            "bytes": log.bytes,
            "duration_s": _number(log.duration),
            "vehicle": log.vehicle,
            "autopilot": log.autopilot,
            "firmware": log.firmware,
            "files": [log.name],
            "system_id": log.system_id,
            "start_utc": log.clock.utc(0.0),
            "boot_offset_s": _number(log.clock.boot(0.0)),
            "flights": [
                {
                    "start_s": _number(flight.start),
                    "end_s": _number(flight.end),
                    "takeoff_s": _number(flight.takeoff),
                    "landing_s": _number(flight.landing),
                    "impact_s": _number(flight.impact),
                }
                for flight in log.flights
            ],
        },
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
                "rate_hz": _number(rate(message)),
                "start_s": _number(float(message.t[0])) if len(message) else None,
                "end_s": _number(float(message.t[-1])) if len(message) else None,
                "fields": list(message.fields),
            }
            for key, message in log.messages.items()
        ],
        "parameters": len(log.parameters),
        "events": [
            {
                "t_s": _number(event.t),
                "kind": event.kind,
                "text": event.text,
                "severity": event.severity,
                "value": _number(event.value),
            }
            for event in log.events
        ],
        "quality": [
            {
                "kind": record.kind,
                "channel": None if record.channel is None else str(record.channel),
                "start_s": _number(record.start),
                "end_s": _number(record.end),
                "count": record.count,
                "text": record.text,
            }
            for record in log.quality
        ],
    }


def rate(message: Message) -> float | None:
    """Return records per second over the message's own extent; None with fewer than two."""
    if len(message) < 2:
        return None
    extent = float(message.t[-1] - message.t[0])
    return (len(message) - 1) / extent if extent > 0 else None


def _number(value: float | None) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.9g}")
