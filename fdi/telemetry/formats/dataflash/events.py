"""What did the vehicle say and do, by its DataFlash records: modes, arming, texts, parameters?

In: the records by name and their times. Out: `Event`s, parameters and their changes, the vehicle.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.catalogue import data_table, is_failsafe_text, mavlink_mode
from fdi.telemetry.events import Event, Kind, over_words
from fdi.telemetry.formats.bounds import (
    MOST_NAMES,
    kept_texts,
    kept_values,
    records_left_out,
)
from fdi.telemetry.formats.commands import command_events
from fdi.telemetry.formats.dataflash.clock import Times
from fdi.telemetry.formats.dataflash.layouts import Ints
from fdi.telemetry.formats.dataflash.tables import Table, Tables, columns
from fdi.telemetry.formats.wording import PARAMETER_NAME, clean_text
from fdi.telemetry.log import ParameterChange
from fdi.telemetry.quality import QualityRecord

_CRITICAL: Final = 2  # MAV_SEVERITY
_ARMED: Final = 10  # EV.Id
_DISARMED: Final = 11
_INTERLOCK: Final = 56
_STOPS: Final = {
    54: "emergency stop: all motors are stopped by a switch",
    _INTERLOCK: "motor interlock: all motors are stopped by a switch",
}
"""EV.Id; of rotors, which run again where it is taken back."""
_SAME_S: Final = 0.5  # s, in which EV and ARM tell of one arming
_COMMON_REASONS: Final = {"plane": 9, "vtol": 9, "sub": 12, "rover": 3, "boat": 3}
"""MODE.Rsn below it means the same in all firmware; from it on otherwise in older ones."""
_OWN_CODES: Final = ("flight mode", "EKF primary changed")  # ECode 0 is a number, not "resolved"
_ALARMS: Final = (
    *("failsafe", "crash check", "EKF check", "thrust loss check"),
    *("CPU", "pilot input"),
)


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
    for table, times in zip(timed.tables, timed.times, strict=True):
        field = table.layout.field("Message")
        if table.layout.name != "MSG" or field is None or not field.is_text:
            continue
        moments, kept = times.t, kept_texts(table.start.size)
        if kept is not None:
            moments, table = moments[kept], table.source.part(table, kept)
        texts, which = table.source.codes(table, field)
        shown = [(clean_text(text), is_failsafe_text(text)) for text in texts]
        for t, i in zip(moments.tolist(), which.tolist(), strict=True):
            text, is_failsafe = shown[i]
            events.append(Event(t, "text", text))
            if is_failsafe:
                events.append(Event(t, "failsafe", text))
    # ArduPilot writes it once, after its watchdog has started it anew
    for t, task, fault in timed.lines("WDOG", "Tsk", "FT"):
        text = f"watchdog reset: the program had stopped in task {task}, fault {fault}"
        events.append(Event(t, "text", text, _CRITICAL))
    return sorted(events, key=lambda e: e.t)


def log_events(timed: Timed, vehicle: str, firmware: str | None) -> Iterator[Event]:
    """Yield modes, arming, stops of the motors and errors."""
    number = None
    reasons = dict(timed.lines("MODE", "Rsn"))
    for name in ("ModeNum", "Mode"):
        for t, mode in timed.lines("MODE", name):
            if mode != number and isinstance(mode, int | str):
                by = _mode_orderer(reasons.get(t), vehicle, firmware)
                yield Event(t, "mode", _mode(mode, vehicle), by=by)
                number = mode
        if number is not None:
            break
    yield from _arming(timed)
    sent = sorted(timed.lines("MAVC", "Cmd", "P1", "P2"))
    yield from command_events(sent)
    disarmed = -np.inf
    for t, code in sorted(timed.lines("EV", "Id")):
        if code == _DISARMED:
            disarmed = t
        # the interlock is off as soon as the motors are disarmed: then nobody switched it
        elif code in _STOPS and not (code == _INTERLOCK and t - disarmed < _SAME_S):
            yield Event(t, "command", _STOPS[code])
    for t, subsystem, code in timed.lines("ERR", "Subsys", "ECode"):
        name = data_table("errors_dataflash")["subsystems"].get(str(subsystem), "")
        is_alarm = name.startswith(_ALARMS)
        if code or name in _OWN_CODES:
            yield Event(t, "failsafe" if is_alarm else "text", error_words(subsystem, code))
        elif is_alarm:
            told = {
                **data_table("errors_dataflash")["bits"].get(str(subsystem), {}),
                **data_table("errors_dataflash")["codes"].get(str(subsystem), {}),
            }
            yield Event(t, "text", over_words(next(iter(told.values()), name)))


def _arming(timed: Timed) -> Iterator[Event]:
    """Yield arming and disarming, with who ordered it where a record of the moment says so."""
    said = [
        (t, code == _ARMED) for t, code in timed.lines("EV", "Id") if code in (_ARMED, _DISARMED)
    ]
    said += [(t, bool(state)) for t, state in timed.lines("ARM", "ArmState")]
    methods = [(t, bool(s), m) for t, s, m in timed.lines("ARM", "ArmState", "Method")]
    armed = None
    for t, state in sorted(said):
        if state != armed:
            by = (m for at, s, m in methods if s == state and abs(at - t) <= _SAME_S)
            kind: Kind = "arm" if state else "disarm"
            yield Event(t, kind, "", by=data_table("orders")["arming"].get(str(next(by, "")), ""))
            armed = state


def _mode_orderer(reason: object, vehicle: str, firmware: str | None) -> str:
    """Return who ordered a mode, "" where nobody can tell: of old others meant others by them."""
    if not isinstance(reason, int):
        return ""
    if reason >= _COMMON_REASONS.get(vehicle, np.inf):
        version = re.search(r" V?(\d+)\.(\d+)", firmware or "")
        if version is None or (int(version[1]), int(version[2])) < (4, 1):
            return ""
    return str(data_table("orders")["mode"].get(str(reason), ""))


def error_words(subsystem: object, code: object) -> str:
    """Return what an error of the firmware's says, by its numbers.

    Examples
    --------
    >>> error_words(6, 1), error_words(24, 1)
    ('battery failsafe: voltage or remaining charge below its limit', \
'the estimator changed to core 1')
    >>> error_words(9, 3)
    'fence breached: too high, fence breached: too far from home'
    >>> error_words(3, 77), error_words(99, 1)
    ('error of compass, code 77', 'error of subsystem 99, code 1')
    """
    table = data_table("errors_dataflash")
    bits = table["bits"].get(str(subsystem))
    if bits and isinstance(code, int):
        told = [words for bit, words in bits.items() if code & int(bit)]
        if told:
            return ", ".join(told)
    said = table["codes"].get(str(subsystem), {})
    words = said.get(str(code), said.get("#"))
    if words is not None:
        return str(words).replace("#", str(code))
    name = table["subsystems"].get(str(subsystem), f"subsystem {subsystem}")
    return f"error of {name}, code {code}"


@lru_cache(maxsize=256)
def _mode(said: int | str, vehicle: str) -> str:
    """Return the name of a mode by its number or by a name (``AltHold``, ``ALT_HOLD``)."""
    if isinstance(said, int):
        return mavlink_mode(said, autopilot="ardupilot", vehicle=vehicle)
    table = data_table("modes_mavlink")
    known = table["modes"][table["mode_table"][vehicle]]
    if said.isascii() and said.isdecimal():
        return str(known.get(said, f"MODE_{said}"))
    same = {name.replace("_", ""): name for name in known.values()}
    plain = clean_text(said).upper()
    return str(same.get(plain.replace("_", ""), plain))


def parameters(
    timed: Timed,
) -> tuple[dict[str, float], tuple[ParameterChange, ...], list[Event], int]:
    """Return the parameters as first written, the later changes, these as events, and what is left.

    That is how many records were left out because their names are too many.
    """
    first: dict[str, float] = {}
    now: dict[str, float] = {}
    changes, beyond = [], 0
    for t, name, value in _parameter_news(timed):
        if len(now) == MOST_NAMES and name not in now:
            beyond += 1
            continue
        old = now.get(name, value)
        if value != old:
            changes.append(ParameterChange(t, name, old, value))
        first.setdefault(name, value)
        now[name] = value
    events = [change.event() for change in changes]
    return dict(sorted(first.items())), tuple(changes), events, beyond


def defaults(timed: Timed) -> dict[str, float]:
    """Return the firmware's own defaults, of the parameters whose records tell them."""
    found: dict[str, float] = {}
    for _, table, names, which in _parameter_tables(timed):
        default = table.layout.field("Default")
        if default is None or default.is_text:
            continue
        said = np.ascontiguousarray(table.column(default))
        codes, first = np.unique(which, return_index=True)
        for code, row in zip(codes.tolist(), first.tolist(), strict=True):
            if PARAMETER_NAME.fullmatch(names[code]) and np.isfinite(said[row]):
                found.setdefault(names[code], float(said[row]))
    return dict(sorted(found.items())[:MOST_NAMES])


