"""The command ``fdi fit``: the weights of the diagnosis, from labelled flights."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, WORKERS, force_option, policy_option
from fdi.cli.output import answer, progress_bar
from fdi.errors import OutputError


@click.command(epilog="Example: fdi fit flights/labels.json --out likelihood.json")
@click.argument("labels", metavar="LABELS.json...", nargs=-1, required=True, type=FILE)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the weights into this file. fdi itself uses fdi/diagnosis/likelihood.json.",
)
@policy_option()
@force_option("Replace FILE if it exists.")
@WORKERS
@NO_PROGRESS
def fit(
    labels: Sequence[str],
    out: Path | None,
    policy: str,
    force: bool,
    workers: int | None,
    no_progress: bool,
) -> int:
    """Fit the weights of the diagnosis to flights whose faults are known.

    LABELS.json describes these flights. Prints each weight with its 95 % interval. How good the
    weights are on flights that they have not seen is printed by fdi evaluate.
    """
    if out is not None and out.exists() and not force:
        raise OutputError("exists", where=str(out), hint="name another file, or give --force")
    from fdi.evaluation import evaluate, load_labels
    from fdi.evaluation.fitting import fit as run
    from fdi.evaluation.fitting import fit_text, fitted_document, lessons_of
    from fdi.report import json_text
    from fdi.report.folder import write_file

    wanted = [one for path in labels for one in load_labels(path)]
    count = workers if workers is not None else os.cpu_count() or 1
    with progress_bar(not no_progress) as progress:
        flown = evaluate(wanted, policy=policy, workers=count, progress=progress).flown
    found = run(lessons_of(flown))
    if out is not None:
        write_file(out, json_text(fitted_document(found)).encode())
    answer(fit_text(found))
    return 0
