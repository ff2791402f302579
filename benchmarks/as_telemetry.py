"""Whom do recorded flights accuse if a radio had sent what their card recorded?

    .venv/bin/python benchmarks/as_telemetry.py LABELS.json ... [--hz 4] [--workers N]
    .venv/bin/python benchmarks/as_telemetry.py LOG ... [--hz 4]

Of each recorded DataFlash log of ArduPilot a telemetry log is made: heartbeats, texts, parameters
and the messages of `RATES`, with what the card had said last, rounded as MAVLink rounds it, at so
many a second. Prints who is accused of it that is not of the card's log, nor named or accepted by
its label, and who is no longer: telemetry shows less, and it should not accuse more.
"""

from __future__ import annotations

import argparse
import struct
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi import analyze
from fdi.errors import FdiError
from fdi.evaluation import load_labels
from fdi.telemetry import Log, read
from fdi.telemetry.dialect import FieldDefinition, definition_by_name
from fdi.telemetry.message import Floats, Message
from fdi.units import si

RATES = {
    "ATTITUDE": 1.0, "GLOBAL_POSITION_INT": 1.0, "VFR_HUD": 1.0, "NAV_CONTROLLER_OUTPUT": 1.0,
    "RAW_IMU": 1.0, "SCALED_IMU2": 1.0, "SCALED_PRESSURE": 1.0, "GPS_RAW_INT": 1.0,
    "SERVO_OUTPUT_RAW": 1.0, "AHRS2": 0.5, "EKF_STATUS_REPORT": 0.5, "SYS_STATUS": 0.5,
    "VIBRATION": 0.5, "WIND": 0.25,
}  # fmt: skip
"""By share of the rate that is asked for."""
KINDS = {"plane": 1, "vtol": 1, "quad": 2, "hexa": 13, "octo": 14, "heli": 4}
NEEDED = {"RAW_IMU": "xacc", "SCALED_IMU2": "xacc", "SYS_STATUS": "voltage_battery"}
INSTEAD = {"alt": "relative_alt"}
"""A field that stands in for one that the card does not hold."""
EPOCH_S = 1.7e9
STALE_S = 1.5
"""What the card has not told for so long, the autopilot does not know either."""
HEALTHY = 0x036FFFFF & ~(1 << 16)  # every sensor but the radio control
UNKNOWN = {
    "flags": 831, "battery_remaining": -1, "current_battery": -1, "satellites_visible": 255,
    "eph": 65535, "epv": 65535, "hdg": 65535, "load": 300,
}  # fmt: skip
"""What ArduPilot sends for what the card does not hold; 0 else."""


def sent(log: Log, hz: float) -> bytes:
    """Return a telemetry log of a flight."""
    link, records = mav.MAVLink(None, srcSystem=1, srcComponent=1), []
    for t, message in sorted(_messages(log, hz), key=lambda one: one[0]):
        stamp = struct.pack(">Q", round(1e6 * (EPOCH_S + t)))
        records.append(stamp + message.pack(link))
        link.seq = (link.seq + 1) % 256
    return b"".join(records)


def _messages(log: Log, hz: float) -> Iterator[tuple[float, mav.MAVLink_message]]:
    low, high = log.span
    count = len(log.parameters)
    for i, (name, value) in enumerate(log.parameters.items()):
        yield low, mav.MAVLink_param_value_message(name.encode()[:16], float(value), 9, count, i)
    for event in log.events:
        if event.kind == "text":
            yield (
                event.t,
                mav.MAVLink_statustext_message(event.severity or 6, event.text.encode()[:50]),
            )
    for t in np.arange(low, high, 1.0):
        yield t, mav.MAVLink_heartbeat_message(KINDS.get(log.vehicle, 2), 3, *_state(log, t), 4, 3)
    for number, (name, share) in enumerate(RATES.items()):
        message = log.messages.get(name)
        if message is not None and NEEDED.get(name, message.fields[0]) in message.fields:
            phase = number / len(RATES) / hz  # not all at the same moment
            yield from _of(message, name, np.arange(low + phase, high, 1 / (share * hz)), low)


