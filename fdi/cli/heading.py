"""The command ``fdi heading``: do all headings agree, who is the odd one out, what instead?"""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.one_flight import Asked, asked_of_one_flight


def read_assumed(
    context: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, float] | None:
    """Return the block and the time in ``satellite@120``; None where nothing is assumed."""
    if value is None:
        return None
    from fdi.methods.heading.recovery import REPLACED

    block, _, since = value.partition("@")
    try:
        seconds = float(since)
    except ValueError:
        seconds = float("nan")
    if block not in REPLACED or not abs(seconds) < float("inf"):
        raise click.BadParameter(
            f"{value!r} is no BLOCK@SECONDS; blocks are {', '.join(REPLACED)}", context, option
        )
    return block, seconds


@click.command(epilog="Example: fdi heading flight.bin --recover position.csv")
@click.argument("log", metavar="LOG", type=FILE)
@click.option(
    "--recover",
    "recovered",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write what the failed sensor would have measured, with standard deviations; "
    ".parquet or .csv.",
)
@click.option(
    "--assume",
    callback=read_assumed,
    metavar="BLOCK@S",
    help="With --recover: suppose that this block failed at S seconds, whatever the comparison "
    "names: satellite, magnetometer, accelerometer or angular_rate.",
)
@asked_of_one_flight(
    "Folder for text, JSON and figures.",
    force="Replace FILE, and write even into a folder that fdi did not make; a file in the way "
    "there is kept as NAME.1.",
)
def heading(
    asked: Asked, log: str, recovered: Path | None, assume: tuple[str, float] | None
) -> int:
    """Compare compass, course, gyroscopes and estimator in LOG, and name the one that is off."""
    from fdi.errors import UsageError
    from fdi.methods.heading import cross_check, recover
    from fdi.report.heading_document import heading_document
    from fdi.report.heading_files import FILES, write_heading
    from fdi.report.heading_text import heading_summary
    from fdi.report.recovered import check_file, write_recovered
    from fdi.telemetry import read

    if assume is not None and recovered is None:
        raise UsageError("--assume says what --recover FILE replaces, and there is no FILE")
    if recovered is not None:
        check_file(recovered, force=asked.force)
    asked.check("headings", FILES)
    found = read(log, system=asked.system)
    check = cross_check(found, asked.flight)
    recovery = None
    if recovered is not None:
        recovery = recover(found, check, *(assume or ()))
        write_recovered(recovery, recovered, force=asked.force)
    asked.tell(
        page=lambda: heading_summary(found, check, recovery),
        document=lambda: heading_document(found, check, recovery),
        write=lambda out: write_heading(found, check, recovery, out, force=asked.force),
    )
    return 0
