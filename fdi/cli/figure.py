"""The command ``fdi figure``: one figure of an analysis, for a printed page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import rich_click as click

from fdi.cli.analyze import read_window
from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, SYSTEM, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar

WHATS = ("grid", "track", "channels", "residual", "isolability", "evidence", "spectrum")
"""The names of `fdi.report.paper.FIGURES`, written out so that help needs no library."""


@click.command(epilog="Example: fdi figure crash.bin --what evidence --out evidence.pdf")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=FILE)
@click.option(
    "--what",
    type=click.Choice(WHATS),
    default="grid",
    show_default=True,
    help="Which figure, see above.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The file: svg, pdf or png. By default LOG-WHAT.svg in the working directory.",
)
@click.option(
    "--channel",
    "channels",
    multiple=True,
    metavar="MESSAGE.FIELD",
    help="For channels: one to draw; may be given several times.",
)
@click.option(
    "--test", metavar="TEST", help="For residual: a test's id, an equation or a component."
)
@click.option(
    "--finding",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    metavar="N",
    help="For evidence, channels and residual: the rank of the finding.",
)
@click.option(
    "--width",
    type=float,
    default=85.0,
    show_default=True,
    metavar="MM",
    help="Width of the figure; 85 is one column of a page, 175 both.",
)
@model_option()
@policy_option()
@click.option(
    "--window",
    metavar="A:B",
    callback=read_window,
    help="Only from A to B, in seconds of the log's clock.",
)
@SYSTEM
@QUIET
@NO_PROGRESS
def figure(
    logs: Sequence[str],
    what: str,
    out: Path | None,
    channels: Sequence[str],
    test: str | None,
    finding: int,
    width: float,
    model: str,
    policy: str,
    window: tuple[float, float] | None,
    system: int | None,
    quiet: bool,
    no_progress: bool,
) -> int:
    """Draw one figure of the analysis of LOG, readable in one column of a paper.

    grid: which faults are marked, over time. track: where the vehicle flew. channels: recorded
    channels. residual: a residual with its threshold. isolability: which faults can be told apart.
    evidence: the curves behind a finding. spectrum: at which frequencies the vehicle shook, with
    the motors' rates and notch filters.
    """
    from fdi.report.paper import check_request, picture_kind

    path = out if out is not None else Path(f"{Path(logs[0]).stem}-{what}.svg")
    kind = picture_kind(path)
    check_request(what, channels, test, width)
    from fdi.analysis import analyze as run
    from fdi.report import write_file
    from fdi.report.paper import DPI
    from fdi.report.style import image

    with progress_bar(not (quiet or no_progress)) as progress:
        found = run(
            logs, model=model, policy=policy, window=window, system=system, progress=progress
        )
        drawn = found.plot(what, channels=channels, test=test, finding=finding, width_mm=width)
        write_file(path, image(drawn, kind, dpi=DPI))
    for line in found.warnings if not quiet else ():
        complain(f"fdi: warning: {line}")
    if not quiet:
        answer(f"{path}\n")
    return 0
