"""What does the observer say of a flight? The value of the whole method.

In: a log. Out: `Observation`. One flight is looked at, by default the last one that flew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.methods.observer.fitted import HOVER_S, calm_mask, fitted, inputs_of
from fdi.methods.observer.limits import Alarm, Limits, alarms_of, learn
from fdi.methods.observer.motor import WeakMotor, weak_motors
from fdi.methods.observer.observer import Observer, ObserverState, Record, begin, design, step
from fdi.methods.observer.records import FROM, LATE_S, LackingError, Rows, rows_of
from fdi.methods.observer.states import RESIDUALS, STATES
from fdi.methods.observer.vehicle import REFERENCE_QUADROTOR, Vehicle
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.message import Floats

LEAST_UPRIGHT: Final = 0.5
"""Cosine of 60 degrees, where a hover's thrust carries half of the weight."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What an observer says of a flight.

    Attributes
    ----------
    observer : Observer
        With the vehicle as the flight told it.
    rows : Rows
        Of the flight.
    u : (4, n) float
        Inputs: thrust less weight, N, and torques, N m.
    flight : int
        Which of the log's flights, from 0.
    air : (float, float)
        s, in the air.
    calm : (n,) bool
        The rows that told centres and noise.
    residuals, doubt, threshold : (13, n) float
        NaN where unknown.
    limits : Limits
    alarms : tuple of Alarm
    motors : tuple of WeakMotor
    notes : tuple of str
        What was taken for granted, a sentence each.
    """

    observer: Observer
    rows: Rows
    u: Floats
    flight: int
    air: tuple[float, float]
    calm: NDArray[np.bool_]
    residuals: Floats
    doubt: Floats
    threshold: Floats
    limits: Limits
    alarms: tuple[Alarm, ...]
    motors: tuple[WeakMotor, ...]
    notes: tuple[str, ...]

    @property
    def off(self) -> Floats:
        """The residuals off their centres, (13, n)."""
        return self.limits.off(self.residuals)

    def __repr__(self) -> str:
        named = ", ".join(f"motor_{one.number}" for one in self.motors) or "no motor named"
        return f"<Observation of flight {self.flight}: {len(self.alarms)} alarms, {named}>"


def observe(
    log: Log,
    vehicle: Vehicle = REFERENCE_QUADROTOR,
    *,
    source: str = "estimator",
    outputs: Sequence[str] | None = None,
    gain: str = "poles",
    flight: int | None = None,
) -> Observation:
    """Return what an observer says of a flight.

    Parameters
    ----------
    log : Log
    vehicle : Vehicle
        The reference's inertias give way to what the flight's turns tell; those of one's own stay.
    source : str
        ``estimator`` or ``sensors``.
    outputs : sequence of str, optional
        Of those that the source has; by default all of them.
    gain : str
        ``poles`` or ``kalman``.
    flight : int, optional
        From 0; by default the last one.

    Raises
    ------
    LogError
        The vehicle is no multicopter, or the log lacks what is needed.
    UsageError
        The outputs leave states unknown or are not the source's, or there is no such flight.
    """
    begun = begin_flight(log, vehicle, source=source, outputs=outputs, gain=gain, flight=flight)
    rows, air = begun.rows, begun.air
    _, residuals, doubts = run(begin(begun.observer), rows.t, rows.y, begun.u)
    limits = learn(rows.t, residuals, begun.calm)
    off, threshold = limits.off(residuals), limits.threshold(rows.t, doubts)
    threshold[:, rows.t < air[0] + SETTLING_S] = np.nan
    alarms = alarms_of(rows.t, off, threshold)
    return Observation(
        begun.observer,
        rows,
        begun.u,
        begun.flight,
        air,
        begun.calm,
        residuals,
        doubts,
        threshold,
        limits,
        alarms,
        weak_motors(alarms, rows.t, off, begun.observer.vehicle, rows.motors),
        begun.notes,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Begun:
    """What a flight, or as much of it as there is, tells before the observer runs.

    Attributes
    ----------
    observer : Observer
        With the vehicle as the flight told it.
    rows : Rows
        Of the flight, in the air.
    u : (4, n) float
        Inputs: thrust less weight, N, and torques, N m.
    flight : int
        Which of the log's flights, from 0.
    air : (float, float)
        s, in the air.
    calm : (n,) bool
        The rows that tell centres and noise.
    is_calm : bool
        They are of a hover.
    notes : tuple of str
        What is taken for granted, a sentence each.
    """

    observer: Observer
    rows: Rows
    u: Floats
    flight: int
    air: tuple[float, float]
    calm: NDArray[np.bool_]
    is_calm: bool
    notes: tuple[str, ...]


def begin_flight(
    log: Log,
    vehicle: Vehicle = REFERENCE_QUADROTOR,
    *,
    source: str = "estimator",
    outputs: Sequence[str] | None = None,
    gain: str = "poles",
    flight: int | None = None,
) -> Begun:
    """Return what a flight tells before the observer runs; parameters and errors of `observe`."""
    wanted = outputs_of(source, outputs)
    design(vehicle, wanted, gain)  # what is wrong with the outputs is said before any log is read
    rows = rows_of(log, source)
    number, air = _flight(log, flight)
    inside = (rows.t >= air[0]) & (rows.t <= air[1])
    rows = Rows(rows.t[inside], rows.y[:, inside], rows.thrust[:, inside], rows.motors, source)
    calm, is_calm = calm_mask(rows, air) if rows.t.size > 1 else (np.zeros(0, np.bool_), False)
    if not calm.any():
        raise LackingError(
            f"knows flight {number + 1} for too short a time to observe", where=log.name
        )
    is_own = vehicle is not REFERENCE_QUADROTOR
    vehicle, axes = fitted(vehicle, rows, calm, air, turns=not is_own)
    return Begun(
        design(vehicle, wanted, gain, late=LATE_S[source]),
        rows,
        inputs_of(vehicle, rows),
        number,
        air,
        calm,
        is_calm,
        (*_notes(axes, is_own=is_own, is_calm=is_calm), *_beyond(rows)),
    )


def outputs_of(source: str, outputs: Sequence[str] | None) -> tuple[str, ...]:
    """Return the outputs that are asked for, by default all that a source tells.

    Raises
    ------
    UsageError
        The source does not tell one of them.
    """
    wanted = FROM[source] if outputs is None else tuple(outputs)
    absent = [name for name in wanted if name not in FROM[source]]
    if source != "estimator" and absent:
        raise UsageError(f"the {source} do not tell {absent[0]}", hint=", ".join(FROM[source]))
    return wanted


def run(
    state: ObserverState, t: Floats, y: Floats, u: Floats
) -> tuple[ObserverState, Floats, Floats]:
    """Return the state after records at t (n,), y (12, n), u (4, n); their residuals and doubts.

    Residuals and doubts are (13, n) each. A log runs at once, a live link in pieces.
    """
    value, doubt = np.full((2, len(RESIDUALS), t.size), np.nan)
    for k, (when, measured, commanded) in enumerate(zip(t.tolist(), y.T, u.T, strict=True)):
        state, after = step(state, Record(when, measured, commanded))
        value[:, k], doubt[:, k] = after
    return state, value, doubt


def _flight(log: Log, wanted: int | None) -> tuple[int, tuple[float, float]]:
    # a vehicle that was only armed is one flight that never flew
    flights = [flight for flight in log.flights if flight.flew]
    if not flights:
        raise LackingError("shows no flight", where=log.name)
    number = len(flights) - 1 if wanted is None else wanted
    if not 0 <= number < len(flights):
        raise UsageError(f"{log.name} has no flight {number + 1}", hint=f"it has {len(flights)}")
    return number, in_air(flights[number])


def _beyond(rows: Rows) -> Iterator[str]:
    """Yield that it leans where a model that is linear about a hover says nothing."""
    upright = np.cos(rows.y[STATES.index("phi")]) * np.cos(rows.y[STATES.index("theta")])
    leans = np.flatnonzero(upright < LEAST_UPRIGHT)
    if leans.size:
        yield (
            f"from log {rows.t[leans[0]]:.1f} s on it leans by more than 60 degrees at times: the "
            "model is linear about a hover, and what it bounds there says nothing of health"
        )


def _notes(axes: Sequence[str], *, is_own: bool, is_calm: bool) -> list[str]:
    found = []
    if not is_calm:
        found.append(
            f"the flight holds no hover of {HOVER_S:.1f} s: centres and noise are those of its "
            "first seconds"
        )
    lacking = [name for name in ("roll", "pitch", "yaw") if name not in axes]
    if lacking and not is_own:
        found.append(
            f"the flight does not tell how fast it turns in {' and '.join(lacking)} by what its "
            "motors are given: rates' residuals there have the reference quadrotor's scale"
        )
    return found
