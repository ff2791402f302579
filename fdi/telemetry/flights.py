"""Which flights does a log hold, and when did each leave the ground and meet it again?

In: a `Course`. Out: one `Flight` for each stretch in the air (`phases`),
with take-off and landing where the height leaves its place of rest and comes to it, and an impact
where there is a blow (`impact`). Arming without leaving the ground is a flight only where nothing
in the log flew.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.course import BEFORE_ARMING_S, FEW, Armed, Course
from fdi.telemetry.events import Event, Flight
from fdi.telemetry.impact import BREAKS, HARD_SPEED, find_impact
from fdi.telemetry.meaning.restarts import SILENT_S
from fdi.telemetry.motion import Floats, Motion, known
from fdi.telemetry.phases import HIGH_M, IDLE, WASH_M, Phases, Wings
from fdi.telemetry.stretches import CARRIED, ON_ITS_SIDE
from fdi.units import G0
from fdi.windows import runs_of

Ints = NDArray[np.int64]

REST_CLIMB: Final = 0.4  # m/s, the climb rate's noise at rest (measured 0.15) with margin
REST_M: Final = 0.3  # m: a barometer's scatter
LEFT_M: Final = 1.0  # m above the ground: there a climb has begun, or a descent has not ended
TOUCH_S: Final = 3.0  # s on the ground, shorter is a bounce or a touch; so long it comes to rest
WRECK_S: Final = 60.0  # s after such an impact, in which nobody flies who is not armed again
RUN_S: Final = 10.0  # s before and after, in which a take-off is looked for
AFTER_S: Final = 4.0  # s after the ground is met, in which a blow is looked for
LEVEL_S: Final = 2.0  # s: for longer an estimate of height does not stand still
CLIMBED_M: Final = 10.0
ALOFT_M: Final = 2.5
"""Above the ground; from here on ArduPilot's filter takes the ground's magnetic interference for
insignificant (AP_NavEKF3: EKF3_MAG_FINAL_RESET_ALT)."""
STANDS_MS: Final = 0.6  # m/s over ground: a receiver's velocity at rest, and no run for a take-off
TURNS: Final = 1.0  # rad/s: on its legs a vehicle that lifts off slides and rocks by less
LIFTS: Final = 0.9
"""Of the throttle in the air: below it rotors give 0.8 to 0.9 of the weight and lift nothing."""
FALLS_S: Final = 0.5  # without lift, after which one that nothing holds up sinks at 4.9 m/s
STILL: Final = 0.05  # rad/s: between who stands (0.01) and who flies (0.1)
STILL_FORCE: Final = 0.3  # m/s^2 from the weight: an accelerometer's error; rotors shake by more


def find_flights(course: Course) -> tuple[Flight, ...]:
    """Return the flights in the order of time.

    Arming without leaving the ground is a flight only where nothing in the log flew (``flew``
    false).
    """
    phases, armed = course.phases, course.armed
    stood = tuple(Flight(low, high, flew=False) for low, high, _ in armed if course.is_told)
    if phases is None:
        return stood
    anew = np.searchsorted(phases.t, course.restarts)
    spans = list(_spans(phases, anew))
    next_ones = [first for first, _ in [*spans, (phases.t.size, 0)][1:]]
    found = tuple(
        _flight(course, phases, stretch, next_one)
        for stretch, next_one in zip(spans, next_ones, strict=True)
    )
    return _apart(_before_wreck(found, armed)) or stood


def _before_wreck(flights: Sequence[Flight], armed: Sequence[Armed]) -> Iterator[Flight]:
    """Yield the flights but those of a wreck: what its estimate does afterwards is no flight."""
    crash, again = -np.inf, -np.inf
    for flight in flights:
        since = flight.airborne[0]
        if since < again and since < crash + WRECK_S:
            continue
        yield flight
        if flight.impact is not None and (flight.impact_speed or 0.0) > BREAKS:
            crash = flight.impact
            again = min((low for low, _, _ in armed if low > crash), default=np.inf)


def _apart(flights: Iterable[Flight]) -> tuple[Flight, ...]:
    """Return the flights of one arming one after the other: each until the next one's take-off."""
    found = list(flights)
    for row, (one, later) in enumerate(pairwise(tuple(found))):
        up = later.airborne[0]
        if one.end > later.start:
            found[row] = replace(found[row], end=min(one.end, up))
            found[row + 1] = replace(later, start=up)
    return tuple(found)


def flight_events(flights: Sequence[Flight]) -> list[Event]:
    """Return take-offs, landings and impacts as events."""
    made = []
    for flight in flights:
        if flight.takeoff is not None:
            made.append(Event(flight.takeoff, "takeoff", "take-off"))
        if flight.landing is not None:
            made.append(Event(flight.landing, "landing", "landing"))
        if flight.impact is not None:
            speed = flight.impact_speed
            text = "impact" if speed is None else f"impact, {speed:.1f} m/s downwards"
            made.append(Event(flight.impact, "impact", text, None, speed))
    return made


