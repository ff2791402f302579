"""The command ``fdi watch``: which component fails, while it flies?"""

from __future__ import annotations

import shlex
from pathlib import Path

import rich_click as click

from fdi.cli.live import follow, live_options
from fdi.cli.options import SYSTEM, model_option, policy_option
from fdi.cli.output import complain
from fdi.errors import UsageError


@click.command(epilog="Example: fdi watch udp:0.0.0.0:14550 --model quadcopter")
@click.argument("connection", metavar="CONNECTION")
@model_option()
@policy_option(metavar="default|FILE")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="At the end, analyse the whole recording and write the report into this folder.",
)
@live_options
@SYSTEM
@click.option("--force", is_flag=True, help="Write even into a folder that fdi did not make.")
def watch(
    connection: str,
    model: str,
    policy: str,
    out: Path | None,
    record_to: Path | None,
    like: str | None,
    seconds: float | None,
    system: int | None,
    force: bool,
) -> int:
    """Run the tests of a model while the vehicle flies, and record a .tlog.

    CONNECTION is udp:HOST:PORT to listen at, udpout:HOST:PORT to call, tcp:HOST:PORT, or a serial
    port with its baud rate (/dev/ttyUSB0,57600). Ctrl-C stops it.
    """
    from fdi.analysis import analyze
    from fdi.decision import load_policy
    from fdi.live.connection import is_connection
    from fdi.live.screen import bank_view
    from fdi.live.watching import Watching
    from fdi.model import load_airframe
    from fdi.report import check_folder, write_report
    from fdi.telemetry import read

    if not is_connection(connection):
        raise UsageError(f"{connection!r} is no connection", hint="for a log: fdi analyze LOG")
    if out is not None:
        check_folder(out, force=force)
    if model != "auto":
        load_airframe(model)  # what is wrong with it is said before the flight
    engine = Watching(load_policy(policy), model, None if like is None else read(like))
    kept = follow(
        connection,
        engine,
        lambda hearing: bank_view(hearing, engine),
        record_to=record_to,
        system=system,
        seconds=seconds,
    )
    if kept is not None and out is None:
        told = f"fdi analyze {shlex.quote(str(kept))} --out analysis"
        complain(f"the report of the whole flight: {told}")
    elif kept is not None and out is not None:
        write_report(analyze(kept, model=model, policy=policy, system=system), out, force=force)
    return 0
