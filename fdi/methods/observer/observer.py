"""What does the observer make of one more record? The same step serves logs and live links.

In: an `Observer` and records one after the other. Out: after each the thirteen residuals. Within a
step heading, A and H are those of its first record; inputs and measurements run linearly to the
second (``hold.py``). After a gap it begins anew at what is measured, and its residuals are unknown
until the error it may have begun with is forgotten.

Beside the estimate runs its doubt: what the equations leave out at each moment (``doubts.py``)
through the same low pass. It has the residual's size where nothing is wrong but the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.methods.observer.doubts import between, doubt
from fdi.methods.observer.gain import GAINS, check_observable
from fdi.methods.observer.hold import hold
from fdi.methods.observer.model import linear_model
from fdi.methods.observer.states import PSI, RESIDUALS, STATES
from fdi.methods.observer.vehicle import Vehicle
from fdi.telemetry.message import Floats

GAP_S: Final = 1.0
"""Records further apart are a gap."""
BLANK: Final = 5.0
"""Time constants of the slowest pole after which 99 % of an error is forgotten."""
_PAIRS: Final = ((0, 1), (3, 4))
"""Places of x and y, of vx and vy."""


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """A designed observer.

    Attributes
    ----------
    vehicle : Vehicle
    gain : str
        ``poles`` or ``kalman``.
    measured : (m,) int
        Places of the outputs among the states.
    late : float
        s, how far outputs may be apart in time.
    blank_s : float
        After a start residuals are unknown for so long.
    at_north : (12, m) float or None
        H at heading 0, which turns with the heading; None where it is found anew at every step.
    """

    vehicle: Vehicle
    gain: str
    measured: NDArray[np.intp]
    late: float
    blank_s: float
    at_north: Floats | None = None

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names of the outputs."""
        return tuple(STATES[i] for i in self.measured)

    def matrices_at(self, heading: float) -> tuple[Floats, Floats, Floats]:
        """Return A - HC (12, 12), B (12, 4) and H (12, m) at a heading, rad."""
        a, b = linear_model(self.vehicle, heading)
        if self.at_north is None:
            h = GAINS[self.gain](a, self.measured)
        else:
            turn = _turned(heading)
            h = turn @ self.at_north @ turn[np.ix_(self.measured, self.measured)].T
        a[:, self.measured] -= h
        return a, b, h


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What is known at one moment.

    Attributes
    ----------
    t : float
        s.
    y : (12,) float
        States as measured; of what is no output only yaw is looked at.
    u : (4,) float
        Thrust less weight, N, and torques, N m, as commanded.
    """

    t: float
    y: Floats
    u: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ObserverState:
    """Where the observer is.

    Attributes
    ----------
    observer : Observer
    last : Record or None
        The last record, its yaw continuous; None before the first.
    x : (12,) float
        The estimate at that record.
    doubt : (12,) float
        What the model may be off by there.
    since : float
        When it began, s.
    """

    observer: Observer
    last: Record | None
    x: Floats
    doubt: Floats
    since: float


class Residuals(NamedTuple):
    """After a record: residuals (13,), and by how much the model explains them at most (13,)."""

    value: Floats
    doubt: Floats


def design(
    vehicle: Vehicle, outputs: Sequence[str] = STATES, gain: str = "poles", *, late: float = 0.0
) -> Observer:
    """Return an observer of a vehicle from its outputs.

    Parameters
    ----------
    vehicle : Vehicle
    outputs : sequence of str
        Of ``states.STATES``.
    gain : str
        ``poles``: twelve between -4 and -5 1/s; ``kalman``: the steady filter's.
    late : float
        s, how far outputs may be apart in time.

    Raises
    ------
    UsageError
        The outputs leave states unknown, in words.
    """
    a, _ = linear_model(vehicle, 0.0)
    measured = check_observable(a, outputs)
    north = GAINS[gain](a, measured)
    # seen from a frame that turns with the heading the equations stay as they are at north, if each
    # horizontal pair is measured whole or not at all; all states measured cost nothing anew
    is_whole = all((i in measured) == (j in measured) for i, j in _PAIRS)
    is_diagonal = gain == "poles" and measured.size == len(STATES)
    at_north = north if is_whole and not is_diagonal else None
    a[:, measured] -= north
    slowest = -float(np.linalg.eigvals(a).real.max())
    return Observer(vehicle, gain, measured, late, BLANK / slowest, at_north)


def begin(observer: Observer) -> ObserverState:
    """Return the state before the first record."""
    nothing = np.zeros(len(STATES))
    return ObserverState(observer, None, nothing, nothing, np.nan)


def step(state: ObserverState, record: Record) -> tuple[ObserverState, Residuals]:
    """Return the state after a record, and its residuals.

    Parameters
    ----------
    state : ObserverState
    record : Record
        One that is not later than the last, or lacks an output or input, is left out.

    Returns
    -------
    state : ObserverState
    residuals : Residuals
        y - x, that of yaw wrapped, and the horizontal speed; NaN where there is no output, after a
        start, and where the record is left out.
    """
    observer, last = state.observer, state.last
    needed = (*record.y[observer.measured], record.y[PSI], *record.u)
    if not np.isfinite(needed).all() or (last is not None and record.t <= last.t):
        return state, _unknown()
    if last is None or record.t - last.t > GAP_S:
        start, nothing = np.nan_to_num(record.y), np.zeros(len(STATES))
        return ObserverState(observer, record, start, nothing, record.t), _unknown()
    record = _continuous(record, float(last.y[PSI]))
    x, doubted = _advanced(state, last, record)
    state = ObserverState(observer, record, x, doubted, state.since)
    is_blank = record.t - state.since < observer.blank_s
    return state, _unknown() if is_blank else residuals_at(state)


def _continuous(record: Record, before: float) -> Record:
    """Return a record with its yaw within half a turn of what it was."""
    y = record.y.copy()
    y[PSI] = before + _wrapped(y[PSI] - before)
    return Record(record.t, y, record.u)


def _advanced(state: ObserverState, last: Record, record: Record) -> tuple[Floats, Floats]:
    observer, heading, span = state.observer, float(last.y[PSI]), record.t - last.t
    error, b, gain = observer.matrices_at(heading)
    phi, gamma_0, gamma_1 = hold(error, span)
    before, after = (b @ one.u + gain @ one.y[observer.measured] for one in (last, record))
    x = phi @ state.x + gamma_0 @ before + gamma_1 @ (after - before) / span
    change, change_u = record.y - last.y, record.u - last.u
    gap = between(observer.vehicle, last.y, change, change_u, span=span, late=observer.late)
    first, then = (gap + doubt(observer.vehicle, one.y, one.u) for one in (last, record))
    doubted = phi @ state.doubt + gamma_0 @ first + gamma_1 @ (then - first) / span
    return x, doubted


def residuals_at(state: ObserverState) -> Residuals:
    """Return the residuals at the last record, also those that are still blank."""
    value, doubted = np.full(len(RESIDUALS), np.nan), np.full(len(RESIDUALS), np.nan)
    if state.last is not None:
        measured = state.observer.measured
        value[measured] = (state.last.y - state.x)[measured]
        doubted[measured] = np.abs(state.doubt[measured])
        value[PSI] = _wrapped(value[PSI])
        value[-1], doubted[-1] = (np.hypot(*one[3:5]) for one in (value, doubted))
    return Residuals(value, doubted)


def _turned(heading: float) -> Floats:
    """Return the matrix that turns the horizontal pairs from north to a heading."""
    c, n = np.cos(heading), np.sin(heading)
    turned = np.eye(len(STATES))
    for i, j in _PAIRS:
        turned[np.ix_((i, j), (i, j))] = [[c, -n], [n, c]]
    return turned


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def _unknown() -> Residuals:
    nothing = np.full(len(RESIDUALS), np.nan)
    return Residuals(nothing, nothing)
