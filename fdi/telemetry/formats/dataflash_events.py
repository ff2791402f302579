"""What did the vehicle say and do, by its DataFlash records: modes, arming, texts, parameters?

In: the records by name and their times. Out: `Event`s, parameters and their changes, the vehicle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table, is_failsafe_text, mavlink_mode
from fdi.telemetry.events import Event
from fdi.telemetry.formats.dataflash_records import Records
from fdi.telemetry.formats.mavlink_events import clean_text
from fdi.telemetry.log import ParameterChange

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ARMED: Final = 10  # EV.Id
_DISARMED: Final = 11
_MAKERS: Final = {
    **{"ArduCopter": "quad", "ArduPlane": "plane", "ArduRover": "rover", "Rover": "rover"},
    **{"ArduSub": "sub", "APM:Copter": "quad", "APM:Plane": "plane", "APM:Rover": "rover"},
}
_FRAMES: Final = {2: "hexa", 3: "octa", 4: "octa", 5: "hexa", 6: "helicopter"}  # FRAME_CLASS
_OWN_CODES: Final = ("flight mode", "EKF primary changed")  # ECode 0 is a number, not "resolved"
_ALARMS: Final = ("failsafe", "crash check", "EKF check", "thrust loss check")


@dataclass(frozen=True, slots=True, eq=False)
class Groups:
    """The rows of each layout's records, and every record's time."""

    records: Records
    rows: Mapping[int, Ints]
    t: Floats

    def columns(self, name: str, *fields: str) -> Iterator[tuple[Floats, list[NDArray[Any]]]]:
        """Yield times and raw values of the records of a name, once per layout that has all."""
        for i, rows in self.rows.items():
            one = self.records.layouts[i]
            found = [one.field(field) for field in fields]
            if one.name == name and None not in found:
                values = [self.records.values(rows, f) for f in found if f is not None]
                yield self.t[rows], values

    def lines(self, name: str, *fields: str) -> Iterator[tuple[Any, ...]]:
        """Yield (t, value, ...) for each of the few records of a name."""
        for t, values in self.columns(name, *fields):
            yield from zip(t.tolist(), *(v.tolist() for v in values), strict=True)


def log_texts(groups: Groups) -> list[Event]:
    """Return the texts, and the failsafes that they speak of."""
    events = []
    for t, text in groups.lines("MSG", "Message"):
        events.append(Event(t, "text", clean_text(text)))
        if is_failsafe_text(text):
            events.append(Event(t, "failsafe", clean_text(text)))
    return sorted(events, key=lambda e: e.t)


def log_events(groups: Groups, vehicle: str) -> Iterator[Event]:
    """Yield modes, arming and errors."""
    number = None
    for name in ("ModeNum", "Mode"):
        for t, mode in groups.lines("MODE", name):
            if mode != number and isinstance(mode, int):
                yield Event(t, "mode", mavlink_mode(mode, autopilot="ardupilot", vehicle=vehicle))
                number = mode
        if number is not None:
            break
    said = [(t, code == _ARMED) for t, code in groups.lines("EV", "Id") if 10 <= code <= 11]
    said += [(t, bool(state)) for t, state in groups.lines("ARM", "ArmState")]
    armed = None
    for t, state in sorted(said):
        if state != armed:
            yield Event(t, "arm" if state else "disarm", "")
            armed = state
    subsystems = data_table("errors_dataflash")["subsystems"]
    for t, subsystem, code in groups.lines("ERR", "Subsys", "ECode"):
        name = subsystems.get(str(subsystem), f"subsystem {subsystem}")
        if code or name in _OWN_CODES:
            is_alarm = name.startswith(_ALARMS)
            yield Event(t, "failsafe" if is_alarm else "text", f"error of {name}, code {code}")


def parameters(
    groups: Groups,
) -> tuple[dict[str, float], tuple[ParameterChange, ...], list[Event]]:
    """Return the parameters as first written, the later changes, and these as events."""
    first: dict[str, float] = {}
    now: dict[str, float] = {}
    changes, events = [], []
    for t, name, value in groups.lines("PARM", "Name", "Value"):
        if not name.replace("_", "").isalnum() or not np.isfinite(value):
            continue
        old = now.setdefault(name, value)
        first.setdefault(name, value)
        if value != old:
            changes.append(ParameterChange(t, name, old, value))
            events.append(Event(t, "parameter", name, None, value))
            now[name] = value
    return dict(sorted(first.items())), tuple(changes), events


def vehicle_of(firmware: str | None, values: Mapping[str, float]) -> str:
    """Return the vehicle's name, from the firmware and the parameters of its frame."""
    kind = _MAKERS.get((firmware or "").split(" ")[0])
    if kind is None and "FRAME_CLASS" in values and "Q_ENABLE" not in values:
        kind = "quad" if "MOT_SPIN_ARM" in values or "ATC_RAT_RLL_P" in values else None
    if kind == "quad":
        return _FRAMES.get(int(values.get("FRAME_CLASS", 1)), "quad")
    if kind == "plane" and values.get("Q_ENABLE", 0) > 0:
        return "vtol"
    return kind or "other"
