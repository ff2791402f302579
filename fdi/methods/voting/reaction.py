"""How long did detection and take-over take?

In: what every autopilot concluded, at the times that are shown and at any phase. Out: a `Reaction`
for every autopilot that was voted out: the first sign of it in the inputs, each vote that changed,
when most votes had, and between which times the program that counts the votes took it over.

Detection is the first changed vote, take-over the count that follows the majority, as the thesis
has them in its table 6.1; both count from the onset, which somebody has to state (an injection is
not to be read out of the log's texts), else from the first sign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

import numpy as np

from fdi.methods.voting.recorded import Recorded
from fdi.methods.voting.replay import Replay
from fdi.methods.voting.rules import Ints
from fdi.methods.voting.settings import Settings, microseconds
from fdi.methods.voting.views import Witness
from fdi.shown import Shown

THESIS: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {"GPS": (6.0, 10.0), "magnetometer": (43.0, 46.0), "communication": (4.0, 7.0)}
)
"""s, detection and replacement of the autopilot in charge by the thesis, table 6.1."""


class Range(NamedTuple):
    """The earliest and the latest time, us."""

    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Change:
    """A vote that changed.

    Attributes
    ----------
    voter : int
        Number of the autopilot that changed its vote.
    is_inferred : bool
        Whether it has no log of its own.
    at : int, us
        In the cycles that are shown.
    any_phase : Range or None
        Over all phases of a free-running cycle; None where it does not change at every phase.
    recorded : int or None
        us, by the log's own voter.
    """

    voter: int
    is_inferred: bool
    at: int
    any_phase: Range | None
    recorded: int | None


@dataclass(frozen=True, slots=True)
class Reaction(Shown):
    """One autopilot is voted out.

    Attributes
    ----------
    pilot, to : int
        Numbers of the one that was voted for, and of the one that is from then on.
    cause : {"errors", "silence"}
    onset : int or None
        us, as stated.
    sign : int or None
        us; when its flags were lost that count as errors, or the stamp of its last message. None
        where it was never heard of.
    changes : tuple of Change
        In the order of time; of each autopilot the first.
    majority : int or None
        us; when enough votes had changed; None where that does not come.
    majority_any_phase : Range or None
    takeover : Range or None
        us; the counts of votes that can follow, in the cycles that are shown.
    takeover_any_phase : Range or None
    """

    pilot: int
    to: int
    cause: Literal["errors", "silence"]
    onset: int | None
    sign: int | None
    changes: tuple[Change, ...]
    majority: int | None
    majority_any_phase: Range | None
    takeover: Range | None
    takeover_any_phase: Range | None

    @property
    def detected(self) -> int:
        """When the first vote changed, us; inferred ones count where there is no other."""
        return self._seen[0].at

    @property
    def detected_any_phase(self) -> Range | None:
        """When the first of these votes changes at any phase, us."""
        found = [change.any_phase for change in self._seen if change.any_phase is not None]
        if not found:
            return None
        return Range(min(one.low for one in found), min(one.high for one in found))

    @property
    def _seen(self) -> tuple[Change, ...]:
        own = tuple(change for change in self.changes if not change.is_inferred)
        return own or self.changes


def reactions(
    voters: Sequence[Witness],
    shown: Sequence[Replay],
    free: Sequence[Replay],
    stated: Sequence[Recorded | None],
    settings: Settings,
    onset: int | None,
) -> tuple[Reaction, ...]:
    """Return every autopilot that was voted out, in the order of time.

    Parameters
    ----------
    voters, shown, free, stated : sequences
        By autopilot: who it is, the cycles that are shown, those of all phases, and the record.
    settings : Settings
    onset : int or None
        us.
    """
    numbers = [voter.number for voter in voters]
    found: dict[tuple[int, int], list[tuple[int, Change]]] = {}
    for place, voter in enumerate(voters):
        for pair, row in _first_changes(shown[place]).items():
            record = stated[place]
            change = Change(
                voter.number,
                voter.is_inferred,
                int(shown[place].t[row]),
                _of_any_phase(free[place], pair),
                None
                if record is None
                else _first(record.t, record.vote, (numbers[pair[0]], numbers[pair[1]])),
            )
            found.setdefault(pair, []).append((place, change))
    made = []
    for pair, changes in found.items():
        changes.sort(key=lambda item: (item[1].at, item[0]))
        first = changes[0][0]
        made.append(
            _reaction(
                pair,
                [change for _, change in changes],
                numbers,
                settings,
                onset,
                _why(pair[0], voters[first], shown[first], changes[0][1].at),
            )
        )
    return tuple(sorted(made, key=lambda one: (one.detected, one.pilot)))


def _first_changes(replay: Replay) -> dict[tuple[int, int], int]:
    """Return by (from, to) the first row in which a vote changes so."""
    rows = (np.flatnonzero(np.diff(replay.vote)) + 1).tolist()
    found: dict[tuple[int, int], int] = {}
    for row in rows:
        found.setdefault((int(replay.vote[row - 1]), int(replay.vote[row])), row)
    return found


def _reaction(
    pair: tuple[int, int],
    changes: list[Change],
    numbers: list[int],
    settings: Settings,
    onset: int | None,
    why: tuple[Literal["errors", "silence"], int | None],
) -> Reaction:
    n, (old, new) = len(numbers), pair
    needed = n // 2 if n % 2 == 0 and new < old else n // 2 + 1  # the lower number wins a draw
    at = sorted(change.at for change in changes)
    ranges = [change.any_phase for change in changes if change.any_phase is not None]
    hold = microseconds(settings.selection_hold)
    majority = at[needed - 1] if len(at) >= needed else None
    of_any = None
    if len(ranges) >= needed:
        lows, highs = sorted(r.low for r in ranges), sorted(r.high for r in ranges)
        of_any = Range(lows[needed - 1], highs[needed - 1])
    return Reaction(
        pilot=numbers[old],
        to=numbers[new],
        cause=why[0],
        onset=onset,
        sign=why[1],
        changes=tuple(changes),
        majority=majority,
        majority_any_phase=of_any,
        takeover=None if majority is None else Range(majority, majority + hold),
        takeover_any_phase=None if of_any is None else Range(of_any.low, of_any.high + hold),
    )


def _first(t: Ints, votes: Ints, pair: tuple[int, int]) -> int | None:
    """Return when a vote first changes from one to another, us."""
    rows = np.flatnonzero((votes[:-1] == pair[0]) & (votes[1:] == pair[1]))
    return int(t[rows[0] + 1]) if rows.size else None


def _of_any_phase(free: Replay, pair: tuple[int, int]) -> Range | None:
    found = [_first(t, votes, pair) for t, votes in zip(free.t, free.vote, strict=True)]
    known = [at for at in found if at is not None]
    return Range(min(known), max(known)) if len(known) == len(found) and known else None


def _why(
    pilot: int, voter: Witness, replay: Replay, at: int
) -> tuple[Literal["errors", "silence"], int | None]:
    """Return why a voter left an autopilot, and the first sign of that in what it knew, us."""
    row = int(np.searchsorted(replay.t, at))
    samples = voter.view.samples[pilot]
    before = samples.t <= at
    if not replay.counted[row, pilot].any():
        return "silence", int(samples.sent[before][-1]) if before.any() else None
    bad = samples.bad[before][:, replay.counted[row, pilot]] == 1
    signs = []
    for flag in bad.T:
        good = np.flatnonzero(~flag)
        start = int(good[-1]) + 1 if good.size else 0
        if start < flag.size:
            signs.append(int(samples.t[before][start]))
    return "errors", min(signs, default=None)
