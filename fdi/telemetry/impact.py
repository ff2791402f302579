"""Does a flight end with a blow, and how fast was the vehicle?

In: a `Motion`, the row of the take-off and the height of the ground. Out: the last row before the
blow, and the speed of descent there.

*Impact*: while sinking fast a pulse of specific force, or a change of the climb rate, that neither
rotors nor wings can produce, after which it sinks no more, does not climb away, and is low or at
rest. Where an accelerometer is logged there is no impact without a blow: a tumbling vehicle's
estimate jumps, the specific force does not. Without one, a fall that ends at rest by the height
alone is an impact. A log that ends in a dive close to the ground ends with one. So does a vehicle
with rotors that turns over near the ground while it sinks faster than a landing gear bears, and
stays on its back: what it falls on may be soft, and its estimate falls on. The impact's time is
that of the last record before it: conservative, since nothing after it may be called a cause.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.motion import Motion, known
from fdi.telemetry.phases import SPINS, WASH_M
from fdi.units import G0

Floats = NDArray[np.float64]

# m/s, a fall from 0.2 m: autopilots touch down at 0.5 (LAND_SPEED), landing gear stands 2
HARD_SPEED: Final = 2.0
BREAKS: Final = 2.0 * HARD_SPEED  # m/s: no landing gear bears it
# s: rotors carry nothing upside down; who lies on its back for longer than a flip takes has landed
OVER_S: Final = 2.0
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
# s on either side in which blow, stop and fall belong together: two records at 4 Hz
WATCH_S: Final = 0.6
# s at the end of a log over which the loss of height must confirm the sink rate; so soon a vehicle
# turns over after a blow
FALL_S: Final = 1.0
FEWEST: Final = 3  # records that a slope is told from
SETTLE_S: Final = (1.0, 4.0)  # s after it in which it no longer sinks
REBOUND_M: Final = 3.0  # m; who climbs higher flies
NEAR_GROUND_M: Final = 10.0  # m above the place of take-off; elsewhere it must come to rest
DIVE_SPEED: Final = 4.0  # m/s, faster than a commanded descent of most vehicles
TOLD_SPEED: Final = 1.0  # m/s: the error of the mean of a second by air pressure in a spin
FASTEST: Final = 100.0  # m/s: beyond the fall of any of them; a height that does is damaged
DIVE_S: Final = 3.0  # s to the ground (the place of take-off) at that speed
REST_SPEED: Final = 1.0  # m/s over ground, for a vehicle that need not roll out
MOVED_M: Final = 1.5  # m: beyond the drift of a barometer
IDLE_THROTTLE: Final = 0.1  # of full: below any hover or cruise
QUIET_S: Final = 3.0  # s of rest at the end that show a landing


def find_impact(
    motion: Motion, ground: float, *, disarmed: bool, is_end: bool, has_wings: bool
) -> tuple[int, float | None] | None:
    """Return the last row before an impact and the speed of descent there, m/s; None without one.

    The speed is None where nothing tells it: who spins down slowly upsets estimate and pressure.

    Parameters
    ----------
    motion : Motion
        From the take-off on until the vehicle has come to rest, or flies again.
    ground : float
        m, height of the place of take-off.
    disarmed : bool
        Whether it is disarmed at the end.
    is_end : bool
        Whether the log ends with it.
    has_wings : bool
        Whether it can rise without thrust.
    """
    blow = _blow(motion, ground, has_wings=has_wings)
    if blow is None and not has_wings:
        blow = _turned_over(motion, ground)
    if blow is None and not known(motion.force):
        blow = _fall_at_end(motion, disarmed=disarmed)
    if blow is None and is_end and not disarmed:
        blow = _dive_at_end(motion, ground)
    return blow


def _blow(motion: Motion, ground: float, *, has_wings: bool) -> tuple[int, float | None] | None:
    """Return the last row before the first blow and the speed of descent there, None unknown."""
    t, climb, force = motion.t, motion.climb, motion.force
    felt = known(force)
    least = BLOW if motion.is_dense else STOP_FORCE
    rise = np.append(np.diff(climb) / np.diff(t), 0.0)
    with np.errstate(invalid="ignore"):
        candidate = (force > BLOW) | (rise > STOP)
        if not has_wings:
            candidate |= (rise > IDLE_STOP) & (np.append(motion.throttle[1:], 1) < IDLE_THROTTLE)
    highest_later = np.maximum.accumulate(motion.height[::-1])[::-1]
    for row in np.flatnonzero(candidate).tolist():
        near = motion.rows(t[row] - WATCH_S, t[row] + WATCH_S)
        if not row or (felt and not np.nanmax(force[near], initial=0.0) > least):
            continue
        rate = _spins(motion, row)
        met = row if rate is None else _spin_ends(motion, row, rate, least)
        if met is None:
            continue
        if not has_wings and met and _spins(motion, met) is not None:
            return met, _sinks(motion, met)
        last = _last_undisturbed(motion, met)
        speed, falls = _speed(motion, last)
        is_over = rate is not None or (felt and np.nanmax(force[near], initial=0.0) > CRUSH)
        height = float(motion.height[last])
        is_down = is_over or _stays_down(motion, row, height, ground, highest_later)
        if speed > HARD_SPEED and falls and is_down:
            return last, speed
    return None


def _speed(motion: Motion, last: int) -> tuple[float, bool]:
    """Return the descent just before a blow, m/s, and whether it descended there."""
    climb = motion.climb
    pressed = _by_pressure(motion, last, WASH_M / FALL_S + climb[last] ** 2 / (2 * G0))
    if pressed is not None:
        return pressed, True
    if -climb[last] > HARD_SPEED:
        return float(-climb[last]), True
    # an estimate that is a little late falls into the blow
    jump = climb[min(last + 1, climb.size - 1)] - climb[last]
    return float(max(jump, -climb[last])), bool(climb[last] < 0)


def _spins(motion: Motion, row: int) -> float | None:
    """Return how fast a vehicle spins before a row, rad/s; None where it does not."""
    before = motion.turns[motion.rows(motion.t[row] - WATCH_S, motion.t[row]).start : row]
    rate = float(np.nanmedian(before)) if known(before) else 0.0
    return rate if rate >= SPINS else None


def _spin_ends(motion: Motion, row: int, rate: float, least: float) -> int | None:
    """Return the last row before the ground takes a spin, at a row or soon after; None: it goes on.

    An accelerometer 3 cm off the axis feels 5 g at 40 rad/s, and more as it wobbles, and the
    estimate of who spins is upset. But nothing other than the ground takes half of a spin at a blow
    and keeps what is left from turning.
    """
    t, turns = motion.t, motion.turns
    taken = np.flatnonzero(turns[row : motion.rows(t[row], t[row] + WATCH_S).stop] < rate / 2)
    if not taken.size:
        return None
    last = max(row + int(taken[0]) - 1, 0)
    felt = motion.force[last : last + 3]
    if known(motion.force) and not np.nanmax(felt, initial=0.0) > least:
        return None
    later = motion.rows(t[last] + SETTLE_S[0], t[last] + SETTLE_S[1])
    pressed = motion.pressed[later]
    if known(turns[later]) and np.nanmedian(turns[later]) > rate / 2:
        return None
    if known(pressed) and np.nanmedian(pressed) > motion.pressed[last] + REBOUND_M:
        return None
    return _first_blow(motion, last, least)


def _first_blow(motion: Motion, last: int, least: float) -> int:
    """Return the last row before the first of the blows that end a spin.

    They stand out by ``least``, m/s^2, from what the spin itself lets an accelerometer feel.
    """
    t, force = motion.t, motion.force
    spun = motion.rows(t[last] - WATCH_S - FALL_S, t[last] - WATCH_S)
    own = float(np.nanmedian(force[spun])) if known(force[spun]) else 0.0
    near = slice(max(spun.stop - 1, 0), last + 1)
    with np.errstate(invalid="ignore"):
        felt = np.flatnonzero(force[near] > own + least)
    return max(near.start + int(felt[0]) - 1, 0) if felt.size else last


def _sinks(motion: Motion, row: int) -> float | None:
    """Return how fast who spins sinks before a row, m/s, None where that is next to nothing.

    Gravity bounds what an upset estimate says.
    """
    sink = _by_pressure(motion, row, HARD_SPEED)
    if sink is None:
        felt = -motion.climb[motion.rows(motion.t[row] - FALL_S, motion.t[row])]
        sink = min(float(felt[-1]), float(np.nanmean(felt)) + G0 * FALL_S / 2)
    return sink if sink > TOLD_SPEED else None


def _by_pressure(motion: Motion, row: int, error: float) -> float | None:
    """Return the mean descent in the second before a row by the air pressure, m/s.

    None where the estimate is within ``error``, m/s, of it, or it is not known. The air that a fall
    stirs may add its dynamic pressure, which is worth a height of v^2/2g.
    """
    near = motion.rows(motion.t[row] - FALL_S, motion.t[row])
    told = np.isfinite(motion.pressed[near]) & np.isfinite(motion.climb[near])
    if np.count_nonzero(told) < FEWEST:
        return None
    t, pressed, climb = (each[near][told] for each in (motion.t, motion.pressed, motion.climb))
    slope = float(np.polyfit(t - t[0], pressed, 1)[0])
    return max(-slope, 0.0) if abs(slope - climb.mean()) > error else None


def _last_undisturbed(motion: Motion, row: int) -> int:
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
    motion: Motion, row: int, height: float, ground: float, highest_later: Floats
) -> bool:
    """Return whether after the blow it neither sinks on nor climbs away, low or at rest.

    ``height`` is the last one before the blow, which upsets the estimate for a while;
    ``highest_later`` (n,) the largest height from each row on.
    """
    settled = motion.rows(motion.t[row] + SETTLE_S[0], motion.t[row] + SETTLE_S[1])
    if settled.stop > settled.start and abs(_climbs(motion, settled)) > HARD_SPEED:
        return False
    if _sinks_on(motion, row, settled):
        return False
    if height > ground + NEAR_GROUND_M:  # on a hill, or the height is wrong
        speed = motion.speed[settled]
        return known(speed) and bool(np.nanmedian(speed) < REST_SPEED)
    is_over = settled.start >= motion.t.size
    return is_over or float(highest_later[settled.start]) <= height + REBOUND_M


def _climbs(motion: Motion, rows: slice) -> float:
    """Return the rate of climb over a while, m/s: of the air pressure, which no blow upsets."""
    told = np.isfinite(motion.pressed[rows])
    t, pressed = motion.t[rows][told], motion.pressed[rows][told]
    if t.size >= FEWEST and np.ptp(t) >= FALL_S:
        return float(np.polyfit(t - t[0], pressed, 1)[0])
    return float(np.median(motion.climb[rows]))


def _sinks_on(motion: Motion, row: int, later: slice) -> bool:
    """Return whether it is lower afterwards than it could fall until the next record.

    By the air pressure, which no blow upsets; it may be wrong by what the wash of rotors adds.
    """
    pressed = motion.pressed[later]
    if not known(pressed) or not np.isfinite(motion.pressed[row]):
        return False
    step = float(motion.t[min(row + 1, motion.t.size - 1)] - motion.t[row])
    falls = max(-float(motion.climb[row]), 0.0) * min(step, WATCH_S)
    return bool(np.nanmedian(pressed) < motion.pressed[row] - falls - WASH_M)


def _turned_over(motion: Motion, ground: float) -> tuple[int, float] | None:
    """Return the last row before the blow that turns it on its back, and the descent there.

    After a blow at which it does not sink so fast the estimate is not believed.
    """
    upright = np.flatnonzero(~(motion.upright < 0))
    if not upright.size or motion.t[-1] - motion.t[upright[-1]] < OVER_S:
        return None
    with np.errstate(invalid="ignore"):
        felt = np.flatnonzero(motion.force > STOP_FORCE)
    for row in felt.tolist():
        last = _last_undisturbed(motion, row)
        speed, _ = _speed(motion, last)
        turns = motion.t[row] >= motion.t[upright[-1]] - FALL_S
        if turns and speed > BREAKS and motion.height[last] < ground + NEAR_GROUND_M:
            return last, speed
        if motion.force[row] > BLOW:
            return None
    return None


def _fall_at_end(motion: Motion, *, disarmed: bool) -> tuple[int, float] | None:
    """Return the last row and speed of a fall that ends at rest, by the height and place alone.

    The estimated climb rate goes on falling for seconds after a blow that no accelerometer is there
    to correct.
    """
    t, height = motion.t, motion.height
    moves = np.flatnonzero(np.abs(height - height[-1]) > MOVED_M)
    if not moves.size or not (disarmed or _is_idle(motion)):
        return None
    row = int(moves[-1])
    before = motion.rows(t[row] - FALL_S, t[row])
    speed = float((height[before.start] - height[row]) / max(t[row] - t[before.start], 1e-3))
    settled = motion.speed[motion.rows(t[row] + SETTLE_S[0], t[-1])]
    rests = t[-1] - t[row] >= (SETTLE_S[0] if disarmed else QUIET_S)
    if known(settled):
        rests &= bool(np.nanmedian(settled) < REST_SPEED)
    return (row, speed) if DIVE_SPEED < speed < FASTEST and rests else None


def _is_idle(motion: Motion) -> bool:
    """Return whether the throttle is idle at the end."""
    last = motion.throttle[-3:]
    return known(last) and bool(np.nanmedian(last) < IDLE_THROTTLE)


def _dive_at_end(motion: Motion, ground: float) -> tuple[int, float] | None:
    """Return the last row and speed when the log ends in a dive close to the ground."""
    last = motion.t >= motion.t[-1] - FALL_S
    fallen = (motion.height[last][0] - motion.height[-1]) / max(np.ptp(motion.t[last]), 1e-3)
    sink = min(-float(np.median(motion.climb[-3:])), float(fallen))
    left = float(motion.height[-1]) - ground
    if DIVE_SPEED < sink < FASTEST and left < sink * DIVE_S:
        return motion.t.size - 1, sink
    return None
