"""What does a waterfall show: power over time and frequency as columns, and what stands over it?

In: a `fdi.telemetry.spectra.Spectrum`. Out: decibels in few enough columns for a picture, how fast
motors turn as the sampling shows it, and the title.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.report.style import label
from fdi.telemetry import Log
from fdi.telemetry.spectra import Spectrum, in_air, motor_rates, notches

Floats = NDArray[np.float64]

MOST_COLUMNS: Final = 600
"""Of a waterfall: more are averaged, so that a picture stays small."""
FLOOR, TOP = 0.05, 0.999
"""Quantiles of the power between which its colours lie."""


def columns_of(one: Spectrum, span: tuple[float, float]) -> tuple[Floats, Floats]:
    """Return times, (k,) s, and decibels, (m, k), within a span of time, averaged where many."""
    inside = (one.t >= span[0]) & (one.t <= span[1])
    t, level = one.t[inside], 10 * np.log10(np.maximum(one.power[:, inside], 1e-30))
    if not t.size:
        return t, level
    every = -(-t.size // MOST_COLUMNS)
    starts = every * np.arange(-(-t.size // every))
    counts = np.diff(starts, append=t.size)
    return (
        np.add.reduceat(t, starts) / counts,
        np.add.reduceat(level, starts, axis=1) / counts,
    )


def with_pauses(t: Floats, level: Floats) -> tuple[Floats, Floats]:
    """Return times and columns with unknown ones at both ends of where no window lies."""
    if t.size < 2:
        return t, level
    step = float(np.median(np.diff(t)))
    last = np.flatnonzero(np.diff(t) > 2 * step)
    places = np.repeat(last + 1, 2)
    ends = np.stack([t[last] + step, t[last + 1] - step], axis=1).ravel()
    return np.insert(t, places, ends), np.insert(level, places, np.nan, axis=1)


def colour_range(level: Floats) -> tuple[float, float]:
    """Return the decibels between which the colours of a waterfall lie."""
    low, high = np.nanquantile(level, [FLOOR, TOP])
    return float(low), float(high)


def turning(one: Spectrum, log: Log) -> Iterator[tuple[Floats, Floats]]:
    """Yield times (s) and Hz of every motor, folded where sampling is too slow for its rate."""
    for t, turns in motor_rates(log):
        yield t, np.abs((turns + one.rate_hz / 2) % one.rate_hz - one.rate_hz / 2)


def told_of(found: Sequence[Spectrum], log: Log) -> Iterator[str]:
    """Yield of each what was sampled how fast, and the line that stands out most in the air.

    A gyroscope's line is held against the fixed notch filters, if any are set.
    """
    air, filters = in_air(found, log), notches(log)
    is_known = bool(filters) and all(notch.width > 0 for notch in filters)
    for one in found:
        line = one.strongest(*air)
        what = (
            "no line stands out" if line is None else f"line at {line[0]:.0f} Hz, {line[1]:.0f} dB"
        )
        if line is not None and is_known and one.sensor == "gyroscope":
            own = next((notch for notch in filters if notch.reaches(line[0])), None)
            what += (
                ", which no fixed notch filter takes out"
                if own is None
                else f", within the notch filter at {own.hz:.0f} Hz"
            )
        yield f"{label(one.message)} at {one.rate_hz:.0f} Hz, {what}"
