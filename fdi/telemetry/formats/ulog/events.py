"""What did the vehicle say and do, by its ULog: modes, arming, texts, parameters, firmware?

In: the log's messages and the messages of the file that hold no data. Out: `Event`s, parameters and
their changes, the vehicle and its firmware.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table, is_failsafe_text, mavlink_vehicle
from fdi.telemetry.events import Event, Kind
from fdi.telemetry.formats.commands import OUTSIDE, command_events
from fdi.telemetry.formats.ulog.definitions import Key, Logged
from fdi.telemetry.formats.ulog.units import Release
from fdi.telemetry.formats.ulog.walk import Other
from fdi.telemetry.formats.wording import clean_text
from fdi.telemetry.log import ParameterChange
from fdi.telemetry.message import Message

Messages = Mapping[str, Message]
Info = Mapping[str, float | str]

_ARMED: Final = 2  # vehicle_status.arming_state, in all releases
_PARAMETER: Final = re.compile(r"[A-Za-z0-9_]{1,32}")
_STAGES: Final = ((255, ""), (192, "rc"), (128, "beta"), (64, "alpha"), (0, "dev"))
_SAME_S: Final = 1.0  # s, in which topics of 2 Hz tell of one thing
HOLDS_S: Final = 10.0
"""Before a failsafe acts it may hold for COM_FAIL_ACT_T, 5 s, after a loss of 0.5 to 1 s."""
_SWITCH_MODE: Final = 5  # action_request.action
_KILL: Final = 4
_STOPS: Final = {
    "manual_lockdown": ("kill switch: all outputs are stopped", _KILL),
    "kill": ("kill switch: all outputs are stopped", _KILL),  # since 1.16
    "lockdown": ("lockdown: all outputs are stopped", 0),
    "force_failsafe": ("flight termination: all outputs go to their failsafe values", 0),
    "termination": ("flight termination: all outputs go to their failsafe values", 0),
}
_MODE_COMMANDS: Final = (20, 21, 22, 176, 300)  # return, land, take off, mode, mission
_CRASH_DUMP: Final = "hardfault_plain"
_EMERGENCY: Final = 0
_SYSTEM_WIDE: Final = 1
"""Of the byte before a default: it is the firmware's own, not that of the airframe (bit 1)."""


def information(others: tuple[Other, ...]) -> dict[str, float | str]:
    """Return the keys of the I messages, the last value of each."""
    found: dict[str, float | str] = {}
    for other in others:
        if other.kind == "I" and isinstance(other.content, Key):
            value = other.content.value()
            if value is not None:
                found[other.content.name] = value
    return found


def release_of(info: Info) -> Release:
    """Return major and minor number of the firmware's release, (0, 0) where it is not told."""
    number = _integer(info.get("ver_sw_release"))
    return number >> 24 & 0xFF, number >> 16 & 0xFF


def firmware_of(info: Info) -> str | None:
    """Return the firmware's name and version, ``PX4 1.15.2 (b589596a)``."""
    name = info.get("sys_name")
    if not isinstance(name, str) or not clean_text(name):
        return None
    told = clean_text(name)
    number = _integer(info.get("ver_sw_release"))
    if number:
        stage = next(word for least, word in _STAGES if number & 0xFF >= least)
        told += f" {number >> 24 & 0xFF}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}{stage}"
    commit = info.get("ver_sw")
    return f"{told} ({clean_text(commit)[:8]})" if isinstance(commit, str) and commit else told


def board_of(info: Info) -> str:
    """Return the board's name and serial number, "" where the log tells no number."""
    number, name = info.get("sys_uuid"), info.get("ver_hw")
    told = clean_text(number) if isinstance(number, str) else ""
    if not told.strip("0"):
        return ""
    return f"{clean_text(name)} {told}" if isinstance(name, str) else told


