"""What does ``fdi info --json`` say about a log, and ``metadata.json`` of ``fdi convert``?

In: a log. Out: plain values: who recorded it, its clock, the flights, messages with fields, counts
and rates, parameters and their changes, events, and what was lost. The JSON Schema is
``log.schema.json`` beside this file.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fdi import __version__
from fdi.report.json_text import number
from fdi.telemetry import Clock, Log, Message

SCHEMA_VERSION: Final = 1
BURST_S: Final = 1.0
BURST_PERIOD_S: Final = 0.01
"""Records of a shorter time and closer together are a burst (a download, definitions)."""
LEAST_RECORDS: Final = 5
SAMPLE: Final = 50_000
"""Steps that tell the median of millions."""
LEAST_REGULAR: Final = 0.5
"""Of the extent, what the median period must account for; what comes now and then has no rate."""


def log_document(log: Log) -> dict[str, Any]:
    """Return a log as plain values; numbers are finite or null."""
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "log": log_facts(log),
        "clock": _clock(log.clock),
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
        "messages": [_message(key, message) for key, message in log.messages.items()],
        "parameters": {name: number(value) for name, value in log.parameters.items()},
        "parameter_defaults": {name: number(value) for name, value in log.defaults.items()},
        "parameter_changes": [
            {"t_s": number(c.t), "name": c.name, "old": number(c.old), "new": number(c.new)}
            for c in log.parameter_changes
        ],
        "events": [
            {
                "t_s": number(event.t),
                "kind": event.kind,
                "text": event.text,
                "severity": event.severity,
                "value": number(event.value),
                "by": event.by,
            }
            for event in log.events
        ],
        "stretches": [
            {
                "start_s": number(one.start),
                "end_s": number(one.end),
                "what": one.what,
                "sure": number(one.sure),
            }
            for one in log.stretches
        ],
        "inputs": input_rows(log),
        "quality": quality_rows(log),
    }


def log_facts(log: Log) -> dict[str, Any]:
    """Return what is said about a log itself: its name, vehicle, clock and flights."""
    return {
        "name": log.name,
        "sha256": log.sha256,
        "format": log.format,
        "bytes": log.bytes,
        "duration_s": number(log.duration),
        "vehicle": log.vehicle,
        "autopilot": log.autopilot,
        "firmware": log.firmware,
        "files": list(log.files),
        "recordings": [
            {
                "name": one.name,
                "format": one.format,
                "bytes": one.bytes,
                "sha256": one.sha256,
                "offset_s": number(one.offset),
                "uncertainty_s": number(one.uncertainty),
                "placed_by": one.placed_by,
                "end_s": number(one.end),
                "messages": list(one.messages),
                "added": {key: list(fields) for key, fields in one.added.items()},
            }
            for one in log.recordings
        ],
        "system_id": log.system_id,
        "start_utc": log.clock.utc(0.0),
        "boot_offset_s": number(log.clock.boot(0.0)),
        "flights": [
            {
                "start_s": number(flight.start),
                "end_s": number(flight.end),
                "takeoff_s": number(flight.takeoff),
                "landing_s": number(flight.landing),
                "impact_s": number(flight.impact),
            }
            for flight in log.flights
        ],
    }


def quality_rows(log: Log) -> list[dict[str, Any]]:
    """Return what was lost or repaired in a log, a row each."""
    return [
        {
            "kind": record.kind,
            "channel": None if record.channel is None else str(record.channel),
            "start_s": number(record.start),
            "end_s": number(record.end),
            "count": record.count,
            "text": record.text,
        }
        for record in log.quality
    ]


def input_rows(log: Log) -> list[dict[str, Any]]:
    """Return which inputs of tests are believed in a log, a row each."""
    return [
        {
            "name": one.name,
            "channels": list(one.channels),
            "believed": one.believed,
            "why": one.why,
            "left_out": number(one.left_out),
        }
        for one in log.inputs
    ]


def moment(t: float | None, log: Log) -> dict[str, Any] | None:
    """Return a time of the log's clock with what it is since boot and in UTC."""
    if t is None:
        return None
    return {"log_s": number(t), "boot_s": number(log.clock.boot(t)), "utc": log.clock.utc(t)}


def rate(message: Message) -> float | None:
    """Return records per second, Hz; None for a burst and for what comes now and then.

    It is the rate that the message has while it comes (by its median period), whatever the gaps.
    """
    if len(message) < LEAST_RECORDS:
        return None
    steps = np.diff(message.t)
    period = float(np.median(steps[:: steps.size // SAMPLE + 1]))
    extent = float(message.t[-1] - message.t[0])
    if extent < BURST_S and period < BURST_PERIOD_S:
        return None
    known = period * (len(message) - 1) / extent
    return 1 / period if LEAST_REGULAR <= known <= 1 / LEAST_REGULAR else None


def _message(key: str, message: Message) -> dict[str, Any]:
    return {
        "name": key,
        "count": len(message),
        "rate_hz": number(rate(message)),
        "start_s": number(float(message.t[0])) if len(message) else None,
        "end_s": number(float(message.t[-1])) if len(message) else None,
        "fields": {
            name: None if column.is_text else column.conversion.unit
            for name, column in message.columns.items()
        },
        "made_from": message.made_from,
    }


def _clock(clock: Clock) -> dict[str, Any]:
    """Return what is added to t to have seconds since boot and since 1970, a row per boot."""
    return {
        "utc_source": clock.utc_source,
        "boot_uncertainty_s": number(clock.boot_uncertainty),
        "utc_uncertainty_s": number(clock.utc_uncertainty),
        "pieces": [
            {"start_s": number(start), "boot_offset_s": _exact(boot), "utc_offset_s": _exact(utc)}
            for start, boot, utc in zip(
                clock.start.tolist(),
                clock.boot_offset.tolist(),
                clock.utc_offset.tolist(),
                strict=True,
            )
        ],
    }


def _exact(seconds: float) -> float | None:
    """Return seconds to the microsecond: nine digits would be a second of UTC."""
    return round(seconds, 6) if np.isfinite(seconds) else None
