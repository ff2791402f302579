"""Which autopilot do the voters of a flight select, when and why?

In: logs of one to n autopilots of one vehicle, `Settings`. Out: `Voting`: what each autopilot could
know, what it concludes from it cycle by cycle, who is selected, how long that took, and how it
compares with what the logs' own voter wrote.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final, NamedTuple

import numpy as np

from fdi.errors import UsageError
from fdi.methods.voting.clocks import offsets
from fdi.methods.voting.flags import LogFlags, boot_us, flags_of
from fdi.methods.voting.reaction import Reaction, reactions
from fdi.methods.voting.recorded import Recorded, differing_cycles, recorded_of
from fdi.methods.voting.replay import PHASES, Replay, free_cycles, replay
from fdi.methods.voting.rules import Ints
from fdi.methods.voting.selection import FOREVER, Selection, select
from fdi.methods.voting.settings import PRESETS, Settings, microseconds
from fdi.methods.voting.views import Witness, witnesses
from fdi.shown import clean
from fdi.telemetry import Log

_SAME_CYCLE: Final = 0.02
"""Share by which a recorded cycle may differ from the one asked for: 1.000 to 1.004 s occur."""


class Placed(NamedTuple):
    """A log: its name, its autopilot, and what was added to its times, s."""

    name: str
    number: int
    offset: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Voter:
    """One autopilot and what it concludes.

    Attributes
    ----------
    number : int
    log : str or None
        The file; None where the autopilot is inferred from what others received.
    witness : Witness
    replay : Replay
        At the recorded cycles, or free running at one phase.
    free : Replay
        Free running, a leading axis of phases.
    is_at_record : bool
        Whether the cycles of ``replay`` are the recorded ones.
    recorded : Recorded or None
        What the log's own voter wrote.
    differing : mapping of str to int, or None
        In how many cycles ``replay`` differs from the record, by quantity.
    """

    number: int
    log: str | None
    witness: Witness
    replay: Replay
    free: Replay
    is_at_record: bool
    recorded: Recorded | None
    differing: Mapping[str, int] | None

    def __repr__(self) -> str:
        return (
            f"<Voter {self.number}: {clean(self.log or 'inferred')}, {self.replay.t.size} cycles>"
        )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Voting:
    """What the voters of a flight conclude.

    Attributes
    ----------
    settings : Settings
    voters : tuple of Voter
        By number.
    selection : Selection
        The counts of votes, the first as soon as all have voted.
    reactions : tuple of Reaction
        Who was voted out, and how soon.
    zero : int
        us, t = 0 of the first log on the clock that all times of this value are of.
    logs : tuple of Placed
        The logs, in the order given.
    onset : float or None
        s of the first log, as stated.
    notes : tuple of str
        What was missing, inferred or not used.
    """

    settings: Settings
    voters: tuple[Voter, ...]
    selection: Selection
    reactions: tuple[Reaction, ...]
    zero: int
    logs: tuple[Placed, ...]
    onset: float | None
    notes: tuple[str, ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of the autopilots."""
        return tuple(voter.number for voter in self.voters)

    def seconds(self, us: int) -> float:
        """Return a time as seconds of the first log's clock."""
        return (us - self.zero) / 1e6

    def __repr__(self) -> str:
        out = ", ".join(
            f"{one.pilot} voted out at {self.seconds(one.detected):.1f} s" for one in self.reactions
        )
        return (
            f"<Voting of {len(self.voters)} autopilots, rules {self.settings.name}: "
            f"{out or 'nobody is voted out'}>"
        )

    def _repr_html_(self) -> str:
        return f"<code>{escape(repr(self))}</code>"


def vote(
    logs: Log | Sequence[Log],
    settings: Settings | str = "recorded",
    *,
    onset: float | None = None,
    phase: float | None = None,
) -> Voting:
    """Return what the voters of a flight conclude from the flags in their logs.

    Parameters
    ----------
    logs : Log or sequence of Log
        Of the autopilots of one vehicle, in any order; the first one's clock is that of all
        answers. One is enough if it holds the flags that it received from the others.
    settings : Settings or str
        Parameters, or the name of a preset: ``recorded``, ``thesis``.
    onset : float, optional
        s of the first log's clock; when something failed, from which reactions are counted.
    phase : float, optional
        s; the cycles run freely, this long after each autopilot's first record. By default they are
        the recorded ones, where a log has them and they have the period that is asked for.

    Raises
    ------
    UsageError
        The logs are not of one flight, or an argument is not possible.
    LogError
        A log holds none of the flags, or a single one nothing of the others.

    References
    ----------
    Thesis, section 4.3 (comparison, silence, priorities, votes), figures 4.16 and 4.17.
    """
    logs = [logs] if isinstance(logs, Log) else list(logs)
    if not logs:
        raise UsageError("no log is given")
    settings = preset(settings) if isinstance(settings, str) else settings
    _check_times(settings, onset, phase, logs[0].span)
    found = [flags_of(log, settings) for log in logs]
    shifts = offsets(logs)
    zero = boot_us(logs[0])
    moved = [
        flags.shifted(microseconds(shift) + zero - boot_us(log))
        for flags, log, shift in zip(found, logs, shifts, strict=True)
    ]
    known = {one.number: one for one in moved}
    placed = _placed(logs, moved, shifts)
    names = {one.number: one.name for one in placed}
    records = {}
    for one, log, shift in zip(moved, logs, shifts, strict=True):
        stated = recorded_of(log, settings)
        if stated is not None:
            records[one.number] = stated.shifted(microseconds(shift) + zero - boot_us(log))
    seen = witnesses(known, names, settings)
    voters = _voters(seen, names, records, settings, phase)
    return Voting(
        settings=settings,
        voters=voters,
        selection=_selection(voters, settings),
        reactions=reactions(
            seen,
            [voter.replay for voter in voters],
            [voter.free for voter in voters],
            [voter.recorded for voter in voters],
            settings,
            None if onset is None else microseconds(onset) + zero,
        ),
        zero=zero,
        logs=placed,
        onset=onset,
        notes=_notes(known, names, seen, settings),
    )


