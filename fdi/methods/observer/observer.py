"""What does the observer make of one more record? The same step serves logs and live links.

In: an `Observer` and records one after the other. Out: after each the thirteen residuals. Within a
step heading, A and H are those of its first record; inputs and measurements run linearly to the
second (``hold.py``). After a gap it begins anew at what is measured, and its residuals are unknown
until the error it may have begun with is forgotten.

The gain turns with the heading where outputs hold both or neither of each horizontal pair, for the
equations at a heading are those at north seen from a turned frame; else it is found at every step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.observer.gain import GAINS, check_observable
from fdi.methods.observer.hold import hold
from fdi.methods.observer.model import linear_model
from fdi.methods.observer.states import PSI, STATES
from fdi.methods.observer.vehicle import Vehicle
from fdi.telemetry.message import Floats

GAP_S: Final = 1.0
"""Records further apart are a gap."""
BLANK: Final = 5.0
"""Time constants of the slowest pole after which 99 % of an error is forgotten."""
_PAIRS: Final = ((0, 1), (3, 4))


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
    at_north : (12, m) float
        H at heading 0.
    turns : bool
        The gain turns with the heading.
    blank_s : float
        After a start residuals are unknown for so long.
    """

    vehicle: Vehicle
    gain: str
    measured: NDArray[np.intp]
    at_north: Floats
    turns: bool
    blank_s: float

    def gain_at(self, heading: float) -> Floats:
        """Return H (12, m) at a heading, rad."""
        a, _ = linear_model(self.vehicle, heading)
        if self.measured.size == len(STATES) or not self.turns:
            return GAINS[self.gain](a, self.measured)
        turned = _turned(heading)
        return np.asarray(turned @ self.at_north @ turned[np.ix_(self.measured, self.measured)].T)


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What is known at one moment.

    Attributes
    ----------
    t : float
        s.
    y : (12,) float
        States as measured, yaw unwrapped; NaN for what is not an output. Yaw is always needed.
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
        The last record; None before the first.
    x : (12,) float
        The estimate at that record.
    since : float
        When it began, s.
    """

    observer: Observer
    last: Record | None
    x: Floats
    since: float


def design(vehicle: Vehicle, outputs: Sequence[str] = STATES, gain: str = "poles") -> Observer:
    """Return an observer of a vehicle from its outputs.

    Parameters
    ----------
    vehicle : Vehicle
    outputs : sequence of str
        Of ``states.STATES``.
    gain : str
        ``poles``: twelve between -4 and -5 1/s; ``kalman``: the steady filter's.

    Raises
    ------
    UsageError
        The outputs leave states unknown, in words.
    """
    a, _ = linear_model(vehicle, 0.0)
    measured = check_observable(a, outputs)
    at_north = GAINS[gain](a, measured)
    slowest = -float(np.linalg.eigvals(a - _spread(at_north, measured)).real.max())
    turns = all((i in measured) == (j in measured) for i, j in _PAIRS)
    return Observer(vehicle, gain, measured, at_north, turns, BLANK / slowest)


def begin(observer: Observer) -> ObserverState:
    """Return the state before the first record."""
    return ObserverState(observer, None, np.zeros(len(STATES)), np.nan)


def step(state: ObserverState, record: Record) -> tuple[ObserverState, Floats]:
    """Return the state after a record, and its residuals.

    Parameters
    ----------
    state : ObserverState
    record : Record
        Later than the last one; one that is not is left out, as is one with an output unknown.

    Returns
    -------
    state : ObserverState
    residuals : (13,) float
        y - x, the yaw's wrapped, and the horizontal speed; NaN where there is no output, after a
        start, and where the record is left out.
    """
    observer, last = state.observer, state.last
    unknown = np.full(len(STATES) + 1, np.nan)
    needed = [*record.y[observer.measured], *record.u, record.y[PSI]]
    if not np.all(np.isfinite(needed)) or (last is not None and record.t <= last.t):
        return state, unknown
    if last is None or record.t - last.t > GAP_S:
        start = np.nan_to_num(record.y)
        return ObserverState(observer, record, start, record.t), unknown
    x = _advanced(observer, state.x, last, record)
    state = ObserverState(observer, record, x, state.since)
    return state, unknown if record.t - state.since < observer.blank_s else residuals_of(
        observer, record, x
    )


def _advanced(observer: Observer, x: Floats, last: Record, record: Record) -> Floats:
    heading, span = float(last.y[PSI]), record.t - last.t
    a, b = linear_model(observer.vehicle, heading)
    gain = observer.gain_at(heading)
    phi, gamma_0, gamma_1 = hold(a - _spread(gain, observer.measured), span)
    before, after = (b @ one.u + gain @ one.y[observer.measured] for one in (last, record))
    return np.asarray(phi @ x + gamma_0 @ before + gamma_1 @ (after - before) / span)


def residuals_of(observer: Observer, record: Record, x: Floats) -> Floats:
    """Return the thirteen residuals, (13,), of an estimate at a record."""
    left = np.full(len(STATES) + 1, np.nan)
    left[observer.measured] = (record.y - x)[observer.measured]
    left[PSI] = np.arctan2(np.sin(left[PSI]), np.cos(left[PSI]))
    left[-1] = np.hypot(left[3], left[4])
    return left


def _spread(gain: Floats, measured: NDArray[np.intp]) -> Floats:
    """Return H C, (12, 12)."""
    whole = np.zeros((len(STATES), len(STATES)))
    whole[:, measured] = gain
    return whole


def _turned(heading: float) -> Floats:
    """Return the matrix that turns the horizontal pairs from north to a heading."""
    c, n = np.cos(heading), np.sin(heading)
    turned = np.eye(len(STATES))
    for i, j in _PAIRS:
        turned[np.ix_((i, j), (i, j))] = [[c, -n], [n, c]]
    return turned
