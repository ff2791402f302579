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

from fdi.methods.setup.records import Series, attitude, series, stretches
from fdi.methods.setup.rotations import to_earth
from fdi.methods.setup.values import Check, Verdict
from fdi.telemetry import Log

NAME: Final = "heading"
TURNED: Final = np.radians(45.0)
"""Orientations are 45 degrees apart."""
FITS: Final = np.radians(22.5)
_SURE: Final = 3.0  # standard errors
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
    off, error = np.degrees(fit.angle), np.degrees(fit.error)
    numbers = {
        "off_deg": float(off),
        "standard_error_deg": float(error),
        "coherence": fit.coherence,
    }
    if fit.coherence < _COHERENT:
        said = "the receiver's velocity does not follow how the vehicle leans"
        return Check(NAME, "not known", said, numbers)
    words = (
        f"the vehicle accelerates {abs(off):.0f} degrees {'right' if off > 0 else 'left'} of where "
        f"it leans by attitude and heading (standard error {error:.0f})"
    )
    half = went.size // 2
    halves = (_angle(went[:half], leant[:half]), _angle(went[half:], leant[half:]))
    verdict: Verdict = "not known"
    if abs(fit.angle) + _SURE * fit.error < TURNED:
        verdict = "in order"
    elif abs(fit.angle) - _SURE * fit.error > TURNED and all(
        abs(each.angle - fit.angle) < FITS and each.coherence > _COHERENT for each in halves
    ):
        verdict = "wrong"
        words += ": the compass or the board is turned"
    return Check(NAME, verdict, words, numbers)


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
        edges = np.arange(start, end, _LENGTH_S)
        if edges.size < 2:
            continue
        north, east = (np.interp(edges + late, moved.t, row) for row in moved.values)
        fine = np.arange(edges[0], edges[-1], _LENGTH_S / _PARTS)
        up = -to_earth(*(np.interp(fine, known.t, row) for row in angles))[:, :, 2]
        steep = -up[:, 2] < np.cos(_STEEP)
        lean = _G * (up[:, 0] + 1j * up[:, 1]) / np.where(steep, 1.0, -up[:, 2])
        whole = fine.size // _PARTS * _PARTS
        flies = ~steep[:whole].reshape(-1, _PARTS).any(axis=1)
        count = flies.size
        leant.append(lean[:whole].reshape(-1, _PARTS).mean(axis=1)[flies])
        went.append((np.diff(north + 1j * east) / _LENGTH_S)[:count][flies])
    return np.concatenate(went), np.concatenate(leant)