def preset(name: str) -> Settings:
    """Return the settings of a preset.

    Raises
    ------
    UsageError
        There is none of that name.
    """
    if name not in PRESETS:
        raise UsageError(f"no preset is called {name!r}", hint=f"known: {', '.join(PRESETS)}")
    return PRESETS[name]


def _placed(
    logs: Sequence[Log], flags: Sequence[LogFlags], shifts: Sequence[float]
) -> tuple[Placed, ...]:
    """Return the logs with names that tell them apart: by their paths where file names do not."""
    is_told = len({log.name for log in logs}) == len(logs)
    return tuple(
        Placed(log.name if is_told else str(log.path), one.number, shift)
        for log, one, shift in zip(logs, flags, shifts, strict=True)
    )


def _check_times(
    settings: Settings, onset: float | None, phase: float | None, span: tuple[float, float]
) -> None:
    if onset is not None and not span[0] <= onset <= span[1]:
        raise UsageError(
            f"an onset at {onset:g} s is no time of the log",
            hint=f"it lasts from {span[0]:.1f} to {span[1]:.1f} s",
        )
    if phase is not None and not 0 <= phase < settings.cycle:
        raise UsageError(
            f"a phase of {phase:g} s is none of a cycle of {settings.cycle:g} s",
            hint="from 0 to less than the cycle",
        )


def _voters(
    seen: Sequence[Witness],
    names: Mapping[int, str],
    records: Mapping[int, Recorded],
    settings: Settings,
    phase: float | None,
) -> tuple[Voter, ...]:
    usable = {} if phase is not None else _of_the_cycle(records, settings)
    made = []
    for witness in seen:
        own = witness.view.samples[witness.view.own]
        span = int(own.t[0]), int(own.t[-1])
        stated = records.get(witness.number)
        # an inferred autopilot runs in step with the first that has a record
        cycles = usable.get(witness.number, next(iter(usable.values()), None))
        if cycles is None:
            share = np.array([(phase or 0.0) / settings.cycle])
            cycles = free_cycles(span, settings, share, records=own.t.size)[0]
        shown = replay(witness.view, cycles, settings)
        phases = np.arange(PHASES) / PHASES
        free = replay(
            witness.view, free_cycles(span, settings, phases, records=own.t.size), settings
        )
        is_comparable = (
            stated is not None
            and witness.number in usable
            and stated.counters.shape[-1] == len(seen)
            and [one.number for one in seen] == list(range(1, len(seen) + 1))
        )
        made.append(
            Voter(
                number=witness.number,
                log=names.get(witness.number),
                witness=witness,
                replay=shown,
                free=free,
                is_at_record=witness.number in usable,
                recorded=stated,
                differing=differing_cycles(shown, stated)
                if is_comparable and stated is not None
                else None,
            )
        )
    return tuple(made)


def _of_the_cycle(records: Mapping[int, Recorded], settings: Settings) -> dict[int, Ints]:
    """Return the recorded cycles that have the period asked for, by number."""
    found = {}
    for number, stated in records.items():
        period = np.median(np.diff(stated.t)) / 1e6 if stated.t.size > 1 else np.nan
        if abs(period - settings.cycle) <= _SAME_CYCLE * settings.cycle:
            found[number] = stated.t
    return found


def _selection(voters: Sequence[Voter], settings: Settings) -> Selection:
    """Return the counts of the votes that are shown."""
    longest = max(voter.replay.t.size for voter in voters)
    t = np.full((len(voters), longest), FOREVER, np.int64)
    votes = np.zeros((len(voters), longest), np.int64)
    for row, voter in enumerate(voters):
        t[row, : voter.replay.t.size] = voter.replay.t
        votes[row, : voter.replay.t.size] = voter.replay.vote
    return select(t, votes, settings)


def _notes(
    known: Mapping[int, LogFlags],
    names: Mapping[int, str],
    seen: Sequence[Witness],
    settings: Settings,
) -> tuple[str, ...]:
    lines = [f"{names[number]}: {note}" for number, log in known.items() for note in log.notes]
    inferred = [str(witness.number) for witness in seen if witness.is_inferred]
    if inferred:
        lines.append(
            f"there is no log of autopilot {' and '.join(inferred)}: votes are inferred from what "
            "others received, so that a link that it alone lost does not show"
        )
    if settings.cycle != PRESETS[settings.name].cycle and any(
        log.received for log in known.values()
    ):
        lines.append(
            "received flags come as often as they were recorded, whatever the cycle: what more "
            "messages would do, a simulation tells"
        )
    if not any(log.received for log in known.values()):
        lines.append(
            "no log holds received flags: each autopilot is taken to hear all others, so that "
            "nobody is silent before a log ends"
        )
    return tuple(lines)