def vehicle_of(own: Messages, values: Mapping[str, float]) -> tuple[str, int]:
    """Return the vehicle's name, and its MAV_TYPE (0: not told), from status and airframe."""
    status = own.get("vehicle_status")
    kinds = [_last(status, "system_type"), _integer(values.get("MAV_TYPE"))]
    kind = next((kind for kind in kinds if kind), 0)
    if status is not None and "is_vtol" in status and status.raw("is_vtol").any():
        return "vtol", kind
    for told in kinds:
        if told and (mavlink_vehicle(told) != "other" or str(told) in data_table("frames")["type"]):
            return mavlink_vehicle(told), told
    table = data_table("modes_ulog")
    number = values.get("SYS_AUTOSTART", 0)
    frames = [name for least, name in table["airframe"] if number >= least]
    if frames:
        return str(frames[-1]), kind
    return str(table["vehicle_type"].get(str(_last(status, "vehicle_type")), "other")), kind


def system_of(own: Messages, values: Mapping[str, float]) -> int:
    """Return the MAVLink system number."""
    return int(values.get("MAV_SYS_ID") or _last(own.get("vehicle_status"), "system_id") or 1)


def _last(message: Message | None, field: str) -> int | None:
    if message is None or field not in message or not len(message):
        return None
    return int(message.raw(field)[-1])


def _integer(value: float | str | None) -> int:
    return int(value) if isinstance(value, int | float) and math.isfinite(value) else 0


def log_texts(others: tuple[Other, ...], t_of: Callable[[int, int], float]) -> list[Event]:
    """Return the logged strings, and the failsafes that they speak of.

    Parameters
    ----------
    t_of : callable
        From a time since boot (us) and a place in the file to s of the log's clock.
    """
    events = []
    for other in others:
        said = other.content
        if not isinstance(said, Logged):
            continue
        t, text = t_of(said.stamp, other.start), clean_text(said.text)
        events.append(Event(t, "text", text, said.severity))
        if is_failsafe_text(text):
            events.append(Event(t, "failsafe", text, said.severity))
    return sorted(events, key=lambda e: e.t)


def crash_dumps(others: tuple[Other, ...], t: float) -> Iterator[Event]:
    """Yield one event for each report of a crash of the autopilot's processor.

    It was written after the next start and appended; nobody knows when the processor stopped, but
    this log ended then: ``t``.
    """
    parts: list[bytes] = []
    for other in others:
        key = other.content
        if not isinstance(key, Key) or key.name != _CRASH_DUMP:
            continue
        is_next = key.is_continued and parts
        parts = [*parts[:-1], parts[-1] + key.raw] if is_next else [*parts, key.raw]
    for part in parts:
        text = clean_text(part.decode("utf-8", "replace"))[:200]
        yield Event(t, "failsafe", f"the autopilot's processor crashed: {text}", _EMERGENCY)


def parameters(
    others: tuple[Other, ...], t_at: Callable[[int], float]
) -> tuple[dict[str, float], tuple[ParameterChange, ...], list[Event]]:
    """Return the parameters at the beginning, the later changes, and these as events.

    Parameters
    ----------
    t_at : callable
        From a place in the file to the time of the last data before it, s.
    """
    first: dict[str, float] = {}
    now: dict[str, float] = {}
    changes, events = [], []
    for other in others:
        key = other.content
        value = key.value() if other.kind == "P" and isinstance(key, Key) else None
        if not isinstance(key, Key) or not isinstance(value, int | float):
            continue
        if not math.isfinite(value) or not _PARAMETER.fullmatch(key.name):
            continue
        old = now.setdefault(key.name, value)
        first.setdefault(key.name, value)
        if value != old:
            t = t_at(other.start)
            changes.append(ParameterChange(t, key.name, old, value))
            events.append(changes[-1].event())
            now[key.name] = value
    return dict(sorted(first.items())), tuple(changes), events


