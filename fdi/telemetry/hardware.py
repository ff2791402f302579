"""Which hardware does a log name: board, sensors, receivers, battery monitors?

In: a log. Out: `Hardware`: the parts that it names, each with the words that tell it, and the kinds
of which it tells nothing. Ids of sensors are taken apart as the firmware puts them together, and
types named by the firmware's own lists (``data/hardware.json``, with their sources); a number that
is not in them stays a number. What is set is not always there: a parameter tells what the autopilot
was told to use, a text what it found when it started.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fdi.shown import Shown
from fdi.telemetry.catalogue import data_table
from fdi.telemetry.identity import identity_of
from fdi.telemetry.log import Log

KINDS: Final = (
    "autopilot board",
    "operating system",
    "accelerometer",
    "gyroscope",
    "compass",
    "barometer",
    "airspeed sensor",
    "GPS receiver",
    "radio control receiver",
    "ESC and outputs",
    "battery monitor",
)
"""In the order in which they are told."""
EXPECTED: Final = tuple(
    kind for kind in KINDS if kind not in ("airspeed sensor", "operating system")
)
"""Kinds that every vehicle has: of these it is said where a log names none."""
MOST: Final = 24
"""Parts of a kind; a log that names more says so by a parameter or text each, which it keeps."""
_IDS: Final = {
    "ardupilot": (
        (r"INS_ACC([23]?)_ID|INS([45])_ACC_ID", "accelerometer", "imu"),
        (r"INS_GYR([23]?)_ID|INS([45])_GYR_ID", "gyroscope", "imu"),
        (r"COMPASS_DEV_ID([2-9]?)|COMPASS([1-3])_DEV_ID", "compass", "compass"),
        (r"BARO([1-3])_DEVID|GND_BARO_ID([23]?)", "barometer", "barometer"),
        (r"ARSPD([2-6]?)_DEVID", "airspeed sensor", "airspeed"),
    ),
    "px4": (
        (r"CAL_ACC([0-3])_ID", "accelerometer", "type"),
        (r"CAL_GYRO([0-3])_ID", "gyroscope", "type"),
        (r"CAL_MAG([0-3])_ID", "compass", "type"),
        (r"CAL_BARO([0-3])_ID", "barometer", "type"),
    ),
}
"""Parameters that hold the id of a sensor: its kind, and the list of types."""
_SETTINGS: Final = (
    (r"GPS_TYPE(2?)|GPS([12])_TYPE", "GPS receiver", "gps"),
    (r"BATT([2-9]?)_MONITOR", "battery monitor", "battery"),
    (r"(?:Q_M|MOT)_PWM_TYPE()", "ESC and outputs", "motor_output"),
)
"""Parameters of ArduPilot that hold what a part was set to."""
_TEXTS: Final = (
    (r"(ChibiOS|NuttX): ([0-9a-f]{8})\b", "operating system"),
    (r"GPS \d: (?:detected|specified) as (.+)", "GPS receiver"),
    (r"u-blox \d HW: .+", "GPS receiver"),
    (r"(?:\[gps\] )?u-blox firmware version: .+", "GPS receiver"),
    (r"RC Protocol: .+", "radio control receiver"),
    (r"RCInput: .+", "radio control receiver"),
    (r"RCOut: .+", "ESC and outputs"),
    (r"APM [12](?:\.\d)?$", "autopilot board"),
)
"""What ArduPilot and PX4 say of what they found, when they start or later."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part that a log names: its kind, what it is, and the record that says so."""

    kind: str
    what: str
    told_by: str


@dataclass(frozen=True, slots=True)
class Hardware(Shown):
    """The hardware that a log names.

    Attributes
    ----------
    parts : tuple of Part
        In the order of `KINDS`.
    not_told : tuple of str
        Kinds that every vehicle has and this log names none of.
    """

    parts: tuple[Part, ...]
    not_told: tuple[str, ...]


def hardware_of(log: Log) -> Hardware:
    """Return the hardware that a log names."""
    found = dict.fromkeys([*_boards(log), *_sensors(log), *_settings(log), *_said(log)])
    parts = [part for kind in KINDS for part in [p for p in found if p.kind == kind][:MOST]]
    named = {part.kind for part in parts}
    return Hardware(tuple(parts), tuple(kind for kind in EXPECTED if kind not in named))


