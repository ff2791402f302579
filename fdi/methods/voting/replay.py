"""What does an autopilot conclude over a flight?

In: what it could know (`View`), the times of its cycles. Out: `Replay`, a row per cycle. The cycles
are those of the record, or run freely from any phase; several phases are computed at once.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.grid import checked
from fdi.methods.voting.flags import FlagSamples
from fdi.methods.voting.rules import Bools, Cycle, Floats, Inputs, Ints, State, begin, step
from fdi.methods.voting.settings import Settings, microseconds

PHASES: Final = 50
"""Phases that are tried of a free-running cycle: of 1 s every 20 ms, five steps of its clock."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What one autopilot could know.

    Attributes
    ----------
    own : int
        Its place among the autopilots.
    samples : tuple of FlagSamples
        By place: its own flags as they were published, those of the others as they were received.
    booted_at : int, us
        When it started: whoever was never heard of is silent since then.
    """

    own: int
    samples: tuple[FlagSamples, ...]
    booted_at: int


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """What an autopilot concluded, cycle by cycle; leading axes are phases.

    Attributes
    ----------
    t : (..., k) int, us
        The cycles.
    is_open : (..., k) bool
        Whether there was a comparison; where not, all stays as it was.
    blamed, counted : (..., k, n, f) bool
    counters, priorities : (..., k, n) int
    silent, healthy : (..., k, n) bool
    best, vote : (..., k) int
    """

    t: Ints
    is_open: Bools
    blamed: Bools
    counted: Bools
    counters: Ints
    priorities: Ints
    silent: Bools
    healthy: Bools
    best: Ints
    vote: Ints


def free_cycles(span: tuple[int, int], settings: Settings, phase: Floats, *, records: int) -> Ints:
    """Return the times of free-running cycles.

    Parameters
    ----------
    span : (int, int), us
        From when to when.
    settings : Settings
    phase : (p,) float
        Of a cycle, 0 to 1.
    records : int
        Of the autopilot whose cycles they are.

    Returns
    -------
    (p, k) int, us
    """
    period = microseconds(settings.cycle)
    count = max(checked((span[1] - span[0]) // period, records, "cycles"), 1)
    start = span[0] + np.rint(phase * period).astype(np.int64)
    cycles: Ints = start[:, None] + period * np.arange(count)
    return cycles


def replay(view: View, cycles: Ints, settings: Settings) -> Replay:
    """Return what an autopilot concludes at given times.

    Parameters
    ----------
    view : View
    cycles : (..., k) int, us
        Ascending along the last axis.
    settings : Settings
    """
    bad, heard_at = _known(view, cycles, settings)
    is_open = _gate(view, cycles, settings)
    shape, n = cycles.shape[:-1], len(view.samples)
    own = np.full(shape, view.own, np.int64)
    state = begin(shape, n, len(settings.flags))
    concluded = []
    for k in range(cycles.shape[-1]):
        inputs = Inputs(cycles[..., k], own, bad[..., k, :, :], heard_at[..., k, :])
        after, cycle = step(state, inputs, settings)
        state = _kept(is_open[..., k], after, state)
        concluded.append(_shown(is_open[..., k], cycle, state))
    return Replay(cycles, is_open, **_stacked(concluded, len(shape)))


def _known(view: View, cycles: Ints, settings: Settings) -> tuple[Floats, Ints]:
    """Return the flags known at each cycle, (..., k, n, f), and the ages' origins, (..., k, n)."""
    bad, heard_at = [], []
    for place, samples in enumerate(view.samples):
        row = np.searchsorted(samples.t, cycles, side="right") - 1
        was_heard = row >= 0
        at = np.maximum(row, 0)
        if samples.t.size:
            bad.append(np.where(was_heard[..., None], samples.bad[at], np.nan))
            origin = samples.sent if settings.age_from == "sent" else samples.t
            heard = np.where(was_heard, origin[at], view.booted_at)
        else:
            bad.append(np.full((*cycles.shape, len(settings.flags)), np.nan))
            heard = np.full(cycles.shape, view.booted_at)
        heard_at.append(cycles if place == view.own else heard)
    return np.stack(bad, axis=-2), np.stack(heard_at, axis=-1)


def _gate(view: View, cycles: Ints, settings: Settings) -> Bools:
    """Return at which cycles there is a comparison."""
    own = view.samples[view.own]
    if not own.t.size:
        return np.zeros(cycles.shape, np.bool_)
    at = np.maximum(np.searchsorted(own.t, cycles, side="right") - 1, 0)
    is_late: Bools = cycles - own.since[at] > microseconds(settings.delay)
    return is_late & own.is_airborne[at] if settings.needs_takeoff else is_late


def _kept(is_open: Bools, after: State, before: State) -> State:
    """Return the state after the cycle, where there was a comparison; else the one before."""
    values = {}
    for field in fields(State):
        new, old = getattr(after, field.name), getattr(before, field.name)
        values[field.name] = np.where(_spread(is_open, new.ndim), new, old)
    return State(**values)


def _shown(is_open: Bools, cycle: Cycle, state: State) -> Cycle:
    """Return what holds in a cycle: without a comparison nobody is blamed, and the vote stays."""
    return Cycle(
        blamed=cycle.blamed & _spread(is_open, cycle.blamed.ndim),
        counted=state.counted,
        counters=state.counted.sum(axis=-1, dtype=np.int64),
        priorities=state.priorities,
        silent=state.silent,
        healthy=state.healthy,
        best=state.priorities.min(axis=-1),
        vote=state.vote,
    )


def _spread(mask: Bools, dimensions: int) -> Bools:
    """Return a mask with axes of length 1 behind it, so that it has so many dimensions."""
    spread: Bools = mask.reshape(mask.shape + (1,) * (dimensions - mask.ndim))
    return spread


def _stacked(concluded: list[Cycle], axis: int) -> dict[str, NDArray[Any]]:
    made = {}
    for field in fields(Cycle):
        made[field.name] = np.stack([getattr(cycle, field.name) for cycle in concluded], axis=axis)
        made[field.name].flags.writeable = False
    return made
