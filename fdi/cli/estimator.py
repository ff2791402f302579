"""The command ``fdi estimator``: was the navigation estimator healthy?"""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import SYSTEM
from fdi.cli.output import answer, show


@click.command(epilog="Example: fdi estimator flight.ulg --out health")
@click.argument("log", metavar="LOG", type=FILE)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for text, JSON, and the figures of ratios and fault trees.",
)
@click.option("--flight", type=click.IntRange(min=1), metavar="N", help="By default the last one.")
@SYSTEM
@click.option(
    "--force",
    is_flag=True,
    help="Write into a folder that fdi did not make; a file in the way is kept as NAME.1.",
)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def estimator(
    log: str, out: Path | None, flight: int | None, system: int | None, force: bool, as_json: bool
) -> int:
    """Say whether the estimator of LOG was healthy: ratios, faults, cores, what made it fail."""
    from fdi.methods.estimator import estimator_health
    from fdi.report import check_folder, json_text
    from fdi.report.estimator_document import estimator_document
    from fdi.report.estimator_files import FILES, write_estimator
    from fdi.report.estimator_text import estimator_summary
    from fdi.telemetry import read

    if out is not None:
        check_folder(out, holds="estimator", names=FILES, force=force)
    found = read(log, system=system)
    health = estimator_health(found, None if flight is None else flight - 1)
    if out is not None:
        write_estimator(found, health, out, force=force)
    if as_json:
        answer(json_text(estimator_document(found, health)))
    else:
        show(estimator_summary(found, health))
    return 0
