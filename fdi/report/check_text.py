"""What does a terminal say about how a vehicle was set up? The page of ``fdi check``.

In: a log and its `Check`s. Out: parts for a console: what was found in a sentence, one line for
each thing that is wrong or strikes, with what to do about it, then what is in order, then what
could not be checked and why, what would decide it, and the gaps of the safety net.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from fdi.diagnosis.advising import about_check
from fdi.diagnosis.safety_net import Gap, safety_net
from fdi.methods.setup import Check
from fdi.report.advice_text import advice_line
from fdi.report.text import heading, text
from fdi.report.words import plural
from fdi.telemetry import Log

if TYPE_CHECKING:
    from rich.console import RenderableType

NET_TITLE: Final = "Safety net: settings that would not have helped, and no failures"
MOST_OF_NET: Final = 5
_REST: Final = (("in order", "In order"), ("not known", "Not checked, or not decided"))


def check_summary(
    log: Log, checks: Sequence[Check], *, all_of_it: bool = False
) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a checked set-up; ``all_of_it``: of the safety net."""
    yield text(log.name, "bold")
    gaps = safety_net(log)
    yield text(_summed_up(checks, sum(gap.word == "mistake" for gap in gaps)))
    for check in checks:
        if check.stands_out:
            sure = "" if check.verdict == "wrong" else " (not beyond doubt)"
            yield text(f"{check.name}: {check.text}{sure}", "bold")
            yield from (text(f"  - {advice_line(one)}") for one in about_check(check, log))
    for verdict, title in _REST:
        of_it = [one for one in checks if one.verdict == verdict and not one.stands_out]
        if of_it:
            yield heading(title)
        for check in of_it:
            yield text(f"  {check.name}: {check.text}")
    open_checks = (one for one in checks if one.verdict == "not known" and not one.stands_out)
    steps = dict.fromkeys(one.do for check in open_checks for one in about_check(check, log))
    if steps:
        yield heading("What would decide it")
        yield from (text(f"  - {step}") for step in steps)
    yield from _net(gaps, all_of_it=all_of_it)


def _net(gaps: Sequence[Gap], *, all_of_it: bool) -> Iterator[RenderableType]:
    """Yield what would not have helped: `MOST_OF_NET` lines, or all with the page of each."""
    if not gaps:
        return
    yield heading(NET_TITLE)
    shown = gaps if all_of_it or len(gaps) <= MOST_OF_NET else gaps[: MOST_OF_NET - 1]
    for gap in shown:
        page = f" ({gap.source}: {gap.address})" if all_of_it else ""
        yield text(f"  {gap.word}: {gap.words()}{page}")
    if len(shown) < len(gaps):
        yield text(f"  and {len(gaps) - len(shown)} more: --verbose", "dim")


def _summed_up(checks: Sequence[Check], mistakes: int) -> str:
    """Return in a sentence what was found, what was not decided, and that settings are mistakes."""
    wrong = sum(check.verdict == "wrong" for check in checks)
    striking = sum(check.stands_out for check in checks) - wrong
    fine = sum(check.verdict == "in order" for check in checks)
    left = [one.name for one in checks if one.verdict == "not known" and not one.stands_out]
    if wrong or striking:
        counted = [f"{wrong} set up wrongly"] if wrong else []
        counted += [f"{striking} striking, though not beyond doubt"] if striking else []
        found = f"Of {plural(len(checks), 'check')}: {' and '.join(counted)}, {fine} in order"
    else:
        what = (
            "No check found anything wrong"
            if mistakes
            else "Nothing was found to be set up wrongly"
        )
        found = f"{what}: {plural(fine, 'check')} in order"
    open_ = f", {len(left)} not decided ({', '.join(left)})" if left else ", all were decided"
    net = f" The safety net has {plural(mistakes, 'mistake')} (below)." if mistakes else ""
    return f"{found}{open_}.{net}"