def defaults(others: tuple[Other, ...]) -> dict[str, float]:
    """Return the firmware's own defaults, of the parameters that have another value.

    A log that holds any leaves out those of parameters that are at their default.
    """
    found: dict[str, float] = {}
    for other in others:
        key = other.content
        value = key.value() if other.kind == "Q" and isinstance(key, Key) else None
        if not isinstance(key, Key) or not isinstance(value, int | float):
            continue
        if key.before & _SYSTEM_WIDE and math.isfinite(value) and _PARAMETER.fullmatch(key.name):
            found[key.name] = value
    return dict(sorted(found.items()))


def log_events(own: Messages, release: Release) -> list[Event]:
    """Return modes, arming and failsafes in the order of time."""
    found = [*_modes(own, release), *_arming(own, release), *_failsafes(own), *_stops(own)]
    found += command_events(_commands(own))
    return sorted(found, key=lambda e: (e.t, e.kind))


def mode_name(number: int, release: Release) -> str:
    """Return the name of a nav_state, ``MODE_<n>`` where it is not known.

    Examples
    --------
    >>> mode_name(6, (1, 15)), mode_name(6, (1, 12)), mode_name(99, (1, 15))
    ('POSITION_SLOW', 'AUTO_RCRECOVER', 'MODE_99')
    """
    table = data_table("modes_ulog")
    name = table["nav_state"].get(str(number))
    if release < tuple(table["older"]["before"]):
        name = table["older"]["nav_state"].get(str(number), name)
    return name or f"MODE_{number}"


def _modes(own: Messages, release: Release) -> Iterator[Event]:
    failsafes = list(_steps(own, "vehicle_status", "failsafe"))
    for row, (t, number) in enumerate(_steps(own, "vehicle_status", "nav_state")):
        is_failsafe = any([bool(state) for at, state in failsafes if at <= t][-1:])
        by = "a failsafe" if is_failsafe else _mode_orderer(own, t) if row else ""
        yield Event(t, "mode", mode_name(int(number), release), by=by)


def _mode_orderer(own: Messages, t: float) -> str:
    """Return who ordered a mode, "" where the log does not say."""
    action = _near(own, "action_request", t, action=_SWITCH_MODE)
    if action is not None and "source" in action:
        return str(data_table("orders")["px4_actions"].get(str(int(action["source"])), ""))
    command = _near(own, "vehicle_command", t, from_external=1)
    if command is not None and int(command.get("command", 0)) in _MODE_COMMANDS:
        return OUTSIDE
    switches = own.get("manual_control_switches")
    if switches is not None:
        for field in ("mode_slot", "return_switch", "loiter_switch", "offboard_switch"):
            turned = [at for at, _ in _steps(own, "manual_control_switches", field)][1:]
            if any(abs(at - t) <= _SAME_S for at in turned):
                return "the pilot's switch"
    return ""


def _near(own: Messages, topic: str, t: float, **wanted: int) -> dict[str, float] | None:
    """Return a record at about a time of which some fields have these values, None without one."""
    message = own.get(topic)
    if message is None or not all(field in message for field in wanted):
        return None
    rows = np.abs(message.t - t) <= _SAME_S
    for field, value in wanted.items():
        rows &= message.raw(field)[message.kept] == value
    where = np.flatnonzero(rows)
    if not where.size:
        return None
    row = message.kept[where[0]]
    numbers = [name for name, column in message.columns.items() if not column.is_text]
    return {name: float(message.raw(name)[row]) for name in numbers}


def _arming(own: Messages, release: Release) -> Iterator[Event]:
    steps = [(t, bool(armed)) for t, armed in _steps(own, "actuator_armed", "armed")]
    if not steps:
        states = _steps(own, "vehicle_status", "arming_state")
        steps = [(t, int(state) == _ARMED) for t, state in states]
    before = False
    for row, (t, armed) in enumerate(steps):
        if armed != before:  # a log that begins disarmed says nothing new
            by = _arming_orderer(own, t, release, armed=armed) if row else ""
            kind: Kind = "arm" if armed else "disarm"
            yield Event(t, kind, "", by=by)
        before = armed


