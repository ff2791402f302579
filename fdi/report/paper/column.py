"""How large is a printed figure, and how do times stand in it?

In: a width in mm. Out: figures whose letters are 6 to 7 points at that width, so that nothing has
to be scaled; vertical lines for take-off, landing, impact and the onsets of findings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis import Finding
from fdi.errors import UsageError
from fdi.report.style import ACCENT, label, levels, new_figure, styled, tidy
from fdi.result import Analysis

MM: Final = 1 / 25.4  # inches
COLUMN_MM: Final = 85.0
NARROWEST_MM, WIDEST_MM = 60.0, 400.0
LETTERS: Final = 7.0  # points
SMALL: Final = 6.0
LETTER_MM: Final = 1.22
"""Mean width of a letter of the small size (DejaVu Sans, 0.58 of its height)."""
PANEL: Final = 0.74
"""Width of a panel as a share of the figure's, where numbers stand beside it."""
MOST_POINTS: Final = 2000
LINE: Final = 0.8
CLOCK: Final = "time in the log (s)"
BEFORE_S, AFTER_S = 20.0, 30.0
LONGEST_S: Final = 150.0
Floats = NDArray[np.float64]
Span = tuple[float, float]


class Mark(NamedTuple):
    """A moment with its name."""

    t: float
    text: str
    colour: str
    dashes: str


@contextmanager
def printed() -> Iterator[None]:
    """Draw in the style of a printed column while this is open."""
    import matplotlib as mpl

    with styled():
        mpl.rcParams.update(
            {
                "font.size": LETTERS,
                "axes.titlesize": LETTERS,
                "axes.titleweight": "normal",
                "axes.labelsize": LETTERS,
                "xtick.labelsize": SMALL,
                "ytick.labelsize": SMALL,
                "legend.fontsize": SMALL,
                "axes.linewidth": 0.6,
                "lines.linewidth": LINE,
                "hatch.linewidth": 0.4,
            }
        )
        yield


def page(width_mm: float, height_mm: float) -> Any:
    """Return an empty figure of that size."""
    return new_figure(width_mm * MM, height_mm * MM)


def stacked(width_mm: float, heights_mm: Sequence[float], *, extra_mm: float) -> tuple[Any, Any]:
    """Return a figure with panels above each other on one axis of time, and these."""
    figure = page(width_mm, sum(heights_mm) + extra_mm)
    axes = figure.subplots(
        len(heights_mm), 1, sharex=True, squeeze=False, height_ratios=list(heights_mm)
    )[:, 0]
    for ax in axes:
        tidy(ax)
    axes[-1].set_xlabel(CLOCK)
    return figure, axes


def finding_of(analysis: Analysis, rank: int) -> Finding:
    """Return a finding by its rank.

    Raises
    ------
    UsageError
        There is none of that rank.
    """
    for one in analysis.findings:
        if one.rank == rank:
            return one
    ranks = ", ".join(str(one.rank) for one in analysis.findings)
    raise UsageError(
        f"there is no finding {rank}",
        where=analysis.log.name,
        hint=f"there are {ranks}" if ranks else "nobody is accused in this log",
    )


def around(analysis: Analysis, finding: Finding) -> Span:
    """Return from when to when a finding is shown, s."""
    t = analysis.signals.t
    end = finding.end if finding.end is not None else finding.onset + AFTER_S
    low = max(finding.onset - BEFORE_S, float(t[0]))
    high = min(end + BEFORE_S / 2, finding.onset + LONGEST_S, float(t[-1]))
    return low, max(high, low + 1.0)


def whole(analysis: Analysis) -> Span:
    """Return from when to when the analysis looked, s; its last sample lasts one step."""
    t = analysis.signals.t
    if not len(t):
        raise UsageError("holds no sample that could be drawn", where=analysis.log.name)
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    return float(t[0]), float(t[-1]) + step


def marks_of(analysis: Analysis, span: Span) -> list[Mark]:
    """Return take-offs, landings, impacts and onsets inside a span, in the order of time."""
    grey = "#52606d"
    found = [
        Mark(t, text, grey, "-")
        for flight in analysis.log.flights
        for text, t in (
            ("take-off", flight.takeoff),
            ("landing", flight.landing),
            ("impact", flight.impact),
        )
        if t is not None
    ]
    found += [Mark(f.onset, f"{f.rank} {f.component}", ACCENT, "--") for f in analysis.findings]
    return sorted((one for one in found if span[0] <= one.t <= span[1]), key=lambda one: one.t)


def mark_times(axes: Sequence[Any], marks: Sequence[Mark], span: Span, panel_mm: float) -> int:
    """Draw moments as lines through panels, with their names above the first one.

    ``panel_mm``: how wide a panel is, so that names get another line before they overlap.

    Returns
    -------
    int
        How many lines of letters stand above the first panel.
    """
    axes[0].set_xlim(*span)
    for ax in axes:
        for one in marks:
            ax.axvline(one.t, color=one.colour, linestyle=one.dashes, linewidth=0.6, zorder=3)
    letter = LETTER_MM / panel_mm
    widths = [letter * len(label(one.text, 24)) for one in marks]
    places = [(one.t - span[0]) / (span[1] - span[0]) for one in marks]
    leans = [p + w > 1.02 for p, w in zip(places, widths, strict=True)]
    starts = [p - w if left else p for p, w, left in zip(places, widths, leans, strict=True)]
    order = sorted(range(len(marks)), key=lambda i: starts[i])
    found = levels([starts[i] for i in order], [widths[i] for i in order], 0.01)
    for i, level in zip(order, found, strict=True):
        axes[0].annotate(
            label(marks[i].text, 24),
            (marks[i].t, 1.0),
            (-1 if leans[i] else 1, 2 + level * (SMALL + 1.5)),
            ha="right" if leans[i] else "left",
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            color=marks[i].colour,
            fontsize=SMALL,
            annotation_clip=False,
        )
    return max(found, default=-1) + 1


def thinned(t: Floats, value: Floats, most: int = MOST_POINTS) -> tuple[Floats, Floats]:
    """Return a curve with fewer points that looks the same: the extremes of every stretch.

    Examples
    --------
    >>> t = np.arange(6.0)
    >>> thinned(t, np.array([0.0, 9.0, 1.0, 2.0, -3.0, 1.0]), 4)[1].tolist()
    [0.0, 9.0, 2.0, -3.0]
    """
    if len(t) <= most:
        return t, value
    pairs = most // 2
    size = -(-len(t) // pairs)
    kept: list[int] = []
    for low in range(0, len(t), size):
        part = value[low : low + size]
        if np.isnan(part).all():
            kept.append(low)
            continue
        kept += sorted({low + int(np.nanargmin(part)), low + int(np.nanargmax(part))})
        if np.isnan(part).any():  # a gap stays a gap
            kept.append(low + int(np.argmax(np.isnan(part))))
    rows = np.unique(kept)
    return t[rows], value[rows]
