"""The linear observer while the vehicle flies: one step a record.

In: records as they come. Out: residuals, thresholds, alarms and weak motors of the last minute, and
lines. Once enough of the flight's beginning is there (20 s from its first hover on, as in a file),
vehicle, centres and noise are learned from it by the functions that `observe` calls, the observer
runs over what has been kept, and goes on from there record by record (`run`). So with a vehicle
that is stated every residual is that of the file, and so are centres, noise and thresholds; where
the flight's own turns have to tell the inertias, only those before count, and the file's differ.

A file shows in hindsight when the vehicle stood on the ground, and judges nothing from there on.
Live, an alarm that begins near the ground waits till the vehicle has climbed from there or would
have been disarmed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from fdi.live.hearing import Hearing
from fdi.live.window import Parameters, Window, as_of, since_boot
from fdi.methods.observer import REFERENCE_QUADROTOR, Vehicle
from fdi.methods.observer.fitted import CALM_S, inputs_of
from fdi.methods.observer.limits import Alarm, Limits, alarms_of, learn
from fdi.methods.observer.motor import WeakMotor, weak_motors
from fdi.methods.observer.observation import Begun, begin_flight, outputs_of, run
from fdi.methods.observer.observer import GAP_S, Observer, ObserverState, begin, design
from fdi.methods.observer.records import LackingError, Rows, multicopter, rows_of
from fdi.methods.observer.states import PSI, RESIDUALS, STATES
from fdi.telemetry import Log
from fdi.telemetry.events import SETTLING_S
from fdi.telemetry.impact import MOVED_M
from fdi.telemetry.message import Floats

RECENT_S: Final = 8.0
"""Records at 2 Hz, the slowest, are known to be that from ten of them on."""
FIRST_S: Final = 300.0
"""From so long before, at most, the beginning of a flight is learned."""
EVERY_S: Final = 5.0
"""Whether the beginning is told is looked at so often."""
HOVERLESS_S: Final = 60.0
"""In the air for so long without a hover, its first seconds have to do."""
SHOWN_S: Final = 60.0
MOST_SHOWN: Final = 30000
"""Records, 500 Hz for a minute."""
MOST_ALARMS: Final = 500
GROUND_S: Final = 10.0
"""A vehicle that has landed is disarmed within that (ArduPilot's usual DISARM_DELAY)."""
_LATE_S: Final = 0.5
"""Messages of one moment are no further apart on a link."""
_Z: Final = STATES.index("z")

Span = TypeVar("Span", Alarm, WeakMotor)
Sink = Callable[[Floats, Floats, Floats], None]
"""Is given t (n,) s since boot, residuals and doubts (13, n) of records as they are computed."""


@dataclass(frozen=True, slots=True, eq=False)
class Recent:
    """The last minute.

    ``t``: (n,) s since boot; ``height``: (n,) m above the place of take-off; residuals off their
    centres and thresholds: (13, n).
    """

    t: Floats
    height: Floats
    off: Floats
    threshold: Floats

    def later(self, t: Floats, height: Floats, off: Floats, threshold: Floats) -> Recent:
        """Return it with what has come since, and without what is old."""
        times = np.concatenate([self.t, t])
        first = int(np.searchsorted(times, times[-1] - SHOWN_S)) if times.size else 0
        kept = slice(max(first, times.size - MOST_SHOWN), None)
        both = zip((self.off, self.threshold), (off, threshold), strict=True)
        heights = np.concatenate([self.height, height])
        return Recent(
            times[kept], heights[kept], *(np.concatenate(pair, axis=1)[:, kept] for pair in both)
        )


def nothing() -> Recent:
    """Return the value before any record."""
    none = np.empty((len(RESIDUALS), 0))
    return Recent(np.empty(0), np.empty(0), none, none)


@dataclass(frozen=True, slots=True, eq=False)
class Learned:
    """What the beginning of a flight told.

    ``start``: since when it is in the air, s since boot; ``log``: its vehicle and parameters hold.
    """

    begun: Begun
    limits: Limits
    start: float
    log: Log


@dataclass(slots=True)
class Observing:
    """The observer of a link; see the module. ``parameters``: of an earlier log, where given."""

    vehicle: Vehicle = REFERENCE_QUADROTOR
    source: str = "estimator"
    outputs: Sequence[str] | None = None
    gain: str = "poles"
    given: Log | None = None
    sink: Sink | None = None
    learned: Learned | None = None
    state: ObserverState | None = None
    recent: Recent = field(default_factory=nothing)
    alarms: list[Alarm] = field(default_factory=list)
    motors: list[WeakMotor] = field(default_factory=list)
    waits_for: str = "a vehicle"
    _first: Window = field(default_factory=lambda: Window("the link", FIRST_S))
    _last: Window = field(default_factory=lambda: Window("the link", RECENT_S))
    _done: float = -np.inf
    _looked: float = -np.inf

    def __post_init__(self) -> None:
        """Refuse outputs that leave states unknown before any link is opened."""
        design(self.vehicle, outputs_of(self.source, self.outputs), self.gain)

    def take(self, records: bytes, hearing: Hearing) -> None:
        """Keep records of the vehicle."""
        self._last.take(records, hearing.boot_s)
        if self.learned is None:
            self._first.take(records, hearing.boot_s)

    def begin_anew(self, *, why: str) -> None:
        """Forget the flight; what was told of it stays told."""
        self.learned = self.state = None
        self.recent, self.alarms, self.motors = nothing(), [], []
        self._first.clear()
        self._last.clear()
        self._done = self._looked = -np.inf
        self.waits_for = f"a take-off ({why})"

    def tick(self, hearing: Hearing, parameters: Parameters) -> list[str]:
        """Compute the records that have come since, and return what is to tell.

        Raises
        ------
        LogError
            The vehicle is no multicopter, or records come too seldom.
        """
        assert hearing.speaker is not None
        multicopter(hearing.speaker.vehicle, "the link")
        if self.learned is not None:
            return self._follow(hearing)
        if hearing.boot_s - self._looked < EVERY_S:
            return []
        self._looked = hearing.boot_s
        return self._learn(hearing, parameters)

    def _learn(self, hearing: Hearing, parameters: Parameters) -> list[str]:
        log = self._first.log(hearing, parameters)
        if log is None:
            return []
        if self.given is not None:
            log = as_of(log, log.vehicle, {**self.given.parameters, **log.parameters}, log.frame)
        before = self.waits_for
        self.waits_for = "a take-off"
        try:
            rows_of(log, self.source)
            if hearing.armed and log.flights and log.flights[-1].flew:
                self.waits_for = "20 s of calm flight, which tell centres and noise"
                return self._adopt(log)
        except LackingError as error:
            if not self.waits_for.startswith("20 s"):
                self.waits_for = f"more: it {error.message}"
        return [f"waiting for {self.waits_for}"] if self.waits_for != before else []

    def _adopt(self, log: Log) -> list[str]:
        """Learn from the flight's beginning once that is whole."""
        begun = begin_flight(
            log, self.vehicle, source=self.source, outputs=self.outputs, gain=self.gain
        )
        rows, offset = begun.rows, since_boot(log)
        first = rows.t[begun.calm][0]
        enough = first + CALM_S if begun.is_calm else begun.air[0] + SETTLING_S + HOVERLESS_S
        if rows.t[-1] < enough or not np.isfinite(offset):
            return []
        upto = _complete(begun.observer, rows, rows.t)
        t, u, calm = (rows.t + offset)[upto], begun.u[:, upto], begun.calm[upto]
        state, value, doubt = run(begin(begun.observer), t, rows.y[:, upto], u)
        limits = learn(rows.t[upto], value, calm)
        limits = replace(limits, since=limits.since + offset)
        self.learned = Learned(begun, limits, begun.air[0] + offset, log)
        self.state, self._done = state, float(t[-1])
        self._first.clear()
        named = begun.observer.vehicle
        told = f"watching: every motor gives {named.thrust_max:.2f} N at most for {named.mass:g} kg"
        return [told, *begun.notes, *self._judge(t, rows.y[_Z, upto], value, doubt)]

    def _follow(self, hearing: Hearing) -> list[str]:
        assert self.learned is not None
        assert self.state is not None
        log = self._last.log(hearing)
        if log is None or not np.isfinite(since_boot(log)):
            return []
        told = self.learned.log
        try:
            rows = rows_of(as_of(log, told.vehicle, told.parameters, told.frame), self.source)
        except LackingError:  # a stream has stopped: nothing is known until it comes back
            return []
        rows, t = self._ready(rows, rows.t + since_boot(log), float(log.clock.start[-1]))
        if not t.size:
            return []
        u = inputs_of(self.learned.begun.observer.vehicle, rows)
        self.state, value, doubt = run(self.state, t, rows.y, u)
        self._done = float(t[-1])
        return self._judge(t, rows.y[_Z], value, doubt)

    def _ready(self, rows: Rows, t: Floats, boot: float) -> tuple[Rows, Floats]:
        """Return the records that are new, as far as what lies around them has come."""
        assert self.learned is not None
        new = _complete(self.learned.begun.observer, rows, t)
        new &= (t > self._done + 1e-6) & (rows.t >= boot)
        own = Rows(rows.t[new], rows.y[:, new], rows.thrust[:, new], rows.motors, rows.source)
        return own, t[new]

    def _judge(self, t: Floats, z: Floats, value: Floats, doubt: Floats) -> list[str]:
        """Hold residuals against their thresholds, and return what is new."""
        assert self.learned is not None
        limits = self.learned.limits
        if self.sink is not None:
            self.sink(t, value, doubt)
        threshold = limits.threshold(t, doubt)
        threshold[:, t < self.learned.start + SETTLING_S] = np.nan
        own = self.learned.begun
        height = float(own.rows.y[_Z, 0]) - z
        self.recent = seen = self.recent.later(t, height, limits.off(value), threshold)
        found = alarms_of(seen.t, seen.off, seen.threshold)
        alarms = [one for one in found if not _may_have_landed(one, seen)]
        motors = weak_motors(alarms, seen.t, seen.off, own.observer.vehicle, own.rows.motors)
        now, lines = float(seen.t[-1]), []
        for one in alarms:
            if merge(self.alarms, one, lambda a: a.residual):
                lines.append(
                    f"{one.residual} beyond its threshold since {one.start:.1f} s since boot, "
                    f"told {now - one.start:.1f} s later"
                )
        for weak in motors:
            if merge(self.motors, weak, lambda w: w.number):
                lines.append(
                    f"MOTOR {weak.number} gives less than it is asked for since {weak.start:.1f} s "
                    f"since boot, told {now - weak.start:.1f} s later"
                )
        return lines


def _may_have_landed(alarm: Alarm, seen: Recent) -> bool:
    since = slice(int(np.searchsorted(seen.t, alarm.start)), None)
    is_low = bool(np.nanmax(seen.height[since], initial=-np.inf) < MOVED_M)
    return is_low and float(seen.t[-1]) - alarm.start < GROUND_S


def _complete(observer: Observer, rows: Rows, t: Floats) -> NDArray[np.bool_]:
    """Return the records, (n,) bool, of which all that lies around them has come."""
    known = np.isfinite(rows.y[[*observer.measured, PSI]]).all(axis=0)
    known &= np.isfinite(rows.thrust).all(axis=0)
    # what is not known beyond a gap will not be: the next record of its message is too far
    upto = max(t[known][-1] if known.any() else -np.inf, t[-1] - GAP_S - _LATE_S)
    return np.asarray(t <= upto)


def merge(known: list[Span], one: Span, key: Callable[[Span], object]) -> bool:
    """Let a span that was found among the last records be part of what is known already.

    Returns whether it is new. It is the same where the two overlap, and begins where it began.
    """
    for place, other in enumerate(known):
        if key(other) == key(one) and one.start <= other.end and one.end >= other.start:
            begins = min(other.start, one.start)
            known[place] = one._replace(start=begins, end=max(other.end, one.end))
            return False
    known.append(one)
    del known[:-MOST_ALARMS]
    return True
