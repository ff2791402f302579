"""The command ``fdi evaluate``: how often are the analyses of labelled flights right?"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import rich_click as click
from click import get_current_context
from click.core import ParameterSource

from fdi.cli.completion import FILE
from fdi.cli.options import METHODS, NO_PROGRESS, WORKERS, policy_option
from fdi.cli.output import answer, progress_bar
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.evaluation.curves import CurveKind


@click.command(epilog="Example: fdi evaluate flights/labels.json --workers 2")
@click.argument("labels", metavar="LABELS.json...", nargs=-1, required=True, type=FILE)
@policy_option()
@METHODS
@click.option(
    "--only",
    metavar="PATTERN",
    multiple=True,
    help="Only flights whose key matches, such as 'sitl/copter/*'; may be given several times.",
)
@WORKERS
@click.option(
    "--inject",
    "is_injected",
    is_flag=True,
    help="Instead, inject faults of growing size into the healthy flights.",
)
@click.option(
    "--kind",
    type=click.Choice(["bias", "drift", "noise"]),
    default="bias",
    show_default=True,
    help="With --inject: the kind of fault.",
)
@click.option(
    "--moments",
    type=click.IntRange(1, 20),
    default=2,
    show_default=True,
    help="With --inject: at how many moments of a flight each fault is injected.",
)
@click.option(
    "--channel",
    "channels",
    multiple=True,
    metavar="CHANNEL",
    help="With --inject: only into this channel; may be given several times.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
@NO_PROGRESS
def evaluate(
    labels: Sequence[str],
    policy: str,
    methods: tuple[str, ...] | None,
    only: tuple[str, ...],
    workers: int | None,
    is_injected: bool,
    kind: CurveKind,
    moments: int,
    channels: tuple[str, ...],
    as_json: bool,
    no_progress: bool,
) -> int:
    """Score the analyses of flights whose faults are known, as LABELS.json describes them.

    Prints how many faults were detected, named first and named in time, and how many accusations
    were wrong. Each figure has its 95 % interval and stands beside what a constant answer would
    score. Prints also on how many flights a component that failed was ruled out, and how many
    faults are named first without the tests that read a recorded command (a throttle cut, an output
    held or stopped); for this every flight is analysed a second time.

    First come the figures out of sample, for each labels file: the weights of the diagnosis are
    fitted anew without the recording, the kind of component or the origin of the flight that they
    are then scored on.

    With --inject it finds how large a fault at each channel of a sensor must be to be detected and
    named, on the healthy flights. That takes long: choose a few by --only.
    """
    context = get_current_context()
    for name, option in (("kind", "--kind"), ("moments", "--moments"), ("channels", "--channel")):
        if not is_injected and context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise UsageError(f"{option} is of --inject", hint="give --inject as well")
    if is_injected and methods is not None:
        raise UsageError(
            "--methods is not of --inject: what is injected into a channel reaches no estimator"
        )
    from fdi.evaluation import load_labels, select
    from fdi.report import json_text

    wanted = select([one for path in labels for one in load_labels(path)], only)
    count = workers if workers is not None else os.cpu_count() or 1
    with progress_bar(not no_progress) as progress:
        if is_injected:
            from fdi.evaluation.curves import curves, curves_document, curves_text

            found = curves(
                wanted,
                kind=kind,
                moments=moments,
                channels=channels,
                policy=policy,
                workers=count,
                progress=progress,
            )
            tree, text = curves_document(found, kind), curves_text(found, kind)
        else:
            from fdi.evaluation import evaluate as run
            from fdi.evaluation.tables import evaluation_document, evaluation_text

            scored = run(
                wanted,
                policy=policy,
                methods=methods,
                bare=True,
                workers=count,
                progress=progress,
            )
            tree, text = evaluation_document(scored), evaluation_text(scored)
    answer(json_text(tree) if as_json else text)
    return 0
