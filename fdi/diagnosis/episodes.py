"""One finding for one part: of several accusations of it in a flight, which is the failure?

In: the causes of one flight and what follows from them. Out: the same with one cause for every
component. It is dated by the episode that lasts: of those that still stood when the flight went
wrong, else of all, the longest. An earlier one belongs to it where the pause between the two was
shorter than the earlier one; what healed for longer than it had lasted is kept as an earlier moment
of the same part. Later ones belong to it: what failed stays failed. How probable it is that the
part failed is what the surest of the episodes says. Where of the parts of an accused component one
is accused soon after it (a motor after the propulsion), the two are one failure, that of the part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fdi.diagnosis.ending import led_to
from fdi.diagnosis.hypotheses import Inquiry
from fdi.diagnosis.naming import LINKED_S, Cause, Effect
from fdi.telemetry.ends import FlightEnd


def joined(
    causes: Sequence[Cause], effects: Sequence[Effect], inquiry: Inquiry
) -> tuple[list[Cause], list[Effect]]:
    """Return one cause for every component of a flight, and the effects of what it keeps.

    Parameters
    ----------
    causes : sequence of Cause
        Of one flight.
    effects : sequence of Effect
        Of these causes.
    inquiry : Inquiry
        Of the same flight.
    """
    named = {cause: _part(cause, causes, inquiry) for cause in causes}
    own: dict[str, list[Cause]] = {}
    for cause in causes:
        own.setdefault(named[cause], []).append(replace(cause, component=named[cause]))
    merged: dict[str, Cause] = {}
    healed: set[Cause] = set()  # under the name of the part
    for component, episodes in own.items():
        episodes.sort(key=lambda one: (one.onset, one.end))
        first = _first_that_lasts(episodes, inquiry.ending)
        healed.update(episodes[:first])
        merged[component] = _merged(episodes, first)
    kept = [
        replace(one, cause=merged[named[one.cause]])
        for one in effects
        if replace(one.cause, component=named[one.cause]) not in healed
    ]
    return list(merged.values()), kept


def _part(cause: Cause, causes: Sequence[Cause], inquiry: Inquiry) -> str:
    """Return whom a cause is of: the one part of its component that is accused soon after it."""
    listed = inquiry.whom.components
    parts = {
        other.component
        for other in causes
        if listed[other.component].part_of == cause.component
        and cause.onset <= other.onset <= cause.end + LINKED_S
    }
    return parts.pop() if len(parts) == 1 else cause.component


def _first_that_lasts(episodes: Sequence[Cause], ending: FlightEnd | None) -> int:
    """Return the place of the episode, of several in the order of onset, that dates the failure."""
    bad = ending if ending is not None and ending.is_bad else None
    place = max(
        range(len(episodes)),
        key=lambda i: (
            bad is not None and led_to(bad, episodes[i].flight, episodes[i].end),
            episodes[i].end - episodes[i].onset,
            -i,
        ),
    )
    while place > 0:
        before = episodes[place - 1]
        if episodes[place].onset - before.end > before.end - before.onset:
            break
        place -= 1
    return place


def _merged(episodes: Sequence[Cause], first: int) -> Cause:
    """Return one cause of several episodes: what came before the ``first`` had healed."""
    surest = max(episodes, key=lambda one: one.probability)
    runs = {run for one in episodes[first:] for run in one.runs}
    return replace(
        episodes[first],
        runs=tuple(sorted(runs, key=lambda run: (run.onset, run.row))),
        probability=surest.probability,
        rivals=surest.rivals,
        because=surest.because,
        earlier=tuple((one.onset, one.end) for one in episodes[:first]),
    )
