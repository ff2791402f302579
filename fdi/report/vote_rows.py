"""Which rows do text, tables, figure and JSON of a voting share?

In: a `Voting`. Out: votes as runs of time, errors with the times from which they were blamed and
counted, reaction times after the onset. Times are seconds of the first log's clock.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.methods.voting import Reaction, Voting
from fdi.methods.voting.reaction import Range
from fdi.methods.voting.selection import FOREVER
from fdi.methods.voting.voting import Voter

_PAUSE_CYCLES: Final = 2.0
"""So many cycles apart, two cycles have a pause between them."""


class Run(NamedTuple):
    """A value that holds from one time to another, s."""

    start: float
    end: float
    value: int


class ErrorRow(NamedTuple):
    """A flag that an autopilot blamed: of whom, from when to when it was blamed, and counted, s.

    ``counted_from`` and ``counted_until`` are None where it never counted, and where it counts to
    the end.
    """

    seen_by: int
    autopilot: int
    flag: str
    blamed_from: float
    blamed_until: float
    counted_from: float | None
    counted_until: float | None


class Times(NamedTuple):
    """Reaction times, s after the onset, or where none is stated after the first sign.

    ``low`` and ``high``: the range over all phases of the cycle; None where the vote does not
    change at every phase.
    """

    detection: float
    detection_range: tuple[float, float] | None
    takeover: tuple[float, float] | None
    takeover_range: tuple[float, float] | None


def runs(t: NDArray[np.float64], values: NDArray[np.int64]) -> list[Run]:
    """Return the runs of equal values; the last one ends at the last time.

    Examples
    --------
    >>> runs(np.array([0.0, 1.0, 2.0]), np.array([1, 1, 2]))
    [Run(start=0.0, end=2.0, value=1), Run(start=2.0, end=2.0, value=2)]
    """
    if not t.size:
        return []
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), t.size]
    return [
        Run(float(t[low]), float(t[min(high, t.size - 1)]), int(values[low]))
        for low, high in pairwise(edges)
    ]


def times(found: Voting, voter: Voter) -> NDArray[np.float64]:
    """Return the times of an autopilot's cycles, s."""
    seconds: NDArray[np.float64] = (voter.replay.t - found.zero) / 1e6
    return seconds


def vote_runs(found: Voting, voter: Voter) -> list[Run]:
    """Return whom an autopilot voted for, by number."""
    return runs(times(found, voter), np.array(found.numbers)[voter.replay.vote])


def pauses(found: Voting, voter: Voter) -> list[tuple[float, float]]:
    """Return from when to when an autopilot compared nothing, s.

    The gate was closed, or there are no cycles: the record holds those with a comparison only.
    """
    t = times(found, voter)
    is_open = voter.replay.is_open[:-1]
    is_pause = ~is_open | (np.diff(t) > _PAUSE_CYCLES * found.settings.cycle)
    spans = runs(t, np.append(is_pause, is_pause[-1:]).astype(np.int64))
    return [(run.start, run.end) for run in spans if run.value]


def selected_runs(found: Voting) -> list[Run]:
    """Return who was in charge by the counts of the votes, by number."""
    is_made = found.selection.t < FOREVER
    t = (found.selection.t[is_made] - found.zero) / 1e6
    return runs(t, np.array(found.numbers)[found.selection.selected[is_made]])


def error_rows(found: Voting) -> Iterator[ErrorRow]:
    """Yield every flag that was blamed for a while, by who saw it, autopilot, flag and time."""
    for voter in found.voters:
        t = times(found, voter)
        for place, number in enumerate(found.numbers):
            for index, flag in enumerate(found.settings.flags):
                blamed = voter.replay.blamed[:, place, index]
                counted = voter.replay.counted[:, place, index]
                counts = [run for run in runs(t, counted.astype(np.int64)) if run.value]
                for run in runs(t, blamed.astype(np.int64)):
                    if run.value:
                        own = [c for c in counts if run.start <= c.start <= run.end]
                        yield ErrorRow(
                            voter.number,
                            number,
                            flag,
                            run.start,
                            run.end,
                            own[0].start if own else None,
                            own[0].end if own and own[0].end < t[-1] else None,
                        )


def grouped_errors(found: Voting) -> list[tuple[ErrorRow, tuple[int, ...]]]:
    """Return the errors, those that several autopilots saw at the same times once, with who did."""
    seen_by: dict[ErrorRow, list[int]] = {}
    for row in error_rows(found):
        seen_by.setdefault(row._replace(seen_by=0), []).append(row.seen_by)
    return [(row, tuple(voters)) for row, voters in seen_by.items()]


def silent_runs(found: Voting, voter: Voter, place: int) -> list[Run]:
    """Return from when to when an autopilot took another one, at a place, for silent."""
    marks = voter.replay.silent[:, place].astype(np.int64)
    return [run for run in runs(times(found, voter), marks) if run.value]


def base(reaction: Reaction) -> int:
    """Return from when reaction times count, us: the onset, else the first sign, else the vote."""
    known = (reaction.onset, reaction.sign, reaction.detected)
    return next(at for at in known if at is not None)


def reaction_times(reaction: Reaction) -> Times:
    """Return how long detection and take-over took, s."""
    zero = base(reaction)

    def after(found: Range | None) -> tuple[float, float] | None:
        return None if found is None else ((found.low - zero) / 1e6, (found.high - zero) / 1e6)

    return Times(
        (reaction.detected - zero) / 1e6,
        after(reaction.detected_any_phase),
        after(reaction.takeover),
        after(reaction.takeover_any_phase),
    )
