"""How does each flight end: landed, with a blow, out of control, in the air?

In: flights, events and the messages that show attitude, demand and outputs. Out: a `FlightEnd` per
flight. Control counts as lost from the beginning of the stretch that lasts to the end of the flight
and in which the vehicle leans where nobody wants it (further than 60 degrees without a demand for
it, or 35 and as far from the demand), spins, falls with all motor outputs at their stop, or is
disarmed.

What is not known is not claimed: without a demand in the log only a mode that levels the vehicle
by itself makes a lean unwanted.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.events import Event, Flight, flight_state
from fdi.telemetry.impact import BREAKS, OVER_S
from fdi.telemetry.inputs.values import turning
from fdi.telemetry.meaning.motors import MOTORS
from fdi.telemetry.meaning.restarts import last_heard
from fdi.telemetry.message import Message
from fdi.telemetry.motion import heights_by_pressure
from fdi.telemetry.ordered import Order
from fdi.telemetry.phases import SPINS, WASH_M
from fdi.units import G0

Floats = NDArray[np.float64]
LostBy = Literal["lean", "demand", "spin", "stop"]
How = Literal[
    "landed",
    "impact",
    "restarted",
    "in_air",
    "control_lost",
    "failsafe",
    "on_ground",
    "tipped_over",
]

TILT: Final = np.radians(60.0)
"""No autopilot demands more of a vehicle that it levels: ANGLE_MAX is 30 to 45 degrees, LIM_ROLL_CD
and FW_R_LIM 45 to 65 with a demand in the log."""
ERROR: Final = np.radians(35.0)
"""Of attitude against demand: beyond the lag of any healthy turn (docs/models.md)."""
OUT_S: Final = 0.5
"""So long a vehicle must lean unwanted, or fall: a flip of the estimate or a gust passes."""
APART_S: Final = 2.0
"""So long it must not follow: a plane that rolls at 45 degrees a second needs 1.5 s for a reversal
of its bank, and more for its lag."""
SAYS: Final = re.compile(r"fail ?-?safe|emergency land|crash: disarm", re.IGNORECASE)
"""What an autopilot's report says where a failsafe acted; others are complaints."""
PAUSE_S: Final = 1.0
"""A tumbling vehicle passes through the demanded attitude; shorter pauses are no recovery."""
LAST_S: Final = 1.5
"""Control is lost at the end where it was not regained this long before."""
STOP: Final = 5.0
"""us above the lowest output of the flight: logs have outputs in whole us, mixers round."""
TOUCH_S: Final = 1.5
"""Before the time of a landing, in which the descent is that of the touch."""
FALLING: Final = 2.0
"""m/s: who sinks faster with idle rotors falls."""
SPINNING: Final = 3.5
"""rad/s: a vehicle on its legs is not turned so fast about roll and pitch, and no autopilot asks
for more about yaw in a mode that levels (MC_YAWRATE_MAX 200 degrees a second, ATC_RATE_Y_MAX)."""
BEGINS: Final = 1.0
"""rad/s: what pilots ask for and gusts do; a spin begins where its turning leaves that."""
RISES_S: Final = 2.0
"""Before it is fast, in which a spin begins; who turned so for longer turned for another reason."""
FEW: Final = 3
"""Records of an attitude, fewer of which are one that flickers."""
TIPPING_S: Final = 5.0
"""After the ground is touched, in which a vehicle that tips over does so, with turning rotors."""
STILLED_S: Final = 1.0
"""After disarming, which a heartbeat tells once a second: who turns it over then is a person."""
RESTS_S: Final = 1.0
"""Over which the weight of a vehicle that has come to rest is felt."""
BAD: Final = ("impact", "restarted", "control_lost", "tipped_over")
"""Ends of which something went wrong."""

_NEARLY: Final = 0.2  # of g, by which what is felt at rest may differ from it and scatter
_FORCE: Final = ("xacc", "yacc", "zacc")
_FREE: Final = ("ACRO", "FLIP", "SPORT", "MANUAL", "STUNT", "TRAINING", "THROW", "RATTITUDE")
"""Modes, in part or whole, in which a pilot may turn the vehicle over."""


