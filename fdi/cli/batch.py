"""The command ``fdi batch``: many logs into one table."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, WORKERS, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.fleet import Row

MOST_NAMED: Final = 20
"""Logs that are named on a terminal; the table has them all."""
_BADLY: Final = {"impact": "hit the ground", "failsafe": "ended in a failsafe"}
"""A log that ends in the air is not among them: every second one does, and says no more by it."""


@click.command(epilog="Example: fdi batch flights/ 'old/*.bin' --out fleet.parquet --workers 4")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=FILE)
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="FILE.parquet", required=True, help="Table."
)
@WORKERS
@click.option("--cluster", metavar="ADDRESS", help="A dask.distributed scheduler; trusted only.")
@click.option("--resume", is_flag=True, help="Keep the rows of logs that did not change.")
@model_option()
@policy_option()
@QUIET
@NO_PROGRESS
def batch(
    paths: tuple[str, ...],
    out: Path,
    workers: int | None,
    cluster: str | None,
    resume: bool,
    model: str,
    policy: str,
    quiet: bool,
    no_progress: bool,
) -> int:
    """Analyse the logs at PATH (files, folders, globs, URLs) into a Parquet file, one row each.

    A log that cannot be read is a row that says why. What an interrupted run has found stays in
    FILE.parquet.rows.jsonl, and --resume goes on from there; it also keeps the rows of a finished
    table, for logs that are as they were under the same model, policy and version of fdi. Prints
    which logs need a look: those that ended badly, with an accusation, or without an analysis.
    """
    from fdi.batch import batch as run
    from fdi.decision import load_policy
    from fdi.fleet import Job
    from fdi.model import load_airframe
    from fdi.report.words import clean, plural
    from fdi.telemetry.search import find_logs

    if workers is not None and cluster is not None:
        raise UsageError("--workers and --cluster exclude each other", hint="give one of them")
    load_policy(policy)
    if model != "auto":
        load_airframe(model)
    jobs = [Job(path, model=model, policy=policy) for path in find_logs(paths)]
    with progress_bar(not (quiet or no_progress)) as progress:
        found = run(
            jobs,
            out,
            workers=workers if workers is not None else os.cpu_count() or 1,
            cluster=cluster,
            resume=resume,
            progress=progress,
            tell=None if quiet else lambda line: complain(f"fdi: warning: {line}"),
        )
    if not quiet:
        accused = sum(bool(row["accused"]) for row in found)
        failed = sum(row["error"] is not None for row in found)
        told = f"{plural(len(found), 'log')} in {out}: {accused} with an accusation"
        badly = sum(bool(_end(row)) for row in found)
        lines = [f"{told}, {badly} ended badly, {failed} without an analysis", *_looks(found)]
        answer("".join(f"{clean(line)}\n" for line in lines))
    return 0


def _looks(found: Sequence[Row]) -> Iterator[str]:
    """Yield a line about each log that needs a look, the worst end first."""
    from fdi.fleet import ENDS

    ranks = {how: rank for rank, how in enumerate(ENDS)}
    told = [(row, why) for row in found if (why := "; ".join(_reasons(row)))]
    told.sort(key=lambda each: (ranks.get(each[0]["ended"], len(ranks)), not each[0]["accused"]))
    for row, why in told[:MOST_NAMED]:
        yield f"  {row['path']}: {why}"
    if len(told) > MOST_NAMED:
        yield f"  and {len(told) - MOST_NAMED} more: columns ended, accused and error of the table"


def _reasons(row: Row) -> Iterator[str]:
    if row["error"] is not None:
        yield f"no analysis: {row['error'].removeprefix(row['path'] + ': ')}"
    if end := _end(row):
        yield end
    if row["accused"]:
        yield f"{', '.join(row['accused'])} accused"


def _end(row: Row) -> str:
    """Return how a flight ended badly, "" where none did."""
    words = []
    if row["lost_control_s"] is not None:
        words.append(f"lost control, {row['lost_control_s']:.1f} s")
    elif row["ended"] == "control_lost":
        words.append(f"lost control before {row['end_s']:.1f} s")
    if row["ended"] in _BADLY:
        speed = "" if row["end_speed"] is None else f" at {row['end_speed']:.1f} m/s"
        words.append(f"{_BADLY[row['ended']]}{speed}, {row['end_s']:.1f} s")
    return ", ".join(words)
