"""Does the autopilot's board lie as its parameters say?

In: a log. Out: a `Check` for accelerometers and one for gyroscopes. At rest, and over a flight in
the mean, what holds a vehicle up points out of its top: the accelerometers read 1 g along body -z.
What the gyroscopes read is the rate at which the attitude turns.

A board that is turned about the vertical alone shows in neither: that is for the motors' moments
(``motors.py``) and for the heading.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import permutations, product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.setup.interval import (
    Interval,
    by_parts,
    in_degrees,
    in_percent,
    numbers_of,
    of_explained,
    verdict_of,
)
from fdi.methods.setup.records import Series, attitude, series, spins, stretches, within
from fdi.methods.setup.rotations import to_earth
from fdi.methods.setup.values import Check
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

_G: Final = 9.80665
TURNED: Final = np.radians(45.0)
FITS: Final = np.radians(22.5)
_STILL: Final = 0.05  # rad/s
_WHOLE: Final = 0.2  # share of g by which what is read at rest may differ from g
OFF: Final = 0.08 * _G
"""m/s^2: the zero-g offset of an accelerometer that nobody has calibrated (InvenSense MPU-6000)."""
TURNS_AT_REST: Final = np.radians(5.0)
"""rad/s: with gyroscopes that far from each other ArduPilot does not arm (AP_Arming)."""
_REST_S: Final = 2.0
_RECORDS: Final = 5  # of a stretch so long
_RESTS: Final = 3
_QUIET: Final = np.array([0.1, 0.1, 0.1, 0.02, 0.02, 0.02])
"""m/s^2 and rad/s: scatter of a vehicle that stands with its motors off, several times the noise of
the sensors (MPU-6000: 0.03 m/s^2 and 0.001 rad/s within 50 Hz)."""
_FEW: Final = 20
_EXPLAINS: Final = 0.7
_LITTLE: Final = 0.2
_STIRRED: Final = 0.05  # rad/s, on two axes at least
_SLOWEST_S: Final = 0.25
_UNITS: Final = (("RAW_IMU", 1), ("SCALED_IMU2", 2), ("SCALED_IMU3", 3))
_FIRST: Final = "accelerometer 1"


def check_mounting(log: Log) -> Iterator[Check]:
    """Yield whether accelerometers and gyroscopes lie in the vehicle as set."""
    for key, number in _UNITS:
        force = series(log, key, ("xacc", "yacc", "zacc"))
        if force is not None:
            yield _upright(f"accelerometer {number}", log, force)
    yield from _zero_rate(log)
    turned = series(log, "RAW_IMU", ("xgyro", "ygyro", "zgyro"), in_units=True)
    known = attitude(log)
    if turned is not None and known is not None:
        yield _turning(log, turned, known)


def _zero_rate(log: Log) -> Iterator[Check]:
    """Yield what the gyroscopes read while their accelerometer rests and nothing flies.

    An autopilot calibrates them as it starts: of their own offset nothing should be left.
    """
    read = series(
        log, "RAW_IMU", ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro"), in_units=True
    )
    if read is None:
        return
    free = ~within(read.t, stretches(log))
    block = np.floor((read.t - read.t[0]) / _REST_S).astype(np.int64)
    still = []
    for rows in np.split(np.arange(read.t.size), np.flatnonzero(np.diff(block)) + 1):
        some = read.values[:, rows]
        shakes = np.std(some, axis=1)
        if rows.size >= _RECORDS and free[rows].all() and not np.any(shakes > _QUIET):
            still.append(np.median(some[3:], axis=1))
    if len(still) < _RESTS:
        return
    size = float(np.linalg.norm(np.median(still, axis=0)))
    name, told = "gyroscopes at rest", f"they read {np.degrees(size):.1f} degrees a second"
    numbers = {"rate_deg_s": float(np.degrees(size))}
    if size > TURNS_AT_REST:
        told += ", while the accelerometer says that the vehicle lies still"
        yield Check(name, "wrong", told, numbers)
    else:
        yield Check(name, "in order", told, numbers)


def _upright(name: str, log: Log, force: Series) -> Check:
    """Return where what holds the vehicle up points: in flight, and at rest where that is unsure.

    Where the attitude says the same, the vehicle may lie or lean so: no sensor is turned then.
    """
    parts = stretches(log)
    flies = any(not part.is_start for part in parts)
    flying = within(force.t, parts) & ~spins(log, force.t)
    seen = [("in flight", flying)] if flies else []
    told: list[tuple[str, NDArray[np.bool_], Interval, float]] = []
    for where, some in [*seen, ("at rest", _at_rest(log, force))]:
        if some.sum() >= _FEW:
            values = force.values[:, some]
            # a weight has a size however the vehicle lies, today on its legs and then on its back
            size = float(np.median(np.linalg.norm(values, axis=0)))
            told.append((where, some, by_parts(_off_top(values), values.shape[1], 0.0), size))
    if not told:
        return Check(name, "not known", "neither a flight nor a rest is long enough")
    fine = (one for one in told if verdict_of(one[2], fine=FITS, bad=TURNED) == "in order")
    where, some, off, size = next(fine, told[0])
    if size < _G / 2:
        return Check(name, "not known", f"it reads {size:.1f} m/s2 {where}, which is no weight")
    numbers = {**numbers_of("off_deg", off, float(np.degrees(1))), "force_m_s2": size}
    weight = next((one[3] for one in told if one[0] == "at rest"), _G)
    # of the others nobody knows whether they are recorded as calibrated
    if name == _FIRST and abs(weight - _G) > OFF:
        words = f"at rest it reads {weight:.2f} m/s2, where its weight is {_G:.2f}"
        numbers |= {"force_m_s2": weight}
        return Check("weight on accelerometer 1", "wrong", words, numbers, strikes=True)
    angle = in_degrees(off)
    words = f"{where} what holds the vehicle up points {angle} off its top"
    verdict, strikes = verdict_of(off, fine=FITS, bad=TURNED), bool(off.value > TURNED)
    if strikes and _leans_so(log, force, some):
        words += ", and so says the attitude: it lay so, or the board is turned"
        verdict = "not known"
    return Check(name, verdict, words, numbers, strikes=strikes)


def _off_top(force: Floats) -> Callable[[NDArray[np.bool_]], float]:
    """Return what tells the angle of the mean force, (3, n), off the top, rad, of some samples."""

    def off(some: NDArray[np.bool_]) -> float:
        mean = force[:, some].mean(axis=1)
        return float(np.arccos(np.clip(-mean[2] / max(np.linalg.norm(mean), 1e-9), -1.0, 1.0)))

    return off


def _leans_so(log: Log, force: Series, some: NDArray[np.bool_]) -> bool:
    """Return whether the vehicle leans by its attitude to where the force points."""
    known = attitude(log)
    if known is None:
        return False
    angles = (np.interp(force.t[some], known.t, np.unwrap(row)) for row in known.values)
    up = -to_earth(*angles)[:, 2].mean(axis=0)
    mean = force.values[:, some].mean(axis=1)
    sizes = float(np.linalg.norm(up) * np.linalg.norm(mean))
    return bool(up @ mean > np.cos(FITS) * sizes)


def _at_rest(log: Log, force: Series) -> np.ndarray:
    """Return when it rests before it first flies, (n,) bool: what rolls or is thrown does not."""
    size = np.linalg.norm(force.values, axis=0)
    still = np.abs(size / _G - 1) < _WHOLE
    rates = series(log, "ATTITUDE", ("rollspeed", "pitchspeed", "yawspeed"))
    if rates is not None:
        turning = np.interp(force.t, rates.t, np.abs(rates.values).max(axis=0))
        still &= turning < _STILL
    first = min((part.start for part in stretches(log)), default=np.inf)
    flight = next((one for one in log.flights if one.flew), None)
    if flight is not None:
        first = min(first, -np.inf if flight.stood is None else flight.stood[1])
    return np.asarray(still & (force.t < first))


def _turning(log: Log, turned: Series, known: Series) -> Check:
    """Return whether the gyroscopes read the rate of the attitude."""
    name = "gyroscopes"
    if max(turned.period, known.period) > _SLOWEST_S:
        slowest = max(turned.period, known.period)
        return Check(name, "not known", f"records are {slowest:.2f} s apart, too far to compare")
    rate, read = _rates(log, turned, known)
    size = (rate**2).mean(axis=1) if rate.size else np.zeros(3)
    stirred = size > _STIRRED**2
    if rate.shape[1] < _FEW or stirred.sum() < 2:
        return Check(name, "not known", "the vehicle turns too little")

    def explained(turn: Floats) -> float:
        left = ((rate - turn @ read) ** 2).mean(axis=1)
        return float(1 - (left[stirred] / size[stirred]).mean())

    best = max(map(explained, _quarter_turns()))
    # pairs count by their size: one blow is one pair
    energy = (rate[stirred] ** 2).sum(axis=0)
    pairs = float(energy.sum() ** 2 / (energy @ energy))
    told = of_explained(explained(np.eye(3)), pairs)
    other = of_explained(best, pairs)
    numbers = {**numbers_of("explained_as_set", told), "explained_best": best}
    words = f"they explain {in_percent(told)} of how the attitude turns"
    if told.least > _EXPLAINS:
        return Check(name, "in order", words, numbers)
    if told.value < _LITTLE and best > _EXPLAINS:
        words += f", and {in_percent(other)} if their axes are turned"
        sure = told.most < other.least
        return Check(name, "wrong" if sure else "not known", words, numbers, strikes=True)
    return Check(name, "not known", words, numbers)


def _rates(log: Log, turned: Series, known: Series) -> tuple[Floats, Floats]:
    """Return rates by the attitude's change and as read, (3, n) rad/s, over pairs of records."""
    roll, pitch, yaw = (np.unwrap(row) for row in known.values)
    t, length = known.t, np.diff(known.t)
    droll, dpitch, dyaw = (np.diff(a) / length for a in (roll, pitch, yaw))
    roll, pitch = (roll[1:] + roll[:-1]) / 2, (pitch[1:] + pitch[:-1]) / 2
    rate = np.array(
        [
            droll - dyaw * np.sin(pitch),
            dpitch * np.cos(roll) + dyaw * np.cos(pitch) * np.sin(roll),
            -dpitch * np.sin(roll) + dyaw * np.cos(pitch) * np.cos(roll),
        ]
    )
    total = np.concatenate(
        [
            np.zeros((3, 1)),
            np.cumsum(
                (turned.values[:, 1:] + turned.values[:, :-1]) / 2 * np.diff(turned.t), axis=1
            ),
        ],
        axis=1,
    )
    read = np.diff([np.interp(t, turned.t, row) for row in total], axis=1) / length
    inside = within(t[:-1], stretches(log)) & (length < 2.5 * known.period)
    inside &= (t[:-1] >= turned.t[0]) & (t[1:] <= turned.t[-1])
    return rate[:, inside], read[:, inside]


def _quarter_turns() -> Iterator[Floats]:
    """Yield the 24 ways to turn a cube."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.zeros((3, 3))
        turn[range(3), order] = signs
        if np.linalg.det(turn) > 0:
            yield turn
