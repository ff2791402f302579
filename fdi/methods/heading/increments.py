"""By how much did heading, tilt and position change over some seconds, one source against another?

In: a `Ride`. Out: `Pair`s: the difference of two sources' increments beside its own predicted
deviation. Increments need no absolute truth: a compass' hard iron, a gyroscope's start, a wind are
the same at both ends. A deviation adds, as variances,

- what sensors of the kind are good for (`STATED`);
- what lies between two records of a rate: were they independent, each would stand for one period
  with the variance of half their difference squared. Where the estimator's attitude is recorded as
  often, and shows that from record to record it turned as far as the mean of their rates says, no
  more than what these differ by was missed;
- what a compass reads late, times how fast the vehicle turns and leans, and what it deviates on
  another heading;
- by how much the heading depends on which tilt levels the compass (accelerometer, estimator);
- what an acceleration does to the tilt of an accelerometer, atan(a / g).

Where the settled beginning of the flight shows more (median over deviation, as of a Gaussian), the
deviation is scaled up to that: the flight's own noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from fdi.methods.heading.compute import compass_heading
from fdi.methods.heading.geodesy import wrap
from fdi.methods.heading.motion import FIX_LATE_S, Bools, Fixes, Ride, gap_between
from fdi.methods.heading.tilt import (
    UPRIGHT,
    G,
    accelerometer_tilt,
    angle_rates,
    complementary,
    turned_by,
)
from fdi.methods.setup.rotations import to_earth
from fdi.telemetry.message import Floats

WINDOW_S: Final = 5.0
RECEIVER_S: Final = (WINDOW_S, 30.0, 120.0)
"""For positions: steps, drifts and slow drifts."""
GATE: Final = 5.0
"""Deviations that count as a disagreement: by Gaussian noise one in 1.7 million (choice)."""
LEFT: Final = 0.3
"""Share of an acceleration's effect on the tilt that taking it off may leave (choice)."""
STEADY: Final = 0.2
"""Of gravity, by which specific force may differ for accelerometers to tell the tilt (choice)."""
BRIEF_S: Final = 0.5
ELSEWHERE: Final = 0.35
"""Share by which a compass that is of use may be off the field's strength at the place."""
AS_OFTEN: Final = 0.1
"""Of a record's period, by which attitudes may be less often recorded and count as often."""
TAU_S: Final = 2.0
"""Of the tilt by accelerometers; usual are 1 to 10 s."""
COMPASS_LATE_S: Final = 0.1
"""ArduPilot reads compasses at 10 Hz, PX4 averages over as long."""
DEVIATION: Final = np.radians(1.4)
"""What a good calibration leaves on other headings, one sigma (as in the models)."""
WANDERS: Final = 0.2
"""m per root second: a receiver's position by its atmosphere and reflections (choice)."""
DOPPLER_BIAS: Final = 0.02
"""m/s, of a receiver's velocity over minutes (choice: data sheets tell 0.05 of one fix)."""
STATED: Final[Mapping[str, float]] = MappingProxyType(
    {"compass": np.radians(1.5), "gyroscope": np.radians(0.5), "estimator": np.radians(0.5),
     "accelerometer": np.radians(1.5), "doppler": 0.1}
)  # fmt: skip
"""Least deviation of an increment over 5 s, rad; of a receiver's velocity, m/s (data sheets)."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Two sources against each other.

    Attributes
    ----------
    name : str
        ``compass-gyroscope``.
    kind : str
        ``heading``, ``attitude``, ``strength``, ``position``, ``velocity`` or ``height``.
    off : (n,) float
        Difference of the increments, rad, m or m/s, of a strength its share; NaN where one is
        absent.
    sigma : (n,) float
        Its predicted deviation.
    """

    name: str
    kind: str
    off: Floats
    sigma: Floats

    @property
    def disagrees(self) -> Floats:
        """1 where the two disagree, 0 where not, NaN where one is absent."""
        apart = (np.abs(self.off) > GATE * self.sigma).astype(np.float64)
        return np.where(np.isfinite(self.off) & np.isfinite(self.sigma), apart, np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """How far a source turned about the vertical over windows, (n,) rad, with its deviation."""

    by: Floats
    sigma: Floats


def heading_pairs(ride: Ride, grid: Floats, length: float = WINDOW_S) -> tuple[Pair, Pair, Pair]:
    """Return compass-gyroscope, compass-estimator, gyroscope-estimator over a window, s."""
    turned = turns(ride, grid, length)
    return (
        turned_apart(ride, grid, "compass-gyroscope", turned),
        turned_apart(ride, grid, "compass-estimator", turned),
        turned_apart(ride, grid, "gyroscope-estimator", turned),
    )


def gyroscopes_apart(ride: Ride, grid: Floats, length: float) -> Iterator[Pair]:
    """Yield how far the gyroscope turned otherwise than each other one on board over a window."""
    if ride.angles is None:
        return
    sigma = np.full(grid.size, np.sqrt(2.0) * drifted(length))
    for number, rates in enumerate(ride.other_rates, 2):
        more = angle_rates(ride.angles[0], ride.angles[1], rates - ride.rates)[2]
        unknown = ~np.isfinite(more)
        by, lost = (
            change(ride.t, integral(ride.t, one), grid, grid - length)
            for one in (np.where(unknown, 0.0, more), unknown.astype(np.float64))
        )
        by[(lost > 0) | _upended(ride, ride.angles, grid, grid - length)] = np.nan
        yield pair_of(ride, grid, f"gyroscope-gyroscope {number}", wrap(by), sigma)


def turned_apart(ride: Ride, grid: Floats, name: str, turned: Mapping[str, Turn]) -> Pair:
    """Return the pair of two sources, ``compass-gyroscope``, by how far each turned."""
    one, other = (turned[source] for source in name.split("-"))
    sigma = np.hypot(one.sigma, other.sigma)
    return pair_of(ride, grid, name, wrap(one.by - other.by), sigma)


def turns(ride: Ride, grid: Floats, length: float) -> dict[str, Turn]:
    """Return how far compass, gyroscope and estimator turned about the vertical over a window."""
    before = grid - length
    angles = ride.angles
    if angles is None:
        angles = np.array([*_accelerometer_tilt(ride), np.full(ride.t.size, np.nan)])
    turned = angle_rates(angles[0], angles[1], ride.rates)
    gyro = change(ride.t, integral(ride.t, turned[2]), grid, before)
    between = _between(ride, turned[2], _steps(ride, angles[2]), grid, before)
    compass, doubt = _compass(ride, angles, turned, grid, before)
    estimator = change(ride.t, angles[2], grid, before)
    gap = gap_between(ride.t, before, grid)
    for own in (gyro, compass):
        own[gap] = np.nan
    for own in (gyro, compass, estimator):
        own[_upended(ride, angles, grid, before)] = np.nan
    late = _sampled_late(ride, turned[2], grid, before)
    return {
        "compass": Turn(compass, np.hypot(doubt, STATED["compass"])),
        "gyroscope": Turn(gyro, np.hypot(between, drifted(length))),
        "estimator": Turn(estimator, np.hypot(STATED["estimator"], late)),
    }


def drifted(length: float) -> float:
    """Return the deviation, rad, of a healthy gyroscope's increment over a window, s."""
    return STATED["gyroscope"] * length / WINDOW_S


def sensor_pairs(ride: Ride, grid: Floats, length: float = WINDOW_S) -> tuple[Pair, Pair, Pair]:
    """Return accelerometer-gyroscope, accelerometer-compass, gyroscope-compass over a window, s.

    No estimator is in them, and no heading: gravity and the Earth's field are two vectors that the
    gyroscopes turn, and the angle between them belongs to the place. An estimator that follows
    a wrong gyroscope agrees with it, and makes the accelerometer look wrong.
    """
    return (
        _gravity_turned(ride, grid, length),
        _gravity_against_field(ride, grid, length),
        _field_turned(ride, grid, length),
    )


def jump_pairs(ride: Ride, grid: Floats) -> tuple[Pair, Pair]:
    """Return by what the field jumps: the angle that gyroscopes leave of it, and its strength."""
    length = max(BRIEF_S, ride.period)
    turned = _field_turned(ride, grid, length)
    return replace(turned, name=f"{turned.name} {length:g} s"), _strength(ride, grid, length)


def _strength(ride: Ride, grid: Floats, length: float) -> Pair:
    """Return by what share the field's strength changed over a window: no turn changes it.

    Unknown of a compass whose strength at the beginning is not that of the place: what is near it
    is in its readings, and comes and goes.
    """
    name, kind, before = f"compass-place {length:g} s", "strength", grid - length
    low, high = ride.reference
    first = (ride.t >= low) & (ride.t <= high)
    seen = np.full(ride.t.size, np.nan)
    if ride.field is not None and first.any():
        seen = np.linalg.norm(ride.field, axis=0)
        if not np.abs(np.nanmedian(seen[first]) / ride.strength - 1) <= ELSEWHERE:
            seen = np.full(ride.t.size, np.nan)
    off = change(ride.t, np.log(seen), grid, before)
    off[gap_between(ride.t, before, grid)] = np.nan
    sigma = np.hypot(STATED["compass"], _deviates(ride, grid, before))
    return pair_of(ride, grid, name, off, sigma, kind)


def _gravity_turned(ride: Ride, grid: Floats, length: float) -> Pair:
    """Return how far roll or pitch, whichever is further, is from what gyroscopes turned."""
    before = grid - length
    leant = [np.where(_is_steady(ride), own, np.nan) for own in accelerometer_tilt(ride.force)]
    angles = np.zeros((3, ride.t.size)) if ride.angles is None else ride.angles
    turned = angle_rates(angles[0], angles[1], ride.rates)
    gap = gap_between(ride.t, before, grid) | _upended(ride, angles, grid, before)
    *pulled, left = _pulled(ride)
    doubt = np.hypot(STATED["accelerometer"], _both(ride, left, grid, before))
    found = []
    for axis in (0, 1):
        between = _between(ride, turned[axis], _steps(ride, angles[axis]), grid, before)
        # what both share is taken off before the angle is wrapped: an integral has no range
        apart = _trailing(ride, wrap(leant[axis] - angles[axis])) - pulled[axis]
        drifts = _trailing(ride, angles[axis] - integral(ride.t, turned[axis]))
        off = change(ride.t, apart + drifts, grid, before)
        off[gap] = np.nan
        sigma = np.sqrt(doubt**2 + between**2 + drifted(length) ** 2)
        found.append(pair_of(ride, grid, "accelerometer-gyroscope", off, sigma, "attitude"))
    return _further(found[0], found[1])


def _gravity_against_field(ride: Ride, grid: Floats, length: float) -> Pair:
    """Return how the angle from specific force to field changed, beyond what accelerations do."""
    before = grid - length
    north, east, left = _accelerations(ride)
    flat = np.cos(ride.dip)
    down = np.array([np.zeros(ride.t.size), np.zeros(ride.t.size), np.full(ride.t.size, -G)])
    pulled = down + np.array([north, east, np.zeros(ride.t.size)])
    earth = np.array(
        [np.cos(ride.declination) * flat, np.sin(ride.declination) * flat, np.sin(ride.dip)]
    )
    expected = _angle(pulled, earth[:, None])
    field = np.full((3, ride.t.size), np.nan) if ride.field is None else ride.field
    seen = np.where(_is_steady(ride), _angle(ride.force, field), np.nan)
    off = change(ride.t, _trailing(ride, seen) - expected, grid, before)
    off[gap_between(ride.t, before, grid)] = np.nan
    late = COMPASS_LATE_S * np.linalg.norm(ride.rates, axis=0)
    sigma = np.sqrt(
        STATED["accelerometer"] ** 2
        + STATED["compass"] ** 2
        + DEVIATION**2
        + _both(ride, left, grid, before) ** 2
        + _both(ride, late, grid, before) ** 2
    )
    return pair_of(ride, grid, "accelerometer-compass", off, sigma, "attitude")


def _field_turned(ride: Ride, grid: Floats, length: float) -> Pair:
    """Return by what angle the field misses where gyroscopes turned it."""
    name, kind, before = "gyroscope-compass", "attitude", grid - length
    if ride.field is None:
        unknown = np.full(grid.size, np.nan)
        return Pair(name, kind, unknown, unknown)
    fixed = np.einsum("nij,jn->in", turned_by(ride.t, ride.rates), ride.field)
    now, then = (
        np.array([np.interp(when, ride.t, row) for row in fixed]) for when in (grid, before)
    )
    off = _angle(now, then)
    off[gap_between(ride.t, before, grid)] = np.nan
    steps = _body_steps(ride)
    between = sum(
        _between(ride, row, step, grid, before) ** 2
        for row, step in zip(ride.rates, steps, strict=True)
    )
    late = COMPASS_LATE_S * np.linalg.norm(ride.rates, axis=0)
    sigma = np.sqrt(
        STATED["compass"] ** 2
        + 3 * drifted(length) ** 2
        + between
        + _both(ride, late, grid, before) ** 2
        + _deviates(ride, grid, before) ** 2
    )
    return pair_of(ride, grid, name, off, sigma, kind)


def _upended(ride: Ride, angles: Floats, grid: Floats, before: Floats) -> Bools:
    """Return in which windows the nose comes so near to the vertical that no heading is told."""
    steep = np.insert(np.cumsum(np.abs(angles[1]) > UPRIGHT), 0, 0)
    first = np.searchsorted(ride.t, before)
    last = np.searchsorted(ride.t, grid, side="right")
    return np.asarray(steep[last] > steep[first])


def _deviates(ride: Ride, grid: Floats, before: Floats) -> Floats:
    """Return what a compass deviates otherwise where it has turned to, as a share of the field."""
    turned = [change(ride.t, integral(ride.t, row), grid, before) for row in ride.rates]
    apart = np.minimum(np.linalg.norm(turned, axis=0), np.pi)
    return np.asarray(2 * DEVIATION * np.sin(apart / 2))


def _angle(one: Floats, other: Floats) -> Floats:
    """Return the angle between vectors, (3, n) each."""
    across = np.linalg.norm(np.cross(one, other, axis=0), axis=0)
    return np.asarray(np.arctan2(across, (one * other).sum(axis=0)))


def _both(ride: Ride, values: Floats, grid: Floats, before: Floats) -> Floats:
    return np.hypot(around(ride, values, grid), around(ride, values, before))


def receiver_pairs(ride: Ride, grid: Floats) -> tuple[Pair, ...]:
    """Return the receiver's positions against its own velocity, over three windows."""
    if ride.fixes is None:
        return ()
    return tuple(_receiver(ride, ride.fixes, grid, length) for length in RECEIVER_S)


def _receiver(ride: Ride, fixes: Fixes, grid: Floats, length: float) -> Pair:
    before = grid - length
    last = np.maximum(np.searchsorted(fixes.t, grid, side="right") - 1, 0)
    first = np.maximum(np.searchsorted(fixes.t, before, side="right") - 1, 0)
    place = fixes.position()
    off, spread = np.zeros((2, grid.size)), np.zeros(grid.size)
    for axis, speed in enumerate((fixes.north, fixes.east)):
        steps = np.diff(fixes.at)
        way = np.insert(np.cumsum((speed[1:] + speed[:-1]) / 2 * steps), 0, 0.0)
        rough = bent(fixes.at, speed)
        off[axis] = place[axis][last] - place[axis][first] - (way[last] - way[first])
        late = FIX_LATE_S * (speed[last] - speed[first])
        spread += rough[last] - rough[first] + late**2
    apart = np.hypot(*off)
    apart[(last <= first) | gap_between(fixes.t, before, grid)] = np.nan
    own = np.sqrt(
        WANDERS**2 * length
        + STATED["doppler"] ** 2 * length
        + (DOPPLER_BIAS * length) ** 2
        + spread
    )
    return pair_of(ride, grid, f"fixes-doppler {length:g} s", apart, own, "position")


def bent(t: Floats, rate: Floats) -> Floats:
    """Return the running variance of what the integral of a rate missed between records.

    Of three in a row the middle one is off the line of its neighbours. Were they independent, that
    would be sixfold their variance; a motion that records resolve lies on the line.
    """
    off = np.zeros(t.size)
    off[1:-1] = (rate[2:] - 2 * rate[1:-1] + rate[:-2]) * (t[2:] - t[:-2]) / 2
    return np.asarray(np.cumsum(off**2 / 6))


def pair_of(
    ride: Ride, grid: Floats, name: str, off: Floats, sigma: Floats, kind: str = "heading"
) -> Pair:
    """Return a pair whose deviation is scaled up where the flight's beginning shows more."""
    low, high = ride.reference
    with np.errstate(invalid="ignore"):
        apart = np.abs(off) / sigma
    seen = apart[(grid >= low) & (grid <= high) & np.isfinite(apart)]
    scale = 1.4826 * float(np.median(seen)) if seen.size else 0.0
    return Pair(name, kind, off, sigma * max(scale, 1.0))


def _further(one: Pair, other: Pair) -> Pair:
    with np.errstate(invalid="ignore"):
        first = ~(np.abs(other.off) / other.sigma > np.abs(one.off) / one.sigma)
    return Pair(
        one.name,
        one.kind,
        np.where(first, one.off, other.off),
        np.where(first, one.sigma, other.sigma),
    )


def _accelerometer_tilt(ride: Ride) -> tuple[Floats, Floats]:
    """Return roll and pitch by accelerometers, smoothed by gyroscopes over `TAU_S`."""
    roll, pitch = accelerometer_tilt(ride.force)
    k = np.exp(-np.diff(ride.t, prepend=ride.t[:1]) / TAU_S)
    found = complementary(ride.t, ride.rates, roll, pitch, k)
    return found[0], found[1]


def _compass(
    ride: Ride,
    angles: Floats,
    turned: Floats,
    grid: Floats,
    before: Floats,
) -> tuple[Floats, Floats]:
    """Return a compass' change of heading, and how far it is to be doubted."""
    if ride.field is None:
        return np.full(grid.size, np.nan), np.zeros(grid.size)
    own = compass_heading(ride.field, angles[0], angles[1], 0.0)
    force = accelerometer_tilt(ride.force)
    beyond = np.zeros(ride.t.size)
    for length in (TAU_S, BRIEF_S):  # a long mean is sure, and late
        *pulled, left = _pulled(ride, length)
        usual = STATED["accelerometer"] ** 2 * TAU_S / length + np.nan_to_num(left) ** 2
        square = np.zeros(ride.t.size)
        for axis in (0, 1):
            apart = _trailing(ride, wrap(force[axis] - angles[axis]), length)
            square += np.nan_to_num(apart - np.nan_to_num(pulled[axis])) ** 2
        beyond = np.maximum(beyond, np.sqrt(np.maximum(square - usual, 0.0)))
    moved = change(ride.t, _unwrap(own), grid, before)
    dip = abs(np.tan(ride.dip))
    leaning = np.hypot(turned[0], turned[1])
    # an attitude between two that are far apart levels a compass as badly as a late one
    late = np.hypot(COMPASS_LATE_S, ride.coarse) * np.hypot(turned[2], dip * leaning)
    ends = [around(ride, late, when) for when in (grid, before)]
    tilts = [dip * np.interp(when, ride.t, beyond) for when in (grid, before)]
    swing = 2 * DEVIATION * np.abs(np.sin(np.nan_to_num(moved) / 2))
    return moved, np.sqrt(sum(x**2 for x in (*ends, *tilts, swing)))


def around(ride: Ride, values: Floats, when: Floats) -> Floats:
    """Return the largest of the records before and after a time."""
    after = np.clip(np.searchsorted(ride.t, when), 1, ride.t.size - 1)
    return np.maximum(values[after], values[after - 1])


def _sampled_late(ride: Ride, rate: Floats, grid: Floats, before: Floats) -> Floats:
    """Return what an angle is wrong by, that was recorded half a record from its rate."""
    size = np.abs(rate) * (ride.period / 2 + ride.coarse)
    return np.hypot(around(ride, size, grid), around(ride, size, before))


def _is_steady(ride: Ride) -> Bools:
    """Return where specific force is nearly gravity's: elsewhere it tells no tilt.

    At the top of a loop it may be as much, and points the other way: who lies on the side or the
    back is never steady.
    """
    steady = np.abs(np.linalg.norm(ride.force, axis=0) - G) < STEADY * G
    if ride.angles is not None:
        steady &= ~(np.cos(ride.angles[0]) * np.cos(ride.angles[1]) < np.cos(UPRIGHT))
    return np.asarray(steady)


def _accelerations(ride: Ride, length: float = TAU_S) -> tuple[Floats, Floats, Floats]:
    """Return accelerations north and east, means over a time before, m/s2, by the receiver.

    And by how much, rad, what they do to a tilt is to be doubted: receivers smooth their velocity.
    Where no receiver tells them, the tilt by accelerometers is not known.
    """
    if ride.fixes is None:
        unknown = np.full(ride.t.size, np.nan)
        return unknown, unknown, unknown
    t, fixes = ride.t, ride.fixes
    north, east = (
        (np.interp(t, fixes.t, row) - np.interp(t - length, fixes.t, row)) / length
        for row in (fixes.north, fixes.east)
    )
    north[gap_between(fixes.t, t - length, t)] = np.nan
    return north, east, LEFT * np.arctan(np.hypot(north, east) / G)


def _pulled(ride: Ride, length: float = TAU_S) -> tuple[Floats, Floats, Floats]:
    """Return what accelerations add to roll and pitch by accelerometers, and the doubt, rad."""
    north, east, doubt = _accelerations(ride, length)
    yaw = np.full(ride.t.size, np.nan) if ride.angles is None else ride.angles[2]
    ahead = north * np.cos(yaw) + east * np.sin(yaw)
    right = -north * np.sin(yaw) + east * np.cos(yaw)
    return -np.arctan(right / G), np.arctan(ahead / G), doubt


def _between(ride: Ride, rate: Floats, turned: Floats, grid: Floats, before: Floats) -> Floats:
    """Return the deviation by what records of a rate may have missed from ``before`` to ``grid``.

    ``turned``, (n - 1,): what the attitude turned from record to record; NaN unknown.
    """
    known = np.nan_to_num(rate)
    period = np.diff(ride.t)
    missed = (np.diff(known) * period) ** 2 / 2
    seen = wrap(turned - (known[1:] + known[:-1]) / 2 * period) ** 2
    seen = np.where(np.isfinite(seen), seen, missed)
    sums = [np.insert(np.cumsum(own), 0, 0.0) for own in (missed, seen)]
    # of the sums the lesser: the sum of the lesser ones would be too small by chance
    least = np.minimum(*(change(ride.t, own, grid, before) for own in sums))
    return np.sqrt(np.maximum(least, 0.0))


def _steps(ride: Ride, angle: Floats) -> Floats:
    """Return by how much an angle of the attitude changed from record to record, (n - 1,)."""
    is_seen = ride.angles is not None and ride.coarse <= AS_OFTEN * ride.period
    return np.diff(angle) if is_seen else np.full(ride.t.size - 1, np.nan)


def _body_steps(ride: Ride) -> Floats:
    """Return by how much the attitude turned about the body's axes, (3, n - 1), rad."""
    if ride.angles is None:
        return np.full((3, ride.t.size - 1), np.nan)
    place = to_earth(*ride.angles)
    step = np.einsum("nji,njk->nik", place[:-1], place[1:])
    across = np.array([step[:, i, j] - step[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))]) / 2
    size = np.linalg.norm(across, axis=0)
    about = np.trace(step, axis1=1, axis2=2)
    whole = across * np.arctan2(size, (about - 1) / 2) / np.maximum(size, 1e-12)
    return np.array([own + 0 * _steps(ride, ride.angles[2]) for own in whole])


