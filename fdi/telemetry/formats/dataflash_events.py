"""What did the vehicle say and do, by its DataFlash records: modes, arming, texts, parameters?

In: the records by name and their times. Out: `Event`s, parameters and their changes, the vehicle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

from fdi.telemetry.catalogue import data_table, is_failsafe_text, mavlink_mode
from fdi.telemetry.events import Event
from fdi.telemetry.formats.dataflash_clock import Times
from fdi.telemetry.formats.dataflash_tables import Tables, columns
from fdi.telemetry.formats.mavlink_events import clean_text
from fdi.telemetry.log import ParameterChange

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
class Timed:
    """The tables of a log and the times of their records."""

    tables: Tables
    times: Sequence[Times]

    def lines(self, name: str, *fields: str) -> Iterator[tuple[Any, ...]]:
        """Yield (t, value, ...) for each of the few records of a name that have all the fields."""
        for i, values in columns(self.tables, name, *fields):
            t = self.times[i].t.tolist()
            yield from zip(t, *(v.tolist() for v in values), strict=True)


def log_texts(timed: Timed) -> list[Event]:
    """Return the texts, and the failsafes that they speak of."""
    events = []
    for t, text in timed.lines("MSG", "Message"):
        events.append(Event(t, "text", clean_text(text)))
        if is_failsafe_text(text):
            events.append(Event(t, "failsafe", clean_text(text)))
    return sorted(events, key=lambda e: e.t)


def log_events(timed: Timed, vehicle: str) -> Iterator[Event]:
    """Yield modes, arming and errors."""
    number = None
    for name in ("ModeNum", "Mode"):
        for t, mode in timed.lines("MODE", name):
            if mode != number and isinstance(mode, int):
                yield Event(t, "mode", mavlink_mode(mode, autopilot="ardupilot", vehicle=vehicle))
                number = mode
        if number is not None:
            break
    said = [(t, code == _ARMED) for t, code in timed.lines("EV", "Id") if 10 <= code <= 11]
    said += [(t, bool(state)) for t, state in timed.lines("ARM", "ArmState")]
    armed = None
    for t, state in sorted(said):
        if state != armed:
            yield Event(t, "arm" if state else "disarm", "")
            armed = state
    subsystems = data_table("errors_dataflash")["subsystems"]
    for t, subsystem, code in timed.lines("ERR", "Subsys", "ECode"):
        name = subsystems.get(str(subsystem), f"subsystem {subsystem}")
        if code or name in _OWN_CODES:
            is_alarm = name.startswith(_ALARMS)
            yield Event(t, "failsafe" if is_alarm else "text", f"error of {name}, code {code}")


def parameters(
    timed: Timed,
) -> tuple[dict[str, float], tuple[ParameterChange, ...], list[Event]]:
    """Return the parameters as first written, the later changes, and these as events."""
    first: dict[str, float] = {}
    now: dict[str, float] = {}
    changes, events = [], []
    for t, name, value in timed.lines("PARM", "Name", "Value"):
        if now.get(name) == value:  # nearly all, where a log holds several downloads
            continue
        if not name.replace("_", "").isalnum() or not isfinite(value):
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
