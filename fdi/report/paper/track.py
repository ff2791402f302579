"""Where did the vehicle fly? The ground track in metres, and the height beside time.

Both what the receiver says and what the estimator makes of it are drawn: that they part is what a
failing receiver looks like.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from fdi.errors import UsageError
from fdi.report.paper.column import (
    CLOCK,
    LETTER_MM,
    MM,
    PANEL,
    SMALL,
    Floats,
    Span,
    mark_times,
    marks_of,
    page,
    printed,
    thinned,
    whole,
)
from fdi.report.style import ACCENT, CURVES, FAINT, label, tidy
from fdi.result import Analysis
from fdi.telemetry import Log

SOURCES: Final = (
    ("receiver", "GPS_RAW_INT", "#f6ad6b", 1.8),
    ("estimator", "GLOBAL_POSITION_INT", CURVES[0], 0.7),
)
SQUAREST, FLATTEST = 1.0, 0.35
"""How tall the track is drawn, as a share of its width; what is narrower gets room beside it."""
HEIGHT_MM: Final = 22.0
TEXT_MM: Final = 2.8  # height of a line of letters
FIX: Final = 3
"""Of `fix_type`; below it a receiver knows no place in three dimensions."""


class _Track(NamedTuple):
    name: str
    colour: str
    width: float
    t: Floats
    lat: Floats
    lon: Floats


def track_figure(analysis: Analysis, width_mm: float) -> Any:
    """Return the track as a printed figure.

    Raises
    ------
    UsageError
        The log holds no position.
    """
    span = whole(analysis)
    tracks = list(_tracks(analysis.log, span))
    if not tracks:
        raise UsageError(
            "holds no position in the time that was looked at",
            where=analysis.log.name,
            hint="GLOBAL_POSITION_INT or GPS_RAW_INT would tell",
        )
    height = analysis.signals.height
    origin = _origin(analysis, tracks[-1])
    with printed():
        places = [_metres(track.lat, track.lon, origin) for track in tracks]
        share = _share(places)
        figure = page(
            width_mm, width_mm * share + 16.0 + (HEIGHT_MM + 8 if height is not None else 0)
        )
        axes = figure.subplots(
            1 if height is None else 2,
            1,
            squeeze=False,
            height_ratios=[width_mm * share] + [HEIGHT_MM] * (height is not None),
        )[:, 0]
        for ax in axes:
            tidy(ax)
        for track, (east, north) in zip(tracks, places, strict=True):
            _, rows = thinned(track.t, np.arange(len(track.t), dtype=float), 4000)
            kept = rows.astype(int)
            axes[0].plot(
                east[kept], north[kept], color=track.colour, linewidth=track.width, label=track.name
            )
        _places(axes[0], analysis, tracks[-1], places[-1], span, width_mm)
        axes[0].set_aspect("equal", adjustable="datalim")
        axes[0].set_xlabel("east of the start (m)")
        axes[0].set_ylabel("north of the start (m)")
        axes[0].legend(
            frameon=False,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.1,
            ncols=2,
            handlelength=1.2,
        )
        if height is not None:
            axes[1].plot(*thinned(analysis.signals.t, height), color=CURVES[0])
            axes[1].set_xlabel(CLOCK)
            axes[1].set_ylabel("height (m)")
            mark_times(axes[1:], marks_of(analysis, span), span, PANEL * width_mm)
        figure.align_ylabels(list(axes))
    return figure


def _tracks(log: Log, span: Span) -> Iterator[_Track]:
    for name, message, ink, width in SOURCES:
        if message not in log or not {"lat", "lon"} <= set(log[message].fields):
            continue
        own = log[message]
        lat, lon = own.si("lat"), own.si("lon")
        known = np.isfinite(lat) & np.isfinite(lon) & ((lat != 0) | (lon != 0))
        if "fix_type" in own.fields:
            known &= own.si("fix_type") >= FIX
        known &= (own.t >= span[0]) & (own.t <= span[1])
        if known.sum() > 1:
            gone = np.where(known, 0.0, np.nan)
            inside = (own.t >= span[0]) & (own.t <= span[1])
            yield _Track(
                name, ink, width, own.t[inside], (lat + gone)[inside], (lon + gone)[inside]
            )


def _origin(analysis: Analysis, track: _Track) -> tuple[float, float]:
    """Return the place of take-off, or where the track begins; rad."""
    known = np.isfinite(track.lat)
    starts = [f.takeoff for f in analysis.log.flights if f.takeoff is not None]
    at = max(starts[0] if starts else track.t[0], track.t[0])
    row = int(np.argmax(known & (track.t >= at))) if (known & (track.t >= at)).any() else 0
    row = row if known[row] else int(np.argmax(known))
    return float(track.lat[row]), float(track.lon[row])


def _metres(lat: Floats, lon: Floats, origin: tuple[float, float]) -> tuple[Floats, Floats]:
    """Return how far east and north of the origin places on the ellipsoid are, m."""
    from pymap3d import geodetic2enu

    zero = np.zeros_like(lat)
    east, north, _ = geodetic2enu(lat, lon, zero, *origin, 0.0, deg=False)
    return np.asarray(east), np.asarray(north)


def _share(places: list[tuple[Floats, Floats]]) -> float:
    """Return how tall the plot is drawn, as a share of its width."""
    east, north = (np.concatenate([one[axis] for one in places]) for axis in (0, 1))
    wide, tall = (
        float(np.nanmax(east) - np.nanmin(east)),
        float(np.nanmax(north) - np.nanmin(north)),
    )
    return float(np.clip(tall / max(wide, 1e-9), FLATTEST, SQUAREST))


def _places(
    ax: Any,
    analysis: Analysis,
    track: _Track,
    place: tuple[Floats, Floats],
    span: Span,
    width_mm: float,
) -> None:
    """Mark where the vehicle was, as far as that is known, at the moments of the flight."""
    known = np.isfinite(place[0])
    middle = (np.nanmin(place[0]) + np.nanmax(place[0])) / 2
    scale = 0.75 * width_mm / max(float(np.nanmax(one) - np.nanmin(one)) for one in place)
    taken: list[tuple[float, float, float]] = []  # label boxes: left, right, bottom, mm
    signs = {"take-off": ("^", "#2f855a"), "landing": ("v", "#52606d"), "impact": ("X", "#1f2933")}
    for one in marks_of(analysis, span):
        at = int(np.argmin(np.where(known, np.abs(track.t - one.t), np.inf)))
        sign, ink = signs.get(one.text, ("o", ACCENT))
        east, north = float(place[0][at]), float(place[1][at])
        ax.plot([east], [north], sign, color=ink, markersize=4, markeredgewidth=0, zorder=4)
        is_left = east <= middle
        long, at_x, at_y = LETTER_MM * len(label(one.text, 24)), east * scale, north * scale + 1.0
        left, right = (at_x, at_x + long) if is_left else (at_x - long, at_x)
        low = at_y
        while any(left < r and begin < right and abs(low - y) < TEXT_MM for begin, r, y in taken):
            low -= TEXT_MM / 2
        taken.append((left, right, low))
        ax.annotate(
            label(one.text, 24),
            (east, north),
            (4 if is_left else -4, 3 + (low - at_y) * 72 * MM),
            ha="left" if is_left else "right",
            textcoords="offset points",
            fontsize=SMALL,
            bbox={"facecolor": "white", "alpha": 0.7, "pad": 0.4, "linewidth": 0},
            color=ink if one.text in signs else ACCENT,
        )
    ax.axhline(0, color=FAINT, linewidth=0.3, zorder=0)
    ax.axvline(0, color=FAINT, linewidth=0.3, zorder=0)
