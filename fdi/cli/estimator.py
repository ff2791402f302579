"""The command ``fdi estimator``: was the navigation estimator healthy?"""

from __future__ import annotations

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.one_flight import Asked, asked_of_one_flight


@click.command(epilog="Example: fdi estimator flight.ulg --out health")
@click.argument("log", metavar="LOG", type=FILE)
@asked_of_one_flight("Folder for text, JSON, and figures of the ratios and the fault tree.")
def estimator(asked: Asked, log: str) -> int:
    """Say whether the navigation estimator was healthy in LOG, and if not, what made it fail."""
    from fdi.methods.estimator import estimator_health
    from fdi.report.estimator_document import estimator_document
    from fdi.report.estimator_files import FILES, write_estimator
    from fdi.report.estimator_text import estimator_summary
    from fdi.telemetry import read

    asked.check("estimator", FILES)
    found = read(log, system=asked.system)
    health = estimator_health(found, asked.flight)
    asked.tell(
        page=lambda: estimator_summary(found, health),
        document=lambda: estimator_document(found, health),
        write=lambda out: write_estimator(found, health, out, force=asked.force),
    )
    return 0
