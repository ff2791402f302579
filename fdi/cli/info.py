"""The command ``fdi info``: what is in a log?"""

from __future__ import annotations

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import JSON, SYSTEM
from fdi.cli.output import answer, show


@click.command(epilog="Example: fdi info flight.tlog --json")
@click.argument("log", metavar="LOG", type=FILE)
@SYSTEM
@JSON
def info(log: str, system: int | None, as_json: bool) -> int:
    """Say what is in LOG: vehicle, flights, events, messages with their rates, damage."""
    from fdi.telemetry import read

    found = read(log, system=system)
    if as_json:
        from fdi.report import json_text, log_document

        answer(json_text(log_document(found)))
    else:
        from fdi.report import log_summary

        show(log_summary(found))
    return 0