@dataclass(frozen=True, slots=True)
class FlightEnd:
    """How one flight ends.

    Attributes
    ----------
    flight : int
        From 0.
    how : str
        ``landed``, ``impact``, ``control_lost`` (and no ground seen), ``tipped_over`` (on the
        ground, as it touched it or was to leave it), ``failsafe`` (landed or in the air, after the
        autopilot reported one), ``in_air`` (the log ends), ``restarted`` (there, as the autopilot
        started anew), ``on_ground`` (never left it).
    at : float
        s of the log's clock.
    speed : float or None
        m/s, descent just before an impact, or before the ground is touched in a landing.
    lost_control : float or None
        s, since when nobody had control of it; None where that was never lost, or is not known.
    overturned : float or None
        s, since when a vehicle with rotors lies on its back, to the end: it does not fly any more.
    lost_by : str
        How that shows: it leans (``lean``), does not follow its demand (``demand``), spins
        (``spin``), falls with all motors at their stop or is disarmed (``stop``).
    chain : tuple of Order
        What was ordered last and has been in force since, in the order of time.
    is_seen : bool
        Whether the log still shows it; not an impact of a vehicle that falls as the log ends.
    over_ground : float or None
        m/s, just before an impact, by the receiver.
    """

    flight: int
    how: How
    at: float
    speed: float | None = None
    lost_control: float | None = None
    lost_by: LostBy | None = None
    overturned: float | None = None
    chain: tuple[Order, ...] = ()
    is_seen: bool = True
    over_ground: float | None = None

    @property
    def how_fast(self) -> str:
        """How fast it was just before an impact, in words that follow a verb; "" for unknown.

        A descent alone is told as the speed; who moves faster over the ground was faster.
        """
        if self.speed is None:
            return ""
        if self.over_ground is None or self.over_ground <= self.speed:
            return f" at {self.speed:.1f} m/s"
        total = float(np.hypot(self.speed, self.over_ground))
        return f" at {total:.1f} m/s, {self.speed:.1f} m/s of it downwards"

    @property
    def is_bad(self) -> bool:
        """Whether something went wrong, whoever's fault it is."""
        return self.how in BAD or self.lost_control is not None

    @property
    def loss(self) -> str:
        """How control was lost, in words: a clause without its time."""
        if self.lost_by == "stop":
            return "all motors were told to stop"
        return "it began to spin" if self.lost_by == "spin" else "control was lost"


def find_ends(
    messages: Mapping[str, Message],
    events: Sequence[Event],
    flights: Sequence[Flight],
    *,
    has_rotors: bool,
) -> tuple[FlightEnd, ...]:
    """Return how every flight ends, in the order of time.

    ``has_rotors``: it is a multicopter, which flies neither upside down nor without its motors.
    """
    return tuple(
        _end(number, flight, messages, events, flights, has_rotors=has_rotors)
        for number, flight in enumerate(flights)
    )


def gravest(ends: Sequence[FlightEnd]) -> FlightEnd | None:
    """Return the end to tell first: the last one that breaks a vehicle, else the hardest bad one.

    None where none is bad. Of a log with several flights the crash is asked for, and not the one
    of them that touched down hardest last.
    """
    bad = [one for one in ends if one.is_bad]
    broken = [one for one in bad if one.lost_control is not None or one.how == "restarted"]
    broken += [one for one in bad if one.speed is not None and one.speed > BREAKS]
    if broken:
        return max(broken, key=lambda one: one.at)
    return max(bad, key=lambda one: (one.speed or 0.0, one.at), default=None)


def is_failsafe(event: Event) -> bool:
    """Return whether the autopilot reports that a failsafe acted."""
    return event.kind == "failsafe" and SAYS.search(event.text) is not None


