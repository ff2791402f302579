"""The command ``fdi batch``: many logs into one table."""

from __future__ import annotations

import os
from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, WORKERS, model_option, policy_option
from fdi.cli.output import answer, progress_bar
from fdi.errors import UsageError


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
    table, for logs that are as they were.
    """
    from fdi.batch import batch as run
    from fdi.batch import check_table
    from fdi.decision import load_policy
    from fdi.fleet import Job
    from fdi.model import load_airframe
    from fdi.report.words import clean, plural
    from fdi.telemetry.search import find_logs

    if workers is not None and cluster is not None:
        raise UsageError("--workers and --cluster exclude each other", hint="give one of them")
    check_table(out, resume=resume)
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
        )
    if not quiet:
        accused = sum(bool(row["accused"]) for row in found)
        failed = sum(row["error"] is not None for row in found)
        told = f"{plural(len(found), 'log')} in {out}: {accused} with an accusation"
        answer(clean(f"{told}, {failed} without an analysis") + "\n")
    return 0