def sensor_of_id(number: int, types: str, autopilot: str) -> str:
    """Return what a sensor's id says of it: type, bus and address.

    Parameters
    ----------
    number : int
    types : str
        The list of types: of ArduPilot ``imu``, ``compass``, ``barometer`` or ``airspeed``; of PX4
        ``type``.
    autopilot : str
        ``ardupilot`` or ``px4``.

    Examples
    --------
    >>> sensor_of_id(2621706, "imu", "ardupilot")
    'ICM20689 on SPI bus 1, address 1'
    >>> sensor_of_id(396809, "type", "px4")
    'IST8310 on I2C bus 1, address 0x0e'
    """
    table: Mapping[str, Any] = data_table("hardware")[autopilot]
    bus_type, bus, address = number & 7, number >> 3 & 31, number >> 8 & 255
    kind = str(number >> 16)
    if kind == "0":
        return f"id {number}, which names no type"
    name = table["by_bus"].get(str(bus_type)) or table[types].get(kind, f"type {kind}")
    where = table["bus"].get(str(bus_type))
    if where is None:
        return f"{name}, bus not known"
    if where in ("DroneCAN", "UAVCAN"):
        return f"{name}, bus {bus}, node {address}"
    shown = f"0x{address:02x}" if where == "I2C" else str(address)
    return f"{name} on {where} bus {bus}, address {shown}"


def _boards(log: Log) -> Iterator[Part]:
    identity = identity_of(log)
    if identity.kind == "board":
        by = "the log's own information" if log.board else "text at the start"
        yield Part("autopilot board", identity.hardware, by)
    for message, field, shift in (
        ("AUTOPILOT_VERSION", "board_version", 16),
        ("VER", "APJ", 0),
    ):
        if message not in log or field not in log[message]:
            continue
        known = log[message].raw(field).astype(np.float64)
        for number in sorted({int(value) >> shift for value in known[np.isfinite(known)]} - {0}):
            named = data_table("hardware")["boards"].get(str(number))
            what = f"board type {number} of the bootloader"
            yield Part(
                "autopilot board", f"{named} ({what})" if named else what, f"{message}.{field}"
            )


def _sensors(log: Log) -> Iterator[Part]:
    for pattern, kind, types in _IDS.get(log.autopilot, ()):
        first = 1 if log.autopilot == "px4" else 0
        for name, place, value in _matching(log, pattern):
            number = int(place or 1) + first
            what = sensor_of_id(int(value), types, log.autopilot)
            yield Part(kind, f"{number}: {what}", f"{name} = {int(value)}")


def _settings(log: Log) -> Iterator[Part]:
    if log.autopilot != "ardupilot":
        return
    table = data_table("hardware")["ardupilot"]
    for pattern, kind, values in _SETTINGS:
        for name, place, value in _matching(log, pattern, zero=values == "motor_output"):
            what = table[values].get(str(int(value)), f"kind {int(value)}")
            set_to = f"set to: {what}"
            numbered = f"{place or 1}: {set_to}" if values != "motor_output" else set_to
            yield Part(kind, numbered, f"{name} = {int(value)}")


def _matching(log: Log, pattern: str, *, zero: bool = False) -> Iterator[tuple[str, str, float]]:
    """Yield parameters by a pattern with the number in their names; 0 says that there is none."""
    found = []
    for name, value in log.parameters.items():
        match = re.fullmatch(pattern, name)
        if match and np.isfinite(value) and (value > 0 or (zero and value == 0)):
            found.append((next((group for group in match.groups() if group), ""), name, value))
    for place, name, value in sorted(found):
        yield name, place, value


def _said(log: Log) -> Iterator[Part]:
    for event in log.reported:
        if event.kind != "text":
            continue
        text = event.text.strip()
        for pattern, kind in _TEXTS:
            found = (
                re.search(pattern, text) if kind == "operating system" else re.match(pattern, text)
            )
            if found:
                yield Part(kind, found.group(0), "text of the autopilot")
