"""The command ``fdi check``: what was set up wrongly, by the physics of the flight?"""

from __future__ import annotations

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import JSON, SYSTEM
from fdi.cli.output import answer, show


@click.command(epilog="Example: fdi check flip_on_takeoff.bin")
@click.argument("log", metavar="LOG", type=FILE)
@SYSTEM
@click.option(
    "--check", "fails", is_flag=True, help="Exit with code 1 if anything is set up wrongly."
)
@click.option("--verbose", is_flag=True, help="Tell all of the safety net, and its pages.")
@JSON
def check(log: str, system: int | None, fails: bool, verbose: bool, as_json: bool) -> int:
    """Say what was set up wrongly on the vehicle of LOG: motors, surfaces, sensors, thrust."""
    from fdi.methods.setup import check_setup
    from fdi.telemetry import read

    found = read(log, system=system)
    checks = check_setup(found)
    if as_json:
        from fdi.report import json_text
        from fdi.report.check_document import check_document

        answer(json_text(check_document(found, checks)))
    else:
        from fdi.report.check_text import check_summary

        show(check_summary(found, checks, all_of_it=verbose))
    return int(fails and any(one.verdict == "wrong" for one in checks))
