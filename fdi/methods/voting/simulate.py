"""How often is the wrong autopilot in charge, and of how many autopilots are three not enough?

In: a `Scenario`: how many autopilots, which of them fail how, how many messages are lost. Out: an
`Outcome`: shares over many random runs, each with its 95 % interval. The rules are those that
replay the logs (`rules.py`, `selection.py`); random are the phases of the cycles, which messages
are lost, how long they travel, and when the failure falls between two counts of the votes.

Kinds of failure, from the onset on:

- ``faulty``: its flags are bad and it says so; it votes as the rules tell it
- ``mute``: its messages to the others stop; it votes on (the published communication failure)
- ``dead``: neither messages nor votes
- ``stuck``: faulty, and it votes for itself whatever it knows
- ``lying``: faulty, but it says that all is well, and votes for itself

With ``outside`` the flags of every autopilot turn bad at the onset (a jammed receiver), of which a
lying one says nothing. Right is every autopilot that does not fail. It is assumed that links fail
independently of each other, and that before the start all heard all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, get_args

import numpy as np
from numpy.random import Generator

from fdi.errors import UsageError
from fdi.methods.voting.rules import Bools, Floats, Inputs, Ints, begin, step
from fdi.methods.voting.selection import FOREVER, Selection, select
from fdi.methods.voting.settings import Settings, microseconds
from fdi.shown import Shown

Kind = Literal["faulty", "mute", "dead", "stuck", "lying"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)
BEGINS_S: Final = 10.0
"""s from the first cycle to the earliest onset: three counts of the votes."""
MOST_AUTOPILOTS: Final = 15
MOST_RUNS: Final = 100_000
MOST_CYCLES: Final = 10_000
_BLOCK: Final = 2_000_000  # messages drawn at once: memory of some 50 MB
_NORMAL_95: Final = 1.959964  # standard deviations


class Failure(NamedTuple):
    """One autopilot fails: how, and its number (from 1)."""

    kind: Kind
    number: int


@dataclass(frozen=True, slots=True)
class Scenario(Shown):
    """What happens in a run.

    Attributes
    ----------
    autopilots : int
    failures : tuple of Failure
    outside : bool
        Whether a cause outside turns the flags of all bad.
    loss : float
        Share of the messages that are lost, each link and message for itself.
    lasts : float
        s that a run goes on after the earliest onset.
    """

    autopilots: int
    failures: tuple[Failure, ...] = ()
    outside: bool = False
    loss: float = 0.0
    lasts: float = 50.0

    def __post_init__(self) -> None:
        if not 2 <= self.autopilots <= MOST_AUTOPILOTS:
            raise UsageError(
                f"{self.autopilots} autopilots cannot be simulated", hint=f"2 to {MOST_AUTOPILOTS}"
            )
        numbers = [failure.number for failure in self.failures]
        wrong = [number for number in numbers if not 1 <= number <= self.autopilots]
        if wrong:
            raise UsageError(f"there is no autopilot {wrong[0]} among {self.autopilots}")
        if len(set(numbers)) < len(numbers):
            raise UsageError("an autopilot can fail in one way only")
        if len(numbers) == self.autopilots:
            raise UsageError(
                f"all {self.autopilots} autopilots fail, so that every selection is wrong",
                hint="one has to be well",
            )
        if not 0 <= self.loss <= 1:
            raise UsageError(f"a loss of {self.loss:g} is no share", hint="from 0 to 1")
        if not 0 < self.lasts <= 1e5:
            raise UsageError(f"a run cannot last {self.lasts:g} s", hint="at most 100000 s")

    def places(self, *kinds: Kind) -> Bools:
        """Return which autopilots fail in one of these ways, (n,)."""
        mask = np.zeros(self.autopilots, np.bool_)
        mask[[failure.number - 1 for failure in self.failures if failure.kind in kinds]] = True
        return mask


class Share(NamedTuple):
    """A share of runs with its 95 % interval (Wilson 1927, score interval)."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Outcome(Shown):
    """What came of many runs.

    Attributes
    ----------
    scenario : Scenario
    settings : Settings
    runs, seed : int
    wrong : Share
        Runs at the end of which an autopilot that fails is in charge.
    stopped : Share
        Runs in which votes are not counted any more at the end.
    needless : Share
        Runs in which one that is well lost the charge.
    reaction : float or None
        s, median from the onset to the last count that put one in charge that is well, over the
        runs that came out right and in which one that fails was in charge; None where there is no
        such run.
    slowest : float or None
        s, the 95th percentile of it.
    """

    scenario: Scenario
    settings: Settings
    runs: int
    seed: int
    wrong: Share
    stopped: Share
    needless: Share
    reaction: float | None
    slowest: float | None


def simulate(scenario: Scenario, settings: Settings, *, runs: int = 1000, seed: int = 0) -> Outcome:
    """Return how often the wrong autopilot is in charge.

    Parameters
    ----------
    scenario : Scenario
    settings : Settings
        ``transport`` is the longest time that a message travels (uniform from 0; None: none, so
        that it waits for the receiver's next cycle alone, 0 to 1 cycle as in the record);
        ``delay`` and ``needs_takeoff`` play no part: a run begins when votes are compared.
    runs : int
    seed : int
        Same seed, same outcome.

    Raises
    ------
    UsageError
        So many runs or cycles are not computed.
    """
    cycles = int((BEGINS_S + scenario.lasts) / settings.cycle)
    if not 1 <= runs <= MOST_RUNS or seed < 0:
        raise UsageError(f"{runs} runs with seed {seed}", hint=f"1 to {MOST_RUNS} runs, seed >= 0")
    if cycles > MOST_CYCLES:
        raise UsageError(
            f"a run of {cycles} cycles is too long", hint=f"at most {MOST_CYCLES}: a longer cycle"
        )
    random = np.random.default_rng(seed)
    parts = [_runs(scenario, settings, size, cycles, random) for size in _blocks(scenario, runs)]
    wrong, stopped, needless, reaction = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    known = reaction[np.isfinite(reaction)]
    return Outcome(
        scenario,
        settings,
        runs,
        seed,
        share(wrong),
        share(stopped),
        share(needless),
        float(np.median(known)) if known.size else None,
        float(np.quantile(known, 0.95)) if known.size else None,
    )


