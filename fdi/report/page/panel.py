"""What is one plot of the page? Curves with a common axis; its JSON for the browser.

In: columns in customary units. Out: a `Panel`, which ``drawing.py`` makes a picture of and the
browser a plot to zoom. A curve that is a channel of the log names it: the page holds it once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.report.page.columns import packed, thinned
from fdi.report.words import clean

Floats = NDArray[np.float64]
Look = Literal["line", "dash", "bound", "mean"]
MOST: Final = 1200
"""Samples of a curve, beside those that are to be kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A line of a plot.

    Attributes
    ----------
    label : str
    t, value : (n,) float
        s of the log's clock; NaN where unknown.
    channel : str
        Where the page holds it, "" for a curve of its own.
    look : str
        ``line``; ``dash`` for what was demanded or predicted; ``bound`` for a threshold, ``mean``
        for a mean.
    colour : int
        Of the page's curves; -1 for the next.
    """

    label: str
    t: Floats
    value: Floats
    channel: str = ""
    look: Look = "line"
    colour: int = -1


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """What lies behind the curves of a plot, as PNG: from ``t[0]`` to ``t[1]``, s, 0 to ``top``."""

    png: bytes
    t: tuple[float, float]
    top: float


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A plot.

    Attributes
    ----------
    title, unit : str
    curves : tuple of Curve
    hot : sequence of (float, float)
        s; when an alarm stood.
    keep : (float, float) or None
        What lies between these times goes before the rest.
    picture : Picture, optional
        Then its axis is that of the picture, whatever the curves do.
    """

    title: str
    unit: str
    curves: tuple[Curve, ...]
    hot: Sequence[Sequence[float]] = ()
    keep: tuple[float, float] | None = None
    picture: Picture | None = None


def coloured(panel: Panel) -> list[tuple[Curve, int]]:
    """Return the curves with the number of their colour; a bound has none of its own."""
    found, place = [], 0
    for curve in panel.curves:
        if curve.colour < 0:
            found.append((curve, place))
            place += 1
        else:
            found.append((curve, curve.colour))
    return found


def panel_json(panel: Panel) -> dict[str, Any]:
    """Return a panel as plain values."""
    keep = () if panel.keep is None else (panel.keep,)
    curves: list[dict[str, Any]] = []
    times: dict[int, int] = {}
    columns: list[dict[str, Any]] = []
    for curve, colour in coloured(panel):
        entry: dict[str, Any] = {"label": clean(curve.label), "look": curve.look, "ink": colour}
        if curve.channel:
            entry["channel"] = clean(curve.channel)
        else:
            t, values = thinned(curve.t, curve.value[None], MOST, keep)
            if id(curve.t) not in times:
                times[id(curve.t)] = len(columns)
                columns.append(packed(t) | {"n": len(t)})
            entry |= {"t": times[id(curve.t)], "v": packed(values[0])}
        curves.append(entry)
    found: dict[str, Any] = {"title": clean(panel.title), "unit": clean(panel.unit)}
    found |= {"curves": curves, "t": columns}
    if len(panel.hot):
        found["hot"] = [[round(edge, 2) for edge in one] for one in panel.hot]
    if panel.picture:  # it is in the drawing; a page holds it once
        found["picture"] = {"t": panel.picture.t, "top": panel.picture.top}
    return found
