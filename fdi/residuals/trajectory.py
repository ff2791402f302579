"""Which trajectory do states follow that are integrated and corrected by a residual?

In: the equations of an observer as expressions, the columns that they read, and a stretch of
samples without a gap. Out: the residual along it, with what every source of error does to it.

Between two samples the rates are integrated by the trapezoidal rule over the time between them,
whatever that is: of second order, and stable for any stable model, however slow the log is. The
rule asks for the states that it gives, and the gain for the slopes there; so the trajectory is
found as a whole. Along a guess rates and residual are taken as linear (all samples at once, by
central differences), the Kalman filter of this linear model is the next guess (``kalman.py``), and
so on until it stays: Newton's method over the trajectory. What it comes to is the extended Kalman
filter. A model that is linear in its states needs one round. Where the rounds do not settle, the
piece is cut shorter; a single step that does not settle ends the trajectory.

Where to start: a linear model at zero, with so large a deviation that each state alone could be the
cause of all that the residual shows of the first samples, ten times over. A nonlinear model starts
in the middle of its domains, or off it in one state, whichever makes the first samples the most
likely.

References
----------
Simon, Optimal State Estimation, 2006, section 13.2 (extended Kalman filter). Bellman, Kalaba,
Quasilinearization and nonlinear boundary-value problems, 1965.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Column, Floats, evaluate, wrap
from fdi.model.parts import Variable
from fdi.residuals.kalman import WORTH, Along, Filtered, State, follow
from fdi.residuals.newton import solve_loop
from fdi.residuals.node import Node

PIECE: Final = 128
"""Samples of a nonlinear model that are tried at once; more or fewer as they go."""
ROUNDS: Final = 12
EASY: Final = 4
"""Rounds after which a longer piece is tried next."""
STAYS: Final = 1e-3
"""Of a state's own standard deviation: two rounds that differ by less are the same."""
EXACT: Final = 1e-9
"""Of the state itself, likewise, where it is known exactly."""
STEP: Final = 1e-4
"""Of a state or of what it may be, for differences; of a linear model any serves."""
BEGINNING: Final = 100
"""Samples that a start is judged by."""
WIDE: Final = 10.0
OFF: Final = 0.7
"""Of the way from the middle of a domain to its ends."""


