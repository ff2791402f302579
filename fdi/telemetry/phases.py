"""When is the vehicle in the air? By all that tells of it, each with its own error.

In: a `Motion` and when it is armed. Out: `Phases`: how likely it is in the air at every time.

A hidden Markov model of two states. Every source says how much likelier what it shows is in the air
than on the ground (the logarithm of the ratio of its densities, counted once a second, since what
follows within a second is one observation); to change the state costs `CHANGE`, and a vehicle that
is disarmed does not take off. None of them decides alone: a frozen barometer, a receiver that
wanders, an autopilot that says "landed" too late are outvoted.

===============  ===================================================================================
source           on the ground                            in the air
===============  ===================================================================================
height           normal about the ground, `LEVEL_M`       anywhere, the more likely the lower
climb rate       normal about 0                           hovering, or wider by far
speed            normal about 0, wings below half of      hovering, or wider by far; wings above 0.7
                 their cruise                             of their cruise
throttle         with rotors anything up to a hover's     with rotors about the hover's
turning          some 0.01 rad/s, or carried about        some 0.1 rad/s, or it spins
tilt             wings on edge that do not turn, rotors   any other
                 on their back
autopilot        says so, or is late                      likewise
arming           disarmed                                 disarmed only as it falls
===============  ===================================================================================

The ground's height is not known beforehand: it is that of the stretches that need no height to be
told from flight (`SURE`), between them in a straight line. The limits of what one source may say
(`MOST`) keep a source that is wrong from outvoting all others.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, inf, log1p
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.motion import Floats, Motion
from fdi.windows import runs_of

Mask = NDArray[np.bool_]
Wings = Literal["none", "alone", "maybe"]
_Ways = tuple[tuple[tuple[float, float], ...], tuple[tuple[float, float], ...]]

CHANGE: Final = 4.0
"""Nats for a change of state: both last a minute rather than a second."""
MOST: Final = 4.0
"""Nats a second, the most that one source says."""
LEVEL_M: Final = 0.4
"""Of a height about the ground's: barometers scatter by 0.1 to 0.3 m and drift by as much."""
HIGHEST_M: Final = 100.0
"""Heights of flights are spread as their logarithm, from 1 m to so much."""
WASH_M: Final = 3.0
"""Below the ground: so much lower a barometer reads in the wash of rotors and in ground effect."""
CLIMB: Final = (((0.3, 1.0),), ((0.2, 0.5), (1.5, 0.5)))
"""m/s and how often, on the ground and in the air, where half is hovering and level flight."""
SPEED: Final = (((0.6, 1.0),), ((0.4, 0.5), (5.0, 0.5)))
TURNING: Final = (((0.01, 0.9), (1.0, 0.1)), ((0.1, 0.97), (20.0, 0.03)))
"""rad/s and how often: it stands or is carried about; it flies or spins with a rotor less."""
SPREAD: Final = 1.0
"""Of the logarithm of how fast it turns, about each."""
SURE: Final = 4.0
"""Nats a second against the air without the height, the most that one source says."""
WORD: Final = 2.5
"""Nats a second that the autopilot's word counts."""
HIGH_M: Final = 3 * LEVEL_M
"""Above the ground: who is there with power hovers, climbs or sinks."""
IDLE: Final = 0.1
"""Of full throttle: below any hover. Rotors that idle, or that lie on their back without turning,
carry nothing, whatever two other sources say: what falls is met by the search for its impact."""
FULL: Final = 0.95
"""Of full throttle: beyond it nobody hovers; one whose motor failed gives it for the most. With 0.9
or 0.99 flights of two or three of 532 logs move."""
_HOVERS: Final = ((0.4, 0.7), (-MOST, 0.75 * MOST))  # by the throttle over that of a hover
_LIFTS: Final = ((0.7, 0.9), _HOVERS[1])
"""Likewise where the autopilot has learned a hover: the share of the weight. With both a tenth less
or a twentieth more flights of one or two of 532 logs move."""
STANDS: Final = 0.1
"""Of its usual speed; wings that go slower, over ground and through the air, up and down, stand: in
the air only a wind within a tenth of their own speed would hold them there. With half or twice as
much no take-off or landing that was read from plots moves."""
FAST: Final = 6.0
"""m/s, slower than wings fly."""
ON_EDGE: Final = 0.3
"""Cosine of the tilt: beyond 72 degrees wings carry 0.3 of what they lift. A level turn there is at
`CARVES` up to 100 m/s (g tan / v); who neither turns nor rises or sinks stands on edge or nose."""
CARVES: Final = 0.3
"""rad/s."""
SPINS: Final = 10.0
"""rad/s over a second, once and a half round: nobody who carries it turns it so fast, and what
rolls over the ground does not stay upright. What leads into it without a pause belongs to it."""
UPRIGHT: Final = 0.5
"""Cosine of the tilt, over a second: of who tumbles it is about nothing."""
STEADY: Final = 1.0
"""m/s, a climb rate that an estimate shows of one that stands."""
ASTRAY_M: Final = 10.0
"""Between an estimated height and that by air pressure: 3 m of wash, and a receiver's height, which
an estimator may use, wanders by as much as 10 m (twice its sigma)."""
ASTRAY_SHARE: Final = 0.1
"""Of the height: air 30 degrees from the standard's is as much thinner or denser."""
ASTRAY_S: Final = 10.0
"""Before and after, in which such an estimate is not believed either: it swings through zero."""
STEP_S: Final = 0.1
"""What is nearer together is one record."""
_ON_GROUND, _IN_AIR = 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Phases:
    """What is known of the vehicle's place, (n,) each, at times ``t`` (s).

    Attributes
    ----------
    in_air : (n,) bool
        Likelier in the air than on the ground.
    sure : (n,) float
        Probability that it is in the air.
    ground : (n,) float
        m, the height of the ground under it as its own heights tell it.
    """

    t: Floats
    in_air: Mask
    sure: Floats
    ground: Floats


