"""Which files does ``fdi vote --out`` write, and what is in each?

In: a `Voting`, or simulated voters. Out: names with their bytes, one after the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from fdi.methods.voting import Settings, Voting
from fdi.methods.voting.scenarios import Row
from fdi.report.folder import fresh_folder
from fdi.report.json_text import json_text
from fdi.report.reliability_text import Units, reliability_table
from fdi.report.simulation_text import (
    simulation_document,
    simulation_summary,
    simulation_table,
)
from fdi.report.style import Picture
from fdi.report.tables import csv_text
from fdi.report.text import plain
from fdi.report.vote_document import error_table, reaction_table, vote_document, vote_table
from fdi.report.vote_figure import vote_figure
from fdi.report.vote_text import vote_summary

VOTE_FILES: Final = (
    "vote.json",
    "summary.txt",
    "votes.csv",
    "errors.csv",
    "reaction.csv",
    "votes.png",
    "votes.svg",
)
SIMULATION_FILES: Final = ("simulation.json", "summary.txt", "simulation.csv", "reliability.csv")


def write_votes(found: Voting, usual: Voting | None, out: Path, *, force: bool) -> None:
    """Write what there is to say of votes into a folder.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    with fresh_folder(out, holds="votes", names=VOTE_FILES, force=force) as fresh:
        for name, content in _of_votes(found, usual):
            (fresh / name).write_bytes(content)


def _of_votes(found: Voting, usual: Voting | None) -> Iterator[tuple[str, bytes]]:
    yield "vote.json", json_text(vote_document(found, usual)).encode()
    yield "summary.txt", plain(vote_summary(found, usual)).encode()
    yield "votes.csv", csv_text(vote_table(found)).encode()
    yield "errors.csv", csv_text(error_table(found)).encode()
    yield "reaction.csv", csv_text(reaction_table(found, usual)).encode()
    picture = Picture(vote_figure(found))
    for kind in ("png", "svg"):
        yield f"votes.{kind}", picture.bytes(kind)


def write_simulation(
    rows: Sequence[Row], settings: Settings, units: Units, out: Path, *, force: bool
) -> None:
    """Write simulated voters and reliability into a folder.

    Raises
    ------
    OutputError
        The folder cannot be written, or is not ours.
    """
    with fresh_folder(out, holds="votes", names=SIMULATION_FILES, force=force) as fresh:
        document = json_text(simulation_document(rows, settings, units))
        (fresh / "simulation.json").write_text(document, "utf-8")
        shown = plain(simulation_summary(rows, settings, units))
        (fresh / "summary.txt").write_text(shown, "utf-8")
        (fresh / "simulation.csv").write_text(csv_text(simulation_table(rows)), "utf-8")
        (fresh / "reliability.csv").write_text(csv_text(reliability_table(units)), "utf-8")
