"""What do an observer's flight and its residuals look like?

In: a log and its `Observation`. Out: three figures, as the published observer has them: the flight
data over time; the trajectory in space; the thirteen residuals off their centres, with thresholds,
alarms and the time in which a motor is named.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fdi.methods.observer import Observation
from fdi.methods.observer.states import ANGLES, POSITION, RATES, RESIDUALS, STATES, UNITS, VELOCITY
from fdi.report.style import (
    ACCENT,
    CURVES,
    FAINT,
    FONT,
    INK,
    label,
    new_figure,
    styled,
    tidy,
)
from fdi.telemetry import Log

_CLOCK: Final = "s of the log's clock"
_PANELS: Final = (
    ("position, m", POSITION),
    ("velocity, m/s", VELOCITY),
    ("rates, rad/s", RATES),
    ("angles, rad", ANGLES),
)


def data_figure(log: Log, seen: Observation) -> Any:
    """Return position, velocity, rates, angles and inputs over time as a figure."""
    with styled():
        figure = new_figure(11.0, 10.0)
        panels = figure.subplots(5, 1, sharex=True)
        for ax, (name, part) in zip(panels, _PANELS, strict=False):
            for colour, state, own in zip(CURVES, STATES[part], seen.rows.y[part], strict=False):
                ax.plot(seen.rows.t, own, color=colour, linewidth=0.8, label=state)
            ax.set_ylabel(name)
        force, *torques = seen.u
        names = ("u_p", "u_q", "u_r")
        for colour, name, own in zip(CURVES, names, torques, strict=False):
            panels[-1].plot(seen.rows.t, own, color=colour, linewidth=0.8, label=name)
        panels[-1].set_ylabel("torques, N m")
        beside = panels[-1].twinx()
        beside.plot(seen.rows.t, force, color=INK, linewidth=0.8, label="u_f less weight")
        beside.set_ylabel("thrust, N")
        for ax in (*panels, beside):
            tidy(ax)
            ax.legend(
                loc="upper right" if ax is not beside else "upper left",
                frameon=False,
                fontsize=FONT - 1,
                ncols=3,
            )
        panels[0].set_title(f"What {label(log.name, 60)} was told and did")
        panels[-1].set_xlabel(_CLOCK)
        figure.align_ylabels(list(panels))
    return figure


def trajectory_figure(log: Log, seen: Observation) -> Any:
    """Return the trajectory in space as a figure: east, north and height."""
    north, east, down = seen.rows.y[POSITION]
    with styled():
        figure = new_figure(8.0, 7.0)
        ax = figure.add_subplot(projection="3d")
        ax.plot(east, north, -down, color=CURVES[0], linewidth=0.9)
        for one in seen.motors:
            part = (seen.rows.t >= one.start) & (seen.rows.t <= one.end)
            ax.plot(
                east[part],
                north[part],
                -down[part],
                color=ACCENT,
                linewidth=2.0,
                label=f"motor {one.number} weak",
            )
        known = np.flatnonzero(np.isfinite(north + east + down))
        for k, name in zip(known[[0, -1]] if known.size else (), ("start", "end"), strict=False):
            ax.scatter([east[k]], [north[k]], [-down[k]], color=INK, s=12)
            ax.text(east[k], north[k], -down[k], f" {name}")
        ax.set_xlabel("east, m")
        ax.set_ylabel("north, m")
        ax.set_zlabel("height, m")
        ax.set_title(f"Trajectory of {label(log.name, 60)}")
        if seen.motors:
            ax.legend(frameon=False)
    return figure


def residuals_figure(log: Log, seen: Observation) -> Any:
    """Return the thirteen residuals with their thresholds and alarms as a figure."""
    off = seen.off
    with styled():
        figure = new_figure(11.0, 16.0)
        panels = figure.subplots(len(RESIDUALS), 1, sharex=True)
        for ax, name, own, limit in zip(panels, RESIDUALS, off, seen.threshold, strict=True):
            for one in seen.motors:
                ax.axvspan(one.start, one.end, color=FAINT, alpha=0.25, linewidth=0)
            for alarm in seen.alarms:
                if alarm.residual == name:
                    ax.axvspan(alarm.start, alarm.end, color=ACCENT, alpha=0.18, linewidth=0)
            ax.plot(seen.rows.t, own, color=CURVES[0], linewidth=0.8)
            ax.plot(seen.rows.t, limit, color=ACCENT, linewidth=0.8)
            if name != RESIDUALS[-1]:
                ax.plot(seen.rows.t, -limit, color=ACCENT, linewidth=0.8)
            if not np.isfinite(own).any():
                ax.text(0.5, 0.5, "no output", transform=ax.transAxes, ha="center", color=FAINT)
            ax.set_ylabel(f"{name}, {UNITS[name]}")
            tidy(ax)
        named = ", ".join(dict.fromkeys(f"motor {one.number} weak" for one in seen.motors))
        told = f" ({named}: grey)" if named else ""
        panels[0].set_title(f"Residuals and thresholds of {label(log.name, 60)}{told}")
        panels[-1].set_xlabel(_CLOCK)
        figure.align_ylabels(list(panels))
    return figure
