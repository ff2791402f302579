"""Rows of ``fdi batch`` as a few flights of one vehicle give them, without an analysis."""

from typing import Any

import numpy as np

from fdi.fleet import Job, lost

SENSORS = "COMPASS_DEV_ID=97539"


def finding(component: str, **changes: Any) -> dict[str, Any]:
    told = {
        "rank": 1,
        "flight": 0,
        "component": component,
        "faults": [f"{component}.weak"],
        "kind": "step",
        "onset_s": 34.5,
        "onset_boot_s": 65.0,
        "alarm_s": 36.0,
        "end_s": None,
        "confidence": 0.93,
        "because": [],
        "rivals": [],
        "text": f"{component} is weak",
    }
    return {**told, **changes}


def trend(part: str, value: float, std: float = 0.01, quantity: str = "thrust_share") -> Any:
    return {
        "quantity": quantity,
        "part": part,
        "flight": 0,
        "value": value,
        "std": std,
        "unit": "",
    }


def row(path: str, **changes: Any) -> dict[str, Any]:
    t = np.linspace(0.0, 90.0, 60)
    curve = {"t": t.round(1).tolist(), "value": (20 * np.sin(t / 30)).round(3).tolist()}
    told = {
        "format": "tlog",
        "sha256": "ab" * 32,
        "bytes": 12345,
        "duration_s": 90.0,
        "start_utc": "2024-06-10T06:14:11.425Z",
        "vehicle": "quad",
        "autopilot": "ardupilot",
        "firmware": "ArduCopter V4.6.3",
        "system_id": 1,
        "hardware": SENSORS,
        "hardware_kind": "sensors",
        "flights": 1,
        "airborne_s": 80.0,
        "ended": "landed",
        "end_s": 85.0,
        "model": "quadcopter",
        "verdict": "Nothing points to a failed component.",
        "not_testable": ["airspeed"],
        "names": [{"component": "motor_1", "name": "Motor 1 (front right)"}],
        "curves": [
            {"name": "height", "unit": "m", **curve},
            {"name": "speed", "unit": "m/s", **curve},
        ],
        "trends": [trend("motor_1", 1.02), trend("motor_2", 0.98)],
        "error": None,
        "error_kind": None,
        "fingerprint": "x",
    }
    return {**lost(Job(path), ""), **told, **changes}


def accused(path: str, component: str = "motor_1", **changes: Any) -> dict[str, Any]:
    found = {"accused": [component], "findings": [finding(component)], "ended": "impact"}
    return row(path, **{**found, "end_speed": 9.8, **changes})
