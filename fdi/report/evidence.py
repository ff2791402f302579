"""What do the curves behind a finding look like?

In: an analysis and one of its findings. Out: a figure: the residuals that tell most with their
bounds, then the recorded channels that they compare, in customary units, around the onset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis import Finding
from fdi.errors import UsageError
from fdi.report.style import ACCENT, CURVES, FAINT, FONT, INK, label, new_figure, styled, tidy
from fdi.report.words import unit
from fdi.result import Analysis
from fdi.units import customary

MOST_RESIDUALS: Final = 2
MOST_PANELS: Final = 3
BEFORE_S: Final = 20.0
AFTER_S: Final = 30.0
MOST_POINTS: Final = 4000
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Curve:
    t: Floats
    value: Floats
    name: str
    message: str


def evidence_figure(analysis: Analysis, finding: Finding) -> Any:
    """Return the figure, or None where the finding names no residual of the bank."""
    place = {generator.id: row for row, generator in enumerate(analysis.bank.generators)}
    named = [place[name] for name in finding.evidence.residuals if name in place]
    if not named:
        return None
    rows = _telling(analysis, named, finding)
    window = _window(analysis, finding)
    panels = _panels(analysis, rows, window)[:MOST_PANELS]
    count = len(rows) + len(panels)
    with styled():
        figure = new_figure(11.0, 0.5 + 1.45 * count)
        axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        for i, (ax, row) in enumerate(zip(axes, rows, strict=False)):
            _draw_residual(ax, analysis, row, window, pad=3 if i else 15)
        for ax, (name, curves) in zip(axes[len(rows) :], panels, strict=True):
            _draw_channels(ax, unit(name), curves, window)
        for ax in axes:
            tidy(ax)
            ax.yaxis.set_offset_position("right")  # on the left are the channels' names
            ax.axvline(finding.onset, color=ACCENT, linestyle="--", linewidth=1.0)
            _draw_ends(ax, analysis, window)
        axes[0].set_xlim(*window)
        axes[-1].set_xlabel("s of the log's clock")
        axes[0].annotate(
            f"onset {finding.onset:.1f} s",
            (finding.onset, 1.0),
            (2, 3),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            color=ACCENT,
            fontsize=FONT,
        )
        figure.align_ylabels(list(axes))
    return figure


def _telling(analysis: Analysis, rows: Sequence[int], finding: Finding) -> list[int]:
    """Return the residuals with the strongest alarm soon after the onset."""
    t = analysis.alarms.residuals.t
    soon = (t >= finding.onset - 0.5) & (t <= finding.onset + 10.0)

    def peak(row: int) -> float:
        own = analysis.alarms.strength[row, soon & analysis.alarms.alarm[row]]
        known = own[np.isfinite(own)]
        return float(known.max()) if len(known) else 0.0

    return sorted(rows, key=lambda row: (-peak(row), row))[:MOST_RESIDUALS]


def _window(analysis: Analysis, finding: Finding) -> tuple[float, float]:
    t = analysis.signals.t
    end = finding.end if finding.end is not None else finding.onset + AFTER_S
    end = min(end, finding.onset + 4 * AFTER_S)
    low, high = finding.onset - BEFORE_S, end + BEFORE_S / 2
    return max(low, float(t[0])), min(max(high, low + BEFORE_S), float(t[-1]))


def _draw_residual(
    ax: Any, analysis: Analysis, row: int, window: tuple[float, float], *, pad: float
) -> None:
    alarms = analysis.alarms
    generator = analysis.bank.generators[row]
    equation = analysis.system.equations[generator.residual]
    name, scale, _ = customary(equation.unit)
    t = alarms.residuals.t
    seen = (t >= window[0]) & (t <= window[1])
    value = (alarms.residuals.values[row] - alarms.centre[row]) * scale
    bound = alarms.threshold[row] * scale
    ax.fill_between(t[seen], -bound[seen], bound[seen], color="#dbe7f3", linewidth=0)
    ax.plot(t[seen], value[seen], color=INK, linewidth=1.1)
    hot = np.where(alarms.alarm[row], value, np.nan)
    ax.plot(t[seen], hot[seen], color=ACCENT, linewidth=1.6)
    _limit_height(ax, value[seen], bound[seen])
    ax.set_ylabel(", ".join(part for part in (generator.id, label(unit(name), 12)) if part))
    ax.set_title(
        f"residual of {label(equation.text or equation.name, 90)}, band: threshold",
        fontsize=FONT,
        fontweight="normal",
        loc="left",
        pad=pad,
    )


def _limit_height(ax: Any, value: Floats, bound: Floats) -> None:
    """Show all of the residual, and the bound where it does not dwarf it."""
    known = np.abs(value[np.isfinite(value)])
    limits = bound[np.isfinite(bound)]
    top = max(
        float(known.max()) if len(known) else 0.0,
        float(np.median(limits)) if len(limits) else 0.0,
    )
    if top > 0:
        ax.set_ylim(-1.1 * top, 1.1 * top)


def _panels(
    analysis: Analysis, rows: Sequence[int], window: tuple[float, float]
) -> list[tuple[str, list[_Curve]]]:
    """Return the channels of some residuals: those of one variable share a panel."""
    panels: dict[tuple[str, str], list[_Curve]] = {}
    seen: set[str] = set()
    for row in rows:
        for number in analysis.bank.generators[row].equations:
            measurement = analysis.system.equations[number].measurement
            if measurement is None or str(measurement.channel) in seen:
                continue
            seen.add(str(measurement.channel))
            try:
                data = analysis.log.channel(measurement.channel)
            except UsageError:
                continue
            name, scale, offset = customary(data.unit)
            channel = measurement.channel
            value = data.value * scale + offset
            curve = _Curve(data.t, value, str(channel), channel.source)
            panels.setdefault((measurement.variable, name), []).append(curve)
    return _merged([(name, curves) for (_, name), curves in panels.items()], window)


def _merged(
    panels: list[tuple[str, list[_Curve]]], window: tuple[float, float]
) -> list[tuple[str, list[_Curve]]]:
    """Return the panels with those of one message and unit made one where their ranges meet."""
    result: list[tuple[str, list[_Curve]]] = []
    for name, curves in panels:
        low, high = _range(curves, window)
        for known_unit, known in result:
            other_low, other_high = _range(known, window)
            if (
                known_unit == name
                and known[0].message == curves[0].message
                and max(low, other_low) <= min(high, other_high)
            ):
                known.extend(curves)
                break
        else:
            result.append((name, curves))
    return result


def _range(curves: Sequence[_Curve], window: tuple[float, float]) -> tuple[float, float]:
    shown = np.concatenate(
        [c.value[(c.t >= window[0]) & (c.t <= window[1]) & np.isfinite(c.value)] for c in curves]
    )
    return (float(shown.min()), float(shown.max())) if len(shown) else (0.0, 0.0)


def _draw_channels(
    ax: Any, shown_unit: str, curves: Sequence[_Curve], window: tuple[float, float]
) -> None:
    for curve, ink in zip(curves, CURVES, strict=False):
        seen = np.flatnonzero((curve.t >= window[0] - 5) & (curve.t <= window[1] + 5))
        seen = seen[:: max(1, len(seen) // MOST_POINTS)]
        ax.plot(
            curve.t[seen],
            curve.value[seen],
            color=ink,
            linewidth=1.1,
            marker="." if len(seen) < 150 else "",
            markersize=3,
            label=label(curve.name),
        )
    ax.set_ylabel(label(shown_unit, 12))
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 0.97),
        borderaxespad=0.0,
        fontsize=FONT - 1,
        frameon=False,
        ncols=4,
    )


def _draw_ends(ax: Any, analysis: Analysis, window: tuple[float, float]) -> None:
    for flight in analysis.log.flights:
        for t in (flight.takeoff, flight.landing, flight.impact):
            if t is not None and window[0] <= t <= window[1]:
                ax.axvline(t, color=FAINT, linewidth=0.9)