def find_phases(motion: Motion, armed: Mask, *, wings: Wings) -> Phases:
    """Return when a vehicle is in the air.

    Parameters
    ----------
    motion : Motion
    armed : (n,) bool
        At the times of the motion; all of them where the log does not tell.
    wings : str
        What carries it: ``none`` (rotors alone), ``alone``, ``maybe`` (a VTOL, or nobody knows).
    """
    rows = np.flatnonzero(np.diff(np.floor(motion.t / STEP_S), prepend=-np.inf))
    motion, armed = motion.at(rows), armed[rows]
    t = motion.t
    steps = np.clip(np.diff(t, append=t[-1:]), 0.0, 1.0)
    astray = _astray(motion)
    height = np.where(astray, motion.pressed, motion.height)
    climb = np.where(astray, 0.0, _normal(_over_a_second(t, motion.climb), CLIMB))
    others = _others(motion, armed, wings=wings)
    ground = _ground(height, others + climb < -SURE)
    if wings == "none":
        others += _of_throttle(motion, height - ground)
    # height and climb rate are one estimate, which falls on after a crash
    vertical = _limited(_of_height(height, ground) + climb)
    sure = _probability((others + vertical) * steps, armed)
    return Phases(t, sure > 0.5, sure, ground)


def _astray(motion: Motion) -> Mask:
    """Return where the estimated height is beyond all errors off that by air pressure.

    There the pressure tells the height, and nobody the climb rate: an estimator that does not
    converge goes through hundreds of metres on a bench, and air does not.
    """
    apart = motion.height - motion.pressed
    known_ones = np.flatnonzero(np.isfinite(apart))
    if not known_ones.size:
        return np.zeros(motion.t.size, np.bool_)
    off = np.abs(apart - apart[known_ones[0]]) > ASTRAY_M + ASTRAY_SHARE * np.abs(motion.pressed)
    low, high = (np.searchsorted(motion.t, motion.t + s) for s in (-ASTRAY_S, ASTRAY_S))
    sums = np.append(0, np.cumsum(off))
    near: Mask = sums[high] > sums[low]
    return near & np.isfinite(motion.pressed)


def never_up(motion: Motion) -> Phases:
    """Return the phases of what drives or swims: whatever its height says, it does not fly."""
    zeros = np.zeros(motion.t.size)
    return Phases(motion.t, zeros > 0, zeros, motion.height)


def _others(motion: Motion, armed: Mask, *, wings: Wings) -> Floats:
    """Return what all but height and climb rate say for the air, nats a second, (n,)."""
    found = _of_wings(motion) if wings == "alone" else _of_speed(motion.speed)
    turns = _over_a_second(motion.t, motion.turns)
    turned = _of_turning(turns)
    if wings == "none":
        turned[_spins(motion, turns)] = 2 * MOST
    found += turned
    if wings == "alone":
        steady = (turns < CARVES) & (np.abs(_over_a_second(motion.t, motion.climb)) < STEADY)
        found -= 2 * MOST * (steady & (np.abs(motion.upright) < ON_EDGE))
    if wings == "none":
        lies = (motion.upright < 0) & (turns < TURNING[1][0][0])
        found -= 2 * MOST * (lies | (motion.throttle <= IDLE))
    found += np.select(
        [motion.landed_state == _ON_GROUND, motion.landed_state == _IN_AIR], [-WORD, WORD], 0.0
    )
    return found - MOST * ~armed


def _spins(motion: Motion, turns: Floats) -> Mask:
    """Return where it spins upright, from where it turns faster than who is carried about."""
    stays = _over_a_second(motion.t, motion.upright) > UPRIGHT
    found = np.zeros(turns.size, np.bool_)
    for low, high in runs_of((turns > TURNING[0][1][0]) & stays):
        found[low:high] = (turns[low:high] > SPINS).any()
    return found


def _limited(values: Floats, most: float = MOST) -> Floats:
    """Return what a source says within its limits; what it does not know is nothing."""
    return np.clip(np.nan_to_num(values, nan=0.0, posinf=most, neginf=-most), -most, most)


def _normal(values: Floats, way: _Ways) -> Floats:
    """Return what values about zero say, by their scatter on the ground and in the air."""
    size = np.minimum(np.abs(values), max(spread for spread, _ in way[1]) * 10.0)
    ground, air = (
        sum(share / spread * np.exp(-((size / spread) ** 2) / 2) for spread, share in one)
        for one in way
    )
    with np.errstate(divide="ignore"):
        return _limited(np.log(air) - np.log(ground))