def share(hits: Bools) -> Share:
    """Return a share with its 95 % interval.

    References
    ----------
    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", J. Am.
    Stat. Assoc. 22 (1927) 209.
    """
    n, p = hits.size, float(hits.mean())
    z2 = _NORMAL_95**2
    middle = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = _NORMAL_95 * np.sqrt(p * (1 - p) / n + z2 / (4 * n * n)) / (1 + z2 / n)
    return Share(p, max(float(middle - half), 0.0), min(float(middle + half), 1.0))


def _blocks(scenario: Scenario, runs: int) -> Iterator[int]:
    size = max(_BLOCK // scenario.autopilots**2 // 100, 1)
    for first in range(0, runs, size):
        yield min(size, runs - first)


def _runs(
    scenario: Scenario, settings: Settings, runs: int, cycles: int, random: Generator
) -> tuple[Bools, Bools, Bools, Floats]:
    """Return of each run whether it ends wrong or stopped, was needless, and its reaction, s."""
    n, period = scenario.autopilots, microseconds(settings.cycle)
    phase = random.integers(0, period, (runs, n))
    begins = microseconds(BEGINS_S)
    onset = begins + random.integers(0, microseconds(settings.selection_hold) + 1, runs)
    t = phase[..., None] + period * np.arange(cycles)
    votes = _votes(scenario, settings, t, onset, random)
    loyal = scenario.places("stuck", "lying")
    is_after = t >= onset[:, None, None]
    votes = np.where(is_after & loyal[:, None], np.arange(n)[:, None], votes)
    t = np.where(is_after & scenario.places("dead")[:, None], FOREVER, t)
    counts = select(t, votes, settings)
    return _judged(scenario, settings, counts, onset, period * cycles)


def _votes(scenario: Scenario, settings: Settings, t: Ints, onset: Ints, random: Generator) -> Ints:
    """Return the votes by the rules, (runs, n, cycles), places."""
    runs, n, cycles = t.shape
    period = microseconds(settings.cycle)
    slowest = microseconds(settings.transport or 0.0)
    reach = slowest // period + 1  # of how many cycles messages can be on their way
    says_bad = scenario.places("faulty", "stuck") | (scenario.outside & ~scenario.places("lying"))
    is_silent = scenario.places("mute", "dead")
    own, is_own = np.broadcast_to(np.arange(n), (runs, n)), np.eye(n, dtype=np.bool_)
    state = begin((runs, n), n, 1)
    heard = np.zeros((runs, n, n), np.int64)  # stamp of the last message; all heard all at 0
    arrived = np.zeros((runs, n, n), np.int64)
    under_way: list[tuple[Ints, Ints]] = []
    votes = np.empty(t.shape, np.int64)
    for k in range(cycles):
        now = t[..., k]
        sent = np.broadcast_to(now[:, None, :], (runs, n, n))
        arrival = sent + random.integers(0, slowest + 1, (runs, n, n))
        is_lost = random.random((runs, n, n)) < scenario.loss
        is_lost |= (is_silent & (now >= onset[:, None]))[:, None, :]
        under_way.append((np.where(is_lost, FOREVER, arrival), sent))
        under_way = under_way[-reach - 1 :]
        for when, stamp in under_way:
            is_newer = (when <= now[..., None]) & (when >= arrived)
            heard, arrived = np.where(is_newer, stamp, heard), np.where(is_newer, when, arrived)
        known = np.where(is_own, now[..., None], heard)
        bad = ((known >= onset[:, None, None]) & says_bad).astype(np.float64)
        origin = known if settings.age_from == "sent" else np.where(is_own, now[..., None], arrived)
        state, concluded = step(state, Inputs(now, own, bad[..., None], origin), settings)
        votes[..., k] = concluded.vote
    return votes


def _judged(
    scenario: Scenario, settings: Settings, counts: Selection, onset: Ints, end: int
) -> tuple[Bools, Bools, Bools, Floats]:
    fails = scenario.places(*KINDS)
    none = np.zeros((onset.size, 1), np.int64)
    t = np.concatenate((none, counts.t), axis=-1)  # autopilot 1 is in charge until the first count
    selected = np.concatenate((none, counts.selected), axis=-1)
    is_made = t < FOREVER
    wrong = fails[selected[:, -1]]
    last = np.where(is_made, t, 0).max(axis=-1)
    pause = microseconds(settings.selection_hold) + 2 * microseconds(settings.cycle)
    stopped = last < end - pause
    changes = is_made[:, 1:] & (selected[:, 1:] != selected[:, :-1])
    was_well = ~fails[selected[:, :-1]] | (t[:, 1:] < onset[:, None])
    needless = np.any(changes & was_well, axis=-1)
    was_wrong = is_made & fails[selected]
    until = np.append(t[:, 1:], np.full((onset.size, 1), FOREVER), axis=1)
    ends = np.where(was_wrong & (until > onset[:, None]) & (until < FOREVER), until, 0).max(axis=-1)
    reaction = np.where(~wrong & (ends > 0), (ends - onset) / 1e6, np.nan)
    return wrong, stopped, needless, reaction
