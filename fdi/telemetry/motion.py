"""How does the vehicle move, at the times of its height?

In: a log's messages. Out: a `Motion`: height, climb rate, ground speed, turning, throttle, the
autopilot's word and the largest specific force, from the first source of each that the log has.

The trap: heights are estimates. With a frozen barometer a vehicle rests on the ground at an
estimated 35 m, so no rule asks for height zero alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.inputs.values import AXES, accelerometers, turning
from fdi.telemetry.meaning.motors import MOTORS
from fdi.telemetry.message import Message

Floats = NDArray[np.float64]

# s: an accelerometer that is logged as often as this misses no blow, which rings for 0.1 s
DENSE_S: Final = 0.05
HIGHEST_M: Final = 1e5  # m; more is damage
HOLE_S: Final = 2.0
"""s: between records further apart, and further than `USUAL` times as usual, nothing is known: for
longer neither a height nor a climb rate stays as it is in flight. With half or twice as much of
either the flights of one of 532 logs move, by 1.2 s at most."""
USUAL: Final = 4.0

_HEIGHTS: Final = (
    ("GLOBAL_POSITION_INT", "relative_alt", 1.0),
    ("LOCAL_POSITION_NED", "z", -1.0),
)
_ABSOLUTE: Final = (("VFR_HUD", "alt", 1.0), ("GPS_RAW_INT", "alt", 1.0))  # above mean sea level
_LOWEST: Final = 0.01  # share of the records below the lowest height that is believed
_CLIMBS: Final = (
    ("VFR_HUD", "climb", 1.0),
    ("GLOBAL_POSITION_INT", "vz", -1.0),
    ("LOCAL_POSITION_NED", "vz", -1.0),
)
SCATTERS_M: Final = 0.5
"""From record to record, of a barometer that may be asked: data sheets have 0.1 to 0.3 m, and a
vehicle that shakes adds as much."""
_SIGMAS: Final = 1.4826  # a deviation over the median of sizes, of Gaussian noise
_SPEEDS: Final = (("VFR_HUD", "groundspeed", 1.0), ("GPS_RAW_INT", "vel", 1.0))
_AIRSPEEDS: Final = (("VFR_HUD", "airspeed", 1.0),)
_THROTTLES: Final = (("VFR_HUD", "throttle", 1.0),)
_HOVERS: Final = (("CTUN", "ThH", 1.0), ("hover_thrust_estimate", "hover_thrust", 1.0))
_UNLEARNED: Final = (0.35, 0.5)
"""Defaults of MOT_THST_HOVER, and of THR_MID and MPC_THR_HOVER, until a flight teaches better."""
_NEAR: Final = 0.005
_PRESSURES: Final = (("SCALED_PRESSURE", "press_abs", 1.0),)
_BAROMETRIC: Final = (("CTUN", "BarAlt", 1.0), ("CTUN", "BAlt", 1.0))  # where no pressure is
_VACUUM: Final = 1e4  # Pa: no barometer reads so little below 16 km
_LANDED_STATES: Final = (("EXTENDED_SYS_STATE", "landed_state", 1.0),)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How the vehicle moved, (n,) at the times of the height; what is not in the log is NaN."""

    t: Floats
    height: Floats
    climb: Floats
    speed: Floats  # over ground
    airspeed: Floats
    turns: Floats  # rad/s
    upright: Floats  # cosine of the tilt, -1 upside down
    throttle: Floats  # or what its motors are given, of full
    hover: Floats  # the throttle of a hover, as the autopilot has learned it
    landed_state: Floats  # as the autopilot believes
    force: Floats  # the largest specific force within half a record, m/s^2
    pressed: Floats  # height by air pressure, above its first record, m
    is_dense: bool  # no blow falls between two records of the force

    def between(self, low: float, high: float) -> Motion:
        """Return the rows from time low to time high, both included."""
        return self.at(self.rows(low, high))

    def at(self, rows: slice | NDArray[np.intp]) -> Motion:
        """Return some of its rows."""
        columns = (name for name in self.__slots__ if name != "is_dense")
        return replace(self, **{name: getattr(self, name)[rows] for name in columns})

    def rows(self, low: float, high: float) -> slice:
        """Return the rows from time low to time high, both included."""
        first = int(np.searchsorted(self.t, low, side="left"))
        return slice(first, int(np.searchsorted(self.t, high, side="right")))


def motion_of(messages: Mapping[str, Message]) -> Motion:
    """Return how the vehicle moved."""
    t, height = heights(messages)

    def at_height(sources: tuple[tuple[str, str, float], ...]) -> Floats:
        return _at(t, *_first(messages, sources))

    climb = at_height(_CLIMBS)
    if t.size > 2 and not np.isfinite(climb).any():
        climb = np.gradient(height, t)
    felt = accelerometers(messages)
    force = _largest_force(felt, t)
    periods = [float(np.median(np.diff(m.t))) for m in felt if len(m) > 1]
    is_dense = bool(periods) and min(periods) <= DENSE_S
    ground_speed, airspeed = at_height(_SPEEDS), at_height(_AIRSPEEDS)
    state, throttle = at_height(_LANDED_STATES), _at(t, *_throttles(messages))
    hover = at_height(_HOVERS)
    for default in _UNLEARNED:
        hover[np.abs(hover - default) < _NEAR] = np.nan
    turns, upright = turning(messages, t), _upright(messages, t)
    pressed = _steady(_at(t, *heights_by_pressure(messages)))
    return Motion(
        t, height, climb, ground_speed, airspeed, turns, upright, throttle, hover, state, force,
        pressed, is_dense,
    )  # fmt: skip