class Move(NamedTuple):
    """What a source of error does: to columns that are read, and, constantly, to what steps give.

    ``steps`` holds the residual under no name.
    """

    columns: dict[str, Floats]
    steps: dict[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Plant:
    """The equations of an observer with what they read.

    Attributes
    ----------
    node : Node
        Rates of its states, what is computed on the way, and the residual.
    t : (N,) float, s
    columns : mapping of str to (N,) float or a number
    moves : tuple of Move
        By source of error.
    low, high : (n,) float
        Domains of the states; infinite where there is none, and for linear models.
    circular : frozenset of str
        The variables that are angles.
    turned : bool
        Whether the residual is one.
    linear : bool
    real_part : bool
        Of an imaginary root.
    """

    node: Node
    t: Floats
    columns: Mapping[str, Column]
    moves: tuple[Move, ...]
    low: Floats
    high: Floats
    circular: frozenset[str]
    turned: bool
    linear: bool
    real_part: bool


class Tracked(NamedTuple):
    """A residual, (m,), and what sources bring to it, (m, s), the start first; see `Filtered`."""

    residual: Floats
    variance: Floats
    lasting: Floats


class _Slopes(NamedTuple):
    """Rates (m, n) and residual (m,) at given states, (m, n), with slopes by states and sources."""

    x: Floats
    rates: Floats
    by_state: Floats  # (m, n, n)
    by_source: Floats  # (m, s, n)
    residual: Floats
    seen: Floats  # (m, n)
    direct: Floats  # (m, s)


def track(plant: Plant, first: int, last: int) -> Tracked:
    """Return the residual of an observer that starts at a sample.

    Parameters
    ----------
    plant : Plant
    first, last : int
        The stretch: ``last`` is not part of it.

    Returns
    -------
    Tracked
        Shorter than the stretch where the equations have no value.
    """
    if plant.linear:
        return _from(plant, first, last, _wide(plant, first, last))
    starts = _starts(plant)
    judged = [_from(plant, first, min(last, first + BEGINNING), start) for start in starts]
    best = min(range(len(starts)), key=lambda i: _unlikely(judged[i], min(last - first, BEGINNING)))
    return _from(plant, first, last, starts[best])


def _unlikely(found: Tracked, wanted: int) -> tuple[int, float]:
    """Return how little a start explains the first samples: how many not at all, and how badly."""
    total = found.variance.sum(axis=1)
    known = np.isfinite(found.residual) & (total > 0)
    cost = found.residual[known] ** 2 / total[known] + np.log(total[known])
    return wanted - len(found.residual), float(cost.sum())


def _from(plant: Plant, first: int, last: int, state: State) -> Tracked:
    """Return the residual from a start on."""
    parts: list[Filtered] = []
    at, length = first, last - first if plant.linear else PIECE
    while at < last:
        wanted = min(length, last - at)
        followed, rounds = _piece(plant, at, at + wanted, last, state)
        if followed is None and wanted == 1:
            break
        if followed is None:
            length = max(1, wanted // 4)
            continue
        found, state = followed
        parts.append(found)
        at += wanted
        length = 2 * length if rounds <= EASY else length
    sources = 1 + len(plant.moves)
    none = [np.zeros(0), np.zeros((0, sources)), np.zeros((0, sources))]
    return Tracked(*(np.concatenate([none[i], *(part[i] for part in parts)]) for i in range(3)))


def _piece(
    plant: Plant, first: int, end: int, last: int, state: State
) -> tuple[tuple[Filtered, State] | None, int]:
    """Return what the observer says along a piece, None where that does not settle, and rounds."""
    more = min(end + 1, last)
    before = np.repeat(state.x[None], more - first, axis=0)
    after = before[: end - first]
    scale = np.sqrt(np.maximum(np.diagonal(state.cov.sum(axis=0)), 0.0))
    for rounds in range(1, ROUNDS + 1):
        came = _slopes(plant, slice(first, more), before, scale)
        goes = came if plant.linear else _slopes(plant, slice(first, end), after, scale)
        along = _between(plant.t[first:more], came, goes, end - first)
        if along is None:
            return None, rounds
        found, ends = follow(
            along, state, plant.low, plant.high, circular=plant.turned, fast=len(plant.t) >= WORTH
        )
        following = np.concatenate([found.before, ends.x[None]])[: more - first]
        if not np.isfinite(following).all():
            return None, rounds
        close = STAYS * found.deviation + EXACT * np.abs(found.after)
        stays = (np.abs(found.after - after) <= close).all()
        stays &= bool((np.abs(found.before - before[: end - first]) <= close).all())
        if plant.linear or stays:
            return (found, ends), rounds
        before, after = following, found.after
    return None, ROUNDS


def _between(t: Floats, came: _Slopes, goes: _Slopes, m: int) -> Along | None:
    """Return the linear model along m samples, None where it has no value.

    ``came`` are the slopes at the states before samples are taken in, of one sample more where the
    stretch goes on, ``goes`` those after. Sources are moved one place up: the first is the start.
    """
    n, sources = came.x.shape[1], came.direct.shape[1]
    steps = min(len(t) - 1, m)
    half = np.diff(t)[:steps, None] / 2
    identity = np.eye(n)
    step = np.tile(identity, (m, 1, 1))
    push = np.zeros((m, n))
    before, after = np.zeros((m, sources + 1, n)), np.zeros((m, sources + 1, n))
    if steps:
        slope, later = goes.by_state[:steps], came.by_state[1 : steps + 1]
        implicit = identity - half[..., None] * later
        rates = goes.rates[:steps] - _times(slope, goes.x[:steps])
        rates = rates + came.rates[1 : steps + 1] - _times(later, came.x[1 : steps + 1])
        if not (np.isfinite(implicit).all() and np.isfinite(slope).all()):
            return None
        try:
            solved = np.linalg.inv(implicit)
        except np.linalg.LinAlgError:
            return None
        step[:steps] = solved @ (identity + half[..., None] * slope)
        push[:steps] = _times(solved, half * rates)
        turned = half[..., None] * solved.swapaxes(1, 2)
        before[:steps, 1:] = goes.by_source[:steps] @ turned
        after[:steps, 1:] = came.by_source[1 : steps + 1] @ turned
    if not (np.isfinite(step).all() and np.isfinite(push).all()):
        return None
    direct = np.concatenate([np.zeros((m, 1)), came.direct[:m]], axis=1)
    residual = came.residual[:m] - (came.seen[:m] * came.x[:m]).sum(axis=1)
    seen = np.where(np.isfinite(residual)[:, None], came.seen[:m], 0.0)
    return Along(step, push, before, after, seen, residual, direct)


def _times(matrices: NDArray[Any], vectors: NDArray[Any]) -> Floats:
    product: Floats = (matrices @ vectors[..., None])[..., 0]
    return product


def _slopes(plant: Plant, span: slice, x: Floats, scale: Floats) -> _Slopes:
    """Return rates and residual at states, (m, n), and how they change, by differences."""
    m, n = x.shape
    node, sources = plant.node, len(plant.moves)
    points = 1 + 2 * n + sources
    small = np.maximum(np.abs(x), np.where(np.isfinite(scale) & (scale > 0), scale, 1.0))
    small *= 1.0 if plant.linear else STEP
    moved: dict[str, dict[int, Floats | float]] = defaultdict(dict)
    for place, move in enumerate(plant.moves, start=1 + 2 * n):
        for name, effect in move.columns.items():
            moved[name][place] = effect[span]
        for name, constant in move.steps.items():
            moved[name][place] = constant

    def spread(name: str, column: Column) -> Floats:
        wide = np.array(np.broadcast_to(column, (points, m)), dtype=np.float64)
        for place, effect in moved[name].items():
            wide[place] += effect
        return wide.reshape(-1)

    values: dict[str, Column] = {
        name: spread(name, column[span]) if np.ndim(column) else column
        for name, column in plant.columns.items()
    }
    for i, name in enumerate(node.variables[: node.states]):
        wide = np.tile(x[:, i], (points, 1))
        wide[1 + 2 * i] += small[:, i]
        wide[2 + 2 * i] -= small[:, i]
        values[name] = wide.reshape(-1)

    def compute(number: int) -> Floats:
        own = evaluate(node.expressions[number], values, real_part=plant.real_part)
        return np.broadcast_to(own, points * m).reshape(points, m)

    at = node.states
    for size in node.blocks:
        own = slice(at, at + size)
        found = [compute(at)] if size == 1 else _solved(plant, own, values, points * m)
        for name, column in zip(node.variables[own], found, strict=True):
            values[name] = spread(name, column.reshape(points, m))
            if name in plant.circular:
                values[name] = wrap(values[name])
        at += size
    rows = [compute(number) for number in range(node.states)]
    rows.append(spread("", compute(len(node.variables))).reshape(points, m))
    table = np.stack(rows)
    return _differences(plant, x, small, table)


def _solved(plant: Plant, own: slice, values: Mapping[str, Column], size: int) -> Floats:
    """Return the unknowns of a block of linear equations."""
    names = plant.node.variables[own]
    unknowns = [Variable(name, "") for name in names]  # no domain: a guess may lie outside
    found = solve_loop(plant.node.expressions[own], unknowns, values)
    return np.broadcast_to(found.columns, (len(names), size))


def _differences(plant: Plant, x: Floats, small: Floats, table: Floats) -> _Slopes:
    """Return the slopes of rates and residual, (n + 1, points, m), given at moved states."""
    _m, n = x.shape
    change = table[:, 1:] - table[:, :1]
    if plant.turned:
        change[-1] = wrap(change[-1])
    up, down = change[:, 0 : 2 * n : 2], -change[:, 1 : 2 * n : 2]
    # at an end of what an equation is defined for there is one side only
    both = np.where(np.isnan(up), down, np.where(np.isnan(down), up, (up + down) / 2))
    slopes = both / small.T
    sources = np.nan_to_num(change[:, 2 * n :])
    return _Slopes(
        x,
        table[:n, 0].T,
        slopes[:n].transpose(2, 0, 1),
        sources[:n].transpose(2, 1, 0),
        table[n, 0],
        slopes[n].T,
        sources[n].T,
    )


def _state(plant: Plant, x: Floats, scale: Floats) -> State:
    sources, n = 1 + len(plant.moves), len(x)
    cov = np.zeros((sources, n, n))
    cov[0] = np.diag(scale**2)
    return State(x, cov, np.zeros((sources, n)), np.zeros((sources, n)))


def _starts(plant: Plant) -> list[State]:
    """Return where a nonlinear model may start."""
    middle, width = (plant.low + plant.high) / 2, (plant.high - plant.low) / 2
    found = [_state(plant, middle, width)]
    for i in range(len(middle)):
        for sign in (-OFF, OFF):
            x = middle.copy()
            x[i] += sign * width[i]
            found.append(_state(plant, x, width))
    return found


def _wide(plant: Plant, first: int, last: int) -> State:
    """Return the start of a linear model: zero, give or take as much as the residual could show."""
    n = plant.node.states
    end = min(last, first + BEGINNING)
    zero = np.zeros((end - first, n))
    came = _slopes(plant, slice(first, end), zero, np.ones(n))
    along = _between(plant.t[first:end], came, came, end - first)
    x, carried = np.zeros(n), np.eye(n)
    energy, shown = 0.0, np.zeros(n)
    if along is not None:
        for k in range(end - first):
            if np.isfinite(along.h[k]):
                residual = along.h[k] + along.c[k] @ x
                energy += residual**2 + float((along.direct[k] ** 2).sum())
                shown += (along.c[k] @ carried) ** 2
            x, carried = along.step[k] @ x + along.push[k], along.step[k] @ carried
    visible = (shown > 0) & np.isfinite(shown)
    scale = np.where(visible, WIDE * np.sqrt(energy / np.where(visible, shown, 1.0)), 1.0)
    return _state(plant, np.zeros(n), np.where(np.isfinite(scale), scale, 1.0))
