"""The command ``fdi convert``: a log for other programs."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, SYSTEM, force_option
from fdi.cli.output import answer, progress_bar


@click.command(epilog="Example: fdi convert flight.bin --out flight.parquet")
@click.argument("log", metavar="LOG", type=FILE)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    required=True,
    help="The folder to write.",
)
@SYSTEM
@force_option()
@QUIET
@NO_PROGRESS
def convert(
    log: str, out: Path, system: int | None, force: bool, quiet: bool, no_progress: bool
) -> int:
    """Write LOG as a folder: a Parquet file for each message, in SI units, and metadata.json.

    A field whose name ends with the unit that it was recorded in (time_boot_ms, TimeUS) stays in
    it. The column t is the log's clock in seconds. Units stand in the files and in metadata.json.
    """
    from fdi.report import check_folder
    from fdi.report import convert as run
    from fdi.report.convert import DOCUMENT, file_names
    from fdi.report.words import clean, plural, size
    from fdi.telemetry import read

    check_folder(out, holds="log", force=force)
    with progress_bar(not (quiet or no_progress)) as progress:
        if progress:
            progress("read", 0.0)
        found = read(log, system=system)
        run(found, out, force=force, progress=progress)
    if not quiet:
        names = (*file_names(found.messages).values(), DOCUMENT)
        total = size(sum((out / name).stat().st_size for name in names))
        told = f"{plural(len(found.messages), 'message')}, {total}, in {out}/"
        damage = plural(len(found.quality), "finding")
        told += f"; {damage} about the data, see {DOCUMENT}" if found.quality else ""
        answer(f"{clean(told)}\n")
    return 0
