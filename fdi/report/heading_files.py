"""Which files tell of a cross-check of headings, and what is in each?

In: a log, its `HeadingCheck` and, where there is one, a `Recovery`. Out: a folder with text, JSON
and figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fdi.methods.heading import HeadingCheck, Recovery
from fdi.report.folder import fresh_folder
from fdi.report.heading_document import heading_document
from fdi.report.heading_figures import headings_figure, recovered_figure
from fdi.report.heading_text import heading_summary
from fdi.report.json_text import json_text
from fdi.report.style import Picture
from fdi.report.text import plain
from fdi.telemetry import Log

FILES: Final = (
    "heading.json",
    "heading.txt",
    "headings.png",
    "headings.svg",
    "recovered.png",
    "recovered.svg",
)
WIDTH: Final = 120


def write_heading(
    log: Log, check: HeadingCheck, recovery: Recovery | None, out: Path, *, force: bool = False
) -> Path:
    """Write a cross-check of headings into a folder and return the folder.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    page = plain(heading_summary(log, check, recovery), width=WIDTH)
    figures = {"headings": headings_figure(log, check)}
    if recovery is not None:
        figures["recovered"] = recovered_figure(log, check, recovery)
    names = tuple(name for name in FILES if name.rpartition(".")[0] in {"heading", *figures})
    with fresh_folder(out, holds="headings", names=names, force=force) as fresh:
        document = json_text(heading_document(log, check, recovery))
        (fresh / "heading.json").write_text(document, "utf-8")
        (fresh / "heading.txt").write_text(page, "utf-8")
        for name, picture in {n: Picture(f) for n, f in figures.items()}.items():
            for kind in ("png", "svg"):
                (fresh / f"{name}.{kind}").write_bytes(picture.bytes(kind))
    return out
