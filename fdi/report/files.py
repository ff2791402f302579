"""Which files does a report hold, and what is in each?

In: an analysis and the formats wanted. Out: names with their bytes, one after the other. A figure
is drawn once for all the formats that show it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from fdi.errors import UsageError
from fdi.report.analysis_document import analysis_document
from fdi.report.figures import fault_grid_figure, isolability_figure
from fdi.report.html import html_report
from fdi.report.json_text import json_text
from fdi.report.style import Picture
from fdi.report.tables import fault_grid_csv, isolability_csv, residuals_parquet
from fdi.report.text import summary
from fdi.result import Analysis

FILES: Final = {
    "html": ("report.html",),
    "json": ("analysis.json",),
    "csv": ("fault_grid.csv", "isolability.csv"),
    "png": ("fault_grid.png", "isolability.png"),
    "svg": ("fault_grid.svg", "isolability.svg"),
    "txt": ("summary.txt",),
    "parquet": ("residuals.parquet",),
}
"""The files of a report, by format."""
FORMATS: Final = tuple(FILES)


def chosen(formats: Sequence[str] | None) -> tuple[str, ...]:
    """Return the formats in their fixed order; all of them by default.

    Raises
    ------
    UsageError
        One is not known, or none is given.
    """
    if formats is None:
        return FORMATS
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise UsageError(
            f"unknown format {unknown[0]!r}" if unknown else "no format is named",
            hint=f"known: {', '.join(FORMATS)}",
        )
    return tuple(name for name in FORMATS if name in formats)


def names_of(formats: Sequence[str]) -> tuple[str, ...]:
    """Return the files that a report in these formats holds."""
    return tuple(name for kind in formats for name in FILES[kind])


def contents(analysis: Analysis, formats: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    """Yield the name and bytes of every file."""
    document = analysis_document(analysis) if {"json", "html"} & set(formats) else {}
    if "json" in formats:
        yield "analysis.json", json_text(document).encode()
    if "txt" in formats:
        yield "summary.txt", summary(analysis).encode()
    if "csv" in formats:
        yield "fault_grid.csv", fault_grid_csv(analysis).encode()
        yield "isolability.csv", isolability_csv(analysis).encode()
    if "parquet" in formats:
        yield "residuals.parquet", residuals_parquet(analysis)
    if "html" in formats:
        yield "report.html", html_report(analysis, document).encode()
    if not {"png", "svg"} & set(formats):
        return
    drawn = {
        "fault_grid": fault_grid_figure(analysis),
        "isolability": isolability_figure(analysis.diagnosis.implementable),
    }
    pictures = {name: Picture(figure) for name, figure in drawn.items()}
    for kind in ("png", "svg"):
        if kind in formats:
            for name, picture in pictures.items():
                yield f"{name}.{kind}", picture.bytes(kind)