def _end(
    number: int,
    flight: Flight,
    messages: Mapping[str, Message],
    events: Sequence[Event],
    flights: Sequence[Flight],
    *,
    has_rotors: bool,
) -> FlightEnd:
    if not flight.flew:
        flipped = _turns_over(messages, flight) if has_rotors else None
        if flipped is not None:
            return FlightEnd(number, "tipped_over", flipped, overturned=flipped)
        return FlightEnd(number, "on_ground", flight.end)
    low, high = flight.airborne
    lost, by, over = _lost_control(messages, events, flights, flight, has_rotors=has_rotors)
    landing = flight.landing
    if has_rotors and landing is not None and _tips_over(messages, events, landing):
        if lost is not None and lost >= landing - TOUCH_S:  # that is how it tips
            lost = by = over = None
        if lost is None:
            return FlightEnd(number, "tipped_over", landing, _touch_speed(messages, landing))
    if flight.impact is not None:
        speed, is_seen = flight.impact_speed, flight.impact < flight.end
        across = _over_ground(messages, flight.impact)
        return FlightEnd(
            number, "impact", flight.impact, speed, lost, by, over, (), is_seen, across
        )
    if flight.restart is not None:
        heard = last_heard(messages.values(), flight.restart)
        return FlightEnd(number, "restarted", heard, None, lost, by, over)
    if lost is not None:
        return FlightEnd(number, "control_lost", high, None, lost, by, over)
    if any(is_failsafe(e) and low <= e.t <= high for e in events):
        return FlightEnd(number, "failsafe", high)
    if flight.landing is None:
        return FlightEnd(number, "in_air", high)
    return FlightEnd(number, "landed", high, _touch_speed(messages, flight.landing))


def _tips_over(messages: Mapping[str, Message], events: Sequence[Event], landing: float) -> bool:
    """Return whether it falls on its side or back as it touches the ground, and stays there."""
    attitude = messages.get("ATTITUDE")
    if attitude is None or "roll" not in attitude or "pitch" not in attitude:
        return False
    near = (attitude.t >= landing - TOUCH_S) & (attitude.t <= landing + TIPPING_S)
    upright = np.cos(attitude.si("roll")[near]) * np.cos(attitude.si("pitch")[near])
    lies = upright < np.cos(TILT)
    if not lies.any() or not lies[-1] or lies.all():
        return False
    since = attitude.t[near][np.flatnonzero(~lies)[-1]]
    if _rests_upright(messages, landing + TIPPING_S):
        return False
    stilled = (e.t for e in events if e.kind == "disarm" and e.t >= landing - TOUCH_S)
    is_driven = since <= min(stilled, default=np.inf) + STILLED_S
    return bool(is_driven and attitude.t[near][-1] - since >= OUT_S)


def _rests_upright(messages: Mapping[str, Message], until: float) -> bool:
    """Return whether an accelerometer feels the ground below its legs at last.

    A blow upsets an estimated attitude, and not the weight that is felt at rest.
    """
    felt = messages.get("RAW_IMU")
    if felt is None or any(name not in felt for name in _FORCE):
        return False
    last = (felt.t > until - RESTS_S) & (felt.t <= until)
    force = np.array([felt.si(name)[last] for name in _FORCE])
    force = force[:, np.isfinite(force).all(axis=0)]
    if force.shape[1] < FEW:
        return False
    mean, size = force.mean(axis=1), float(np.linalg.norm(force, axis=0).mean())
    is_weight = abs(size / G0 - 1) < _NEARLY and float(force.std(axis=1).max()) < _NEARLY * G0
    return bool(is_weight and -mean[2] / size > np.cos(TILT))


def _turns_over(messages: Mapping[str, Message], flight: Flight) -> float | None:
    """Return since when, s, it falls over that was to leave the ground, to the end or disarming.

    Over in a spin it is upright at times.
    """
    attitude = messages.get("ATTITUDE")
    names = ("roll", "pitch", "rollspeed", "pitchspeed")
    if attitude is None or any(name not in attitude for name in names):
        return None
    inside = (attitude.t >= flight.start) & (attitude.t <= flight.end)
    t = attitude.t[inside]
    roll, pitch, *rates = (attitude.si(name)[inside] for name in names)
    lies = np.cos(roll) * np.cos(pitch) < np.cos(TILT)
    falls = lies | (np.hypot(*rates) > SPINNING)
    since = _to_the_end(t, falls, flight.end, 0.0)
    if since is None or since <= t[0] or not lies[t >= since].any():
        return None
    if _rests_upright(messages, flight.end):
        return None
    return since if np.count_nonzero(falls[t >= since]) >= FEW else None


def _over_ground(messages: Mapping[str, Message], impact: float) -> float | None:
    """Return the receiver's last speed over ground before an impact, m/s, None where it has none.

    An estimate that is upset flies on as it likes.
    """
    receiver = messages.get("GPS_RAW_INT")
    if receiver is None or "vel" not in receiver:
        return None
    near = (receiver.t > impact - TOUCH_S) & (receiver.t <= impact)
    speed = receiver.si("vel")[near]
    speed = speed[np.isfinite(speed)]
    return float(speed[-1]) if speed.size else None


