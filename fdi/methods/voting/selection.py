"""Which autopilot does the program that counts the votes put in charge, and when?

In: the votes of all over time. Out: `Selection`, the counts. The program waits until all have voted
since its last count (or as many as the quorum asks for), takes the one with most votes, the lowest
number among equals (of three different votes: autopilot 1), and then sleeps. It runs outside the
autopilots; when it began is not recorded, so a count can lie anywhere within its sleep.

The trap for a maintainer: an autopilot that stops voting stops a program that waits for all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fdi.methods.voting.rules import NEVER, Ints
from fdi.methods.voting.settings import Settings, microseconds

FOREVER = 1 << 60
"""us; when a vote comes that never comes."""


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The counts; leading axes are cases.

    Attributes
    ----------
    t : (..., c) int, us
        Ascending; `FOREVER` where no count follows.
    selected : (..., c) int
        Place of the autopilot in charge from there on.
    """

    t: Ints
    selected: Ints


def select(t: Ints, votes: Ints, settings: Settings) -> Selection:
    """Return every count of the votes.

    Parameters
    ----------
    t : (..., n, k) int, us
        When each autopilot voted, ascending; `FOREVER` for a vote that never came.
    votes : (..., n, k) int
        Places of those voted for.
    settings : Settings
        ``quorum`` and ``selection_hold``.
    """
    n = t.shape[-2]
    quorum = n if settings.quorum is None else min(settings.quorum, n)
    hold = microseconds(settings.selection_hold)
    last = np.full(t.shape[:-2], NEVER, np.int64)
    wake = last
    selected = np.zeros(t.shape[:-2], np.int64)
    counts, choices = [], []
    end = np.where(t < FOREVER, t, NEVER).max(axis=(-2, -1))
    for _ in range(t.shape[-1]):
        fresh = np.where(t > last[..., None, None], t, FOREVER).min(axis=-1)
        count = np.maximum(np.sort(fresh, axis=-1)[..., quorum - 1], wake)
        is_made = count <= end
        if not is_made.any():
            break
        selected = np.where(is_made, _most_voted(t, votes, last, count), selected)
        count = np.where(is_made, count, FOREVER)
        counts.append(count)
        choices.append(selected)
        last, wake = count, np.where(is_made, count + hold, FOREVER)
    if not counts:
        nothing = np.zeros((*t.shape[:-2], 0), np.int64)
        return Selection(nothing, nothing)
    return Selection(np.stack(counts, axis=-1), np.stack(choices, axis=-1))


def _most_voted(t: Ints, votes: Ints, last: Ints, count: Ints) -> Ints:
    """Return who has most of the latest votes that came after the last count."""
    is_in_time = (t > last[..., None, None]) & (t <= count[..., None, None])
    latest = is_in_time.shape[-1] - 1 - np.argmax(is_in_time[..., ::-1], axis=-1)
    vote = np.take_along_axis(votes, latest[..., None], axis=-1)[..., 0]
    has_voted = is_in_time.any(axis=-1)
    n = t.shape[-2]
    of_each = [np.sum(has_voted & (vote == place), axis=-1) for place in range(n)]
    most: Ints = np.argmax(np.stack(of_each, axis=-1), axis=-1)
    return most
