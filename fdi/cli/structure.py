"""The command ``fdi structure``: what can a model show, with what telemetry?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import rich_click as click

from fdi.cli.completion import FILE, model_names
from fdi.cli.options import JSON
from fdi.cli.output import answer, complain, show
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.model import Airframe
    from fdi.model.placement import Placement
    from fdi.report.enough import Enough
    from fdi.report.model_document import ModelStudy
    from fdi.report.model_gain import ModelGain
    from fdi.report.sizes import Sizes
    from fdi.telemetry import Log

PICTURES: Final = ("png", "svg", "pdf")
FIGURES: Final = ("graph", "dm", "isolability", "matching", "sequence")
EXPORTS: Final = ("py", "csv", "mat", "graphml")


@click.command(
    epilog="Example: fdi structure fixed_wing --log flight.tlog --sizes --figure isolability"
)
@click.argument("model", metavar="MODEL", shell_complete=model_names)
@click.option(
    "--log",
    metavar="LOG",
    type=FILE,
    help="Use only the channels that this log has; without it, all that the model names.",
)
@click.option(
    "--place",
    "placing",
    is_flag=True,
    help="Say which further sensors would show more faults; with --log: which messages that "
    "LOG lacks.",
)
@click.option(
    "--against",
    metavar="OLDER",
    shell_complete=model_names,
    help="Say what MODEL adds to this older model: equations, tests, faults detected and told"
    " apart.",
)
@JSON
@click.option(
    "--sizes",
    is_flag=True,
    help="With --log: how large each fault must be to be seen within 5 s, and to be told from"
    " the others.",
)
@click.option(
    "--tell",
    metavar="FAULT=SIZE[,FAULT=SIZE]",
    help="With --log: the cheapest messages and tests that see one fault, or tell two apart, "
    "within 5 s; sizes in SI units.",
)
@click.option(
    "--figure",
    metavar="KIND|FILE",
    help=f"Draw {', '.join(FIGURES[:-1])} or {FIGURES[-1]}. A FILE ({', '.join(PICTURES)}) "
    "gets the isolability.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File of the figure; by default MODEL-KIND.svg.",
)
@click.option(
    "--test",
    metavar="ID",
    help="For graph, dm, matching and sequence: draw only this residual generator, such as r3.",
)
@click.option(
    "--integrate",
    is_flag=True,
    help="Also count tests that integrate states, as with integrate: true in a policy.",
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
    sizes: bool,
    tell: str | None,
    figure: str | None,
    out: Path | None,
    integrate: bool,
    test: str | None,
    export: Path | None,
) -> int:
    """Check a model, and say which faults it can detect and tell apart.

    MODEL is a shipped name, such as quadcopter, or a YAML file.
    """
    what, path = _picture(figure, out, model)
    kind = _ending(path, PICTURES, "picture")
    form = _ending(export, EXPORTS, "export")
    if (sizes or tell is not None) and log is None:
        raise UsageError("sizes need a flight to be sizes of", hint="name one with --log")
    if placing and against is not None:
        raise UsageError("--place and --against answer two questions", hint="ask one at a time")
    from fdi.model import load_airframe
    from fdi.model.placement import place
    from fdi.report.enough import enough_for
    from fdi.report.model_gain import model_gain
    from fdi.report.sizes import sizes_of

    airframe = load_airframe(model)
    older = None if against is None else load_airframe(against)
    studied = _studies(log, integrate=integrate)
    found = studied.of(airframe, place(airframe, studied.log) if placing else None)
    gain = None if older is None else model_gain(studied.of(older), found)
    measured = enough = None
    if (sizes or tell is not None) and studied.log is not None:
        from fdi.chain import residuals_of

        residuals = residuals_of(studied.log, airframe).residuals
        measured = sizes_of(residuals) if sizes else None
        enough = None if tell is None else enough_for(residuals, tell)
    if path is not None:
        from fdi.report import write_file
        from fdi.report.model_figures import model_figure
        from fdi.report.style import image

        known = None if measured is None else measured.found
        write_file(path, image(model_figure(found, what, test, known), kind))
    if export is not None:
        from fdi.report import write_file

        write_file(export, _exported(found, form))
    if as_json:
        _print_json(found, gain, measured, enough)
    else:
        _print_text(found, gain, measured, enough)
    return 0


@dataclass(frozen=True, slots=True)
class _Studies:
    """What models are studied with: a log's channels, or all that they name."""

    log: Log | None
    silent: tuple[str, ...]
    integrate: bool

    def of(self, airframe: Airframe, placement: Placement | None = None) -> ModelStudy:
        """Return what a model shows."""
        from fdi.report.model_document import study

        system = airframe.observe(self.log)
        system = replace(system, warnings=(*self.silent, *system.warnings))
        name = None if self.log is None else self.log.name
        return study(airframe, system, name, placement, integrate=self.integrate)


def _studies(path: str | None, *, integrate: bool) -> _Studies:
    if path is None:
        return _Studies(None, (), integrate)
    from fdi.decision import load_policy
    from fdi.methods.columns import with_columns
    from fdi.methods.table import methods_of
    from fdi.telemetry import read

    log, silent = with_columns(read(path), methods_of(load_policy("default").methods))
    return _Studies(log, silent, integrate)


def _print_json(
    found: ModelStudy, gain: ModelGain | None, measured: Sizes | None, enough: Enough | None
) -> None:
    from fdi.report import json_text
    from fdi.report.enough import enough_document
    from fdi.report.model_document import model_document
    from fdi.report.model_gain import gain_document
    from fdi.report.sizes import sizes_document

    for line in found.warnings:
        complain(f"fdi: warning: {line}")
    bought = {} if gain is None else {"against": gain_document(gain)}
    large = {} if measured is None else {"sizes": sizes_document(measured)}
    cheap = {} if enough is None else {"enough": enough_document(enough)}
    answer(json_text({**model_document(found), **bought, **large, **cheap}))


def _print_text(
    found: ModelStudy, gain: ModelGain | None, measured: Sizes | None, enough: Enough | None
) -> None:
    from fdi.report import model_summary
    from fdi.report.enough import enough_summary
    from fdi.report.model_gain_text import gain_summary
    from fdi.report.sizes import sizes_summary

    if gain is not None:
        show(gain_summary(gain))
        return
    show(model_summary(found))
    if measured is not None:
        show(sizes_summary(measured))
    if enough is not None:
        show(enough_summary(enough))


def _picture(figure: str | None, out: Path | None, model: str) -> tuple[str, Path | None]:
    """Return what is drawn, and into which file."""
    if figure is None:
        if out is not None:
            raise UsageError("--out is for a figure", hint="name one with --figure")
        return "", None
    if figure in FIGURES:
        return figure, out if out is not None else Path(f"{Path(model).stem}-{figure}.svg")
    if out is not None or not Path(figure).suffix:
        raise UsageError(f"no figure is called {figure!r}", hint=", ".join(FIGURES))
    return "isolability", Path(figure)


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
