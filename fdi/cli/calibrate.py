"""The command ``fdi calibrate``: a policy learned from healthy flights of one vehicle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import rich_click as click

from fdi.cli.completion import FILE
from fdi.cli.options import NO_PROGRESS, QUIET, force_option, model_option, policy_option
from fdi.cli.output import answer, complain, progress_bar
from fdi.errors import OutputError, UsageError

if TYPE_CHECKING:
    from fdi.calibrate import Calibrated


@click.command(epilog="Example: fdi calibrate monday.bin tuesday.bin --out heron_3.yaml")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=FILE)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    required=True,
    help="The new policy; use it by fdi analyze --policy FILE.",
)
@model_option()
@policy_option("The policy to begin with.", metavar="default|FILE")
@force_option("Replace FILE if it exists.")
@QUIET
@NO_PROGRESS
def calibrate(
    logs: Sequence[str],
    out: Path,
    model: str,
    policy: str,
    force: bool,
    quiet: bool,
    no_progress: bool,
) -> int:
    """Learn from healthy flights of one vehicle what is usual for it, and write a policy.

    It learns thresholds, constant offsets, and the parameters that the model identifies: their mean
    and how far a later flight may differ. Against these also shows what was wrong before take-off.
    Three flights are few, five are better; one flight tells nothing of the spread between flights.

    Prints the learned parameters, how often these flights were accused before, and how often each
    is accused by a policy that was learned from the others. A flight that ends with an impact, or
    on which a component is clearly accused, is refused.
    """
    if out.exists() and not force:
        raise OutputError("exists", where=str(out), hint="name another file, or give --force")
    twice = [log for number, log in enumerate(logs) if log in logs[:number]]
    if twice:
        raise UsageError("is given twice", where=twice[0])
    from fdi.calibrate import calibrate as run
    from fdi.decision.policy import policy_text
    from fdi.report.folder import write_file

    with progress_bar(not (quiet or no_progress)) as progress:
        found = run(logs, name=out.stem, model=model, policy=policy, progress=progress)
    for line in found.warnings if not quiet else ():
        complain(f"fdi: warning: {line}")
    write_file(out, policy_text(found.policy).encode())
    if not quiet:
        answer(_told(found, out))
    return 0


def _told(found: Calibrated, out: Path) -> str:
    from fdi.report.words import clean

    hours = sum(check.hours for check in found.checks)
    lines = []
    for check in found.checks:
        after = "-" if check.after is None else str(check.after)
        lines.append(
            f"{clean(check.name)}: {60 * check.hours:.1f} min, accusations {check.before} before, "
            f"{after} learned from the others"
        )
    before = sum(check.before for check in found.checks)
    if len(found.checks) > 1:
        left = sum(check.after or 0 for check in found.checks)
        lines.append(f"per flight hour: {before / hours:.1f} before, {left / hours:.1f} after")
    else:
        lines.append(f"per flight hour: {before / hours:.1f} before; one flight cannot be checked")
    return "\n".join([*lines, *_parameters(found), clean(str(out)), ""])


def _parameters(found: Calibrated) -> Iterator[str]:
    from fdi.report.words import clean, plural

    learned = found.policy.calibration.parameters if found.policy.calibration else {}
    for name, one in learned.items():
        flights = plural(one.flights, "flight")
        yield f"{clean(name)}: {one.value:.4g} +- {one.std:.2g} on a later flight, by {flights}"
