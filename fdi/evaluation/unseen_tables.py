"""How are figures out of sample told? As a text table, and as plain values.

In: labelled flights with what their tests did. Out: for every way of leaving likes out, and every
labels file, the figures of weights that have not seen the flights they are scored on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

from fdi.errors import UsageError
from fdi.evaluation.calibration import Judged, brier, brier_of_constant, stated
from fdi.evaluation.fitting import Flown
from fdi.evaluation.run import Evaluation
from fdi.evaluation.score import Score
from fdi.evaluation.totals import Rate, Totals, totals
from fdi.evaluation.unseen import LEFT_OUT, unseen
from fdi.report.words import clean

SURE: Final = 0.9
"""An accusation given so much is called sure."""
_HEAD: Final = (
    "left out",
    "flights of",
    "named first",
    "timely",
    "detected",
    "without command evidence",
    "healthy clean",
    "false/h",
    "wrong",
    "cleared wrongly",
    "Brier (constant)",
    f"right at {SURE} and above",
    "delay s of steps, of ramps",
)


@dataclass(frozen=True, slots=True)
class Figures:
    """What weights that have not seen the flights of one labels file score on them.

    Attributes
    ----------
    delays : tuple of (float or None)
        s, medians over steps and over ramps.
    """

    left_out: str
    source: str
    totals: Totals
    said: Judged
    delays: tuple[float | None, float | None]

    @property
    def sure(self) -> Rate:
        """Return how many of the sure accusations are right."""
        own = [right for confidence, right in self.said if confidence >= SURE]
        return Rate(sum(own), len(own))


def out_of_sample(flights: Sequence[Flown]) -> tuple[Figures, ...]:
    """Return the figures of every way of leaving likes out; none where nothing can be learned."""
    found = []
    for way in LEFT_OUT:
        try:
            made = unseen(flights, way)
        except UsageError:
            return ()
        for source in dict.fromkeys(one.label.source for one in flights):
            own = [i for i, one in enumerate(flights) if one.label.source == source]
            part = Evaluation(tuple(made.scores[i] for i in own), tuple(made.rows[i] for i in own))
            found.append(
                Figures(way, source, totals(part.scores), stated(part), _delays(part.scores))
            )
    return tuple(found)


def _delays(scores: Sequence[Score]) -> tuple[float | None, float | None]:
    kinds: tuple[list[float], list[float]] = ([], [])
    for one in scores:
        if one.delay is not None:
            kinds[any(fault.is_slow for fault in one.label.faults)].append(one.delay)
    steps, ramps = (median(own) if own else None for own in kinds)
    return steps, ramps


def unseen_lines(figures: Sequence[Figures]) -> Iterator[str]:
    """Yield the table, or why there is none."""
    if not figures:
        yield "Out of sample: these flights are too few to fit weights without some of them."
        return
    yield "By weights fitted without the flights that they are scored on:"
    yield ""
    yield f"| {' | '.join(_HEAD)} |"
    yield "| --- " * len(_HEAD) + "|"
    for one in figures:
        value = one.totals
        score, constant = brier(one.said), brier_of_constant(one.said)
        cells = [
            one.left_out,
            clean(_named(one.source)),
            *map(_share, (value.named, value.timely, value.detected, value.bare_named)),
            _share(value.clean),
            _number(value.false_per_hour),
            str(value.wrong),
            str(value.cleared),
            f"{_number(score, 3)} ({_number(constant, 3)})",
            _share(one.sure),
            ", ".join(_number(delay, 1) for delay in one.delays),
        ]
        yield f"| {' | '.join(cells)} |"


def unseen_document(figures: Sequence[Figures]) -> list[Mapping[str, Any]]:
    """Return the figures as plain values."""
    return [
        {
            "left_out": one.left_out,
            "labels": _named(one.source),
            **{
                name: {"hits": rate.hits, "of": rate.of}
                for name, rate in (
                    ("named", one.totals.named),
                    ("timely", one.totals.timely),
                    ("detected", one.totals.detected),
                    ("without_commands", one.totals.bare_named),
                    ("clean", one.totals.clean),
                    ("sure", one.sure),
                )
            },
            "false_per_hour": one.totals.false_per_hour,
            "wrong": one.totals.wrong,
            "cleared_wrongly": one.totals.cleared,
            "brier": brier(one.said),
            "brier_of_constant": brier_of_constant(one.said),
            "delay_of_steps_s": one.delays[0],
            "delay_of_ramps_s": one.delays[1],
        }
        for one in figures
    ]


def _named(source: str) -> str:
    """Return a labels file by its folder's name and its own: paths differ between machines."""
    path = Path(source)
    return f"{path.resolve().parent.name}/{path.name}"


def _share(rate: Rate) -> str:
    return "–" if rate.share is None else f"{rate.hits}/{rate.of} {rate.share:.0%}"


def _number(value: float | None, digits: int = 2) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
