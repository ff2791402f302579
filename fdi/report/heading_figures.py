"""What do headings look like over time, and what was recovered beside what was recorded?

In: a `HeadingCheck`, a `Recovery`. Out: figures. Headings stand against the estimator's, so that
what disagrees leaves the zero line; bands show which block is named. A recovery has a band of two
predicted deviations.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fdi.methods.heading import HeadingCheck, Recovery
from fdi.methods.heading.check import BLOCKS
from fdi.methods.heading.geodesy import wrap
from fdi.report.style import ACCENT, CURVES, FAINT, FONT, INK, label, new_figure, styled, tidy
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

SHADE: Final = 0.16
_RECORDED: Final = {"heading_deg": 2, "roll_deg": 0, "pitch_deg": 1}
_SIGMAS: Final = {
    "north_m": "sigma_m",
    "east_m": "sigma_m",
    "heading_deg": "sigma_heading_deg",
    "roll_deg": "sigma_tilt_deg",
    "pitch_deg": "sigma_tilt_deg",
}


def headings_figure(log: Log, check: HeadingCheck) -> Any:
    """Return all headings over time, and below how far each is from the estimator's."""
    t = check.ride.t
    known = [one for one in check.sources.values() if not one.absent]
    base = next((one for one in known if one.name == "estimator"), known[0])
    with styled():
        figure = new_figure(11.0, 5.6)
        axes = figure.subplots(2, 1, sharex=True)
        for number, one in enumerate(known):
            colour = CURVES[number % len(CURVES)]
            _draw(axes[0], t, np.degrees(one.heading), colour, one.name)
            off = np.degrees(wrap(one.heading - base.heading))
            _draw(axes[1], t, off, colour, "")
        for ax in axes:
            tidy(ax)
            _bands(ax, check)
            ax.set_xlim(*check.ride.air)
        axes[0].set_title(f"Headings of {label(log.name, 60)}")
        axes[0].set_ylabel("heading, deg")
        axes[1].set_ylabel(f"less {base.name}, deg")
        axes[1].set_xlabel("s of the log's clock")
        figure.legend(loc="outside lower center", ncols=6, frameon=False, fontsize=FONT)
    return figure


def _draw(ax: Any, t: Floats, values: Floats, colour: str, name: str) -> None:
    """Draw an angle without the lines that a turn through south would make."""
    shown = values.copy()
    shown[1:][np.abs(np.diff(values)) > 180.0] = np.nan
    ax.plot(t, shown, color=colour, linewidth=0.9, label=name or None)


def _bands(ax: Any, check: HeadingCheck) -> None:
    drawn: set[str] = set()
    for one in check.named:
        colour = CURVES[BLOCKS.index(one.block) % len(CURVES)]
        low, high = one.start - check.ride.cycle / 2, one.end + check.ride.cycle / 2
        ax.axvspan(low, high, color=colour, alpha=SHADE, linewidth=0)
        if one.block not in drawn:
            drawn.add(one.block)
            ax.annotate(
                one.block,
                (one.start, 0.97),
                xycoords=("data", "axes fraction"),
                color=ACCENT,
                fontsize=FONT - 0.5,
                va="top",
            )
    for low, high in (span for spans in check.ride.lost.values() for span in spans):
        ax.axvspan(low, high, color=FAINT, alpha=SHADE, linewidth=0)


def recovered_figure(log: Log, check: HeadingCheck, recovery: Recovery) -> Any:
    """Return what was recovered, a panel for each quantity, with what the log recorded."""
    names = [name for name in _SIGMAS if name in recovery.columns]
    with styled():
        figure = new_figure(11.0, 1.0 + 2.2 * len(names))
        axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
        for ax, name in zip(axes, names, strict=True):
            _panel(ax, check, recovery, name)
            tidy(ax)
        axes[0].set_title(f"Recovered {recovery.block} of {label(log.name, 60)}")
        axes[-1].set_xlabel("s of the log's clock")
        handles, said = axes[0].get_legend_handles_labels()
        figure.legend(
            handles, said, loc="outside lower right", ncols=3, frameon=False, fontsize=FONT
        )
    return figure


def _panel(ax: Any, check: HeadingCheck, recovery: Recovery, name: str) -> None:
    t, values = recovery.t, recovery.columns[name]
    sigma = recovery.columns[_SIGMAS[name]]
    recorded = _recorded(check, recovery, name)
    if recorded is not None:
        ax.plot(*recorded, color=INK, linewidth=0.9, label="recorded")
    if name == "heading_deg":
        values = np.unwrap(values, period=360.0)
        if recorded is not None:
            values = values + 360.0 * np.round((np.median(recorded[1]) - np.median(values)) / 360.0)
    ax.plot(t, values, color=CURVES[0], linewidth=1.1, label="recovered")
    band = (values - 2 * sigma, values + 2 * sigma)
    ax.fill_between(
        t, *band, color=CURVES[0], alpha=SHADE, linewidth=0, label="two predicted deviations"
    )
    ax.set_ylabel(name.replace("_", ", "))


def _recorded(check: HeadingCheck, recovery: Recovery, name: str) -> tuple[Floats, Floats] | None:
    """Return times and values of what the log has: of a failed block, what it should not be."""
    ride, low, high = check.ride, recovery.start, recovery.end
    if name in _RECORDED:
        if ride.angles is None:
            return None
        rows = (ride.t >= low) & (ride.t <= high)
        return ride.t[rows], np.degrees(ride.angles[_RECORDED[name]][rows])
    if ride.fixes is None:
        return None
    t = ride.fixes.t
    place = ride.fixes.position()[("north_m", "east_m").index(name)]
    rows = (t >= low) & (t <= high)
    return t[rows], place[rows] - float(np.interp(low, t, place))
