"""The command ``fdi evaluate``: how often are the analyses of labelled flights right?"""

from __future__ import annotations

import os

import rich_click as click

from fdi.cli.completion import FILE, policy_names
from fdi.cli.output import answer, progress_bar


@click.command(epilog="Example: fdi evaluate flights/labels.json --workers 2")
@click.argument("labels", metavar="LABELS.json", type=FILE)
@click.option(
    "--policy",
    default="default",
    metavar="default|paper|FILE",
    shell_complete=policy_names,
    help="The recipe.",
)
@click.option("--only", metavar="PATTERN", multiple=True, help="Only flights like 'sitl/copter/*'.")
@click.option("--workers", type=int, metavar="N", help="Local processes; by default one per core.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
@click.option("--no-progress", is_flag=True, help="No progress bar.")
def evaluate(
    labels: str,
    policy: str,
    only: tuple[str, ...],
    workers: int | None,
    as_json: bool,
    no_progress: bool,
) -> int:
    """Score the analyses of the flights that LABELS.json describes.

    Prints how many faults were detected, named first, named in time, and how many accusations were
    wrong, each with its 95 % interval and beside what a constant answer would score.
    """
    from fdi.evaluation import evaluate as run
    from fdi.evaluation import load_labels, select
    from fdi.evaluation.tables import evaluation_document, evaluation_text

    wanted = select(load_labels(labels), only)
    with progress_bar(not no_progress) as progress:
        found = run(
            wanted, policy=policy, workers=workers or os.cpu_count() or 1, progress=progress
        )
    if as_json:
        from fdi.report import json_text

        answer(json_text(evaluation_document(found)))
    else:
        answer(evaluation_text(found))
    return 0
