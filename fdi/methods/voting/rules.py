"""What does an autopilot conclude in one cycle?

In: what it concluded before (`State`), what it knows now (`Inputs`). Out: what it concludes now
(`Cycle`) and the next `State`. The rules are those of the thesis, section 4.3, as the published
program carries them out: compare, persist, hold, count, rank, vote.

All arrays may have leading axes (cases: phases, runs, autopilots) that are computed at once. Times
are whole microseconds of one clock. Autopilots are places 0 to n - 1 in the order of their numbers;
flags are places in `Settings.flags`.

The trap for a maintainer: every limit is strict. At an age of exactly 3.000 s nobody is silent yet,
and the record has such a cycle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.voting.priorities import priorities
from fdi.methods.voting.settings import Settings, microseconds

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

NEVER: Final = -(1 << 60)
"""us; a time before all others, from which any span of a rule can be taken without overflow."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """What an autopilot remembers from cycle to cycle.

    Attributes
    ----------
    clear_at, blamed_at : (..., n, f) int, us
        The last cycle in which a flag was not blamed, and was.
    counted : (..., n, f) bool
        Errors that count.
    silent : (..., n) bool
    without_errors_at, with_errors_at : (..., n) int, us
        The last cycle without a counted error, and with one.
    healthy : (..., n) bool
    priorities : (..., n) int
    vote : (...) int
        Place of the autopilot that is voted for.
    """

    clear_at: Ints
    blamed_at: Ints
    counted: Bools
    silent: Bools
    without_errors_at: Ints
    with_errors_at: Ints
    healthy: Bools
    priorities: Ints
    vote: Ints


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What an autopilot knows in one cycle.

    Attributes
    ----------
    now : (...) int, us
    own : (...) int
        Place of the autopilot itself.
    bad : (..., n, f) float
        1 where a flag is bad, 0 where it is good, NaN where that is unknown.
    heard_at : (..., n) int, us
        From when the age of the last message counts; of the autopilot itself: now.
    """

    now: Ints
    own: Ints
    bad: Floats
    heard_at: Ints


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """What an autopilot concludes in one cycle.

    Attributes
    ----------
    blamed, counted : (..., n, f) bool
    counters, priorities : (..., n) int
    silent, healthy : (..., n) bool
    best : (...) int
        The smallest priority.
    vote : (...) int
        Place of the autopilot that is voted for.
    """

    blamed: Bools
    counted: Bools
    counters: Ints
    priorities: Ints
    silent: Bools
    healthy: Bools
    best: Ints
    vote: Ints


def begin(shape: tuple[int, ...], n: int, flags: int) -> State:
    """Return the state before the first cycle: nobody is blamed, the lowest number is voted for.

    Parameters
    ----------
    shape : tuple of int
        The leading axes.
    n, flags : int
        How many autopilots, and how many flags of each.
    """
    of_all, of_flags = (*shape, n), (*shape, n, flags)
    return State(
        clear_at=np.full(of_flags, NEVER, np.int64),
        blamed_at=np.full(of_flags, NEVER, np.int64),
        counted=np.zeros(of_flags, np.bool_),
        silent=np.zeros(of_all, np.bool_),
        without_errors_at=np.full(of_all, NEVER, np.int64),
        with_errors_at=np.full(of_all, NEVER, np.int64),
        healthy=np.ones(of_all, np.bool_),
        priorities=np.ones(of_all, np.int64),
        vote=np.zeros(shape, np.int64),
    )


def blame(bad: Floats) -> Bools:
    """Return whose flags are blamed: the bad ones, unless nobody known has a good one.

    It is no majority rule: two bad against one good blames the two. Where all agree the cause is
    outside. What is unknown is neither blamed nor does it exonerate.

    Parameters
    ----------
    bad : (..., n, f) float
        1 bad, 0 good, NaN unknown.
    """
    some_good = np.any(bad == 0, axis=-2, keepdims=True)
    found: Bools = (bad == 1) & some_good
    return found


def step(state: State, inputs: Inputs, settings: Settings) -> tuple[State, Cycle]:
    """Return the next state and what is concluded in this cycle.

    Parameters
    ----------
    state : State
    inputs : Inputs
    settings : Settings
    """
    blamed = blame(inputs.bad)
    clear_at, blamed_at, counted = _persist(state, blamed, inputs.now[..., None, None], settings)
    counters = counted.sum(axis=-1, dtype=np.int64)
    age = inputs.now[..., None] - inputs.heard_at
    silent = state.silent | (age > microseconds(settings.silence))
    ranked = np.where(silent, silent.shape[-1], _as_seen(counters, inputs.own, settings))
    best = ranked.min(axis=-1)
    # argmin gives the first, which is the lowest number
    vote = np.where(best == ranked.shape[-1], state.vote, ranked.argmin(axis=-1))
    without, with_errors, healthy = _health(state, counters > 0, inputs, settings)
    concluded = Cycle(blamed, counted, counters, ranked, silent, healthy, best, vote)
    after = State(clear_at, blamed_at, counted, silent, without, with_errors, healthy, ranked, vote)
    return after, concluded


def _persist(
    state: State, blamed: Bools, now: Ints, settings: Settings
) -> tuple[Ints, Ints, Bools]:
    """Return when each flag was last clear and blamed, and which errors count.

    What is blamed in the first cycle of all has been so from there on.
    """
    since = np.where(state.clear_at == NEVER, now, state.clear_at)
    lasts = blamed & (now - since > microseconds(settings.persistence))
    is_over = ~blamed & (now - state.blamed_at > microseconds(settings.hold))
    return (
        np.where(blamed, since, now),
        np.where(blamed, now, state.blamed_at),
        (state.counted | lasts) & ~is_over,
    )


def _as_seen(counters: Ints, own: Ints, settings: Settings) -> Ints:
    """Return priorities by place: they are found in the order own, then the others by number."""
    n = counters.shape[-1]
    places = np.broadcast_to(np.arange(n), counters.shape)
    order = np.argsort(places != own[..., None], axis=-1, kind="stable")
    found = priorities(
        np.take_along_axis(counters, order, axis=-1),
        keeps_vote_when_equal=settings.keeps_vote_when_equal,
    )
    return np.take_along_axis(found, np.argsort(order, axis=-1), axis=-1)


def _health(
    state: State, has_errors: Bools, inputs: Inputs, settings: Settings
) -> tuple[Ints, Ints, Bools]:
    """Return when each was last without errors and with them, and the marks of health."""
    now, n = inputs.now[..., None], has_errors.shape[-1]
    without = np.where(state.without_errors_at == NEVER, now, state.without_errors_at)
    first = np.where(inputs.own == 0, 1, 0)[..., None]  # of the others, the lowest number
    limit = np.where(
        np.arange(n) == first,
        microseconds(settings.unhealthy_after_first),
        microseconds(settings.unhealthy_after),
    )
    falls_ill = has_errors & (now - without > limit)
    recovers = ~has_errors & (now - state.with_errors_at > microseconds(settings.healthy_after))
    return (
        np.where(has_errors, without, now),
        np.where(has_errors, now, state.with_errors_at),
        (state.healthy & ~falls_ill) | recovers,
    )
