"""What did the vehicle say and do, by its MAVLink messages: modes, arming, texts, parameters?

In: the payloads of the vehicle's own messages and the times of its records. Out: `Event`s, the
parameters as first downloaded and their later changes, the firmware.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table, is_failsafe_text, mavlink_mode
from fdi.telemetry.clock import Timeline, in_order
from fdi.telemetry.events import Event
from fdi.telemetry.formats.bounds import (
    MOST_NAMES,
    kept_texts,
    kept_values,
    records_left_out,
)
from fdi.telemetry.formats.commands import OUTSIDE, command_events
from fdi.telemetry.formats.tlog.columns import Payloads
from fdi.telemetry.formats.wording import PARAMETER_NAME, clean_text, greeting
from fdi.telemetry.log import ParameterChange
from fdi.telemetry.quality import ANEW, QualityRecord

Own = Mapping[int, Payloads]

_HEARTBEAT: Final = 0
_SET_MODE: Final = 11
_PARAM_VALUE: Final = 22
_PARAM_SET: Final = 23
_COMMAND_INT: Final = 75
_COMMAND_LONG: Final = 76
_AUTOPILOT_VERSION: Final = 148
_STATUSTEXT: Final = 253
_ARMED: Final = 0x80  # MAV_MODE_FLAG_SAFETY_ARMED
_STATES: Final = {  # MAV_STATE; ArduPilot is critical while one of its failsafes acts
    5: "the autopilot reports a critical state",
    6: "the autopilot reports an emergency",
    8: "the autopilot terminates the flight",
}
_MODE_COMMANDS: Final = (20, 21, 22, 176, 300)  # return, land, take off, mode, mission
_ARM_COMMAND: Final = 400
_ORDERED_S: Final = (2.5, 0.5)
"""Before and after a heartbeat that shows what a command ordered: they come once a second, and a
link delays either way."""
_CHUNK: Final = 50  # characters of one STATUSTEXT; a longer text comes in several
_CHUNK_WAIT_S: Final = 10.0  # parts of one text that are further apart belong to two
_INTEGERS: Final = {1: "<u1", 2: "<i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4"}  # MAV_PARAM_TYPE
_VERSION: Final = re.compile(r"(\S+) V?(\d+)\.(\d+)")


def log_events(own: Own, line: Timeline, autopilot: str, vehicle: str) -> list[Event]:
    """Return modes, arming, reboots, texts and failsafes in the order of time."""
    events = list(_heartbeats(own, line, autopilot, vehicle))
    said = list(_texts(own, line))
    is_failsafe = {
        text: is_failsafe_text(text) for text in dict.fromkeys(text for _, _, text in said)
    }
    for t, severity, text in said:
        events.append(Event(t, "text", text, severity))
        if is_failsafe[text]:
            events.append(Event(t, "failsafe", text, severity))
    for first in line.restarts:
        # others' records, which a timeline counts among those of a boot, are no word of it
        heard = (sent.rows[np.searchsorted(sent.rows, first) :][:1] for sent in own.values())
        row = min((int(rows[0]) for rows in heard if rows.size), default=first)
        events.append(Event(float(line.created[row]), "reboot", ANEW))
    return sorted(events, key=lambda e: (e.t, e.kind))


def with_orders(
    events: list[Event],
    others: Mapping[int, Sequence[tuple[Payloads, NDArray[np.float64]]]],
    system: int,
) -> list[Event]:
    """Return the events with who ordered modes, arming, parameters, by what others sent.

    Parameters
    ----------
    others : mapping of int to sequence of (Payloads, (n,) float)
        By message number, what other systems sent, and when, s.
    system : int
        Of the vehicle.
    """
    modes, arming = [np.empty(0)], [np.empty(0)]
    for sent, t in others.get(_SET_MODE, ()):
        modes.append(t[sent.field("target_system") == system])
    for sent, t in others.get(_COMMAND_LONG, ()):
        # int64: within `isin`, numpy before 2.0 counts with the smaller type
        whom, command = (sent.field(n).astype(np.int64) for n in ("target_system", "command"))
        to_it = np.isin(whom, (0, system))
        modes.append(t[to_it & np.isin(command, _MODE_COMMANDS)])
        arming.append(t[to_it & (command == _ARM_COMMAND)])
    set_to: dict[str, list[float]] = {}
    for name, at in _set_by_others(others.get(_PARAM_SET, ()), system):
        set_to.setdefault(name, []).append(at)
    asked = {"mode": np.concatenate(modes)}
    asked["arm"] = asked["disarm"] = np.concatenate(arming)
    before, after = _ORDERED_S

    seen: set[str] = set()

    def is_ordered(event: Event) -> bool:
        t = asked.get(event.kind)
        begins = event.kind == "mode" and "mode" not in seen  # it may have been in force for long
        seen.add(event.kind)
        if event.kind == "parameter":
            t = np.array(set_to.get(event.text, ()))
        near = t is not None and ((t >= event.t - before) & (t <= event.t + after)).any()
        return bool(near and not begins)

    told = [replace(one, by=OUTSIDE) if is_ordered(one) else one for one in events]
    return sorted([*told, *command_events(_commands(others, system))], key=lambda e: e.t)


def _commands(
    others: Mapping[int, Sequence[tuple[Payloads, NDArray[np.float64]]]], system: int
) -> list[tuple[float, int, float, float]]:
    """Return what others told the vehicle to do, in the order of time, as `command_events` asks."""
    found = []
    for sent, t in (*others.get(_COMMAND_INT, ()), *others.get(_COMMAND_LONG, ())):
        to_it = np.isin(sent.field("target_system").astype(np.int64), (0, system))
        columns = (sent.field(name)[to_it].tolist() for name in ("command", "param1", "param2"))
        found += list(zip(t[to_it].tolist(), *columns, strict=True))
    return sorted(found)


def _set_by_others(
    sent: Sequence[tuple[Payloads, NDArray[np.float64]]], system: int
) -> Iterator[tuple[str, float]]:
    """Yield which parameters others asked the vehicle to set, and when."""
    for asked, t in sent:
        names, which = asked.texts("param_id")
        to_it = np.isin(asked.field("target_system").astype(np.int64), (0, system))
        for row in np.flatnonzero(to_it).tolist():
            yield names[which[row]], float(t[row])


def _heartbeats(own: Own, line: Timeline, autopilot: str, vehicle: str) -> Iterator[Event]:
    beats = own.get(_HEARTBEAT)
    if beats is None:
        return
    t = line.created[beats.rows]
    mode = beats.field("custom_mode").astype(np.int64)
    for row in _changes(mode):
        name = mavlink_mode(int(mode[row]), autopilot=autopilot, vehicle=vehicle)
        yield Event(float(t[row]), "mode", name)
    status = beats.field("system_status")
    for row in _changes(status):
        if int(status[row]) in _STATES:
            yield Event(float(t[row]), "failsafe", _STATES[int(status[row])])
    armed = beats.field("base_mode") & _ARMED != 0
    for row in _changes(armed):
        if row or armed[row]:  # a log that begins disarmed says nothing new
            yield Event(float(t[row]), "arm" if armed[row] else "disarm", "")


def _changes(values: NDArray[np.generic]) -> list[int]:
    """Return the first row and every row that differs from the one before."""
    return [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()]


def _texts(own: Own, line: Timeline) -> Iterator[tuple[float, int, str]]:
    """Yield time, severity and text; parts of one text (same id, counted up) joined."""
    said = own.get(_STATUSTEXT)
    if said is None:
        return
    kept = kept_texts(said.rows.size)
    said = said if kept is None else said.of(kept)
    times = in_order(line.created[said.rows]).tolist()
    severities = said.field("severity").tolist()
    ids, parts = said.field("id").tolist(), said.field("chunk_seq").tolist()
    joined: list[tuple[float, int, str]] = []
    open_id, next_part = 0, 0
    for t, severity, text, number, part in zip(
        times, severities, said.field("text"), ids, parts, strict=True
    ):
        follows = number and number == open_id and part == next_part and part > 0
        if follows and t - joined[-1][0] < _CHUNK_WAIT_S:
            joined[-1] = (joined[-1][0], severity, joined[-1][2] + text)
        else:
            joined.append((t, severity, text))
        open_id, next_part = (number, part + 1) if len(text) >= _CHUNK else (0, 0)
    cleaned = {text: clean_text(text) for text in dict.fromkeys(text for _, _, text in joined)}
    for t, severity, text in joined:
        yield t, severity, cleaned[text]


def with_mavlink_severities(
    events: list[Event], autopilot: str, firmware: str | None, recorded: str | None
) -> list[Event]:
    """Return the events with severities as MAVLink has them, whatever firmware told them.

    Parameters
    ----------
    recorded : str or None
        UTC as ISO 8601; decides where the log names no firmware.
    """
    table = data_table("severities")
    named = _VERSION.match(firmware or "")
    since = table["since"].get(named[1]) if named else None
    if since is not None and named is not None:
        is_old = (int(named[2]), int(named[3])) < tuple(since)
    else:
        is_old = firmware is None and recorded is not None and recorded < table["recorded"]
    if autopilot != "ardupilot" or not is_old:
        return events
    old: Mapping[str, int] = table["old"]
    return [replace(e, severity=old.get(str(e.severity), e.severity)) for e in events]


def parameters(
    own: Own, line: Timeline, autopilot: str
) -> tuple[dict[str, float], tuple[ParameterChange, ...], list[Event], int]:
    """Return the parameters as first sent, the later changes, these as events, and what is left.

    That is how many records were left out because their names are too many.
    """
    sent = own.get(_PARAM_VALUE)
    if sent is None:
        return {}, (), [], 0
    kept = kept_values(np.arange(sent.rows.size))
    sent = sent if kept is None else sent.of(kept)
    with np.errstate(invalid="ignore"):  # signalling NaN
        values = sent.field("param_value").astype(np.float64)
    if autopilot == "px4":
        values = _bytewise(sent, values)
    # the records of every parameter together, in file order: then a change is a step to the next
    names, name, beyond = _parameter_names(sent)
    rows = np.flatnonzero((name >= 0) & np.isfinite(values))
    rows = rows[np.argsort(name[rows], kind="stable")]
    name, values, times = name[rows], values[rows], line.created[sent.rows[rows]]
    is_first = np.diff(name, prepend=-1) != 0
    first = {names[name[i]]: float(values[i]) for i in np.flatnonzero(is_first).tolist()}
    again = np.flatnonzero((values[1:] != values[:-1]) & ~is_first[1:]) + 1
    changes = tuple(
        ParameterChange(float(times[i]), names[name[i]], float(values[i - 1]), float(values[i]))
        for i in again[np.argsort(rows[again])].tolist()
    )
    events = [change.event() for change in changes]
    return dict(sorted(first.items())), changes, events, beyond


def _parameter_names(sent: Payloads) -> tuple[list[str], NDArray[np.int16], int]:
    """Return the names of parameters, which one every record has, (m,); -1: none.

    The last: how many records have none because there are `MOST_NAMES` before.
    """
    texts, text = sent.texts("param_id")
    number: dict[str, int] = {}
    of_text = [
        number.setdefault(name, len(number)) if PARAMETER_NAME.fullmatch(name) else -1
        for name in texts
    ]
    which = np.array(of_text, np.int64)[text]
    beyond = which >= MOST_NAMES
    which[beyond] = -1
    # numpy sorts numbers of 16 bits by counting
    return list(number)[:MOST_NAMES], which.astype(np.int16), int(beyond.sum())


def told_too_much(own: Own, beyond: int) -> Iterator[QualityRecord]:
    """Yield what is left out of parameters and texts; ``beyond`` as `parameters` returns it."""
    values, texts = (
        own[number].rows.size if number in own else 0 for number in (_PARAM_VALUE, _STATUSTEXT)
    )
    yield from records_left_out(values, beyond, texts)


def _bytewise(sent: Payloads, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with integers taken from the bytes of the float, as PX4 sends them."""
    bits = np.ascontiguousarray(sent.field("param_value")).view("<u4")
    kinds = sent.field("param_type")
    values = values.copy()
    for kind, dtype in _INTEGERS.items():
        here = kinds == kind
        width = np.dtype(dtype).itemsize
        low = bits[here].view(np.uint8).reshape(-1, 4)[:, :width]
        values[here] = np.ascontiguousarray(low).view(dtype).reshape(-1)
    return values


def firmware(own: Own, events: list[Event], maker: str | None) -> str | None:
    """Return the firmware's name and version, from its greeting or AUTOPILOT_VERSION.

    ``maker`` is the name to go with a bare version number.
    """
    greeted = greeting(event.text for event in events if event.kind == "text")
    version = own.get(_AUTOPILOT_VERSION)
    if greeted is not None or version is None or not version.rows.size:
        return greeted
    number = int(version.field("flight_sw_version")[-1])
    if not number:
        return None
    bare = f"{number >> 24}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}"
    return f"{maker} {bare}" if maker else bare
