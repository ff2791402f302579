"""How is advice told: as rows of a document, and as the few lines that come first?

In: `Advice`, an analysis, `Check`s of the set-up. Out: plain values, and lines for a terminal or a
table. What is wrong with the set-up comes first, because it lasts until somebody mends it; then
the first finding; then how the flight ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any, Final

from fdi.diagnosis import Advice, Ending
from fdi.diagnosis.advising import about_check, about_no_flight, setting_words
from fdi.diagnosis.stood_out import CARRIES
from fdi.methods.setup import Check
from fdi.report.json_text import number
from fdi.result import Analysis
from fdi.telemetry.ends import gravest

MOST: Final = 3


def advice_rows(advice: Sequence[Advice]) -> list[dict[str, Any]]:
    """Return advice as a document holds it; numbers are finite or null."""
    return [
        {
            "when": one.when,
            "do": one.do,
            "why": one.why,
            "parameter": None
            if one.parameter is None
            else {
                "name": one.parameter.name,
                "now": number(one.parameter.now),
                "suggested": number(one.parameter.suggested),
            },
            "source": f"{one.source}, {one.address}",
        }
        for one in advice
    ]


def advice_line(one: Advice) -> str:
    """Return what to do and how to tell, as a sentence or two.

    Examples
    --------
    >>> advice_line(Advice("Weigh it", "Less is better", None, "a page", "an address"))
    'Weigh it. Less is better.'
    """
    return f"{_ended(advised_words(one))} {_ended(one.why)}"


def advised_words(one: Advice) -> str:
    """Return what to do, with the parameter where the words do not hold it."""
    named = one.parameter
    if named is None or named.name in one.do:
        return one.do
    if named.now is None and named.suggested is None:
        return one.do
    told = setting_words(named)
    return f"{one.do} ({told})" if named.suggested is None else f"{one.do}; set {told}"


def first_steps(
    analysis: Analysis, checks: Sequence[Check] = (), most: int = MOST
) -> tuple[str, ...]:
    """Return what to do first about a flight, a line each, the last one what to record next time.

    Parameters
    ----------
    analysis : Analysis
    checks : sequence of Check
        Of the set-up, by ``fdi.methods.setup.check_setup``; those that are wrong go first.
    most : int
        Lines at the most.
    """
    steps = first_advice(analysis, checks)
    now = [one for one in steps if one.when == "now"]
    later = [one for one in steps if one.when != "now"][:1]
    told = [advice_line(one) for one in now[: most - len(later)]]
    return (*told, *(f"Next time: {_lower(advised_words(one))}." for one in later))[:most]


def first_advice(analysis: Analysis, checks: Sequence[Check] = ()) -> tuple[Advice, ...]:
    """Return all that is advised about a flight at first, in order, each once."""
    wrong = [one for one in checks if one.verdict == "wrong"]
    carries, others = (
        [about_check(one, analysis.log)[:2] for one in wrong if (one.name in CARRIES) == is_so]
        for is_so in (True, False)
    )
    first = [one.advice for one in analysis.findings[:1]]
    ended = last_end(analysis)
    end = ended.advice if ended is not None else about_no_flight(analysis.log, analysis.system)
    # of a crash that nobody is accused of what it was comes before what else is set up wrongly
    is_crash = ended is not None and ended.end.is_bad and not first
    told = (end, *others) if is_crash else (*others, *first, end)
    untested = () if analysis.findings else _untested(analysis)
    return tuple(dict.fromkeys(chain(*carries, *told, untested)))


def last_end(analysis: Analysis) -> Ending | None:
    """Return the end to tell first: of the flight that ended worst, or else of the last."""
    endings = analysis.diagnosis.endings
    worst = gravest([one.end for one in endings])
    return next((one for one in endings if one.end is worst), endings[-1] if endings else None)


def _untested(analysis: Analysis) -> list[Advice]:
    """Return what would have to be recorded for the parts that no test saw."""
    told = (one for part in analysis.not_testable for one in part.advice)
    return [one for one in told if one.when != "now"]


def _ended(words: str) -> str:
    return words if words.endswith(("?", ".", "!")) else f"{words}."


def _lower(words: str) -> str:
    return words[:1].lower() + words[1:]
