"""The command ``fdi observe``: does a multicopter move as its motors are told? Also live."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.live import follow, live_options
from fdi.cli.one_flight import Asked, asked_of_one_flight
from fdi.cli.output import complain
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.methods.observer import Vehicle
    from fdi.telemetry import Log


@click.command(epilog="Example: fdi observe flight.tlog --out observed")
@click.argument("log", metavar="LOG|CONNECTION", type=FILE)
@click.option(
    "--vehicle",
    default="reference",
    metavar="reference|FILE",
    help="The reference quadrotor, or a YAML file with the mass, inertia and arm of your own.",
)
@click.option(
    "--from",
    "source",
    type=click.Choice(("estimator", "sensors")),
    default="estimator",
    help="What the observer compares with: the estimator's states, or receiver and gyroscopes.",
)
@click.option(
    "--outputs",
    metavar="LIST",
    help="Which states are compared, such as x,y,z,psi; by default all that the source has.",
)
@click.option(
    "--gain",
    type=click.Choice(("poles", "kalman")),
    default="poles",
    help="Gain of the observer: by placed poles, or the steady-state Kalman gain.",
)
@live_options
@asked_of_one_flight("Folder for text, JSON, residuals as a table, and the three figures.")
def observe(
    asked: Asked,
    log: str,
    vehicle: str,
    source: str,
    outputs: str | None,
    gain: str,
    record_to: Path | None,
    like: str | None,
    seconds: float | None,
) -> int:
    """Compare how a multicopter moves with a linear observer, and say which motor is weak.

    With a CONNECTION (udp:, tcp:, a serial port) it does so while the vehicle flies, and records a
    .tlog.
    """
    from fdi.live.connection import is_connection
    from fdi.methods.observer import observe, read_vehicle
    from fdi.report.observer_document import observer_document
    from fdi.report.observer_files import FILES, write_observation
    from fdi.report.observer_text import observer_summary
    from fdi.telemetry import read

    asked.check("observer", FILES)
    own = read_vehicle(vehicle)
    wanted = None if outputs is None else [name.strip() for name in outputs.split(",")]
    if is_connection(log):
        if asked.flight is not None or asked.as_json:
            raise UsageError("--flight and --json are of a log, not of a connection", where=log)
        given = None if like is None else read(like)
        if given is not None:
            own = _as_flown(own, given)
        kept = _live(log, own, given, source, wanted, gain, record_to, asked.system, seconds)
        if kept is None:
            return 0
        if asked.out is None:
            complain(f"the figures of it: fdi observe {shlex.quote(str(kept))} --out observed")
            return 0
        log = str(kept)
    elif record_to or like or seconds:
        raise UsageError("--record, --like and --seconds are of a connection", where=log)
    found = read(log, system=asked.system)
    seen = observe(
        found,
        own,
        source=source,
        outputs=wanted,
        gain=gain,
        flight=asked.flight,
    )
    asked.tell(
        page=lambda: observer_summary(found, seen),
        document=lambda: observer_document(found, seen),
        write=lambda out: write_observation(found, seen, out, force=asked.force),
    )
    return 0


def _as_flown(vehicle: Vehicle, log: Log) -> Vehicle:
    """Return a vehicle as an earlier log told it: thrust and inertia."""
    from fdi.methods.observer import observe

    told = observe(log, vehicle).observer.vehicle
    return replace(told, name=f"{told.name}, as in {log.name}")


def _live(
    connection: str,
    vehicle: Vehicle,
    given: Log | None,
    source: str,
    outputs: Sequence[str] | None,
    gain: str,
    record_to: Path | None,
    system: int | None,
    seconds: float | None,
) -> Path | None:
    from fdi.live.observing import Observing
    from fdi.live.screen import observer_view

    engine = Observing(vehicle, source, outputs, gain, given)
    return follow(
        connection,
        engine,
        lambda hearing: observer_view(hearing, engine),
        record_to=record_to,
        system=system,
        seconds=seconds,
    )
