"""What do the labelled flights score by weights that have not seen them?

In: labelled flights with what their tests did. Out: a score for each, by weights that were fitted
without its likes. What its likes are is asked three ways (`LEFT_OUT`): the same recording in any
format; the flights on which the same kind of component failed; those of the same origin.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fdi.diagnosis.answer import named_in
from fdi.diagnosis.likelihood import Fitted
from fdi.diagnosis.naming import Cause, doubted
from fdi.evaluation.fitting import Flown, fit, lessons_of
from fdi.evaluation.score import Score, score

LEFT_OUT: Final[Mapping[str, Callable[[Flown], frozenset[str]]]] = {
    "recording": lambda one: frozenset({one.recording}),
    "component": lambda one: one.components,
    "origin": lambda one: frozenset({one.origin}),
}
"""What a flight has in common with its likes."""


@dataclass(frozen=True, slots=True)
class Unseen:
    """Scores and the findings they come from, in the order of the flights."""

    scores: tuple[Score, ...]
    rows: tuple[Mapping[str, Any], ...]


def unseen(flights: Sequence[Flown], by: str) -> Unseen:
    """Return the scores of flights by weights that have seen none of their likes.

    Parameters
    ----------
    flights : sequence of Flown
    by : str
        One of `LEFT_OUT`.

    Raises
    ------
    UsageError
        What is left teaches nothing.
    """
    taught = lessons_of(flights)
    likes = [LEFT_OUT[by](one) for one in flights]
    fits: dict[tuple[frozenset[str], str], Fitted] = {}
    rows = []
    for one, own in zip(flights, likes, strict=True):
        key = (own, one.recording)
        if key not in fits:
            kept = [
                lessons
                for lessons, other, its in zip(taught, flights, likes, strict=True)
                if not its & own and other.recording != one.recording
            ]
            fits[key] = fit(kept).fitted
        rows.append(row_of(one, fits[key]))
    scores = tuple(
        score(one.label, row, row_of(_without_commands(one), fits[own, one.recording]))
        for one, own, row in zip(flights, likes, rows, strict=True)
    )
    return Unseen(scores, tuple(rows))


def row_of(flown: Flown, fitted: Fitted) -> dict[str, Any]:
    """Return what is said of a flight by some weights, as a row of the fleet has it."""
    causes, effects = named_in(flown.inquiries, fitted)
    kept = doubted(causes, effects, flown.inquiries, fitted)
    return {
        "findings": [_finding(rank, cause) for rank, cause in enumerate(causes, 1)],
        "consequences": list(dict.fromkeys(one.component for one in effects)),
        "ruled_out": [name for name in flown.clearable if name not in kept],
        "not_testable": [],
        "airborne_s": sum(one.end - one.start for one in flown.inquiries),
        "error": None,
    }


def _finding(rank: int, cause: Cause) -> dict[str, Any]:
    return {
        "rank": rank,
        "flight": cause.flight,
        "component": cause.component,
        "onset_s": cause.onset,
        "alarm_s": cause.alarm,
        "confidence": cause.probability,
    }


def _without_commands(flown: Flown) -> Flown:
    """Return a flight as it looks without the tests that read a recorded command."""
    inquiries = tuple(one.without_commands() for one in flown.inquiries)
    return Flown(flown.label, inquiries, flown.origin, flown.clearable)