def _arming_orderer(own: Messages, t: float, release: Release, *, armed: bool) -> str:
    """Return who armed or disarmed, "" where the log does not say."""
    status = own.get("vehicle_status")
    field = "latest_arming_reason" if armed else "latest_disarming_reason"
    if status is None or field not in status:
        return ""
    row = min(int(np.searchsorted(status.t, t + _SAME_S, side="right")), len(status)) - 1
    reason = str(int(status.raw(field)[status.kept][row])) if row >= 0 else ""
    table = data_table("orders")
    older = table["px4_older"] if release < tuple(table["px4_older"]["before"]) else {}
    return str(older.get(reason, table["px4"].get(reason, "")))


def _stops(own: Messages) -> Iterator[Event]:
    """Yield where a switch or command stops all outputs; a simulation is locked all along."""
    for field, (what, action) in _STOPS.items():
        for t, on in list(_steps(own, "actuator_armed", field))[1:]:
            asked = _near(own, "action_request", t, action=action) if action else None
            turned = _near(own, "manual_control_switches", t, kill_switch=1) if action else None
            is_pilot = turned is not None or (asked is not None and asked.get("source") != 0)
            if on:
                yield Event(t, "command", what, by="the pilot's switch" if is_pilot else "")


def _commands(own: Messages) -> Iterator[tuple[float, int, float, float]]:
    """Yield what others told the vehicle to do, as `command_events` asks."""
    sent = own.get("vehicle_command")
    fields = ("command", "param1", "param2")
    if sent is None or any(name not in sent for name in (*fields, "from_external")):
        return
    is_outside = sent.raw("from_external")[sent.kept] == 1
    columns = (sent.raw(name)[sent.kept][is_outside].tolist() for name in fields)
    yield from zip(sent.t[is_outside].tolist(), *columns, strict=True)


def _failsafes(own: Messages) -> Iterator[Event]:
    table = data_table("modes_ulog")
    before = 0
    for t, state in _steps(own, "vehicle_status", "failsafe"):
        if state:
            why = ", ".join(_reasons(own, t))
            yield Event(t, "failsafe", "the autopilot is in failsafe" + (f": {why}" if why else ""))
    for t, state in _steps(own, "vehicle_status", "failure_detector_status"):
        for bit, name in table["failure_detector"].items():
            if int(state) & ~before & int(bit):
                yield Event(t, "failsafe", f"failure detector: {name}")
        before = int(state)
    for field, name in table["failure_detector_fields"].items():
        for t, state in _steps(own, "failure_detector_status", field):
            if state:
                which = _motors(own, t) if field == "fd_motor" else ""
                yield Event(t, "failsafe", f"failure detector: {name}{which}")


def _motors(own: Messages, t: float) -> str:
    """Return which motors the failure detector means, "" where it does not tell."""
    masks = [int(mask) for at, mask in _steps(own, "failure_detector_status", "motor_failure_mask")
             if at <= t + _SAME_S]  # fmt: skip
    mask = masks[-1] if masks else 0
    return " " + ", ".join(str(n + 1) for n in range(16) if mask >> n & 1) if mask else ""


def _reasons(own: Messages, t: float) -> list[str]:
    """Return which of the flags that let a failsafe act rose before it, each once."""
    names = data_table("modes_ulog")["failsafe_flags"]
    risen = [
        name
        for field, name in names.items()
        if any(on and t - HOLDS_S <= at <= t + _SAME_S
               for at, on in list(_steps(own, "failsafe_flags", field))[1:])
    ]  # fmt: skip
    return list(dict.fromkeys(risen))


def _steps(own: Messages, topic: str, field: str) -> Iterator[tuple[float, Any]]:
    """Yield the first value of a field and every one that differs from the one before."""
    message = own.get(topic)
    if message is None or field not in message or not len(message):
        return
    values: NDArray[Any] = message.raw(field)[message.kept]
    rows = [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()]
    for row in rows:
        yield float(message.t[row]), values[row].item()
