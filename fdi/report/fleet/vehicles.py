"""Which logs are of one vehicle, and how did it change over its flights?

In: rows of `fdi.fleet`. Out: `Vehicle`s with their trends as pictures. One vehicle is what has the
same board; where logs tell none, what has the same type, autopilot, system id and sensors, of which
there may be several: that is said. Flights stand in the order of their dates, where all tell one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, Final

from fdi.report.fleet.flagged import is_flagged
from fdi.report.fleet.trend import Drawn, Point, drawn
from fdi.report.style import label
from fdi.report.words import plural
from fdi.units import customary

Row = Mapping[str, Any]
_TITLES: Final = {
    "thrust_share": "Thrust asked of",
    "vibration": "Vibration of unit",
    "compass_deviation": "Deviation of compass",
    "battery_resistance": "Resistance of",
}
_QUANTITIES: Final = {
    "thrust_share": "Thrust asked of each motor, over the mean of all",
    "vibration": "Vibration",
    "compass_deviation": "Compass: north by it less north by attitude and place",
    "battery_resistance": "Battery: internal resistance under load",
    "identified": "What the model identified in the first seconds",
}
"""In the order of the page."""
LEAST: Final = 2
"""Flights of a trend."""


@dataclass(frozen=True, slots=True)
class Group:
    """The trends of one quantity; ``is_folded``: for who asks."""

    title: str
    trends: tuple[Drawn, ...]
    is_folded: bool


@dataclass(frozen=True, slots=True)
class Vehicle:
    """The logs of one vehicle.

    Attributes
    ----------
    name : str
    doubt : str
        Why they may be of several; "" where their board tells that they are not.
    order : str
        In which order its flights stand.
    rows : tuple of int
        Places among the rows.
    groups : tuple of Group
    """

    name: str
    doubt: str
    order: str
    rows: tuple[int, ...]
    groups: tuple[Group, ...]

    @property
    def outside(self) -> int:
        """How many trends end outside what the quiet flights before let expect."""
        return sum(trend.is_outside for group in self.groups for trend in group.trends)


def vehicles_of(rows: Sequence[Row]) -> list[Vehicle]:
    """Return the vehicles of rows that have trends to show; who flew most stands first."""
    logs: dict[tuple[Any, ...], list[int]] = {}
    for place, row in enumerate(rows):
        if row["error"] is None and row["same_flight_as"] is None:  # a point is a flight
            logs.setdefault(_key(row), []).append(place)
    found = [_vehicle(places, rows) for places in logs.values() if len(places) >= LEAST]
    return sorted((one for one in found if one.groups), key=lambda one: -len(one.rows))


def _key(row: Row) -> tuple[Any, ...]:
    if row["hardware_kind"] == "board":
        return (row["hardware"], row["vehicle"])
    return (row["hardware"], row["vehicle"], row["autopilot"], row["system_id"])


def _vehicle(places: Sequence[int], rows: Sequence[Row]) -> Vehicle:
    first = rows[places[0]]
    is_dated = all(rows[place]["start_utc"] for place in places)
    ordered = sorted(places, key=lambda p: rows[p]["start_utc"]) if is_dated else list(places)
    kind = first["hardware_kind"] or "none"
    name = f"{first['vehicle']}, {first['autopilot']}, system {first['system_id']}"
    doubt = {
        "board": "",
        "sensors": "No log tells the serial number of its board. These have the same sensors; "
        "another vehicle of that build would stand among them.",
        "none": "The logs tell neither board nor sensors: these may be of several vehicles.",
    }[kind]
    order = "by their dates" if is_dated else "as the logs are listed, since not all tell a date"
    groups = (_group(quantity, ordered, rows) for quantity in _QUANTITIES)
    return Vehicle(
        name=f"{first['hardware']}, {name}" if kind == "board" else name,
        doubt=doubt,
        order=order,
        rows=tuple(ordered),
        groups=tuple(group for group in groups if group.trends),
    )


def _group(quantity: str, places: Sequence[int], rows: Sequence[Row]) -> Group:
    points: dict[tuple[str, str], list[Point]] = {}
    for place in places:
        row = rows[place]
        own = [one for one in row["trends"] if one["quantity"] == quantity]
        several = len({one["flight"] for one in own}) > 1
        for one in sorted(own, key=lambda one: one["flight"]):
            name = label(PurePath(row["path"]).name)
            called = f"{name} #{one['flight'] + 1}" if several else name
            _, scale, _ = customary(one["unit"])
            point = Point(
                one["value"] * scale, one["std"] * scale, called, place + 1, is_flagged(row)
            )
            points.setdefault((one["part"], one["unit"]), []).append(point)
    shown = [
        drawn(_title(quantity, part), customary(unit).unit, own)
        for (part, unit), own in sorted(points.items())
        if len(own) >= LEAST
    ]
    return Group(_QUANTITIES[quantity], tuple(shown), quantity == "identified")


def _title(quantity: str, part: str) -> str:
    if quantity == "identified":
        return part
    words = part.replace("_", " ")
    number = part.rpartition("_")[2]
    return f"{_TITLES[quantity]} {number if quantity in _NUMBERED else words}"


_NUMBERED: Final = ("vibration", "compass_deviation")


def told_of(vehicle: Vehicle) -> str:
    """Return what a page says beside a vehicle's name."""
    logs = plural(len(vehicle.rows), "log")
    if not vehicle.outside:
        return logs
    return f"{logs}; {plural(vehicle.outside, 'quantity', 'quantities')} of the last flight unusual"
