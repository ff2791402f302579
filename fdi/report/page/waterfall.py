"""At which frequencies did the vehicle shake, and when? Waterfalls for the page.

In: a log. Out: a `Panel` for each inertial sensor whose records are fast enough, none for a log
without: the picture of its power over time and frequency, and over it how fast the motors turn and
the fixed notch filters.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO

import numpy as np

from fdi.report.page.panel import Curve, Panel, Picture
from fdi.report.waterfall import (
    Floats,
    colour_range,
    columns_of,
    told_of,
    turning,
    with_pauses,
)
from fdi.telemetry import Log
from fdi.telemetry.spectra import SENSORS, Spectrum, notches, spectrum


def waterfalls(log: Log, span: tuple[float, float]) -> Iterator[Panel]:
    """Yield a panel for each inertial sensor whose records tell vibrations, within a span, s."""
    found = [one for sensor in SENSORS if (one := spectrum(log, sensor)) is not None]
    if not found:
        return
    for one, told in zip(found, told_of(found, log), strict=True):
        t, level = columns_of(one, span)
        if t.size > 1:
            picture = Picture(_png(t, level), (float(t[0]), float(t[-1])), float(one.hz[-1]))
            yield Panel(
                f"Vibrations of the {one.sensor} ({told})",
                "Hz",
                tuple(_curves(one, log, t)),
                picture=picture,
            )


def _png(t: Floats, level: Floats) -> bytes:
    """Return columns of decibels as a picture, low frequencies below, equal steps of time."""
    from matplotlib import colormaps
    from matplotlib.image import imsave

    low, high = colour_range(level)
    t, level = with_pauses(t, level)
    # a picture's columns stand at equal steps: each shows the window that is next in time
    at = np.linspace(t[0], t[-1], level.shape[1])
    right = np.clip(np.searchsorted(t, at), 1, t.size - 1)
    nearest = right - (at - t[right - 1] < t[right] - at)
    file = BytesIO()
    map_ = colormaps["magma"].with_extremes(bad=(0, 0, 0, 0))
    image = np.ma.masked_invalid(level[:, nearest])
    imsave(file, image, vmin=low, vmax=high, cmap=map_, origin="lower", format="png")
    return file.getvalue()


def _curves(one: Spectrum, log: Log, t: Floats) -> Iterator[Curve]:
    whole = np.array([t[0], t[-1]])
    for number, (moments, turns) in enumerate(turning(one, log), 1):
        yield Curve(f"motor {number} turns", moments, turns)
    for hz, _ in notches(log):
        if hz < one.hz[-1]:
            yield Curve(f"notch filter {hz:.0f} Hz", whole, np.full(2, hz), look="bound")
    yield Curve("half the rate of sampling", whole, np.full(2, one.hz[-1]), look="dash")