def _state(log: Log, t: float) -> tuple[int, int]:
    """Return base and custom mode of a heartbeat."""
    wings = log.vehicle in ("plane", "vtol")
    names = mavutil.mode_mapping_apm if wings else mavutil.mode_mapping_acm
    arming = [e for e in log.events if e.kind in ("arm", "disarm")]
    modes = [e.text for e in log.events if e.kind == "mode" and e.t <= t]
    armed = not arming or arming[0].kind == "disarm"  # who disarms first began armed
    for event in arming:
        armed = event.kind == "arm" if event.t <= t else armed
    number = {own: key for key, own in names.items()}.get(modes[-1], 0) if modes else 0
    return 1 | (mav.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0), number


def _of(
    message: Message, name: str, grid: Floats, low: float
) -> Iterator[tuple[float, mav.MAVLink_message]]:
    """Yield a message at some times, where the card told it shortly before."""
    told = definition_by_name(name)
    assert told is not None
    last = np.searchsorted(message.t, grid, side="right") - 1
    at = np.maximum(last, 0)
    columns = {one.name: _column(message, one, at, grid, low) for one in told.fields}
    known = np.any([np.isfinite(message.si(field)[at]) for field in message.fields], axis=0)
    make = getattr(mav, f"MAVLink_{name.lower()}_message")
    for i in np.flatnonzero(known & (last >= 0) & (grid - message.t[at] < STALE_S)):
        yield grid[i], make(*(columns[field][i] for field in make.fieldnames))


def _column(
    message: Message, field: FieldDefinition, at: np.ndarray, grid: Floats, low: float
) -> list[float] | list[int]:
    """Return a field as MAVLink sends it, (n,)."""
    name, kind = field.name, np.dtype(field.dtype)
    if name not in message.fields:
        name = INSTEAD.get(name, name)
    if name in ("time_boot_ms", "time_usec"):
        when = message.t[at] if message.name == "GPS_RAW_INT" else grid  # a fix has its own time
        values = (when - low + 1.0) * (1e3 if name == "time_boot_ms" else 1e6)
    elif name.startswith("onboard_control_sensors"):
        values = np.full(grid.size, float(HEALTHY))
    elif name in message.fields:
        own = si("us (pulse)" if name.startswith("servo") else field.unit)
        values = (message.si(name)[at] - own.offset) / own.scale
    else:
        values = np.full(grid.size, np.nan)
    values = np.where(np.isnan(values), UNKNOWN.get(name, 0), values)
    if kind.kind not in "iu":
        return values.tolist()
    info = np.iinfo(kind)
    return [int(one) for one in np.clip(np.round(values), info.min, info.max)]


def look(path: Path, accepted: Sequence[str], hz: float) -> tuple[list[str], list[str]] | str:
    """Return who is accused of the telemetry alone and of the card's log alone, or why not."""
    own = {one.component for one in analyze(path).findings}
    with TemporaryDirectory() as folder:
        made = Path(folder) / f"{path.stem}.tlog"
        made.write_bytes(sent(read(path), hz))
        try:
            found = analyze(made).findings
        except FdiError as error:
            return str(error)
    known = {*accepted, *own}
    new = [f"{one.component} {one.confidence:.0%}" for one in found if one.component not in known]
    return new, sorted(own - {one.component for one in found})


def main() -> int:
    """Print who is accused, and how many."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--hz", type=float, default=4.0)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    logs: list[tuple[Path, Sequence[str]]] = []
    for file in arguments.files:
        if file.suffix == ".json":
            for one in load_labels(file):
                if one.origin == "recorded":
                    logs.append((one.path, [*one.accept, *(f.component for f in one.faults)]))
        else:
            logs.append((file, ()))
    logs = [one for one in logs if one[0].suffix.lower() == ".bin"]
    new, tried = 0, 0
    with ProcessPoolExecutor(arguments.workers) as pool:
        paths, accepted = [one for one, _ in logs], [other for _, other in logs]
        for path, found in zip(
            paths, pool.map(partial(look, hz=arguments.hz), paths, accepted), strict=True
        ):
            if isinstance(found, str):
                print(f"{path.name}: {found}")
                continue
            tried, new = tried + 1, new + bool(found[0])
            if any(found):
                print(f"{path.name}: accused {', '.join(found[0]) or '-'}; "
                      f"no longer {', '.join(found[1]) or '-'}")  # fmt: skip
    print(f"somebody is accused by telemetry alone of {new} of {tried} logs")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
