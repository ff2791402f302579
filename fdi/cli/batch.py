"""The command ``fdi batch``: many logs into one table."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, WORKERS, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar
from fdi.errors import OutputError, UsageError

if TYPE_CHECKING:
    from fdi.fleet import Row

MOST_NAMED: Final = 20
"""Logs that are named on a terminal; the table has them all."""


@click.command(epilog="Example: fdi batch flights/ --out fleet.parquet --html --reports flagged")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=FILE)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE.parquet",
    required=True,
    help="The table.",
)
@click.option("--html", is_flag=True, help="Write also FILE.html, a page about all logs.")
@click.option("--ndjson", is_flag=True, help="Write also FILE.ndjson, the rows as lines of JSON.")
@click.option(
    "--reports",
    type=click.Choice(["none", "flagged", "all"]),
    default="none",
    show_default=True,
    help="Write reports into FILE.reports/: of flagged logs (that ended badly or have an "
    "accusation), or of all.",
)
@WORKERS
@click.option(
    "--cluster",
    metavar="ADDRESS",
    help="A dask.distributed scheduler that does the work; use only one that you trust.",
)
@click.option(
    "--resume", is_flag=True, help="Keep the rows of logs that have not changed, and do the others."
)
@model_option()
@policy_option()
@QUIET
@NO_PROGRESS
def batch(
    paths: tuple[str, ...],
    out: Path,
    html: bool,
    ndjson: bool,
    reports: Literal["none", "flagged", "all"],
    workers: int | None,
    cluster: str | None,
    resume: bool,
    model: str,
    policy: str,
    quiet: bool,
    no_progress: bool,
) -> int:
    """Analyse many logs into one table (Parquet), with a row for each.

    PATH is a log, a folder, a glob or a URL. Prints which logs need a look: those that ended badly,
    those with an accusation, and those without an analysis. A log that cannot be read has a row
    that says why.

    An interrupted run leaves its rows in FILE.parquet.rows.jsonl, and --resume goes on from there.
    It also keeps the rows of a finished table if the log, the model, the policy and the version of
    fdi are the same.

    The page of --html shows all logs, and how each vehicle changes over its flights.
    """
    from fdi.batch import Beside, beside
    from fdi.batch import batch as run
    from fdi.decision import load_policy
    from fdi.fleet import Job
    from fdi.model import load_airframe
    from fdi.report.fleet.flagged import bad_end
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
            also=Beside(html, ndjson, None if reports == "none" else reports),
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
        badly = sum(bool(bad_end(row)) for row in found)
        lines = [f"{told}, {badly} ended badly, {failed} without an analysis", *_looks(found)]
        if html:
            lines.append(f"the page of all logs: {beside(out, 'html')}")
        answer("".join(f"{clean(line)}\n" for line in lines))
    _tell_unwritten(found)
    return 0


def _tell_unwritten(found: Sequence[Row]) -> None:
    """Say which reports could not be written; everything else is.

    Raises
    ------
    OutputError
        There are some.
    """
    unwritten = [row["report_error"] for row in found if row["report_error"] is not None]
    if unwritten:
        more = f" (and {len(unwritten) - 1} more reports)" if len(unwritten) > 1 else ""
        raise OutputError(f"the report is not written: {unwritten[0]}{more}")


def _looks(found: Sequence[Row]) -> Iterator[str]:
    """Yield a line about each log that needs a look, the worst end first."""
    from fdi.report.fleet.flagged import ENDS, reasons

    ranks = {how: rank for rank, how in enumerate(ENDS)}
    told = [(row, why) for row in found if (why := "; ".join(reasons(row)))]
    told.sort(key=lambda each: (ranks.get(each[0]["ended"], len(ranks)), not each[0]["accused"]))
    for row, why in told[:MOST_NAMED]:
        yield f"  {row['path']}: {why}"
    if len(told) > MOST_NAMED:
        yield f"  and {len(told) - MOST_NAMED} more: columns ended, accused and error of the table"
