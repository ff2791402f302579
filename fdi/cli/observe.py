"""The command ``fdi observe``: does a multicopter move as its motors are told?"""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import SYSTEM
from fdi.cli.output import answer, show


@click.command(epilog="Example: fdi observe flight.tlog --out observed")
@click.argument("log", metavar="LOG", type=FILE)
@click.option(
    "--vehicle",
    default="reference",
    metavar="reference|FILE",
    help="The reference quadrotor, or a YAML file with mass, inertia and arm of one's own.",
)
@click.option(
    "--from",
    "source",
    type=click.Choice(("estimator", "sensors")),
    default="estimator",
    help="Outputs of the estimator, or of receiver and gyroscopes.",
)
@click.option(
    "--outputs", metavar="LIST", help="Such as x,y,z,psi; by default all that the source tells."
)
@click.option(
    "--gain",
    type=click.Choice(("poles", "kalman")),
    default="poles",
    help="Placed poles, or the steady Kalman gain.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for text, JSON, residuals as a table, and the three figures.",
)
@click.option("--flight", type=click.IntRange(min=1), metavar="N", help="By default the last one.")
@SYSTEM
@click.option(
    "--force",
    is_flag=True,
    help="Write into a folder that fdi did not make; a file in the way is kept as NAME.1.",
)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def observe(
    log: str,
    vehicle: str,
    source: str,
    outputs: str | None,
    gain: str,
    out: Path | None,
    flight: int | None,
    system: int | None,
    force: bool,
    as_json: bool,
) -> int:
    """Hold LOG's multicopter against a linear observer: thirteen residuals, which motor is weak."""
    from fdi.methods.observer import observe, read_vehicle
    from fdi.report import check_folder, json_text
    from fdi.report.observer_document import observer_document
    from fdi.report.observer_files import FILES, write_observation
    from fdi.report.observer_text import observer_summary
    from fdi.telemetry import read

    if out is not None:
        check_folder(out, holds="observer", names=FILES, force=force)
    own = read_vehicle(vehicle)
    found = read(log, system=system)
    seen = observe(
        found,
        own,
        source=source,
        outputs=None if outputs is None else [name.strip() for name in outputs.split(",")],
        gain=gain,
        flight=None if flight is None else flight - 1,
    )
    if out is not None:
        write_observation(found, seen, out, force=force)
    if as_json:
        answer(json_text(observer_document(found, seen)))
    else:
        show(observer_summary(found, seen))
    return 0
