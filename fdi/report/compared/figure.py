"""What do the tests look like by which flights differ most? A panel each, aligned at take-off.

Grey is the band of the healthy flights and, thin, these; in colour stand those that leave it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fdi.comparison import Comparison
from fdi.comparison.band import at_times
from fdi.report.compared.text import by_test
from fdi.report.paper.column import LETTER_MM, SMALL, page, printed, thinned
from fdi.report.style import CURVES, FAINT, label, tidy
from fdi.report.words import number, unit
from fdi.units import customary

MOST_PANELS: Final = 3
MOST_COLOURS: Final = len(CURVES)
PANEL_MM: Final = 27.0
BAND: Final = "#e4e7eb"


def comparison_figure(found: Comparison, width_mm: float) -> Any:
    """Return the tests that differ most as a printed figure."""
    by_statement = {found.tests[one.test].statement: one for one in reversed(by_test(found))}
    chosen = sorted(by_statement.values(), key=lambda one: -one.bands)[:MOST_PANELS]
    odd = _odd(found)
    names = [label(found.flights[place].name, int(width_mm / LETTER_MM) - 16) for place in odd]
    with printed():
        figure = page(width_mm, PANEL_MM * len(chosen) + 13.0 + 3.0 * (len(names) + 1))
        axes = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
        for ax, one in zip(axes, chosen, strict=True):
            _draw(ax, found, one.test, odd)
            test = found.tests[one.test]
            ax.set_title(
                label(f"{test.text}: {number(one.bands, 3)} bands", int(width_mm / LETTER_MM)),
                fontsize=SMALL,
                loc="left",
                pad=2,
            )
        axes[-1].set_xlabel("time after take-off (s)")
        axes[-1].set_xlim(0, max(one.seconds for one in found.flights))
        figure.align_ylabels(list(axes))
        _legend(figure, names)
    return figure


def _odd(found: Comparison) -> list[int]:
    """Return the flights drawn in colour: those outside the band's set, else those that differ."""
    odd = [i for i, one in enumerate(found.flights) if not one.is_healthy]
    differing = dict.fromkeys(one.flight for one in found.differences if one.bands > 1)
    return (odd or list(differing))[:MOST_COLOURS]


def _draw(ax: Any, found: Comparison, test: int, odd: list[int]) -> None:
    tidy(ax)
    shown = customary(found.tests[test].unit)
    band = found.band
    scale = shown.scale * (found.tests[test].way or 1)  # violations upwards, as in the text
    low, high = ((band.middle[test] + sign * band.half[test]) * scale for sign in (-1, 1))
    last = max(one.seconds for one in found.flights)
    t, low, high = (
        np.append(some, end) for some, end in ((band.t, last), (low, low[-1]), (high, high[-1]))
    )
    order = np.argsort(t, kind="stable")
    ax.fill_between(t[order], low[order], high[order], color=BAND, linewidth=1.0, zorder=0)
    for place, course in enumerate(found.courses):
        t, value = thinned(course.t, course.values[test] * scale)
        if place in odd:
            ax.plot(t, value, color=CURVES[odd.index(place)], linewidth=0.9, zorder=3)
        else:
            ax.plot(t, value, color=FAINT, linewidth=0.4, zorder=1)
    ids = found.tests[test].ids
    name = ids[odd[0]] if odd else ids[0]
    ax.set_ylabel(f"{name} ({unit(shown.unit)})" if unit(shown.unit) else name)
    _limit_height(ax, found, test, scale)


def _limit_height(ax: Any, found: Comparison, test: int, scale: float) -> None:
    """Show all that flights and band do."""
    seen = []
    for course in found.courses:
        middle, half = at_times(found.band, course)
        known = np.isfinite(middle[test]) & np.isfinite(course.values[test])
        seen += [course.values[test, known], (middle - half)[test, known]]
        seen += [(middle + half)[test, known]]
    values = np.concatenate(seen) * scale
    if len(values) and np.ptp(values) > 0:
        margin = 0.06 * float(np.ptp(values))
        ax.set_ylim(float(values.min()) - margin, float(values.max()) + margin)


def _legend(figure: Any, names: list[str]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=ink, label=name) for name, ink in zip(names, CURVES, strict=False)
    ]
    handles.append(Patch(color=BAND, label="healthy flights: band"))
    handles.append(Line2D([], [], color=FAINT, linewidth=0.4, label="each of them"))
    figure.legend(
        handles=handles, loc="outside lower left", ncols=1, frameon=False, handlelength=1.2
    )
