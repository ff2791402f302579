"""The command ``fdi batch``: many logs into one table."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, WORKERS, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar
from fdi.errors import LogError, OutputError, UsageError
from fdi.report.words import clean, plural, shortened

if TYPE_CHECKING:
    from fdi.fleet import Row

MOST_NAMED: Final = 20
"""Logs that are named on a terminal; the table has them all."""
MOST_ENDS: Final = 6


@click.command(epilog="Example: fdi batch flights/ --out fleet.parquet --html --reports flagged")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=FILE)
@click.option(
    "-o",
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
@click.option(
    "--check",
    is_flag=True,
    help="Exit with code 1 if a component is accused in any log, else with 3 if a log has no "
    "analysis.",
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
    check: bool,
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

    Logs of one flight by two recorders (.tlog and .bin) are told as such and counted once.

    Exit code 3, after the table is written, if no log could be analysed. With --check also if one
    could not, unless a component is accused in another: then it is 1.

    The page of --html shows all logs, and how each vehicle changes over its flights.
    """
    from fdi.batch import Beside, beside
    from fdi.batch import batch as run
    from fdi.decision import load_policy
    from fdi.fleet import Job
    from fdi.model import load_airframe
    from fdi.telemetry.search import search_logs

    if workers is not None and cluster is not None:
        raise UsageError("--workers and --cluster exclude each other", hint="give one of them")
    load_policy(policy)
    if model != "auto":
        load_airframe(model)
    logs, others = search_logs(paths)
    jobs = [Job(path, model=model, policy=policy) for path in logs]
    if others and not quiet:
        complain(f"fdi: {_passed_over(others)}")
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
        lines = list(summary(found, out, paths))
        if html:
            lines.append(f"the page of all logs: {beside(out, 'html')}")
        answer("".join(f"{clean(line)}\n" for line in lines))
    _tell_unwritten(found)
    return _code(found, check=check)


def _code(found: Sequence[Row], *, check: bool) -> int:
    """Return the exit code of what was found.

    Raises
    ------
    LogError
        No log has an analysis; or, with ``check``, one has none and nobody is accused in another.
    """
    if check and any(row["accused"] for row in found):
        return 1
    failed = sum(row["error"] is not None for row in found)
    if failed == len(found) or (check and failed):
        raise LogError(
            f"{failed} of {plural(len(found), 'log')} could not be analysed",
            hint="the column error of the table says why",
        )
    return 0


def _passed_over(others: Mapping[str, int]) -> str:
    """Return how many files of folders are not taken for logs, by the end of their name."""
    ends = [f"{count} {end or 'without an ending'}" for end, count in others.items()]
    files = plural(sum(others.values()), "file is no log and was", "files are no logs and were")
    return f"{files} passed over: {shortened(ends, MOST_ENDS)}"


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


def summary(found: Sequence[Row], out: Path, given: Sequence[str]) -> Iterator[str]:
    """Yield what a terminal shows: how many logs, then a line about each that needs a look."""
    from fdi.report.fleet.flagged import bad_end, flights_of, reasons, worst_first

    accused = flights_of(row for row in found if row["accused"])
    badly = flights_of(row for row in found if bad_end(row))
    failed = sum(row["error"] is not None for row in found)
    yield (
        f"{plural(len(found), 'log')} in {out}: {accused} with an accusation, {badly} ended badly, "
        f"{failed} without an analysis"
    )
    names = _names(found, given)
    told = [(found[i], why) for i in worst_first(found) if (why := "; ".join(reasons(found[i])))]
    for row, why in told[:MOST_NAMED]:
        first = row["same_flight_as"]
        same = f"; same flight as {names[first]}" if first else ""
        yield f"  {names[row['path']]}: {why}{same}"
    if len(told) > MOST_NAMED:
        yield f"  and {len(told) - MOST_NAMED} more: columns ended, accused and error of the table"
    repeated = sum(row["same_flight_as"] is not None for row in found)
    if repeated:
        yield f"{plural(repeated, 'log is', 'logs are')} of a flight that another one tells as well"


def _names(found: Sequence[Row], given: Sequence[str]) -> dict[str, str]:
    """Return the path of each log from where the user pointed on; whole where two are alike."""
    folders = sorted((path for path in given if os.path.isdir(path)), key=len, reverse=True)

    def short(path: str) -> str:
        inside = (one for one in folders if path.startswith(os.path.join(one, "")))
        folder = next(inside, os.path.dirname(path))
        return path.removeprefix(os.path.join(folder, "")) if folder else path

    names = Counter(short(row["path"]) for row in found)
    paths = [row["path"] for row in found]
    return {path: path if names[short(path)] > 1 else short(path) for path in paths}
