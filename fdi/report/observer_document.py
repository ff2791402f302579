"""What does ``fdi observe --json`` say?

In: a log and its `Observation`. Out: plain values: the log, the observer with its vehicle, each
residual with its centre, noise and largest excess, alarms, motors that are named. Numbers are
finite or null. The JSON Schema is ``observer.schema.json`` beside this file.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fdi import __version__
from fdi.methods.observer import Observation
from fdi.methods.observer.states import RESIDUALS, UNITS
from fdi.report.json_text import number
from fdi.report.log_document import log_facts
from fdi.telemetry import Log

SCHEMA_VERSION: Final = 1


def observer_document(log: Log, seen: Observation) -> dict[str, Any]:
    """Return what an observer says of a flight as plain values."""
    observer, vehicle = seen.observer, seen.observer.vehicle
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "log": log_facts(log),
        "observer": {
            "outputs_from": seen.rows.source,
            "outputs": list(observer.outputs),
            "gain": observer.gain,
            "flight": seen.flight,
            "air_s": [number(t) for t in seen.air],
            "calm_s": number(float(seen.limits.since)),
            "vehicle": {
                "name": vehicle.name,
                "mass_kg": number(vehicle.mass),
                "inertia_kg_m2": [number(one) for one in vehicle.inertia],
                "arm_m": number(vehicle.arm),
                "torque_per_thrust_m": number(vehicle.torque_per_thrust),
                "thrust_max_n": number(vehicle.thrust_max),
                "motors": len(seen.rows.motors),
            },
        },
        "residuals": _residuals(seen),
        "alarms": [
            {
                "residual": one.residual,
                "start_s": number(one.start),
                "end_s": number(one.end),
                "peak": number(one.peak),
                "threshold": number(one.threshold),
            }
            for one in seen.alarms
        ],
        "weak_motors": [
            {
                "component": f"motor_{one.number}",
                "start_s": number(one.start),
                "end_s": number(one.end),
            }
            for one in seen.motors
        ],
        "notes": list(seen.notes),
    }


def _residuals(seen: Observation) -> list[dict[str, Any]]:
    off = np.abs(seen.off)
    in_alarm = {alarm.residual for alarm in seen.alarms}
    found = []
    for row, name in enumerate(RESIDUALS):
        judged = np.isfinite(off[row]) & np.isfinite(seen.threshold[row])
        known = bool(judged.any())
        own, limit = off[row][judged], seen.threshold[row][judged]
        ratio = float((own / limit).max()) if known else None
        found.append(
            {
                "name": name,
                "unit": UNITS[name],
                "centre": number(float(seen.limits.centre[row])) if known else None,
                "deviation": number(float(seen.limits.deviation[row])) if known else None,
                "largest": number(float(own.max())) if known else None,
                "largest_over_threshold": number(ratio),
                "state": _state(ratio, is_in_alarm=name in in_alarm),
            }
        )
    return found


def _state(ratio: float | None, *, is_in_alarm: bool) -> str:
    if ratio is None:
        return "unknown"
    if is_in_alarm:
        return "beyond"
    return "briefly beyond" if ratio > 1.0 else "within"
