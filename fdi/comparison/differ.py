"""By which tests do flights differ most from the healthy others?

Every flight is held against the band of the healthy flights without itself. How far a healthy
flight is off the band of the others says how wide a band has to be: test by test it is widened to
that, so that different is what is further off than any healthy flight was by the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fdi.comparison.band import at_times, band_of, distance, reach
from fdi.comparison.values import Band, Compared, Course, Difference, Floats
from fdi.shown import Rows

Members = frozenset[int]


class Bands:
    """The bands of sets of flights, each made once."""

    def __init__(self, courses: Sequence[Course]) -> None:
        self._courses = courses
        self._made: dict[Members, Band] = {}
        self._widened: dict[Members, Band] = {}

    def of(self, members: Members) -> Band:
        """Return the band of some flights."""
        if members not in self._made:
            self._made[members] = band_of([self._courses[i] for i in sorted(members)])
        return self._made[members]

    def widened(self, members: Members) -> Band:
        """Return it as wide as to hold each of them by the others."""
        if members not in self._widened:
            band = self.of(members)
            half = band.half
            if len(members) > 1:
                for one in sorted(members):
                    needed = reach(self.of(members - {one}), self._courses[one])
                    half = np.maximum(half, needed[:, None])
            self._widened[members] = replace(band, half=half)
        return self._widened[members]


def healthy_members(flights: Sequence[Compared]) -> Members:
    """Return which flights make the band."""
    return frozenset(i for i, flight in enumerate(flights) if flight.is_healthy)


def differences(
    flights: Sequence[Compared], courses: Sequence[Course], bands: Bands
) -> Rows[Difference]:
    """Return how far every flight leaves the band of the healthy others, the furthest first."""
    healthy = healthy_members(flights)
    found: list[Difference] = []
    for place, course in enumerate(courses):
        others = healthy - {place}
        if others:
            found += _of_flight(place, course, bands.widened(others))
    return Rows(sorted(found, key=lambda one: (-one.bands, one.test, one.flight)))


def _of_flight(place: int, course: Course, band: Band) -> list[Difference]:
    far, held = distance(band, course)
    middle, half = at_times(band, course)
    found = []
    for test in range(len(far)):
        if not np.isfinite(far[test]).any():
            continue
        at = int(np.argmax(held[test]))
        since = _since(held[test], at)
        found.append(
            Difference(
                test=test,
                flight=place,
                bands=float(held[test, at]),
                since=float(course.t[since]),
                at=float(course.t[at]),
                value=float(course.values[test, at]),
                middle=float(middle[test, at]),
                half=float(half[test, at]),
            )
        )
    return found


def _since(held: Floats, at: int) -> int:
    """Return from which sample on it was beyond the band without a break."""
    inside = np.flatnonzero(held[: at + 1] <= 1.0)
    return min(int(inside[-1]) + 1, at) if len(inside) else 0
