"""Which figures are there for a printed page, and what may each be asked for?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from fdi.errors import UsageError
from fdi.report.paper.behind import behind_figure
from fdi.report.paper.column import COLUMN_MM, NARROWEST_MM, WIDEST_MM
from fdi.report.paper.curves import channels_figure
from fdi.report.paper.grid import grid_figure
from fdi.report.paper.groups import isolability_figure
from fdi.report.paper.spectrum import spectrum_figure
from fdi.report.paper.tests import residual_figure
from fdi.report.paper.track import track_figure
from fdi.result import Analysis
from fdi.telemetry import Channel

FIGURES: Final = {
    "grid": "which faults are marked when",
    "track": "where the vehicle flew",
    "channels": "recorded channels over time",
    "residual": "a test with its threshold",
    "isolability": "which faults can be told apart",
    "evidence": "the curves behind a finding",
    "spectrum": "at which frequencies it shook",
}
PICTURES: Final = ("svg", "pdf", "png")
DPI: Final = 300
"""Of a PNG: what journals ask for."""


def draw(
    analysis: Analysis,
    what: str = "grid",
    *,
    channels: Sequence[str] = (),
    test: str | None = None,
    finding: int = 1,
    width_mm: float = COLUMN_MM,
) -> Any:
    """Return a figure of an analysis for a printed page; the parameters are those of `plot`.

    Raises
    ------
    UsageError
        There is no such figure, channel, test or finding, or nothing to draw.
    """
    check_request(what, channels, test, width_mm)
    if what == "grid":
        return grid_figure(analysis, width_mm)
    if what == "track":
        return track_figure(analysis, width_mm)
    if what == "isolability":
        return isolability_figure(analysis, width_mm)
    if what == "spectrum":
        return spectrum_figure(analysis, width_mm)
    if what == "channels":
        return channels_figure(analysis, channels, finding, width_mm)
    if what == "residual":
        return residual_figure(analysis, test, finding, width_mm)
    return behind_figure(analysis, finding, width_mm)


def check_request(what: str, channels: Sequence[str], test: str | None, width_mm: float) -> None:
    """Refuse what no log could be asked for.

    Raises
    ------
    UsageError
        There is no such figure or width, a text is no channel, or the figure shows no such thing.
    """
    if what not in FIGURES:
        raise UsageError(f"there is no figure {what!r}", hint=f"there are {', '.join(FIGURES)}")
    if channels and what != "channels":
        raise UsageError(f"channels are not what {what} shows", hint="ask for channels")
    if test is not None and what != "residual":
        raise UsageError(f"a test is not what {what} shows", hint="ask for residual")
    for name in channels:
        Channel.parse(name)
    if not NARROWEST_MM <= width_mm <= WIDEST_MM:
        raise UsageError(
            f"a figure of {width_mm:g} mm cannot be drawn",
            hint=f"{NARROWEST_MM:g} to {WIDEST_MM:g} mm; 85 is one column",
        )


def picture_kind(path: Path) -> str:
    """Return the kind of picture that a file's name asks for.

    Raises
    ------
    UsageError
        It is none of ours.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in PICTURES:
        raise UsageError(
            f"no picture ends with {path.suffix!r}", where=str(path), hint=", ".join(PICTURES)
        )
    return kind
