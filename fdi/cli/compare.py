"""The command ``fdi compare``: by what does a flight differ from others of the vehicle?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import JSON, NO_PROGRESS, SYSTEM, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar, show
from fdi.errors import UsageError


@click.command(epilog="Example: fdi compare odd.bin --healthy good_1.bin --healthy good_2.bin")
@click.argument("logs", metavar="LOG LOG...", nargs=-1, required=True, type=FILE)
@click.option(
    "--healthy",
    multiple=True,
    type=FILE,
    metavar="LOG",
    help="A healthy flight, for the band; also one that is not among LOG. May be given "
    "several times. By default those on which nobody is accused.",
)
@model_option()
@policy_option()
@SYSTEM
@JSON
@click.option(
    "--figure",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Draw the tests that differ most; svg, pdf or png.",
)
@NO_PROGRESS
def compare(
    logs: Sequence[str],
    healthy: Sequence[str],
    model: str,
    policy: str,
    system: int | None,
    as_json: bool,
    figure: Path | None,
    no_progress: bool,
) -> int:
    """Compare flights of one vehicle: by which tests does one of them differ from the others?

    Flights are aligned at take-off. The healthy ones give a band for each test. Prints the tests by
    which a flight leaves its band furthest, the parameters that differ between the logs, and the
    values that the model identified on each flight. A log may hold several flights.
    """
    from fdi.report.paper import DPI, picture_kind

    kind = picture_kind(figure) if figure is not None else ""
    paths = list(dict.fromkeys((*logs, *healthy)))
    if len(paths) < 2 and len(logs) + len(healthy) > 1:
        raise UsageError("is named twice, and there is no other log", where=paths[0])
    from fdi.analysis import analyze
    from fdi.comparison import compare as run
    from fdi.report import json_text, write_file
    from fdi.report.compared import comparison_document, comparison_summary
    from fdi.report.style import image

    analyses = []
    with progress_bar(not no_progress) as progress:
        for number, path in enumerate(paths):
            if progress:
                progress(Path(path).name[:10], number / len(paths))
            analyses.append(analyze(path, model=model, policy=policy, system=system))
        chosen = [path in healthy for path in paths] if healthy else None
        found = run(analyses, healthy=chosen)
    if figure is not None:
        write_file(figure, image(found.plot(), kind, dpi=DPI))
    if as_json:
        for line in found.notes:
            complain(f"fdi: warning: {line}")
        answer(json_text(comparison_document(found)))
    else:
        show(comparison_summary(found))
    return 0