def _touch_speed(messages: Mapping[str, Message], landing: float) -> float | None:
    """Return the fastest descent just before a landing, m/s, that three records in a row bear out.

    None where nothing tells it, or where the air pressure tells otherwise.
    """
    climb = messages.get("VFR_HUD")
    if climb is None or "climb" not in climb:
        return None
    sink = -climb.si("climb")[(climb.t >= landing - TOUCH_S) & (climb.t <= landing)]
    sink = sink[np.isfinite(sink)]
    if sink.size < 3:
        return None
    pressed = _sinks_by_pressure(messages, landing)
    if pressed is not None and abs(float(sink.mean()) - pressed) > WASH_M / TOUCH_S:
        return None
    middle = np.median([sink[:-2], sink[1:-1], sink[2:]], axis=0)
    return float(max(middle.max(), 0.0))


def _sinks_by_pressure(messages: Mapping[str, Message], landing: float) -> float | None:
    """Return the mean descent just before a landing by the air pressure, m/s, None where unknown.

    It may be wrong by what the wash of rotors adds to a height in that time.
    """
    t, height = heights_by_pressure(messages)
    near = (t >= landing - TOUCH_S) & (t <= landing) & np.isfinite(height)
    t, height = t[near], height[near]
    if t.size < 3:
        return None
    return -float(np.polyfit(t - t[0], height, 1)[0])


def _lost_control(
    messages: Mapping[str, Message],
    events: Sequence[Event],
    flights: Sequence[Flight],
    flight: Flight,
    *,
    has_rotors: bool,
) -> tuple[float | None, LostBy | None, float | None]:
    """Return since when control is lost to the end, s, how that shows, since when it is over."""
    low, high = flight.airborne
    found, over = _upset(messages, events, flights, low, high, has_rotors=has_rotors)
    if has_rotors and flight.landing is None:
        stopped = (_motors_stopped(messages, low, high), _disarmed(events, flight))
        found += [(since, "stop") for since in stopped if since is not None]
    return (*min(found, key=lambda one: one[0], default=(None, None)), over)


def _disarmed(events: Sequence[Event], flight: Flight) -> float | None:
    """Return since when it is disarmed in the air, s, with which all motors are told to stop."""
    if flight.restart is not None:
        return None
    low, high = flight.airborne
    until = high if flight.impact is None else flight.impact - OUT_S
    armed = max((e.t for e in events if e.kind == "arm" and e.t <= until), default=low)
    since = (e.t for e in events if e.kind == "disarm" and max(low, armed) < e.t <= until)
    return min(since, default=None)


def _upset(
    messages: Mapping[str, Message],
    events: Sequence[Event],
    flights: Sequence[Flight],
    low: float,
    high: float,
    *,
    has_rotors: bool,
) -> tuple[list[tuple[float, LostBy]], float | None]:
    """Return since when the vehicle leans or turns where nobody wants it, and lies on its back."""
    attitude = messages.get("ATTITUDE")
    if attitude is None or "roll" not in attitude or "pitch" not in attitude:
        return [], None
    inside = (attitude.t >= low) & (attitude.t <= high)
    t = attitude.t[inside]
    if t.size < 3:
        return [], None
    roll, pitch = attitude.si("roll")[inside], attitude.si("pitch")[inside]
    tilt = np.arccos(np.clip(np.cos(roll) * np.cos(pitch), -1.0, 1.0))
    modes = flight_state(t, events, flights).mode
    levels = np.array([bool(m) and not any(w in m.upper() for w in _FREE) for m in modes], bool)
    wanted, apart = _demand(messages, t, roll, pitch, levels)
    with np.errstate(invalid="ignore"):
        unwanted = np.where(np.isfinite(wanted), wanted < TILT - ERROR, levels)
        leans = (tilt > TILT) & unwanted
        # who stays level while a demand goes astray is under control, whosever demand it is
        strays = leans | ((apart > ERROR) & (tilt > ERROR) & levels)
    shown: list[tuple[float | None, LostBy]] = [
        (_to_the_end(t, leans, high, OUT_S), "lean"),
        (_to_the_end(t, strays, high, APART_S), "demand"),
    ]
    over = _to_the_end(t, tilt > np.radians(90.0), high, OVER_S) if has_rotors else None
    shown.append((over, "lean"))
    turns = turning(messages, t)
    spun = _to_the_end(t, (turns > SPINNING) & levels, high, OUT_S)
    if spun is not None and np.median(turns[t >= spun]) > SPINS:
        shown.append((_began(t, turns, spun), "spin"))
    return [(since, by) for since, by in shown if since is not None], over


