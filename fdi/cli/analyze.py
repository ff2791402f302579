"""The command ``fdi analyze``: the whole chain on one log."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import METHODS, NO_PROGRESS, SYSTEM, force_option, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar, show
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.result import Analysis


MOST_WARNINGS: Final = 2
"""On a terminal that was not asked for more; what concerns the whole log comes first."""


def read_window(
    context: click.Context, option: click.Parameter, value: str | None
) -> tuple[float, float] | None:
    """Return the two ends of ``A:B``, s of the log's clock."""
    if value is None:
        return None
    low, _, high = value.partition(":")
    try:
        ends = float(low), float(high)
    except ValueError:
        ends = (1.0, 0.0)
    if not ends[0] <= ends[1] or not all(abs(end) < 1e12 for end in ends):
        raise click.BadParameter(
            f"{value!r} is not two ascending times in seconds, such as 120:180", context, option
        )
    return ends


def read_rate(context: click.Context, option: click.Parameter, value: str) -> float | None:
    """Return the rate in Hz, None for ``auto``."""
    if value == "auto":
        return None
    try:
        rate = float(value)
    except ValueError:
        rate = 0.0
    if not 0 < rate <= 1000:
        raise click.BadParameter(
            f"{value!r} is neither 'auto' nor a rate above 0 and up to 1000 Hz", context, option
        )
    return rate


def read_budget(context: click.Context, option: click.Parameter, value: str | None) -> float | None:
    """Return false alarms per hour; rarer ones than 0.01 nobody could check."""
    if value is None:
        return None
    try:
        budget = float(value)
    except ValueError:
        budget = 0.0
    if not 0.01 <= budget <= 100:
        raise click.BadParameter(
            f"{value!r} is not a number of alarms per hour from 0.01 to 100", context, option
        )
    return budget


@click.command(epilog="Example: fdi analyze flight.tlog --model fixed_wing --window 2000:2332")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=FILE)
@model_option()
@policy_option()
@click.option(
    "--window",
    metavar="A:B",
    callback=read_window,
    help="Analyse only from A to B, in seconds of the log's clock, both included.",
)
@click.option(
    "--rate",
    metavar="HZ|auto",
    default="auto",
    callback=read_rate,
    help="Rate at which the tests run; auto follows the rates of the channels.",
)
@click.option(
    "--budget",
    metavar="PER_HOUR",
    callback=read_budget,
    help="Scale thresholds, up or down, until noise raises so many false alarms in an hour of "
    "flight; few of them accuse anybody. By default thresholds are only raised.",
)
@METHODS
@click.option(
    "--recovered",
    type=FILE,
    metavar="FILE",
    help="A file that fdi heading --recover wrote of LOG; what it recovered replaces the "
    "sensor that failed.",
)
@SYSTEM
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for the report; by default LOG.fdi/ in the working directory.",
)
@click.option(
    "--format",
    "formats",
    metavar="html,json,...",
    help="Write only these files of the report: html, json, csv, png, svg, txt, parquet.",
)
@click.option("--open", "opens", is_flag=True, help="Open report.html in the browser.")
@click.option("--json", "as_json", is_flag=True, help="Print analysis.json and nothing else.")
@click.option(
    "--explain",
    metavar="TEST",
    help="Print what a test did, and why it was judged or not. TEST is a test's id, an "
    "equation, a component (all of its tests), all, or facts (what stood out, with the records "
    "it rests on). No files are written without --out.",
)
@click.option("--check", is_flag=True, help="Exit with code 1 if a component is accused.")
@force_option()
@click.option("--quiet", "-q", is_flag=True, help="Print the verdict only.")
@click.option(
    "--verbose",
    "-v",
    is_flag=True,
    help="Print all that was found, every warning, and how long each stage took.",
)
@NO_PROGRESS
def analyze(
    logs: Sequence[str],
    model: str,
    policy: str,
    window: tuple[float, float] | None,
    rate: float | None,
    budget: float | None,
    methods: tuple[str, ...] | None,
    recovered: str | None,
    system: int | None,
    out: Path | None,
    formats: str | None,
    opens: bool,
    as_json: bool,
    explain: str | None,
    check: bool,
    force: bool,
    quiet: bool,
    verbose: bool,
    no_progress: bool,
) -> int:
    """Find out which component failed first in the flight that LOG recorded.

    LOG is a .tlog, a .bin, a text .log, a .ulg, or a table of your own (.csv, .parquet). Several
    LOGs are one flight seen by several recorders: of each channel the better recording is used.

    Prints the verdict, and writes a folder with report.html, analysis.json, tables and figures.
    """
    if quiet and verbose:
        raise UsageError("--quiet and --verbose exclude each other")
    if as_json and explain is not None:
        raise UsageError("--json and --explain exclude each other")
    printed = "json" if as_json else None if explain is None else "explain"
    if printed is not None and formats is not None and out is None:
        hint = "name a folder with --out"
        raise UsageError(f"--{printed} writes no files for --format", hint=hint)
    folder = out if out is not None or printed else Path(f"{Path(logs[0]).stem}.fdi")
    wanted = _files(folder, formats, opens=opens, force=force)
    with progress_bar(not (quiet or no_progress)) as progress:
        from fdi.analysis import analyze as run

        found = run(
            logs,
            model=model,
            policy=policy,
            window=window,
            rate=rate,
            budget=budget,
            methods=methods,
            recovered=recovered,
            system=system,
            command=["fdi", *sys.argv[1:]],
            progress=progress,
        )
        if folder is not None:
            if progress:
                progress("report", 0.95)
            found.report(folder, wanted, force=force)
    _tell(found, folder, as_json=as_json, explain=explain, quiet=quiet, verbose=verbose)
    if opens and folder is not None:
        _open(folder / "report.html")
    return 1 if check and found.findings else 0


