"""At which frequencies did the vehicle shake, and when? A waterfall of every inertial sensor.

Over it how fast the motors turn, by their controllers, and the fixed notch filters: a line that
follows a motor is its propeller, one that stands still a resonance or an interference, and a notch
that no line meets takes out nothing.
"""

from __future__ import annotations

from typing import Any, Final

from fdi.errors import UsageError
from fdi.report.paper.column import (
    PANEL,
    SMALL,
    Span,
    mark_times,
    marks_of,
    printed,
    stacked,
    whole,
)
from fdi.report.waterfall import (
    colour_range,
    columns_of,
    told_of,
    turning,
    with_pauses,
)
from fdi.result import Analysis
from fdi.telemetry.spectra import SENSORS, Spectrum, notches, spectrum, too_slow

HEIGHT_MM: Final = 34.0
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
        told = zip(found, told_of(found, log), strict=True)
        title = "\n".join(f"{one.sensor}: {words}" for one, words in told)
        figure.suptitle(title, x=0.01, ha="left", fontsize=SMALL)
    return figure


def _waterfall(ax: Any, one: Spectrum, span: Span) -> None:
    """Draw power over time and frequency, in decibels."""
    t, level = columns_of(one, span)
    if not t.size:
        return
    low, high = colour_range(level)
    t, level = with_pauses(t, level)
    ax.pcolormesh(t, one.hz, level, cmap="magma", vmin=low, vmax=high, rasterized=True, zorder=0)
    ax.set_ylim(0.0, one.hz[-1])


def _overlay(ax: Any, one: Spectrum, analysis: Analysis) -> None:
    """Draw how fast motors turn, folded where sampling is too slow for it, and notch filters."""
    for t, folded in turning(one, analysis.log):
        ax.plot(t, folded, color="white", linewidth=0.4, alpha=0.8)
    for hz, _ in notches(analysis.log):
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