def _parameter_tables(
    timed: Timed,
) -> Iterator[tuple[NDArray[np.float64], Table, NDArray[Any], Ints]]:
    """Yield the tables of parameters that are kept: times, table, names, and which of them each."""
    for table, times in zip(timed.tables, timed.times, strict=True):
        one = table.layout
        name, value = one.field("Name"), one.field("Value")
        if one.name != "PARM" or name is None or value is None:
            continue
        if not name.is_text or value.is_text:
            continue
        t, kept = times.t, kept_values(np.arange(table.start.size))
        if kept is not None:
            t, table = t[kept], table.source.part(table, kept)
        yield t, table, *table.source.codes(table, name)


def _parameter_news(timed: Timed) -> Iterator[tuple[float, str, float]]:
    """Yield in file order where a parameter is not what its record before said: t, name, value."""
    for t, table, names, which in _parameter_tables(timed):
        value = table.layout.field("Value")
        assert value is not None
        is_name = np.array([PARAMETER_NAME.fullmatch(text) is not None for text in names])
        values = np.ascontiguousarray(table.column(value))
        rows = np.flatnonzero(is_name[which] & np.isfinite(values))
        # of numbers with 16 bits the order is found in linear time
        narrow = which.astype(np.uint16) if names.size < 1 << 16 else which
        order = rows[np.argsort(narrow[rows], kind="stable")]
        named, said = narrow[order], values[order]
        is_news = np.ones(order.size, np.bool_)
        is_news[1:] = (named[1:] != named[:-1]) | (said[1:] != said[:-1])
        for row in np.sort(order[is_news]).tolist():
            yield float(t[row]), names[which[row]], float(values[row])


def told_too_much(tables: Tables, beyond: int) -> Iterator[QualityRecord]:
    """Yield what is left out of parameters and texts; ``beyond`` as `parameters` returns it."""
    values, texts = (
        sum(x.start.size for x in tables if x.layout.name == name) for name in ("PARM", "MSG")
    )
    yield from records_left_out(values, beyond, texts)