def _spans(phases: Phases, anew: Ints) -> Iterator[tuple[int, int]]:
    """Yield the first row of every stretch in the air, and that after its last.

    ``anew``: the rows with which an autopilot starts anew, where one ends and another may begin.
    """
    bounds = np.unique([0, *anew, phases.t.size])
    for low, high in pairwise(bounds.tolist()):
        edges = low + np.flatnonzero(np.diff(phases.in_air[low:high], prepend=False, append=False))
        starts, ends = edges[::2], edges[1::2]
        if not starts.size:
            continue
        apart = phases.t[starts[1:]] - phases.t[ends[:-1] - 1] > TOUCH_S
        firsts, afters = starts[np.append(True, apart)], ends[np.append(apart, True)]
        yield from zip(firsts.tolist(), afters.tolist(), strict=True)


def _flight(course: Course, phases: Phases, stretch: tuple[int, int], next_one: int) -> Flight:
    """Return the flight of a stretch in the air; ``next_one`` is the first row of the next."""
    motion, armed, wings = course.motion, course.armed, course.wings
    first, after = stretch
    t = phases.t
    anew = np.searchsorted(t, course.restarts)
    later = zip(course.restarts, anew, strict=True)
    near = (s for s, row in later if row == after and s - t[after - 1] <= SILENT_S)
    restart = next(near, None)
    begins_in_air = first == 0 or first in anew
    is_end = after == t.size or restart is not None
    before = float(t[first] if begins_in_air else t[first - 1])
    down = float(t[after - 1] if is_end else t[after])
    takeoff = None if begins_in_air else _take_off(motion, before, down, wings=wings)
    since = before if takeoff is None else takeoff
    low, high, disarmed = _arming(armed, since, down)
    # a log whose records begin in the air knows nothing of the time before
    flight = Flight(since if begins_in_air else min(low, since), max(high, down), takeoff)
    ground = float(phases.ground[max(first - 1, 0)])
    until = down if is_end else float(t[-1] if next_one == t.size else t[next_one])
    met = motion.between(since, min(max(down + AFTER_S, high), until))
    blow = find_impact(
        met, ground, disarmed=disarmed, is_end=is_end, has_wings=wings != "none"
    ) if met.t.size >= FEW else None  # fmt: skip
    if blow is not None:
        row, speed = blow
        is_last = is_end and row == met.t.size - 1
        impact = flight.end if is_last else float(met.t[row])
        flight = replace(flight, impact=impact, impact_speed=speed, end=max(flight.end, impact))
    elif disarmed and wings == "none" and _cut(motion, ground, (since, down), high, until):
        flight = replace(flight, end=max(flight.end, _falls_until(motion, high, until)))
    elif not is_end:
        landing = _landing(motion, down, min(down + TOUCH_S, until))
        if disarmed and wings == "none" and since < high < landing:
            # rotors that are disarmed in the air fall; what does not stood, and is carried away
            landing = landing if _fell(motion, high, landing) else high
        flight = replace(flight, landing=landing)
    elif restart is not None:
        flight = replace(flight, restart=restart, end=restart)
    elif disarmed and met.t.size and met.climb[-1] >= -HARD_SPEED:
        flight = replace(flight, landing=min(down, high))  # the log ends as it has landed
    flight = replace(flight, stood=_stood(motion, phases, first, since, wings=wings))
    return _with_phases(flight, motion, ground)


def _stood(
    motion: Motion, phases: Phases, first: int, until: float, *, wings: Wings
) -> tuple[float, float] | None:
    """Return from when to when it stood last before the row ``first``.

    What rotors alone carry neither rolls nor is pushed, whatever an estimator says of its speed.
    """
    earlier = motion.at(np.searchsorted(motion.t, phases.t[:first]))
    with np.errstate(invalid="ignore"):
        moves = phases.in_air[:first] | (earlier.turns > CARRIED) | (earlier.t > until)
        moves |= earlier.upright < ON_ITS_SIDE
        rolls = np.where(
            np.isnan(earlier.speed), earlier.throttle > IDLE, earlier.speed > STANDS_MS
        )
    if wings != "none":
        moves |= rolls
    still = np.flatnonzero(~moves)
    if not still.size:
        return None
    last = int(still[-1])
    begun = np.flatnonzero(moves[:last])
    return float(earlier.t[begun[-1] + 1 if begun.size else 0]), float(earlier.t[last])


def _arming(armed: Sequence[Armed], takeoff: float, down: float) -> tuple[float, float, bool]:
    """Return when a flight was armed, until when, and whether it was disarmed then."""
    for low, high, disarmed in armed:
        if low - BEFORE_ARMING_S <= takeoff <= high:
            return low, high, disarmed
    return takeoff, down, False