def _began(t: Floats, turns: Floats, spun: float) -> float:
    """Return since when, s, what spins fast from ``spun`` on turns faster than others do."""
    calm = np.flatnonzero((t < spun) & ~(turns > BEGINS))
    if not calm.size or spun - t[calm[-1] + 1] > RISES_S:
        return spun
    return float(t[calm[-1] + 1])


def _demand(
    messages: Mapping[str, Message],
    t: Floats,
    roll: Floats,
    pitch: Floats,
    levels: NDArray[np.bool_],
) -> tuple[Floats, Floats]:
    """Return the demanded tilt and how far the attitude is from the demand, rad, NaN unknown.

    A demand of exactly nothing is one to be level where the mode levels; else it is none.
    """
    unknown = np.full(t.size, np.nan)
    demand = messages.get("NAV_CONTROLLER_OUTPUT")
    if demand is None or "nav_roll" not in demand or "nav_pitch" not in demand:
        return unknown, unknown
    nav_roll, nav_pitch = demand.si("nav_roll"), demand.si("nav_pitch")
    known = np.isfinite(nav_roll) & np.isfinite(nav_pitch)
    is_set = known & (abs(nav_roll) + abs(nav_pitch) > 0)
    if is_set.sum() < 3:
        return unknown, unknown
    since = np.searchsorted(demand.t, t, side="right") - 1
    fresh = (since >= 0) & (t - demand.t[since] <= PAUSE_S)
    fresh &= np.where(levels, known[since], is_set[since])
    wanted_roll = np.where(fresh, nav_roll[since], np.nan)
    wanted_pitch = np.where(fresh, nav_pitch[since], np.nan)
    tilt = np.arccos(np.clip(np.cos(wanted_roll) * np.cos(wanted_pitch), -1.0, 1.0))
    # the angle between the two vertical axes of the body: no wrap, no gimbal lock
    between = _down(roll, pitch) * _down(wanted_roll, wanted_pitch)
    return tilt, np.arccos(np.clip(between.sum(axis=0), -1.0, 1.0))


def _down(roll: Floats, pitch: Floats) -> Floats:
    """Return the direction of gravity in the body's axes, (3, n)."""
    return np.array([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])


def _motors_stopped(messages: Mapping[str, Message], low: float, high: float) -> float | None:
    """Return since when all motors stand still in a fall, to the end."""
    motors, climb = messages.get(MOTORS), messages.get("VFR_HUD")
    if motors is None or climb is None or "climb" not in climb:
        return None
    inside = (motors.t >= low) & (motors.t <= high)
    t = motors.t[inside]
    if t.size < 3 or not any(map(motors.has_known, motors.fields)):  # or they do not drive it
        return None
    # as they were sent: an output of 0 is a stop here, and not unknown
    us = np.array([motors.raw(name)[motors.kept][inside] for name in motors.fields])
    sinking = -np.interp(t, climb.t, climb.si("climb"))
    with np.errstate(invalid="ignore"):
        still = (us <= us.min(axis=1, keepdims=True) + STOP).all(axis=0)
    since = _to_the_end(t, still, high, OUT_S)
    if since is None or not (sinking[t >= since] > FALLING).any():
        return None
    return since


def _to_the_end(t: Floats, out: NDArray[np.bool_], high: float, least: float) -> float | None:
    """Return where the stretch begins that lasts, but for short pauses, to the end, or None.

    ``least`` s it must last.
    """
    where = np.flatnonzero(out)
    if not where.size or high - t[where[-1]] > LAST_S:
        return None
    # a recorder that pauses shows no recovery, unless for longer than one takes
    recovers = (np.diff(where) > 1) | (np.diff(t[where]) > OVER_S)
    pauses = np.flatnonzero((np.diff(t[where]) > PAUSE_S) & recovers)
    first = where[pauses[-1] + 1] if pauses.size else where[0]
    return float(t[first]) if high - t[first] >= least else None
