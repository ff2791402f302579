"""Which way do the signs of this log point?

Where firmware versions differ the dialect cannot tell, the data can, by a correlation whose two
answers lie far apart.

- `GLOBAL_POSITION_INT.vz` is down positive by definition, and up positive in ArduPilot until about
  2016: against the climb rate (VFR_HUD.climb, else the change of altitude) -0.8..-1.0 in new logs,
  +0.86 and +0.95 in old ones (formats.md, trap 1).
- `WIND.direction` is where the wind comes from; ArduPilot of 2012 sent where it goes to. The drift
  (velocity over ground less that through the air) tells. Only logs as old as that are looked at: a
  dead airspeed sensor on a flight against the wind would look the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.message import Message
from fdi.telemetry.quality import QualityRecord
from fdi.units import Conversion

Floats = NDArray[np.float64]
Known = Mapping[str, Message]

_CLEAR: Final = 0.5  # |correlation| that decides; measured ones are 0.82 and more
_MOVING: Final = 0.3  # m/s, standard deviation: on the ground there is only noise
_FLYING: Final = 5.0  # m/s through the air: slower, the heading is not where it goes
_WIND_TO: Final = "2014-01-01"  # the year after the last firmware that sent it so


def vertical_speed_down(messages: Known) -> tuple[dict[str, Message], list[QualityRecord]]:
    """Return the messages with a down positive GLOBAL_POSITION_INT.vz, and what was turned."""
    position = messages.get("GLOBAL_POSITION_INT")
    if position is None or len(position) < 3:
        return dict(messages), []
    down = position.si("vz")
    climb = _climb(messages, position)
    known = np.isfinite(down) & np.isfinite(climb)
    if known.sum() < 3 or min(np.std(down[known]), np.std(climb[known])) < _MOVING:
        return dict(messages), []
    correlation = float(np.corrcoef(down[known], climb[known])[0, 1])
    if correlation < _CLEAR:
        return dict(messages), []
    unit, scale, offset = position.columns["vz"].conversion
    turned = position.with_conversion("vz", Conversion(unit, -scale, -offset))
    text = f"vz is up positive in this log (r = {correlation:+.2f} with the climb rate): turned"
    return _with(messages, turned), [_repaired(turned, "vz", text)]


def _climb(messages: Known, position: Message) -> Floats:
    hud = messages.get("VFR_HUD")
    if hud is not None and len(hud) > 2:
        return np.interp(position.t, hud.t, hud.si("climb"), left=np.nan, right=np.nan)
    altitude = position.si("relative_alt")
    return np.gradient(altitude, position.t)


def wind_from(
    messages: Known, recorded: str | None
) -> tuple[dict[str, Message], list[QualityRecord]]:
    """Return the messages with a WIND.direction where the wind comes from, and what was turned.

    ``recorded``: when, UTC as ISO 8601.
    """
    wind, hud, gps = (messages.get(key) for key in ("WIND", "VFR_HUD", "GPS_RAW_INT"))
    is_old = recorded is not None and recorded < _WIND_TO
    if not is_old or wind is None or hud is None or gps is None or not (len(hud) and len(gps)):
        return dict(messages), []
    drift = _at(wind, gps, "vel", "cog") - _at(wind, hud, "airspeed", "heading")
    said = wind.si("speed") * np.exp(1j * wind.si("direction"))
    speed = np.interp(wind.t, hud.t, hud.si("airspeed"))
    known = np.isfinite(drift) & np.isfinite(said) & (speed > _FLYING)
    sizes = float(np.sum(np.abs(drift[known]) ** 2) * np.sum(np.abs(said[known]) ** 2)) ** 0.5
    along = float(np.sum((drift[known] * said[known].conj()).real))
    if not sizes or along / sizes < _CLEAR:
        return dict(messages), []
    unit, scale, offset = wind.columns["direction"].conversion
    turned = wind.with_conversion("direction", Conversion(unit, scale, offset + pi))
    text = f"direction is where the wind goes to (r = {along / sizes:+.2f} with the drift): turned"
    return _with(messages, turned), [_repaired(turned, "direction", text)]


def _at(wind: Message, message: Message, speed: str, angle: str) -> NDArray[np.complex128]:
    """Return a velocity, north + i east, at the times of the wind."""
    velocity = message.si(speed) * np.exp(1j * message.si(angle))
    north, east = (
        np.interp(wind.t, message.t, part, left=np.nan, right=np.nan)
        for part in (velocity.real, velocity.imag)
    )
    at_wind: NDArray[np.complex128] = north + 1j * east
    return at_wind


def _with(messages: Known, message: Message) -> dict[str, Message]:
    return {**messages, message.key: message}


def _repaired(message: Message, field: str, text: str) -> QualityRecord:
    span = float(message.t[0]), float(message.t[-1])
    return QualityRecord("repaired", f"{message.key}.{field}", *span, len(message), text)
