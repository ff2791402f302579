"""Which flights does a log hold, and when did each leave the ground and meet it again?

In: the messages and the arming events. Out: one `Flight` per arming (without arming: by motion),
with take-off, landing and impact found from motion: height, climb rate, ground speed, throttle and
specific force, not from one event of the autopilot (which an old or failing one does not send).

*Take-off*: the height leaves the place of rest. *Landing*: from some time on the vehicle rests, and
the end of the flight shows that it rests on the ground (disarmed, or throttle idle). *Impact*:
while sinking fast a pulse of specific force, or a change of the climb rate, that neither rotors
nor wings can produce, after which it sinks no more, does not climb away, and is low or at rest.
Where an accelerometer is logged there is no impact without a blow: a tumbling vehicle's estimate
jumps, the specific force does not. Without one, a fall that ends at rest by the height alone is an
impact. A log that ends in a dive close to the ground ends with one. The impact's time is that of
the last record before it: conservative, since nothing after it may be called a cause.

The trap: heights are estimates. With a frozen barometer a vehicle rests on the ground at an
estimated 35 m, so no rule asks for height zero alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.events import Event, Flight
from fdi.telemetry.message import Message
from fdi.units import G0

Floats = NDArray[np.float64]

# m/s, a fall from 0.2 m: autopilots touch down at 0.5 (LAND_SPEED), landing gear stands 2
HARD_SPEED: Final = 2.0
# m/s^2 of specific force: above what rotors (thrust/weight up to 3) or wings bear for long
BLOW: Final = 4.0 * G0
# m/s^2 of vertical acceleration: the same bound without gravity, 3 g
STOP: Final = 2.0 * G0
# m/s^2: 20 g, no airframe flies through that, whatever the upset estimate says afterwards
CRUSH: Final = 20.0 * G0
# m/s^2 upwards with idle rotors: only the ground does that
IDLE_STOP: Final = 0.5 * G0
# m/s^2: a stop must be felt, since an estimator's reset changes the climb rate alone
STOP_FORCE: Final = 1.5 * G0
# s: an accelerometer that is logged as often as this misses no blow, which rings for 0.1 s
DENSE_S: Final = 0.05
# s on either side in which blow, stop and fall belong together: two records at 4 Hz
WATCH_S: Final = 0.6
# s at the end of a log over which the loss of height must confirm the sink rate
FALL_S: Final = 1.0
SETTLE_S: Final = (1.0, 4.0)  # s after it in which it no longer sinks
REBOUND_M: Final = 3.0  # m; who climbs higher flies
NEAR_GROUND_M: Final = 10.0  # m above the place of take-off; elsewhere it must come to rest
BEFORE_ARMING_S: Final = 3.0  # heartbeats come once a second: arming is seen late, motion is not
DIVE_SPEED: Final = 4.0  # m/s, faster than a commanded descent of most vehicles
DIVE_S: Final = 3.0  # s to the ground (the place of take-off) at that speed
REST_CLIMB: Final = 0.4  # m/s, the climb rate's noise at rest (measured 0.15) with margin
REST_SPEED: Final = 1.0  # m/s over ground, for a vehicle that need not roll out
LIFT_M: Final = 1.5  # m above the place of rest: beyond the drift of a barometer while waiting
LIFT_FLOOR_M: Final = 0.3  # m: where the climb to LIFT_M began
FLYING_SPEED: Final = 6.0  # m/s over ground: who arms (or begins the log) so fast is in the air
FLYING_HEIGHT: Final = 3.0  # m above the place of take-off
CLIMBED_M: Final = 10.0
HIGHEST_M: Final = 1e5  # m; more is damage
IDLE_THROTTLE: Final = 0.1  # of full: below any hover or cruise
QUIET_S: Final = 3.0  # s of rest at the end that show a landing

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
_SPEEDS: Final = (("VFR_HUD", "groundspeed", 1.0), ("GPS_RAW_INT", "vel", 1.0))
_THROTTLES: Final = (("VFR_HUD", "throttle", 1.0),)
_LANDED_STATES: Final = (("EXTENDED_SYS_STATE", "landed_state", 1.0),)
_IN_AIR: Final = 1.5  # between 1, on the ground, and 2, in the air
_ACCELEROMETERS: Final = ("RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "HIGHRES_IMU")
_AXES: Final = ("xacc", "yacc", "zacc")


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """How the vehicle moved, (n,) at the times of the height; what is not in the log is NaN."""

    t: Floats
    height: Floats
    climb: Floats
    speed: Floats
    throttle: Floats
    landed_state: Floats  # as the autopilot believes
    force: Floats  # the largest specific force within half a record, m/s^2
    is_dense: bool  # no blow falls between two records of the force

    def between(self, low: float, high: float) -> _Motion:
        inside = self.rows(low, high)
        columns = (name for name in self.__slots__ if name != "is_dense")
        return replace(self, **{name: getattr(self, name)[inside] for name in columns})

    def rows(self, low: float, high: float) -> slice:
        """Return the rows from time low to time high, both included."""
        first = int(np.searchsorted(self.t, low, side="left"))
        return slice(first, int(np.searchsorted(self.t, high, side="right")))


def find_flights(
    messages: Mapping[str, Message],
    events: Sequence[Event],
    span: tuple[float, float],
    *,
    has_wings: bool,
) -> tuple[Flight, ...]:
    """Return the flights in the order of time.

    Parameters
    ----------
    messages : Mapping[str, Message]
    events : sequence of Event
        Arming and disarming.
    span : (float, float)
        First and last time of the vehicle's own messages, s.
    has_wings : bool
        Whether it can rise without thrust.

    Notes
    -----
    Arming without leaving the ground is a flight only where nothing in the log flew (``flew``
    false).
    """
    motion = _motion(messages)
    found = []
    armed = list(_armed(events, span))
    for (low, high, disarmed), (after, *_) in zip(armed, [*armed[1:], (span[1],)], strict=True):
        from_ground = low > span[0] + BEFORE_ARMING_S
        find = partial(_flight, disarmed=disarmed, from_ground=from_ground, has_wings=has_wings)
        since = low - BEFORE_ARMING_S * from_ground
        part = motion.between(since, high)
        flight = find(part, Flight(low, high))
        if disarmed and flight.flew and flight.impact is None and part.climb[-1] < -HARD_SPEED:
            # disarmed as it falls, by a failsafe or by hand: the ground is still to come
            fallen = find(motion.between(since, min(high + DIVE_S, after)), Flight(low, high))
            if fallen.impact is not None:
                flight = replace(fallen, end=max(high, fallen.impact))
        found.append(flight)
    if not any(e.kind in ("arm", "disarm") for e in events):
        found = [f for f in found if f.flew]
    return tuple([f for f in found if f.flew] or found)


def flight_events(flights: Sequence[Flight]) -> list[Event]:
    """Return take-offs, landings and impacts as events."""
    made = []
    for flight in flights:
        if flight.takeoff is not None:
            made.append(Event(flight.takeoff, "takeoff", "take-off"))
        if flight.landing is not None:
            made.append(Event(flight.landing, "landing", "landing"))
        if flight.impact is not None:
            text = f"impact at {flight.impact_speed:.1f} m/s"
            made.append(Event(flight.impact, "impact", text, None, flight.impact_speed))
    return made


def _armed(
    events: Sequence[Event], span: tuple[float, float]
) -> Iterator[tuple[float, float, bool]]:
    """Yield the armed times, and whether each ends by disarming; the whole log without any."""
    arming = [e for e in events if e.kind in ("arm", "disarm")]
    since = span[0] if not arming or arming[0].kind == "disarm" else None
    for event in arming:
        if event.kind == "arm":
            since = event.t if since is None else since
        elif since is not None:
            yield since, event.t, True
            since = None
    if since is not None:
        yield since, max(span[1], since), False


def _motion(messages: Mapping[str, Message]) -> _Motion:
    t, height = heights(messages)

    def at_height(sources: tuple[tuple[str, str, float], ...]) -> Floats:
        known_t, values = _first(messages, sources)
        if not known_t.size or not t.size:
            return np.full(t.size, np.nan)
        return np.interp(t, known_t, values)

    climb = at_height(_CLIMBS)
    if t.size > 2 and not np.isfinite(climb).any():
        climb = np.gradient(height, t)
    felt = _felt(messages)
    force = _largest_force(felt, t)
    periods = [float(np.median(np.diff(m.t))) for m in felt if len(m) > 1]
    is_dense = bool(periods) and min(periods) <= DENSE_S
    speed, throttle, state = map(at_height, (_SPEEDS, _THROTTLES, _LANDED_STATES))
    return _Motion(t, height, climb, speed, throttle, state, force, is_dense)


def heights(messages: Mapping[str, Message]) -> tuple[Floats, Floats]:
    """Return times and heights above the place of take-off; without one, above the lowest."""
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


def _felt(messages: Mapping[str, Message]) -> list[Message]:
    """Return the messages of accelerometers, none twice."""
    found: dict[str, Message] = {}
    for name in _ACCELEROMETERS:
        message = messages.get(name)
        if message is None or not len(message) or not all(axis in message for axis in _AXES):
            continue
        if message.unit("xacc") != "m/s^2":
            continue
        found.setdefault(message.made_from or name, message)  # the same records, another name
    return list(found.values())


def _largest_force(felt: Sequence[Message], t: Floats) -> Floats:
    """Return the largest specific force of any accelerometer nearest to each time, NaN without."""
    force = np.full(t.size, np.nan)
    if t.size < 2:
        return force
    edges = (t[1:] + t[:-1]) / 2
    for message in felt:
        x, y, z = (message.si(axis) for axis in _AXES)
        first = np.append(0, np.searchsorted(message.t, edges, side="right"))
        some = np.flatnonzero(np.diff(first, append=len(message)))
        with np.errstate(over="ignore"):
            largest = np.fmax.reduceat(x * x + y * y + z * z, first[some])
        force[some] = np.fmax(force[some], np.sqrt(largest))
    return force


def _flight(
    motion: _Motion, flight: Flight, *, disarmed: bool, from_ground: bool, has_wings: bool
) -> Flight:
    if motion.t.size < 3:
        return replace(flight, flew=False)
    up = _take_off(motion, from_ground=from_ground)
    if up is None:
        return replace(flight, flew=False)
    in_air, ground = up
    if in_air:
        takeoff = float(motion.t[in_air])
        flight = replace(flight, takeoff=takeoff, start=min(flight.start, takeoff))
    blow = _impact(motion, in_air, ground, has_wings=has_wings)
    if blow is None and not _known(motion.force):
        blow = _fall_at_end(motion, disarmed=disarmed)
    if blow is None and not disarmed:
        blow = _dive_at_end(motion, ground)
    if blow is not None:
        row, speed = blow
        is_last = row == motion.t.size - 1
        impact = flight.end if is_last else float(motion.t[row])
        flight = replace(flight, impact=impact, impact_speed=speed)
    else:
        rest = _rest_at_end(motion, in_air, disarmed=disarmed, has_wings=has_wings)
        flight = replace(flight, landing=None if rest is None else float(motion.t[rest]))
        if rest == in_air:  # at rest again at once: on the ground a height drifts
            return replace(flight, flew=False, takeoff=None, landing=None)
    return _with_phases(flight, motion, ground)


def _take_off(motion: _Motion, *, from_ground: bool) -> tuple[int, float] | None:
    """Return the row of the take-off (0: in the air from the start) and the height it began at.

    None when the vehicle never left the ground.
    """
    height, ground = motion.height, float(motion.height[0])
    with np.errstate(invalid="ignore"):
        is_fast = (
            np.nanmedian(motion.speed[:5]) > FLYING_SPEED if _known(motion.speed[:5]) else False
        )
        is_high = ground > FLYING_HEIGHT and not motion.throttle[0] < IDLE_THROTTLE
    if not from_ground and (is_fast or is_high):
        return 0, min(0.0, float(height.min()))
    # the barometer drifts while the vehicle waits: the place of rest follows the lowest height
    lowest = np.minimum.accumulate(height)
    high = np.flatnonzero(height > lowest + LIFT_M)
    if not high.size:  # in a room: the autopilot's word, where the height bears it out
        with np.errstate(invalid="ignore"):
            said = motion.landed_state > _IN_AIR
        high = np.flatnonzero(said & (height > lowest + LIFT_FLOOR_M))
    if not high.size:
        return None
    rests = motion.climb[: high[0]] <= REST_CLIMB
    if not rests.any():
        rests = height[: high[0]] <= lowest[high[0]] + LIFT_FLOOR_M
    row = int(np.flatnonzero(rests)[-1]) if rests.any() else 0
    return max(row, 1), float(height[row])


def _known(values: Floats) -> bool:
    return bool(np.isfinite(values).any())


def _impact(
    motion: _Motion, in_air: int, ground: float, *, has_wings: bool
) -> tuple[int, float] | None:
    """Return the last row before the first impact and the speed of descent there."""
    t, climb, force = motion.t, motion.climb, motion.force
    felt = _known(force)
    least = BLOW if motion.is_dense else STOP_FORCE
    rise = np.append(np.diff(climb) / np.diff(t), 0.0)
    with np.errstate(invalid="ignore"):
        candidate = (force > BLOW) | (rise > STOP)
        if not has_wings:
            candidate |= (rise > IDLE_STOP) & (np.append(motion.throttle[1:], 1) < IDLE_THROTTLE)
    highest_later = np.maximum.accumulate(motion.height[::-1])[::-1]
    for row in np.flatnonzero(candidate).tolist():
        near = motion.rows(t[row] - WATCH_S, t[row] + WATCH_S)
        if row <= in_air or (felt and not np.nanmax(force[near], initial=0.0) > least):
            continue
        last = _last_undisturbed(motion, row)
        speed = max(-climb[last], climb[min(row + 1, t.size - 1)] - climb[last])
        is_hard = speed > HARD_SPEED and climb[last] < 0
        is_over = felt and np.nanmax(force[near], initial=0.0) > CRUSH
        height = float(motion.height[last])
        if is_hard and (is_over or _stays_down(motion, row, height, ground, highest_later)):
            return last, float(-climb[last] if -climb[last] > HARD_SPEED else speed)
    return None


def _last_undisturbed(motion: _Motion, row: int) -> int:
    """Return the last record before the blow changes force and climb rate."""
    climb = motion.climb
    last = row if row + 1 < climb.size and motion.force[row] <= STOP_FORCE else max(row - 1, 0)
    while last > 0 and motion.t[row] - motion.t[last] < WATCH_S:
        step = abs(climb[last] - climb[last - 1]) / (motion.t[last] - motion.t[last - 1])
        if step <= G0:
            break
        last -= 1
    return last


def _stays_down(
    motion: _Motion, row: int, height: float, ground: float, highest_later: Floats
) -> bool:
    """Return whether after the blow it neither sinks on nor climbs away, low or at rest.

    ``height`` is the last one before the blow, which upsets the estimate for a while;
    ``highest_later`` (n,) the largest height from each row on.
    """
    settled = motion.rows(motion.t[row] + SETTLE_S[0], motion.t[row] + SETTLE_S[1])
    if settled.stop > settled.start and abs(np.median(motion.climb[settled])) > HARD_SPEED:
        return False
    if height > ground + NEAR_GROUND_M:  # on a hill, or the height is wrong
        speed = motion.speed[settled]
        return _known(speed) and bool(np.nanmedian(speed) < REST_SPEED)
    is_over = settled.start >= motion.t.size
    return is_over or float(highest_later[settled.start]) <= height + REBOUND_M


def _fall_at_end(motion: _Motion, *, disarmed: bool) -> tuple[int, float] | None:
    """Return the last row and speed of a fall that ends at rest, by the height and place alone.

    The estimated climb rate goes on falling for seconds after a blow that no accelerometer is there
    to correct.
    """
    t, height = motion.t, motion.height
    moves = np.flatnonzero(np.abs(height - height[-1]) > LIFT_M)
    if not moves.size or not (disarmed or _is_idle(motion)):
        return None
    row = int(moves[-1])
    before = motion.rows(t[row] - FALL_S, t[row])
    speed = float((height[before.start] - height[row]) / max(t[row] - t[before.start], 1e-3))
    settled = motion.speed[motion.rows(t[row] + SETTLE_S[0], t[-1])]
    rests = t[-1] - t[row] >= (SETTLE_S[0] if disarmed else QUIET_S)
    if _known(settled):
        rests &= bool(np.nanmedian(settled) < REST_SPEED)
    return (row, speed) if speed > DIVE_SPEED and rests else None


def _is_idle(motion: _Motion) -> bool:
    """Return whether the throttle is idle at the end."""
    last = motion.throttle[-3:]
    return _known(last) and bool(np.nanmedian(last) < IDLE_THROTTLE)


def _dive_at_end(motion: _Motion, ground: float) -> tuple[int, float] | None:
    """Return the last row and speed when the log ends in a dive close to the ground."""
    last = motion.t >= motion.t[-1] - FALL_S
    fallen = (motion.height[last][0] - motion.height[-1]) / max(np.ptp(motion.t[last]), 1e-3)
    sink = min(-float(np.median(motion.climb[-3:])), float(fallen))
    left = float(motion.height[-1]) - ground
    if sink > DIVE_SPEED and left < sink * DIVE_S:
        return motion.t.size - 1, sink
    return None


def _rest_at_end(motion: _Motion, in_air: int, *, disarmed: bool, has_wings: bool) -> int | None:
    """Return the row from which the vehicle rests on the ground until the end."""
    height, n = motion.height, motion.t.size
    if not disarmed and not _is_idle(motion):
        return None
    with np.errstate(invalid="ignore"):
        moves = (np.abs(motion.climb) > REST_CLIMB) | (np.abs(height - height[-1]) > LIFT_M)
        if not has_wings:  # rotors that idle do not fly, whatever a poor estimate of height says
            is_idle = motion.throttle < IDLE_THROTTLE
            moves = (moves | (motion.landed_state > _IN_AIR)) & ~is_idle
    last = np.flatnonzero(moves)
    row = int(last[-1]) + 1 if last.size else in_air
    if row >= n:
        return n - 1 if disarmed else None
    rests = motion.t[-1] - motion.t[row] >= QUIET_S
    return max(row, in_air) if disarmed or rests else None


def _with_phases(flight: Flight, motion: _Motion, ground: float) -> Flight:
    """Return the flight with the ends of climb-out and the beginning of the approach."""
    low, high = flight.airborne
    inside = (motion.t >= low) & (motion.t <= high)
    t, height = motion.t[inside], motion.height[inside]
    climbed = approach = None
    if flight.takeoff is not None and t.size:
        above = np.flatnonzero(height > ground + CLIMBED_M)
        climbed = float(t[above[0]]) if above.size else high
    if flight.landing is not None and t.size:
        above = np.flatnonzero(height > height[-1] + CLIMBED_M)
        approach = float(t[above[-1]]) if above.size else low
        approach = max(approach, climbed or approach)
    return replace(flight, climbed=climbed, approach=approach)
