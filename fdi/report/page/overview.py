"""Which plots does everybody look at first?

In: a log. Out: panels of height, speed, attitude as demanded and as flown, outputs, battery,
vibration, the estimator's ratios and the satellites, as far as the log holds them. Every format's
log is read in MAVLink's words, so one table of channels serves all.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.report.page.panel import Curve, Look, Panel
from fdi.telemetry import Log
from fdi.telemetry.events import flight_state
from fdi.telemetry.motion import heights_by_pressure
from fdi.units import customary

Floats = NDArray[np.float64]


_YAW_DEMAND: Final = "ATT.DesYaw"


class _Row(NamedTuple):
    """A curve: its label, the channels that may show it, the best first, and its look."""

    label: str
    channels: tuple[str, ...]
    look: Look = "line"


_PANELS: Final[tuple[tuple[str, tuple[_Row, ...]], ...]] = (
    (
        "Height above take-off",
        (_Row("flown", ("GLOBAL_POSITION_INT.relative_alt",)),),
    ),
    (
        "Speed",
        (
            _Row("over ground", ("VFR_HUD.groundspeed", "GPS_RAW_INT.vel")),
            _Row("through the air", ("VFR_HUD.airspeed",)),
            _Row("climb", ("VFR_HUD.climb",)),
        ),
    ),
    (
        "Roll",
        (
            _Row("flown", ("ATTITUDE.roll",)),
            _Row("demanded", ("NAV_CONTROLLER_OUTPUT.nav_roll",), "dash"),
        ),
    ),
    (
        "Pitch",
        (
            _Row("flown", ("ATTITUDE.pitch",)),
            _Row("demanded", ("NAV_CONTROLLER_OUTPUT.nav_pitch",), "dash"),
        ),
    ),
    ("Yaw", (_Row("flown", ("ATTITUDE.yaw",)), _Row("demanded", (_YAW_DEMAND,), "dash"))),
    ("Throttle", (_Row("throttle", ("VFR_HUD.throttle",)),)),
    (
        "Battery voltage",
        (_Row("voltage", ("SYS_STATUS.voltage_battery", "BATTERY_STATUS.voltages[0]")),),
    ),
    (
        "Battery current",
        (_Row("current", ("SYS_STATUS.current_battery", "BATTERY_STATUS.current_battery")),),
    ),
    (
        "Vibration",
        tuple(_Row(axis, (f"VIBRATION.vibration_{axis}",)) for axis in "xyz"),
    ),
    (
        "Estimator: innovations, 1 is rejected",
        tuple(
            _Row(label, (f"EKF_STATUS_REPORT.{ekf}", f"ESTIMATOR_STATUS.{ratio}"))
            for label, ekf, ratio in (
                ("velocity", "velocity_variance", "vel_ratio"),
                ("position", "pos_horiz_variance", "pos_horiz_ratio"),
                ("height", "pos_vert_variance", "pos_vert_ratio"),
                ("compass", "compass_variance", "mag_ratio"),
                ("airspeed", "airspeed_variance", "tas_ratio"),
            )
        ),
    ),
    ("Satellites", (_Row("seen", ("GPS_RAW_INT.satellites_visible",)),)),
)
_OUTPUTS_AFTER: Final = "Yaw"
_OUTPUTS: Final = ("MOTORS", "OUTPUTS", "SERVO_OUTPUT_RAW")
MOST_OUTPUTS: Final = 12
_BY_RECEIVER: Final = "GPS_RAW_INT.alt"
_HEIGHTS: Final = ("VFR_HUD.alt", _BY_RECEIVER)
_METRES: Final = "m"
_SAME_M: Final = 0.05


def overview(log: Log) -> list[Panel]:
    """Return the panels of a log; those of which it knows nothing are left out."""
    panels = []
    for title, rows in _PANELS:
        panel = _panel(title, rows, log)
        if panel is None and title.startswith("Height"):
            panel = _panel("Height above the sea", (_Row("flown", _HEIGHTS),), log)
        if panel is not None:
            panels.append(_with_witnesses(panel, log) if title.startswith("Height") else panel)
        if title == _OUTPUTS_AFTER:
            panels += _outputs(log)
    return panels


def curve_of(log: Log, label: str, channel: str, look: Look = "line") -> tuple[Curve, str] | None:
    """Return a channel as a curve in customary units, and its unit; None where nothing is known."""
    source, _, name = channel.partition(".")
    if source not in log or name not in log[source]:
        return None
    data = log.channel(channel)
    if not np.isfinite(data.value).any():
        return None
    unit, scale, offset = customary(data.unit)
    value = data.value * scale + offset
    if channel == _YAW_DEMAND:  # 0 to 360 degrees, and what is flown is -180 to 180
        return Curve(label, data.t, (value + 180.0) % 360.0 - 180.0, look=look), unit
    return Curve(label, data.t, value, channel, look), "" if unit == "1" else unit


def _panel(title: str, rows: tuple[_Row, ...], log: Log) -> Panel | None:
    curves, units = [], []
    for row in rows:
        found = (curve_of(log, row.label, channel, row.look) for channel in row.channels)
        first = next((one for one in found if one is not None), None)
        if first is not None and np.nanmax(np.abs(first[0].value)) > 0:  # 0 all along: not there
            curves.append(first[0])
            units.append(first[1])
    return Panel(title, units[0], tuple(curves)) if curves else None


def _outputs(log: Log) -> list[Panel]:
    for source in _OUTPUTS:
        if source not in log:
            continue
        names = [name for name in log[source].fields if "raw" in name or source != _OUTPUTS[-1]]
        found = [curve_of(log, name, f"{source}.{name}") for name in names]
        moving = [one for one in found if one is not None and np.nanmax(np.abs(one[0].value)) > 0]
        if moving:
            curves = tuple(curve for curve, _ in moving[:MOST_OUTPUTS])
            return [Panel("Outputs to motors and surfaces", moving[0][1], curves)]
    return []


def _with_witnesses(panel: Panel, log: Log) -> Panel:
    """Return a panel of the height with all else in the log that tells a height."""
    flown = panel.curves[0]
    known = np.isfinite(flown.value)
    if not known.any():
        return panel
    others = (_demanded(flown, log), *_measured(flown, panel.unit, log))
    return Panel(panel.title, panel.unit, (flown, *(one for one in others if one is not None)))


def _demanded(flown: Curve, log: Log) -> Curve | None:
    """Return the height that was demanded while a mode controls it; None where nothing tells it.

    ``alt_error`` is demanded less flown (MAVLink).
    """
    error = curve_of(log, "demanded", "NAV_CONTROLLER_OUTPUT.alt_error", "dash")
    if error is None or not np.nanmax(np.abs(error[0].value)) > 0:
        return None
    own, known = error[0], np.isfinite(flown.value)
    at = np.interp(own.t, flown.t[known], flown.value[known], left=np.nan, right=np.nan)
    controlled = flight_state(own.t, log.reported, ()).controls_height
    return Curve("demanded", own.t, np.where(controlled, own.value + at, np.nan), look="dash")


def _measured(flown: Curve, unit: str, log: Log) -> Iterator[Curve]:
    """Yield the heights that sensors measure, moved to where the flown one is at take-off.

    An estimate that runs away from both of them shows at once.
    """
    start = next((flight.airborne[0] for flight in log.flights if flight.flew), flown.t[0])
    pressed = heights_by_pressure(log.messages)
    found = [("by air pressure", *pressed, _METRES)]
    receiver = curve_of(log, "", _BY_RECEIVER)
    if receiver is not None and flown.channel != _BY_RECEIVER:
        found.append(("by the receiver", receiver[0].t, receiver[0].value, receiver[1]))
    for label, t, value, its_unit in found:
        known = np.isfinite(value)
        if its_unit == unit and known.any():
            own = float(np.interp(start, t[known], value[known]))
            here = np.isfinite(flown.value)
            level = float(np.interp(start, flown.t[here], flown.value[here]))
            moved = value - own + level
            same = np.interp(t[known], flown.t[here], flown.value[here])
            if np.abs(moved[known] - same).max() > _SAME_M:  # or it is the same reading
                yield Curve(label, t, moved)