def integral(t: Floats, rate: Floats) -> Floats:
    """Return a rate's running integral, (n,), by trapezoids; what is unknown counts as 0."""
    known = np.nan_to_num(rate)
    return np.insert(np.cumsum((known[1:] + known[:-1]) / 2 * np.diff(t)), 0, 0.0)


def _trailing(ride: Ride, angles: Floats, length: float = TAU_S) -> Floats:
    """Return the mean of angles over a time before each record; of what is known for half of it.

    A vehicle thrown about feels the weight of one that stands for moments, whatever its tilt.
    """
    known = np.isfinite(angles)
    smooth = np.where(known, angles, 0.0)
    total, count = (np.insert(np.cumsum(x), 0, 0.0) for x in (smooth, known.astype(float)))
    first = np.searchsorted(ride.t, ride.t - length)
    last = np.arange(1, ride.t.size + 1)
    seen = count[last] - count[first]
    mean = (total[last] - total[first]) / np.maximum(seen, 1)
    return np.where((seen > 0) & (2 * seen >= last - first), mean, np.nan)


def change(t: Floats, values: Floats, grid: Floats, before: Floats) -> Floats:
    """Return by how much what is known at ``t`` changed from ``before`` to ``grid``."""
    return np.asarray(np.interp(grid, t, values) - np.interp(before, t, values))


def _unwrap(angles: Floats) -> Floats:
    """Return angles without jumps; unknown ones stay unknown."""
    known: Bools = np.isfinite(angles)
    result = np.full(angles.size, np.nan)
    result[known] = np.unwrap(angles[known])
    return result