def _take_off(motion: Motion, before: float, down: float, *, wings: Wings) -> float:
    """Return when the height last rests, about the time from which it flies."""
    flown = motion.throttle[motion.rows(before, down)] if wings == "none" else np.empty(0)
    lifts = LIFTS * float(np.nanmedian(flown)) if known(flown) else -np.inf
    part = motion.between(before - RUN_S, min(before + RUN_S, down))
    flying = part.t > before
    above = part.height - np.median(part.height[~flying & (part.t >= before - LEVEL_S)])
    up = np.flatnonzero(flying & (above > LEFT_M))
    if not up.size:
        return before
    with np.errstate(invalid="ignore"):
        # an estimate of height may rest where the vehicle does not
        rests = (above <= REST_M) & ~(part.climb > REST_CLIMB) & ~(part.turns > TURNS)
        # an estimate that settles climbs by metres; nothing is felt, and the rotors carry nothing
        still = (part.turns < STILL) & (np.abs(part.force - G0) < STILL_FORCE)
        still &= part.throttle < lifts
    rows = np.flatnonzero((rests | still)[: up[0]])
    if not rows.size:
        return before
    moves = np.flatnonzero(~still[rows[-1] + 1 :])
    return float(part.t[rows[-1] + (moves[0] if moves.size else 0)])


def _landing(motion: Motion, down: float, until: float) -> float:
    """Return when the height comes to its place of rest, from the time on that it is down."""
    part = motion.between(down, until)
    above = part.height - np.median(part.height[part.t <= down + LEVEL_S])
    with np.errstate(invalid="ignore"):
        rests = (np.abs(above) <= REST_M) & ~(np.abs(part.climb) > REST_CLIMB)
    rows = np.flatnonzero(rests)
    return float(part.t[rows[0]]) if rows.size else down


def _cut(
    motion: Motion, ground: float, flown: tuple[float, float], disarmed: float, until: float
) -> bool:
    """Return whether rotors carried it above the ground until it was disarmed: that is no landing.

    Who lands on a roof stands there with rotors that do not lift, before anybody disarms it; who
    does not stand falls.
    """
    throttle = motion.throttle[motion.rows(*flown)]
    if not known(throttle):
        return False
    part = motion.between(disarmed - BEFORE_ARMING_S, min(disarmed + BEFORE_ARMING_S, until))
    with np.errstate(invalid="ignore"):
        lifts = part.throttle >= LIFTS * float(np.nanmedian(throttle))
        carried = np.flatnonzero(lifts & (part.t <= disarmed) & (part.height > ground + HIGH_M))
    if not carried.size:
        return False
    later = part.t > part.t[carried[-1]] + FALLS_S
    return not (later & ~lifts & (part.climb > -HARD_SPEED)).any()


def _falls_until(motion: Motion, low: float, high: float) -> float:
    """Return until when it is seen to fall from a time on."""
    part = motion.between(low, high)
    falls = np.flatnonzero(part.climb < -HARD_SPEED)
    return float(part.t[falls[-1]]) if falls.size else low


def _fell(motion: Motion, low: float, high: float) -> bool:
    """Return whether it sank in that time as nothing does that stands."""
    with np.errstate(invalid="ignore"):
        return bool((motion.between(low, high).climb < -HARD_SPEED).any())


def _with_phases(flight: Flight, motion: Motion, ground: float) -> Flight:
    """Return the flight with the end of its climb-out, its approach, and when it was aloft."""
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
    aloft = _aloft(flight, t, height, ground) if t.size else ()
    return replace(flight, climbed=climbed, approach=approach, aloft=aloft)


def _aloft(
    flight: Flight, t: Floats, height: Floats, ground: float
) -> tuple[tuple[float, float], ...]:
    """Return from when to when, each time, a flight is clear of the fields of the ground.

    The ground is that of take-off and landing, in a straight line between them where it saw both;
    who is further below it than air pressure errs flies over other ground.
    """
    low, high = flight.airborne
    first = ground if flight.takeoff is not None else float(height[-1])
    last = float(height[-1]) if flight.landing is not None else first
    level = np.interp(t, [t[0], t[-1]], [first, last])
    up = (height > level + ALOFT_M) | (height < level - WASH_M)
    if flight.takeoff is None and flight.landing is None:
        up[:] = True  # no ground was seen
    spans = [(float(t[begin]), float(t[end - 1])) for begin, end in runs_of(up)]
    # the records of height begin and end within a flight that does so in the air
    if spans and up[0] and flight.takeoff is None:
        spans[0] = (low, spans[0][1])
    if spans and up[-1] and flight.landing is None:
        spans[-1] = (spans[-1][0], high)
    return tuple(spans)