def _files(
    folder: Path | None, formats: str | None, *, opens: bool, force: bool
) -> tuple[str, ...]:
    """Return which files of the report are written, into a folder that may be."""
    from fdi.report.files import chosen, names_of

    wanted = chosen(None if formats is None else [f.strip() for f in formats.split(",")])
    if opens and (folder is None or "html" not in wanted):
        raise UsageError("--open needs report.html", hint="name a folder with --out, and html")
    if folder is not None:
        from fdi.report import check_folder

        check_folder(folder, names=names_of(wanted), force=force)
    return wanted


def _open(page: Path) -> None:
    import webbrowser

    if not webbrowser.open(page.resolve().as_uri()):
        complain(f"fdi: warning: no browser was found: open {page} by hand")


def _tell(
    found: Analysis,
    folder: Path | None,
    *,
    as_json: bool,
    explain: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    if as_json:
        from fdi.report import json_text

        answer(json_text(found.document()))
    elif explain is not None:
        from fdi.report.explained import explained

        answer(explained(found, explain))
    elif quiet:
        from fdi.report.words import clean

        answer(f"{clean(found.verdict)}\n")
    else:
        from fdi.report.text import brief, parts

        show(parts(found, folder, warned=True) if verbose else brief(found, folder))
    if not quiet:
        _warn(found.warnings, all_of_them=verbose or as_json or explain is not None)
    for stage, seconds in found.timings.items() if verbose else ():
        complain(f"fdi: {stage} took {seconds:.2f} s")


def _warn(warnings: Sequence[str], *, all_of_them: bool) -> None:
    """Complain of what an analysis warns of, behind its answer."""
    from fdi.report.words import plural

    shown = warnings if all_of_them or len(warnings) <= MOST_WARNINGS else warnings[:MOST_WARNINGS]
    for line in shown:
        complain(f"fdi: warning: {line}")
    left = len(warnings) - len(shown)
    if left:
        complain(
            f"fdi: {plural(left, 'more warning')}: --verbose prints all, the report holds them"
        )
