"""What did the voter of a log itself conclude?

In: a log. Out: `Recorded`, the rows of ``redundancy_selection``; and how a replay differs from it.
It is for comparison: of it a replay is given the times of the cycles at the most, never a content.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.methods.voting.flags import boot_us
from fdi.methods.voting.replay import Replay
from fdi.methods.voting.rules import Bools, Ints
from fdi.methods.voting.settings import Settings
from fdi.telemetry import Log

TOPIC: Final = "redundancy_selection"
_MOST: Final = 16  # autopilots, of which a topic could have fields


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """What a log's own voter concluded.

    Attributes
    ----------
    t : (m,) int, us
        Its cycles.
    vote, best : (m,) int
        The number of the autopilot voted for, and the smallest priority.
    priorities, counters, healthy : (m, n) int
        By the numbers of the autopilots.
    counted : (m, n, f) bool or None
        Errors that count, by the flags of the settings; an older program recorded none. False for
        a flag that it did not compare.
    """

    t: Ints
    vote: Ints
    best: Ints
    priorities: Ints
    counters: Ints
    healthy: Ints
    counted: Bools | None

    def shifted(self, by: int) -> Recorded:
        """Return the same on another clock, us."""
        return replace(self, t=self.t + by)


def recorded_of(log: Log, settings: Settings) -> Recorded | None:
    """Return what a log's voter concluded, None where the log has no such record."""
    if TOPIC not in log or not len(log[TOPIC]):
        return None
    message = log[TOPIC]
    n = next(k for k in range(_MOST) if f"pilot{k + 1}_priority" not in message)
    fields = ("pilot_selection", "best_pilot_priority", "pilot1_error_count", "pilot1_healthy")
    if n == 0 or any(name not in message for name in fields):
        return None
    numbers = range(1, n + 1)

    def column(name: str) -> Ints:
        return np.nan_to_num(message.si(name), nan=-1.0).astype(np.int64)

    def columns(name: str) -> Ints:
        return np.stack([column(f"pilot{k}_{name}") for k in numbers], axis=-1)

    counted = None
    if any(f"{name}_1" in message for name in settings.flags):
        none = np.zeros(len(message), np.int64)
        rows = [
            [column(f"{f}_{k}") if f"{f}_{k}" in message else none for f in settings.flags]
            for k in numbers
        ]
        counted = np.moveaxis(np.array(rows) > 0, -1, 0)
    return Recorded(
        np.rint(message.t * 1e6).astype(np.int64) + boot_us(log),
        column("pilot_selection"),
        column("best_pilot_priority"),
        columns("priority"),
        columns("error_count"),
        columns("healthy"),
        counted,
    )


def differing_cycles(found: Replay, stated: Recorded) -> Mapping[str, int]:
    """Return in how many cycles each quantity of a replay differs from the record.

    Parameters
    ----------
    found : Replay
        At the recorded cycles, of as many autopilots.
    stated : Recorded

    Returns
    -------
    mapping of str to int
        ``vote``, ``best``, ``priorities``, ``counters``, ``healthy``, ``counted`` where that is
        recorded, ``compared`` (cycles that the replay left out), and ``any``.
    """
    differs = {
        "vote": found.vote + 1 != stated.vote,
        "best": found.best != stated.best,
        "priorities": np.any(found.priorities != stated.priorities, axis=-1),
        "counters": np.any(found.counters != stated.counters, axis=-1),
        "healthy": np.any(found.healthy != (stated.healthy > 0), axis=-1),
        "compared": ~found.is_open,
    }
    if stated.counted is not None:
        differs["counted"] = np.any(found.counted != stated.counted, axis=(-2, -1))
    total = np.any(np.stack(list(differs.values())), axis=0)
    return {**{name: int(rows.sum()) for name, rows in differs.items()}, "any": int(total.sum())}
