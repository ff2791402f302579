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
SETTLE_S: Final = (1.0, 4.0)  # s after it in which it no longer sinks
REBOUND_M: Final = 3.0  # m; who climbs higher flies
NEAR_GROUND_M: Final = 10.0  # m above the place of take-off; elsewhere it must come to rest
DIVE_SPEED: Final = 4.0  # m/s, faster than a commanded descent of most vehicles
FASTEST: Final = 100.0  # m/s: beyond the fall of any of them; a height that does is damaged
DIVE_S: Final = 3.0  # s to the ground (the place of take-off) at that speed
REST_SPEED: Final = 1.0  # m/s over ground, for a vehicle that need not roll out
MOVED_M: Final = 1.5  # m: beyond the drift of a barometer
IDLE_THROTTLE: Final = 0.1  # of full: below any hover or cruise
QUIET_S: Final = 3.0  # s of rest at the end that show a landing
SPINS: Final = 10.0  # rad/s: faster than anybody flies, in a spin or a tumble


def find_impact(
    motion: Motion, ground: float, *, disarmed: bool, is_end: bool, has_wings: bool
) -> tuple[int, float] | None:
    """Return the last row before an impact and the speed of descent there, m/s; None without one.

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


def _blow(motion: Motion, ground: float, *, has_wings: bool) -> tuple[int, float] | None:
    """Return the last row before the first blow and the speed of descent there."""
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
        spins_on = _spin(motion, row)
        if spins_on:
            continue
        last = _last_undisturbed(motion, row)
        speed = max(-climb[last], climb[min(row + 1, t.size - 1)] - climb[last])
        is_hard = speed > HARD_SPEED and climb[last] < 0
        is_over = spins_on is not None or (felt and np.nanmax(force[near], initial=0.0) > CRUSH)
        height = float(motion.height[last])
        if is_hard and (is_over or _stays_down(motion, row, height, ground, highest_later)):
            return last, float(-climb[last] if -climb[last] > HARD_SPEED else speed)
    return None


def _spin(motion: Motion, row: int) -> bool | None:
    """Return whether a spin goes on over what is felt at a row; None where it did not spin.

    An accelerometer 3 cm off the axis feels 5 g at 40 rad/s, and more as it wobbles. Nothing but
    the ground takes half of a spin within the time of a blow.
    """
    t, turns = motion.t, motion.turns
    before = turns[motion.rows(t[row] - WATCH_S, t[row]).start : row]
    if not known(before) or np.nanmedian(before) < SPINS:
        return None
    after = turns[row : motion.rows(t[row], t[row] + WATCH_S).stop]
    return bool(np.nanmin(after, initial=np.inf) > np.nanmedian(before) / 2)


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
    if settled.stop > settled.start and abs(np.median(motion.climb[settled])) > HARD_SPEED:
        return False
    if height > ground + NEAR_GROUND_M:  # on a hill, or the height is wrong
        speed = motion.speed[settled]
        return known(speed) and bool(np.nanmedian(speed) < REST_SPEED)
    is_over = settled.start >= motion.t.size
    return is_over or float(highest_later[settled.start]) <= height + REBOUND_M


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
        speed = float(-motion.climb[last])
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
