"""The command ``fdi inject``: a healthy log with known faults."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import QUIET, force_option, model_option
from fdi.cli.output import answer
from fdi.errors import OutputError


@click.command(
    epilog="Example: fdi inject flight.tlog --fault GPS_RAW_INT.alt:bias=15@60:90 --out bad.tlog"
)
@click.argument("log", metavar="LOG", type=FILE)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    required=True,
    metavar="SPEC",
    help="CHANNEL|COMPONENT:bias|drift|freeze|noise|scale|dropout[=SIZE]@START[:END], SIZE in the "
    "channel's SI unit (drift: per second, scale: factor, noise: one sigma, dropout: share lost), "
    "seconds of the log's clock; may be given several times.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    required=True,
    help="The new log.",
)
@model_option("Airframe model, which says what channels a COMPONENT has.")
@force_option("Replace FILE where it exists.")
@QUIET
def inject(
    log: str, faults: tuple[str, ...], out: Path, model: str, force: bool, quiet: bool
) -> int:
    """Write a copy of LOG with known faults in it, in the same format.

    A dropout leaves out the records of the whole message. What a field cannot hold is held at the
    end of its range. DataFlash logs in text form are refused.
    """
    from fdi.evaluation.inject import injected
    from fdi.evaluation.injected_fault import parse_fault
    from fdi.report.folder import write_file
    from fdi.report.words import clean
    from fdi.telemetry import read

    wanted = [parse_fault(fault) for fault in faults]
    if out.exists() and Path(log).exists() and out.samefile(log):
        raise OutputError("is the log itself", where=str(out), hint="name another file")
    if out.exists() and not force:
        raise OutputError("exists", where=str(out), hint="name another file, or give --force")
    write_file(out, injected(read(log), *wanted, model=model))
    if not quiet:
        answer(f"{clean(out)}\n")
    return 0
