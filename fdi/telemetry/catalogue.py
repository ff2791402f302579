"""What do the numbers of a log mean, where its own metadata are silent, ambiguous or wrong?

In: names of messages, fields, vehicles. Out: unit and sentinel corrections, names of vehicles and
modes. All of it is data: the JSON files in ``data/``, each with its sources.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files
from typing import Any

_PX4_POSITION = 3
_PX4_AUTO = 4
_PX4_EXTERNAL = range(11, 19)  # sub modes of auto, of a companion


@dataclass(frozen=True, slots=True)
class FieldMeaning:
    """Unit of a field as the dialect would spell it, and the raw values that mean unknown.

    ``blank``: the value is unknown where all these fields of the record have these raw values;
    ``range``: the least and the largest raw value that is possible.
    """

    unit: str
    invalid: tuple[float, ...] = ()
    blank: tuple[tuple[str, float], ...] = ()
    range: tuple[float, float] | None = None


@cache
def data_table(name: str) -> Mapping[str, Any]:
    """Return one of the tables in ``data/``."""
    text = files("fdi.telemetry").joinpath("data", f"{name}.json").read_text("utf-8")
    table: Mapping[str, Any] = json.loads(text)
    return table


def recorded_message(source: str) -> str:
    """Return the message that another one is made of, itself for one that is recorded.

    Examples
    --------
    >>> recorded_message("MOTORS"), recorded_message("ATTITUDE")
    ('SERVO_OUTPUT_RAW', 'ATTITUDE')
    """
    return str(data_table("logging")["made_of"].get(source, source))


def mavlink_meaning(
    message: str,
    field: str,
    unit: str,
    *,
    autopilot: str,
    vehicle: str,
    recorded: str | None = None,
) -> FieldMeaning:
    """Return what a MAVLink field means, for this autopilot and vehicle.

    Parameters
    ----------
    message, field : str
        As the dialect spells them; an array's field without index.
    unit : str
        The dialect's unit, "" where it has none.
    recorded : str, optional
        When the log was recorded, UTC as ISO 8601: an old log is no newer firmware's.
    """
    meaning: dict[str, Any] = {"unit": unit, "invalid": (), "blank": {}, "range": None}
    facts = {"autopilot": autopilot, "vehicle": vehicle}
    for rule in _rules_of(message, field):
        when, unless = rule.get("when", {}), rule.get("unless", {})
        if any(facts[key] not in allowed for key, allowed in when.items()):
            continue
        if any(facts[key] in refused for key, refused in unless.items()):
            continue
        if "before" in rule and not (recorded and recorded < rule["before"]):
            continue
        meaning.update({key: rule[key] for key in meaning if key in rule})
    blank = tuple((name, float(value)) for name, value in meaning["blank"].items())
    limits = None if meaning["range"] is None else (meaning["range"][0], meaning["range"][1])
    return FieldMeaning(meaning["unit"], tuple(map(float, meaning["invalid"])), blank, limits)


@cache  # both are of the dialect: there are so many and no more
def _rules_of(message: str, field: str) -> tuple[Mapping[str, Any], ...]:
    def concerns(pattern: str) -> bool:
        return fnmatchcase(f"{message}.{field}", pattern)

    rules = data_table("units_mavlink")["rules"]
    return tuple(rule for rule in rules if any(map(concerns, rule["fields"])))


def mavlink_vehicle(kind: int) -> str:
    """Return the vehicle's name of a MAV_TYPE, "other" where it is none of ours."""
    name: str = data_table("modes_mavlink")["vehicle"].get(str(kind), "other")
    return name


def mavlink_autopilot(number: int) -> str:
    """Return the autopilot's name of a MAV_AUTOPILOT, "other" where it is none of ours."""
    name: str = data_table("modes_mavlink")["autopilot"].get(str(number), "other")
    return name


def mavlink_firmware(autopilot: str, vehicle: str) -> str | None:
    """Return the name of the firmware that such an autopilot runs in such a vehicle."""
    table = data_table("modes_mavlink")
    name: str | None = table["firmware"].get(autopilot)
    return table["firmware"].get(table["mode_table"][vehicle]) if autopilot == "ardupilot" else name


def mavlink_mode(custom_mode: int, *, autopilot: str, vehicle: str) -> str:
    """Return the mode's name, ``MODE_<n>`` where the autopilot's numbers are not known.

    Examples
    --------
    >>> mavlink_mode(10, autopilot="ardupilot", vehicle="plane")
    'AUTO'
    >>> mavlink_mode(4 << 16 | 12 << 24, autopilot="px4", vehicle="quad")
    'EXTERNAL2'
    """
    table = data_table("modes_mavlink")
    if autopilot == "px4":
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        name = str(table["px4"]["main"].get(str(main), f"MODE_{main}"))
        if main == _PX4_POSITION:
            return str(table["px4"]["position"].get(str(sub), name))
        if main == _PX4_AUTO and sub in _PX4_EXTERNAL:
            return f"EXTERNAL{1 + sub - _PX4_EXTERNAL.start}"
        auto = table["px4"]["auto"].get(str(sub)) if main == _PX4_AUTO else None
        return f"{name}_{auto}" if auto else name
    if autopilot != "ardupilot":
        return f"MODE_{custom_mode}"
    modes = table["modes"][table["mode_table"][vehicle]]
    return str(modes.get(str(custom_mode), f"MODE_{custom_mode}"))


@cache
def _failsafe_patterns() -> tuple[re.Pattern[str], re.Pattern[str]]:
    table = data_table("failsafe_texts")
    is_one, is_none = ("|".join(table[key]) for key in ("failsafe", "not_failsafe"))
    return re.compile(is_one, re.IGNORECASE), re.compile(is_none, re.IGNORECASE)


def is_failsafe_text(text: str) -> bool:
    """Return whether a text of the autopilot says that a failsafe acts."""
    is_one, is_none = _failsafe_patterns()
    return bool(is_one.search(text)) and not is_none.search(text)
