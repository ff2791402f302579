"""The command ``fdi structure``: what can a model show, with what telemetry?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import rich_click as click

from fdi.cli.completion import FILE, model_names
from fdi.cli.output import answer, complain, show
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.report.model_document import ModelStudy

PICTURES: Final = ("png", "svg", "pdf")
EXPORTS: Final = ("py", "csv", "mat", "graphml")


@click.command(epilog="Example: fdi structure fixed_wing --log flight.tlog --figure matrix.svg")
@click.argument("model", metavar="MODEL", shell_complete=model_names)
@click.option(
    "--log", metavar="LOG", type=FILE, help="Only the channels in this log count as present."
)
@click.option(
    "--place",
    "placing",
    is_flag=True,
    help="Say which messages that LOG lacks (without LOG: which sensors) would show more.",
)
@click.option(
    "--against",
    metavar="OLDER",
    shell_complete=model_names,
    help="Say what MODEL adds to this older one: equations, tests, faults detected and told apart.",
)
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
@click.option(
    "--figure",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help=f"Draw the isolability matrix ({', '.join(PICTURES)}).",
)
@click.option(
    "--export",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the residuals as a Python module (.py), or the incidence (.csv, .mat, .graphml).",
)
def structure(
    model: str,
    log: str | None,
    placing: bool,
    against: str | None,
    as_json: bool,
    figure: Path | None,
    export: Path | None,
) -> int:
    """Check MODEL, a shipped name or a file, and say which faults it can detect and tell apart."""
    kind = _ending(figure, PICTURES, "picture")
    form = _ending(export, EXPORTS, "export")
    if placing and against is not None:
        raise UsageError("--place and --against answer two questions", hint="ask one at a time")
    from fdi.decision import load_policy
    from fdi.methods.columns import with_columns
    from fdi.methods.table import methods_of
    from fdi.model import Airframe, load_airframe
    from fdi.model.placement import Placement, place
    from fdi.report.model_document import model_document, study
    from fdi.report.model_gain import gain_document, model_gain
    from fdi.telemetry import read

    airframe = load_airframe(model)
    older = None if against is None else load_airframe(against)
    recorded = None if log is None else read(log)
    silent: tuple[str, ...] = ()
    if recorded is not None:
        recorded, silent = with_columns(recorded, methods_of(load_policy("default").methods))
    name = None if recorded is None else recorded.name

    def studied(one: Airframe, placement: Placement | None = None) -> ModelStudy:
        system = one.observe(recorded)
        system = replace(system, warnings=(*silent, *system.warnings))
        return study(one, system, name, placement)

    found = studied(airframe, place(airframe, recorded) if placing else None)
    gain = None if older is None else model_gain(studied(older), found)
    if figure is not None:
        from fdi.report import write_file
        from fdi.report.figures import isolability_figure
        from fdi.report.style import image

        title = f"Isolability of {airframe.name}"
        write_file(figure, image(isolability_figure(found.implementable, title), kind))
    if export is not None:
        from fdi.report import write_file

        write_file(export, _exported(found, form))
    if as_json:
        from fdi.report import json_text

        for line in found.warnings:
            complain(f"fdi: warning: {line}")
        bought = {} if gain is None else {"against": gain_document(gain)}
        answer(json_text({**model_document(found), **bought}))
    elif gain is not None:
        from fdi.report.model_gain_text import gain_summary

        show(gain_summary(gain))
    else:
        from fdi.report import model_summary

        show(model_summary(found))
    return 0


def _ending(file: Path | None, known: tuple[str, ...], what: str) -> str:
    """Return the kind of file that a name ends with."""
    kind = file.suffix.lower().lstrip(".") if file is not None else ""
    if file is not None and kind not in known:
        raise UsageError(
            f"no {what} ends with {file.suffix!r}", where=str(file), hint=", ".join(known)
        )
    return kind


def _exported(found: ModelStudy, form: str) -> bytes:
    from fdi.residuals.export import python_module
    from fdi.structure.export import incidence_bytes

    if form == "py":
        return python_module(found.bank).encode()
    return incidence_bytes(found.system.structure(), form)
