"""Which files tell of an observer's residuals, and what is in each?

In: a log and its `Observation`. Out: a folder with text, JSON, the residuals off their centres with
their thresholds as CSV (empty where unknown), and the three figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from fdi.methods.observer import Observation
from fdi.methods.observer.states import RESIDUALS
from fdi.report.folder import fresh_folder
from fdi.report.json_text import json_text
from fdi.report.observer_document import observer_document
from fdi.report.observer_figures import data_figure, residuals_figure, trajectory_figure
from fdi.report.observer_text import observer_summary
from fdi.report.style import Picture
from fdi.report.text import plain
from fdi.telemetry import Log

FIGURES: Final = {
    "data": data_figure,
    "trajectory": trajectory_figure,
    "residuals": residuals_figure,
}
FILES: Final = (
    "observer.json",
    "observer.txt",
    "residuals.csv",
    *(f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")),
)
WIDTH: Final = 120


def write_observation(log: Log, seen: Observation, out: Path, *, force: bool = False) -> Path:
    """Write what an observer says of a flight into a folder and return the folder.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    page = plain(observer_summary(log, seen), width=WIDTH)
    with fresh_folder(out, holds="observer", names=FILES, force=force) as fresh:
        (fresh / "observer.json").write_text(json_text(observer_document(log, seen)), "utf-8")
        (fresh / "observer.txt").write_text(page, "utf-8")
        (fresh / "residuals.csv").write_text(_table(seen), "utf-8")
        for name, draw in FIGURES.items():
            picture = Picture(draw(log, seen))
            for kind in ("png", "svg"):
                (fresh / f"{name}.{kind}").write_bytes(picture.bytes(kind))
    return out


def _table(seen: Observation) -> str:
    names = ["t", *(f"r_{name}" for name in RESIDUALS), *(f"limit_{name}" for name in RESIDUALS)]
    rows = np.concatenate([seen.rows.t[None], seen.off, seen.threshold]).T
    lines = [",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in rows.tolist()]
    return "\n".join([",".join(names), *lines]) + "\n"