def _of_turning(rate: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        ground, air = (
            sum(
                share * np.exp(-((np.log(rate / middle) / SPREAD) ** 2) / 2)
                for middle, share in one
            )
            for one in TURNING
        )
        return np.maximum(_limited(np.log(air / ground)), -MOST / 2)  # a calm flight is quiet too


def _of_speed(speed: Floats) -> Floats:
    return np.minimum(_normal(speed, SPEED), MOST / 2)  # receivers wander


def _of_wings(motion: Motion) -> Floats:
    """Return what the speed says of wings: in the wind they may be slow over ground.

    Wings that move in the log, and never as fast as wings fly, are carried about.
    """
    speed = np.fmax(np.hypot(motion.speed, np.nan_to_num(motion.climb)), motion.airspeed)
    with np.errstate(invalid="ignore"):
        fast = speed[speed > FAST]
        if not fast.size:
            is_carried = np.nanmax(motion.speed, initial=0.0) > SPEED[0][0][0]
            return np.full(speed.size, -2 * MOST) if is_carried else _of_speed(speed)
        share = speed / np.quantile(fast, 0.75)
        told = np.interp(share, [STANDS, 0.25, 0.5, 0.7], [-2 * MOST, -MOST / 2, 0.0, MOST / 2])
        return _limited(told, 2 * MOST)


def _of_throttle(motion: Motion, above: Floats) -> Floats:
    """Return what a throttle that does not idle says, by that of the rows well above ground.

    Without such a row by the hover that the autopilot has learned; without that nobody knows what a
    hover takes, and half is believed of either.
    """
    throttle = motion.throttle
    with np.errstate(invalid="ignore"):
        on = throttle > IDLE
        if not on.any():
            return np.zeros(throttle.size)
        high = on & (above > HIGH_M)
        usual = high if high.any() else on
        part = usual & (throttle < FULL)
        hover = np.median(throttle[part if part.any() else usual])
        told = np.interp(throttle / hover, *_HOVERS)
        if high.any():
            return np.where(on, told, 0.0)
        lifts = np.interp(throttle / motion.hover, *_LIFTS)
        return np.where(on, np.where(np.isfinite(motion.hover), lifts, told) / 2, 0.0)


def _of_height(height: Floats, ground: Floats) -> Floats:
    above = np.abs(
        np.where((height < ground) & (height > ground - WASH_M), ground, height) - ground
    )
    in_air = 1 / ((1 + above) * np.log(1 + HIGHEST_M))
    with np.errstate(over="ignore", invalid="ignore"):
        told = np.log(LEVEL_M * np.sqrt(2 * np.pi) * in_air) + (above / LEVEL_M) ** 2 / 2
    return _limited(told)


def _ground(height: Floats, on_ground: Mask) -> Floats:
    """Return the height of the ground, from the stretches on it and between them.

    Without any that of the place of take-off, where heights begin.
    """
    if not on_ground.any():
        return np.full(height.size, min(0.0, float(height.min())))
    rows = np.arange(height.size)
    return np.interp(rows, rows[on_ground], height[on_ground])


def _over_a_second(t: Floats, values: Floats) -> Floats:
    """Return the mean over the second about every time; of unknown values nothing."""
    known_values = np.isfinite(values)
    sums = np.append(0.0, np.cumsum(np.where(known_values, values, 0.0)))
    counts = np.append(0, np.cumsum(known_values))
    low, high = np.searchsorted(t, t - 0.5, side="left"), np.searchsorted(t, t + 0.5, side="right")
    count = counts[high] - counts[low]
    mean = (sums[high] - sums[low]) / np.maximum(count, 1)
    return np.where(count > 0, mean, np.nan)


def _probability(told: Floats, armed: Mask) -> Floats:
    """Return the probability, (n,), that it is in the air, by forward and backward sums.

    ``told`` are nats for the air of every step.
    """
    gains, may_rise = told.tolist(), armed.tolist()
    enter = [CHANGE if may else inf for may in may_rise]
    ground, air = 0.0, -CHANGE  # most logs begin on the ground
    forward = np.empty(told.size)
    for row, (gain, cost) in enumerate(zip(gains, enter, strict=True)):
        ground, air = _either(ground, air - CHANGE), _either(air, ground - cost) + gain
        forward[row] = air - ground
    backward = np.zeros(told.size)
    ground, air = 0.0, 0.0
    for row in range(told.size - 1, 0, -1):
        gain, cost = gains[row], enter[row]
        ground, air = _either(ground, air + gain - cost), _either(air + gain, ground - CHANGE)
        backward[row - 1] = air - ground
    return 1 / (1 + np.exp(-np.clip(forward + backward, -700.0, 700.0)))


def _either(one: float, other: float) -> float:
    """Return the logarithm of the sum of two exponentials."""
    high, low = (one, other) if one > other else (other, one)
    return high + log1p(exp(low - high)) if low > high - 40.0 else high
