"""The command ``fdi observe``: does a multicopter move as its motors are told?"""

from __future__ import annotations

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.one_flight import Asked, asked_of_one_flight


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
@asked_of_one_flight("Folder for text, JSON, residuals as a table, and the three figures.")
def observe(
    asked: Asked,
    log: str,
    vehicle: str,
    source: str,
    outputs: str | None,
    gain: str,
) -> int:
    """Hold LOG's multicopter against a linear observer: thirteen residuals, which motor is weak."""
    from fdi.methods.observer import observe, read_vehicle
    from fdi.report.observer_document import observer_document
    from fdi.report.observer_files import FILES, write_observation
    from fdi.report.observer_text import observer_summary
    from fdi.telemetry import read

    asked.check("observer", FILES)
    own = read_vehicle(vehicle)
    found = read(log, system=asked.system)
    seen = observe(
        found,
        own,
        source=source,
        outputs=None if outputs is None else [name.strip() for name in outputs.split(",")],
        gain=gain,
        flight=asked.flight,
    )
    asked.tell(
        page=lambda: observer_summary(found, seen),
        document=lambda: observer_document(found, seen),
        write=lambda out: write_observation(found, seen, out, force=asked.force),
    )
    return 0