def _at(t: Floats, known_t: Floats, values: Floats) -> Floats:
    """Return what is known at other times at those of ``t``; far from any of them NaN."""
    if not known_t.size or not t.size:
        return np.full(t.size, np.nan)
    return np.where(_told(known_t, t), np.interp(t, known_t, values), np.nan)


def _told(known_t: Floats, t: Floats) -> NDArray[np.bool_]:
    """Return at which times a record is near enough to tell: no further than half a hole."""
    after = np.searchsorted(known_t, t)
    later, earlier = known_t[np.minimum(after, known_t.size - 1)], known_t[np.maximum(after - 1, 0)]
    hole = max(HOLE_S, USUAL * float(np.median(np.diff(known_t)))) if known_t.size > 1 else HOLE_S
    return np.asarray(np.minimum(np.abs(later - t), np.abs(t - earlier)) <= hole / 2)


def heights_by_pressure(messages: Mapping[str, Message]) -> tuple[Floats, Floats]:
    """Return times, s, and heights by air pressure, m, or the autopilot's of it."""
    t, pressure = _first(messages, _PRESSURES)
    return (t, by_pressure(pressure)) if t.size else _first(messages, _BAROMETRIC)


def by_pressure(pressure: Floats) -> Floats:
    """Return heights above the first known one, m, by the standard atmosphere (ISO 2533)."""
    pressure = np.where(pressure > _VACUUM, pressure, np.nan)
    first = pressure[np.isfinite(pressure)][:1]
    if not first.size:
        return pressure
    return np.asarray(44330.8 * (1 - (pressure / first[0]) ** 0.190263))


def _steady(height: Floats) -> Floats:
    """Return heights by air pressure, of a barometer that scatters too much to be asked none."""
    bent = np.abs(np.diff(height[np.isfinite(height)], 2))
    # of white noise the second difference has six times its variance, and motion next to nothing
    if bent.size and np.median(bent) * _SIGMAS / np.sqrt(6.0) > SCATTERS_M:
        return np.full(height.size, np.nan)
    return height


def _upright(messages: Mapping[str, Message], t: Floats) -> Floats:
    attitude = messages.get("ATTITUDE")
    if attitude is None or not {"roll", "pitch"} <= set(attitude.fields):
        return np.full(t.size, np.nan)
    told = np.cos(attitude.si("roll")) * np.cos(attitude.si("pitch"))
    rows = np.isfinite(told)
    return np.interp(t, attitude.t[rows], told[rows]) if rows.any() else np.full(t.size, np.nan)


def heights(messages: Mapping[str, Message]) -> tuple[Floats, Floats]:
    """Return times and heights above the place of take-off; without one, above the lowest.

    Where an estimator tells none for a while, as one that lost its receiver, air pressure does.
    """
    t, height = _estimated(messages)
    pressed_t, pressed = heights_by_pressure(messages)
    pressed = _steady(pressed)
    pressed_t, pressed = pressed_t[np.isfinite(pressed)], pressed[np.isfinite(pressed)]
    if t.size < 2 or not pressed.size:
        return t, height
    holes = ~_told(t, pressed_t)
    if not holes.any():
        return t, height
    # changes slowly, and so is known between the edges of a hole
    apart = height - np.interp(t, pressed_t, pressed)
    times = np.append(t, pressed_t[holes])
    told = np.append(height, pressed[holes] + np.interp(pressed_t[holes], t, apart))
    order = np.argsort(times, kind="stable")
    return times[order], told[order]


def _estimated(messages: Mapping[str, Message]) -> tuple[Floats, Floats]:
    """Return times and heights of the first estimate that is in the log."""
    t, height = _first(messages, _HEIGHTS)
    is_absolute = not t.size
    if is_absolute:
        t, height = _first(messages, _ABSOLUTE)
    believed = np.abs(height) < HIGHEST_M
    t, height = t[believed], height[believed]
    return t, height - np.quantile(height, _LOWEST) if is_absolute and t.size else height


def _first(
    messages: Mapping[str, Message], sources: tuple[tuple[str, str, float], ...]
) -> tuple[Floats, Floats]:
    """Return times and values of the first source that is in the log, known ones only."""
    for name, field, sign in sources:
        message = messages.get(name)
        if message is not None and field in message:
            values = sign * message.si(field)
            known = np.isfinite(values)
            if known.sum() > 2:
                return message.t[known], values[known]
    return np.empty(0), np.empty(0)


def _throttles(messages: Mapping[str, Message]) -> tuple[Floats, Floats]:
    """Return times, s, and the throttle; of a log that tells none the mean of its motors."""
    t, throttle = _first(messages, _THROTTLES)
    motors = messages.get(MOTORS)
    if t.size or motors is None:
        return t, throttle
    given = np.array([motors.si(name) for name in motors.fields])
    known = np.isfinite(given).all(axis=0)
    return (motors.t[known], given[:, known].mean(axis=0)) if known.sum() > 2 else (t, throttle)


def _largest_force(felt: Sequence[Message], t: Floats) -> Floats:
    """Return the largest specific force of any accelerometer nearest to each time, NaN without."""
    force = np.full(t.size, np.nan)
    if t.size < 2:
        return force
    edges = (t[1:] + t[:-1]) / 2
    for message in felt:
        x, y, z = (message.si(axis) for axis in AXES)
        first = np.append(0, np.searchsorted(message.t, edges, side="right"))
        some = np.flatnonzero(np.diff(first, append=len(message)))
        with np.errstate(over="ignore"):
            largest = np.fmax.reduceat(x * x + y * y + z * z, first[some])
        force[some] = np.fmax(force[some], np.sqrt(largest))
    return force


def known(values: Floats) -> bool:
    """Return whether any of the values is known."""
    return bool(np.isfinite(values).any())
