"""Does the heading agree with where the vehicle goes when it leans?

In: a log. Out: one `Check`. A vehicle that leans accelerates to where it leans, by g tan(tilt): a
copter because its thrust leans with it, a plane because its lift does. The receiver tells that
acceleration in north and east without a compass; attitude and heading tell it with one. The angle
between both is the error of the heading, whose usual cause is a compass that is turned about the
vertical, or a board that is. A steady wind makes a lean without an acceleration and is taken out as
a mean.

Given as a complex number each, north + i east: their regression coefficient's argument is the
angle, its coherence says how far it can be believed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.grid import uniform
from fdi.methods.setup.interval import SURE, Interval, by_parts, in_degrees, numbers_of, verdict_of
from fdi.methods.setup.records import Series, attitude, series, spins, stretches
from fdi.methods.setup.rotations import to_earth
from fdi.methods.setup.values import Check
from fdi.telemetry import Log

NAME: Final = "heading"
TURNED: Final = np.radians(45.0)
"""Orientations are 45 degrees apart."""
FITS: Final = np.radians(22.5)
_COHERENT: Final = 0.5
_LENGTH_S: Final = 1.0
"""Of an interval: receivers smooth their velocity over some tenths of a second."""
_PARTS: Final = 10
_LEANS_S: Final = _LENGTH_S / 3
"""Of an attitude; a plane that rocks by its own looks as if it leaned the other way, else."""
_LATE_S: Final = (0.0, 0.1, 0.2, 0.3, 0.5, 0.8)
_FEW: Final = 5.0
"""Pairs that count, fewer of which are a blow or two."""
_MOVES: Final = 1.0  # m/s; below that a receiver's course is noise
_G: Final = 9.80665
_RESTS_ON: Final = ("gps",)
_STEEP: Final = np.radians(50.0)  # beyond, a vehicle falls rather than flies

Complexes = NDArray[np.complex128]


class Fit(NamedTuple):
    """Angle and its standard error, rad; coherence; how many pairs count for it."""

    angle: float
    error: float
    coherence: float
    pairs: float


def check_heading(log: Log) -> Iterator[Check]:
    """Yield whether the heading is that of the receiver."""
    moved, known = _velocity(log), attitude(log)
    if moved is None:
        yield Check(NAME, "not known", "the log holds no speed and course of a receiver")
    elif known is None:
        yield Check(NAME, "not known", "the log holds no attitude")
    elif known.period > _LEANS_S or moved.period > _LENGTH_S:
        said = f"records are {max(known.period, moved.period):.1f} s apart, too far to see it lean"
        yield Check(NAME, "not known", said)
    else:
        yield _told(log, moved, known)


def _velocity(log: Log) -> Series | None:
    """Return north and east velocity of the receiver itself, (2, n) m/s."""
    found = series(log, "GPS_RAW_INT", ("vel", "cog"))
    if found is None or not np.any(found.values[0] > _MOVES):
        return None
    speed, course = found.values
    return Series(found.t, np.array([speed * np.cos(course), speed * np.sin(course)]))


def _told(log: Log, moved: Series, known: Series) -> Check:
    found = [_accelerations(log, moved, known, late) for late in _LATE_S]
    fits = [_angle(went, leant) for went, leant in found]
    best = max(range(len(fits)), key=lambda i: fits[i].coherence)
    fit, (went, leant) = fits[best], found[best]
    if fit.pairs < _FEW:
        return Check(NAME, "not known", "the vehicle leans and accelerates too seldom")
    numbers = {"coherence": fit.coherence}
    if fit.coherence < _COHERENT:
        said = "the receiver's velocity does not follow how the vehicle leans"
        return Check(NAME, "not known", said, numbers)
    off = _between(went, leant, fit)
    numbers |= numbers_of("off_deg", off, float(np.degrees(1)))
    numbers["standard_error_deg"] = (numbers["off_deg_most"] - numbers["off_deg"]) / SURE
    side = "right" if off.value > 0 else "left"
    seen = _turned_by(off)
    words = (
        f"the vehicle accelerates {in_degrees(seen)} {side} of where "
        "it leans by attitude and heading"
    )
    half = went.size // 2
    halves = (_angle(went[:half], leant[:half]), _angle(went[half:], leant[half:]))
    verdict = verdict_of(seen, fine=TURNED, bad=TURNED)
    if seen.value <= TURNED or verdict == "in order":
        return Check(NAME, verdict, words, numbers, rests_on=_RESTS_ON)
    lasts = all(abs(_apart(e.angle, fit.angle)) < FITS and e.coherence > _COHERENT for e in halves)
    sound = _agrees_with_itself(log, moved)
    if verdict == "wrong" and lasts and sound:
        words += ": the compass or the board is turned, or the compass is badly calibrated"
    else:
        verdict = "not known"
        words += "" if lasts else ", but not all along"
        words += "" if sound else "; the receiver's course is not that of its own positions"
    return Check(NAME, verdict, words, numbers, strikes=sound, rests_on=_RESTS_ON)


def _between(went: Complexes, leant: Complexes, fit: Fit) -> Interval:
    """Return the angle with the larger of two errors: that of the phase, and that of the parts.

    A receiver that is wrong for a while is no noise: it makes one part differ from the others.
    """

    def off(some: NDArray[np.bool_]) -> float:
        return fit.angle + _apart(_angle(went[some], leant[some]).angle, fit.angle)

    parts = by_parts(off, went.size)
    reach = max(SURE * fit.error, parts.most - parts.value)
    return Interval(fit.angle, fit.angle - reach, fit.angle + reach)


def _apart(one: float, other: float) -> float:
    """Return by how much one angle is larger than another, the short way round."""
    return (one - other + np.pi) % (2 * np.pi) - np.pi


def _turned_by(off: Interval) -> Interval:
    """Return the size of an angle, without its side."""
    size, reach = abs(off.value), off.most - off.value
    return Interval(size, max(size - reach, 0.0), min(size + reach, np.pi))


def _agrees_with_itself(log: Log, moved: Series) -> bool:
    """Return whether a receiver's course is that of its positions, as far as both are known."""
    where = series(log, "GPS_RAW_INT", ("lat", "lon"), in_units=True)
    if where is None:
        return True
    edges = uniform(moved.t[0], moved.t[-1], _LENGTH_S, records=moved.t.size)
    lat, lon = (np.interp(edges, where.t, row) for row in where.values)
    went = np.diff(lat) + 1j * np.diff(lon) * np.cos(lat[:-1])
    north, east = (np.interp(edges[:-1] + _LENGTH_S / 2, moved.t, row) for row in moved.values)
    said = north + 1j * east
    total = np.vdot(went, said)
    sizes = np.linalg.norm(went) * np.linalg.norm(said)
    return bool(sizes > 0 and abs(np.angle(total)) < FITS and abs(total) > _COHERENT * sizes)


