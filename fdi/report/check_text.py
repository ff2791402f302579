"""What does a terminal say about how a vehicle was set up? The page of ``fdi check``.

In: a log and its `Check`s. Out: parts for a console: one line for each thing that is wrong, then
what was found in order, then what could not be checked and why.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from fdi.methods.setup import Check
from fdi.report.text import heading, text
from fdi.telemetry import Log

if TYPE_CHECKING:
    from rich.console import RenderableType

_REST: Final = (("in order", "In order"), ("not known", "Not checked, or not decided"))


def check_summary(log: Log, checks: Sequence[Check]) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a checked set-up."""
    yield text(log.name, "bold")
    wrong = [check for check in checks if check.verdict == "wrong"]
    if not wrong:
        sure = sum(check.verdict == "in order" for check in checks)
        yield text(
            f"Nothing was found to be set up wrongly: {sure} checks in order, "
            f"{len(checks) - sure} not decided."
        )
    for check in wrong:
        yield text(f"{check.name}: {check.text}", "bold")
    for verdict, title in _REST:
        of_it = [check for check in checks if check.verdict == verdict]
        if of_it:
            yield heading(title)
        for check in of_it:
            yield text(f"  {check.name}: {check.text}")
