"""At which frequencies did the vehicle shake, and when? A waterfall of every inertial sensor.

Over it how fast the motors turn, by their controllers, and the fixed notch filters: a line that
follows a motor is its propeller, one that stands still a resonance or an interference, and a notch
that no line meets takes out nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from fdi.errors import UsageError
from fdi.report.paper.column import (
    PANEL,
    SMALL,
    Floats,
    Span,
    mark_times,
    marks_of,
    printed,
    stacked,
    whole,
)
from fdi.report.style import label
from fdi.result import Analysis
from fdi.telemetry.spectra import (
    SENSORS,
    Spectrum,
    in_air,
    motor_rates,
    notches,
    spectrum,
    too_slow,
)

HEIGHT_MM: Final = 34.0
MOST_COLUMNS: Final = 600
"""Of a waterfall: more are averaged, so that a picture stays small."""
FLOOR, TOP = 0.05, 0.999
"""Quantiles of the power between which its colours lie."""
HINT: Final = {
    "ardupilot": "INS_LOG_BAT_MASK 1 records batches of raw samples",
    "px4": "SDLOG_PROFILE bits 8 and 9 record the sensors' own buffers (raw FIFO high-rate IMU)",
}


def spectrum_figure(analysis: Analysis, width_mm: float) -> Any:
    """Return the waterfalls of a log as a printed figure.

    Raises
    ------
    UsageError
        No record of an inertial sensor is fast enough.
    """
    log, span = analysis.log, whole(analysis)
    found = [one for sensor in SENSORS if (one := spectrum(log, sensor)) is not None]
    if not found:
        raise UsageError(
            f"holds no vibrations to draw: {too_slow(log)}",
            where=log.name,
            hint=HINT.get(log.autopilot, ""),
        )
    with printed():
        marks = marks_of(analysis, span)
        figure, axes = stacked(width_mm, [HEIGHT_MM] * len(found), extra_mm=22.0)
        mark_times(axes, marks, span, width_mm * PANEL)
        for ax, one in zip(axes, found, strict=True):
            _waterfall(ax, one, span)
            _overlay(ax, one, analysis)
            ax.set_ylabel(f"{one.sensor} (Hz)")
        figure.suptitle(_title(found, in_air(found, log)), x=0.01, ha="left", fontsize=SMALL)
    return figure


def _waterfall(ax: Any, one: Spectrum, span: Span) -> None:
    """Draw power over time and frequency, in decibels."""
    inside = (one.t >= span[0]) & (one.t <= span[1])
    t, power = one.t[inside], one.power[:, inside]
    if not t.size:
        return
    level = 10 * np.log10(np.maximum(power, 1e-30))
    low, high = np.quantile(level, [FLOOR, TOP])
    t, level = _with_pauses(*_fewer(t, level))
    ax.pcolormesh(t, one.hz, level, cmap="magma", vmin=low, vmax=high, rasterized=True, zorder=0)
    ax.set_ylim(0.0, one.hz[-1])


def _fewer(t: Floats, level: Floats) -> tuple[Floats, Floats]:
    """Return times and columns, so many of them averaged that `MOST_COLUMNS` are left at most."""
    every = -(-t.size // MOST_COLUMNS)
    starts = every * np.arange(-(-t.size // every))
    counts = np.diff(starts, append=t.size)
    return (
        np.add.reduceat(t, starts) / counts,
        np.add.reduceat(level, starts, axis=1) / counts,
    )


def _with_pauses(t: Floats, level: Floats) -> tuple[Floats, Floats]:
    """Return times and columns with unknown ones at both ends of where no window lies."""
    if t.size < 2:
        return t, level
    step = float(np.median(np.diff(t)))
    last = np.flatnonzero(np.diff(t) > 2 * step)
    places = np.repeat(last + 1, 2)
    ends = np.stack([t[last] + step, t[last + 1] - step], axis=1).ravel()
    return np.insert(t, places, ends), np.insert(level, places, np.nan, axis=1)


def _overlay(ax: Any, one: Spectrum, analysis: Analysis) -> None:
    """Draw how fast motors turn, folded where sampling is too slow for it, and notch filters."""
    for t, turns in motor_rates(analysis.log):
        folded = np.abs((turns + one.rate_hz / 2) % one.rate_hz - one.rate_hz / 2)
        ax.plot(t, folded, color="white", linewidth=0.4, alpha=0.8)
    for hz in notches(analysis.log):
        if hz < one.hz[-1]:
            ax.axhline(hz, color="#63b3ed", linestyle=":", linewidth=0.8)
            ax.annotate(
                f"notch {hz:.0f}",
                (1.0, hz),
                (2, 0),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                fontsize=SMALL,
                va="center",
            )


def _title(found: Sequence[Spectrum], air: Span) -> str:
    """Return what was sampled how fast, and the line that stands out most in the air."""
    told = []
    for one in found:
        line = one.strongest(*air)
        what = (
            "no line stands out" if line is None else f"line at {line[0]:.0f} Hz, {line[1]:.0f} dB"
        )
        told.append(f"{one.sensor}: {label(one.message)} at {one.rate_hz:.0f} Hz, {what}")
    return "\n".join(told)