def _angle(went: Complexes, leant: Complexes) -> Fit:
    """Return how far one acceleration is turned against the other.

    The phase of a coherence has the variance (1 - c2) / (2 n c2), of n independent pairs (Bendat
    and Piersol, Random Data, 9.1); pairs count by their size, so that one blow is one pair.
    """
    if went.size < 2:
        return Fit(0.0, np.pi, 0.0, 0.0)
    went, leant = went - went.mean(), leant - leant.mean()
    product = np.conj(leant) * went
    size = np.sqrt((np.abs(leant) ** 2).sum() * (np.abs(went) ** 2).sum())
    if not size:
        return Fit(0.0, np.pi, 0.0, 0.0)
    total = product.sum()
    coherence = float(min(abs(total) / size, 1.0))
    count = float(np.abs(product).sum() ** 2 / (np.abs(product) ** 2).sum())
    error = np.sqrt(max(1 - coherence**2, 0.0) / (2 * count)) / max(coherence, 1e-9)
    return Fit(float(np.angle(total)), float(error), coherence, count)


def _accelerations(
    log: Log, moved: Series, known: Series, late: float
) -> tuple[Complexes, Complexes]:
    """Return what the receiver saw and what the lean makes, north + i east, m/s2, by interval."""
    went: list[Complexes] = [np.zeros(0, np.complex128)]
    leant: list[Complexes] = [np.zeros(0, np.complex128)]
    angles = np.array([np.unwrap(row) for row in known.values])
    for part in stretches(log):
        start = max(part.start, known.t[0], moved.t[0] - late)
        end = min(part.end, known.t[-1], moved.t[-1] - late)
        edges = uniform(start, end, _LENGTH_S, records=known.t.size)
        if edges.size < 2:
            continue
        north, east = (np.interp(edges + late, moved.t, row) for row in moved.values)
        fine = uniform(edges[0], edges[-1], _LENGTH_S / _PARTS, records=known.t.size)
        up = -to_earth(*(np.interp(fine, known.t, row) for row in angles))[:, :, 2]
        steep = -up[:, 2] < np.cos(_STEEP)
        lean = _G * (up[:, 0] + 1j * up[:, 1]) / np.where(steep, 1.0, -up[:, 2])
        whole = fine.size // _PARTS * _PARTS
        flies = ~(steep | spins(log, fine))[:whole].reshape(-1, _PARTS).any(axis=1)
        count = flies.size
        leant.append(lean[:whole].reshape(-1, _PARTS).mean(axis=1)[flies])
        went.append((np.diff(north + 1j * east) / _LENGTH_S)[:count][flies])
    return np.concatenate(went), np.concatenate(leant)
