"""What did height and speed of a flight look like, in a few samples? And their tiny pictures.

In: a log. Out: curves as plain values, for a row of `fdi.fleet`. They hold the extremes; unknown is
None. From such curves: SVG, whose box is the curve's range.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.report.page.columns import gaps, thinned
from fdi.report.page.drawing import escaped
from fdi.report.page.overview import curve_of
from fdi.report.page.panel import Curve
from fdi.report.words import at, number
from fdi.telemetry import Log

Floats = NDArray[np.float64]

CURVES: Final = {
    "height": ("GLOBAL_POSITION_INT.relative_alt", "VFR_HUD.alt", "GPS_RAW_INT.alt"),
    "speed": ("VFR_HUD.groundspeed", "GPS_RAW_INT.vel", "VFR_HUD.airspeed"),
}
"""The channels that may show it, the best first."""
MOST: Final = 60
"""Samples: the picture is 110 pixels wide."""
DIGITS: Final = 4
WIDTH: Final = 110
HEIGHT: Final = 26
EDGE: Final = 2


def curves_of(log: Log) -> list[dict[str, Any]]:
    """Return height and speed as name, unit, ``t`` and ``value``; what is not in it is left out."""
    found = []
    for name, channels in CURVES.items():
        curves = (curve_of(log, name, channel) for channel in channels)
        first = next((one for one in curves if one is not None and _moves(one[0])), None)
        if first is not None:
            curve, unit = first
            t, values = _with_breaks(curve)
            found.append(
                {
                    "name": name,
                    "unit": unit,
                    "t": [round(each, 1) for each in t.tolist()],
                    "value": [_plain(each) for each in values.tolist()],
                }
            )
    return found


def _with_breaks(curve: Curve) -> tuple[Floats, Floats]:
    """Return few samples of a curve, unknown in the middle of every break that can be seen."""
    t, values = thinned(curve.t, curve.value[None], MOST)
    length = float(curve.t[-1] - curve.t[0])
    broken = np.append(gaps(curve.t) & (np.diff(curve.t) > length / MOST), False)
    middles = (curve.t[broken] + np.append(curve.t[1:], curve.t[-1])[broken]) / 2
    places = np.searchsorted(t, middles)
    return np.insert(t, places, middles), np.insert(values[0], places, np.nan)


def _moves(curve: Curve) -> bool:
    """Return whether a curve is more than a value that nobody sets."""
    return bool(np.nanmax(curve.value) > np.nanmin(curve.value))


def _plain(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None


def spark_svg(curve: Mapping[str, Any], moments: Sequence[float]) -> str:
    """Return a curve as a tiny picture; ``moments``, s, are when something went wrong."""
    t = np.array(curve["t"], float)
    values = np.array([np.nan if v is None else v for v in curve["value"]], float)
    known = np.isfinite(values)
    low, high = float(values[known].min()), float(values[known].max())
    first, last = float(t[0]), float(t[-1])
    x = EDGE + (WIDTH - 2 * EDGE) * (t - first) / ((last - first) or 1.0)
    y = HEIGHT - EDGE - (HEIGHT - 2 * EDGE) * (values - low) / ((high - low) or 1.0)
    joined = np.append(False, known[1:] & known[:-1]) if len(t) > 1 else known & False
    path = "".join(
        f"{'L' if line else 'M'}{a:.0f} {b:.0f}"
        for a, b, line, shown in zip(x, y, joined, known, strict=True)
        if shown
    )
    lines = "".join(
        f'<path class="mark" d="M{EDGE + (WIDTH - 2 * EDGE) * (m - first) / (last - first):.0f} '
        f'0V{HEIGHT}"/>'
        for m in moments
        if first <= m <= last > first
    )
    span = f"{number(low, 3)} to {number(high, 3)} {curve['unit']}, {at(last - first)} s"
    label = escaped(f"{curve['name']} {span}")
    return (
        f'<svg class="spark" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">'
        f'<title>{label}</title>{lines}<path class="line" d="{path}"/></svg>'
    )
