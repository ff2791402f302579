"""What does one quantity of a vehicle look like over its flights? A small picture.

In: points with their errors. Out: `Drawn`: SVG with a point per flight, bars of two standard
errors, and a band for what the quiet flights before the last one let expect of it
(`fdi.residuals.between.expected`): 95 of 100 healthy flights fall into it, whatever of their
scatter is due to load and weather. One in twenty last flights so lies outside by chance alone.
A flight that ended badly or accuses somebody teaches nothing of what is usual.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from fdi.report.page.drawing import escaped, ticks
from fdi.report.words import number
from fdi.residuals.between import expected

WIDTH: Final = 300
HEIGHT: Final = 118
LEFT: Final = 50
RIGHT: Final = 8
TOP: Final = 8
FOOT: Final = 8
_DISC: Final = "m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0z"
_DIAMOND: Final = "m0-4.5l4.5 4.5-4.5 4.5-4.5-4.5z"
"""A flagged flight has another shape, not only another colour."""
LEAST_BEFORE: Final = 2
"""Quiet flights before the last one, fewer of which tell no scatter."""
SIGMAS: Final = 2.0
FLAT: Final = 1e-9


class Point(NamedTuple):
    """A flight: its value with one sigma, what it is called, its row of the table, flagged."""

    value: float
    std: float
    name: str
    row: int
    is_flagged: bool


class Drawn(NamedTuple):
    """A trend's title, its picture, and what is to be said of its last flight."""

    title: str
    svg: str
    told: str
    is_outside: bool


def drawn(title: str, unit: str, points: Sequence[Point]) -> Drawn:
    """Return a trend as a picture; at least two points, in the order of the flights."""
    band = _expected(points)
    edges = [one.value + sign * SIGMAS * one.std for one in points for sign in (-1, 1)]
    low, high = _range([*edges, *(band or ())], [one.value for one in points])
    step = (WIDTH - LEFT - RIGHT) / len(points)

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - FOOT) * float(
            (high - np.clip(value, low, high)) / (high - low)
        )

    label = escaped(f"{title}, {unit}" if unit else title)
    parts = [
        f'<svg class="plot trend" viewBox="0 0 {WIDTH} {HEIGHT}" role="group" aria-label="{label}">'
    ]
    if band is not None:
        parts.append(
            f'<rect class="band" x="{LEFT}" y="{y(band[1]):.1f}" width="{WIDTH - LEFT - RIGHT}" '
            f'height="{y(band[0]) - y(band[1]):.1f}"/>'
        )
    for value in ticks(low, high, 5):
        parts.append(
            f'<path class="rule" d="M{LEFT} {y(value):.1f}H{WIDTH - RIGHT}"/>'
            f'<text class="end" x="{LEFT - 5}" y="{y(value) + 3.5:.1f}">{value:.5g}</text>'
        )
    for place, one in enumerate(points):
        x = LEFT + step * (place + 0.5)
        top, bottom = y(one.value + SIGMAS * one.std), y(one.value - SIGMAS * one.std)
        said = escaped(f"{one.name}: {_said(one.value, one.std, unit)}")
        kind, dot = ("flagged", _DIAMOND) if one.is_flagged else ("quiet", _DISC)
        parts.append(
            f'<a class="{kind}" href="#log-{one.row}" aria-label="{said}"><title>{said}</title>'
            f'<path class="bars" d="M{x:.1f} {top:.1f}V{bottom:.1f}"/>'
            f'<path class="dot" d="M{x:.1f} {y(one.value):.1f}{dot}"/></a>'
        )
    told, is_outside = _of_last(points, band, unit)
    return Drawn(
        f"{title}, {unit}" if unit else title, "".join([*parts, "</svg>"]), told, is_outside
    )


def _expected(points: Sequence[Point]) -> tuple[float, float] | None:
    """Return between what values the last flight is to be expected, by quiet ones before it."""
    before, last = [one for one in points[:-1] if not one.is_flagged], points[-1]
    if len(before) < LEAST_BEFORE:
        return None
    told = expected([one.value for one in before], [one.std for one in before], np.inf)
    half = SIGMAS * float(np.hypot(told.std, last.std))
    return told.value - half, told.value + half


def _of_last(
    points: Sequence[Point], band: tuple[float, float] | None, unit: str
) -> tuple[str, bool]:
    last = points[-1]
    told = f"last: {_said(last.value, last.std, unit)}"
    if band is None:
        return f"{told}; too few quiet flights before it to tell what is usual", False
    usual = f"{number(band[0], 3)} to {number(band[1], 3)}"
    if band[0] <= last.value <= band[1]:
        return f"{told}; the quiet flights before let expect {usual}", False
    return f"{told}, outside what the quiet flights before let expect ({usual})", True


def _said(value: float, std: float, unit: str) -> str:
    return f"{number(value, 3)} +- {number(std, 2)} {unit}".rstrip()


def _range(edges: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Return what is shown: all values, and of the bars at most as much again on each side.

    One flight that knows next to nothing would else make a line of all others.
    """
    low, high = min(values), max(values)
    room = max(
        high - low, float(np.median(np.diff(np.sort(edges)))), FLAT * max(abs(low), abs(high))
    )
    room = room or 1.0
    low, high = max(min(edges), low - room), min(max(edges), high + room)
    margin = 0.06 * (high - low) or room
    return low - margin, high + margin
