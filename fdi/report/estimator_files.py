"""Which files tell of an estimator's health, and what is in each?

In: a log and its `EstimatorHealth`. Out: a folder with text, JSON and both figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fdi.methods.estimator import EstimatorHealth
from fdi.report.estimator_document import estimator_document
from fdi.report.estimator_figures import ratios_figure, trees_figure
from fdi.report.estimator_text import estimator_summary
from fdi.report.folder import fresh_folder
from fdi.report.json_text import json_text
from fdi.report.style import Picture
from fdi.report.text import plain
from fdi.telemetry import Log

FILES: Final = (
    "estimator.json",
    "estimator.txt",
    "ratios.png",
    "ratios.svg",
    "trees.png",
    "trees.svg",
)
WIDTH: Final = 120


def write_estimator(log: Log, health: EstimatorHealth, out: Path, *, force: bool = False) -> Path:
    """Write what is known of an estimator's health into a folder and return the folder.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    page = plain(estimator_summary(log, health), width=WIDTH)
    with fresh_folder(out, holds="estimator", names=FILES, force=force) as fresh:
        (fresh / "estimator.json").write_text(json_text(estimator_document(log, health)), "utf-8")
        (fresh / "estimator.txt").write_text(page, "utf-8")
        pictures = {"ratios": ratios_figure(log, health), "trees": trees_figure(log, health)}
        for name, picture in {n: Picture(f) for n, f in pictures.items()}.items():
            for kind in ("png", "svg"):
                (fresh / f"{name}.{kind}").write_bytes(picture.bytes(kind))
    return out
