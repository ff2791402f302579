"""The bank and the methods while the vehicle flies: one bank, a block of records a tick.

In: records as they come. Out: residuals over the last 90 s, tests in alarm, accused components, and
lines. Once a flight has been in the air for half a minute, the chain of files runs over what was
kept of it: channels, bank, parameters, lags, constants, thresholds and the scale of the budget are
what this minute tells, and stay. From then on the same bank is evaluated anew over a window that is
longer than any operator of the shipped models looks back (60 s), on the grid that began with the
flight: its samples are those of the whole flight, but near the ends of the window. The records of
the flight's beginning stay beside the window, so that what the methods learn from them (levels of
ratios, offsets of gyroscopes) is what they learn in a file. The bank and the thresholds are not
those of a file, which learns from all of the flight. Who is accused is the diagnosis of that
window.

A tick takes a few tenths of a second of processor time and is repeated as often as costs so small a
share of a core.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from fdi.chain import Chain, residuals_of
from fdi.decision import Alarms, Policy, load_policy
from fdi.decision.bounds import Told, held_against, told_by
from fdi.decision.judging import judge
from fdi.decision.recipes import PredictedSpread
from fdi.diagnosis import diagnose
from fdi.diagnosis.plain import alarm_sentences
from fdi.errors import UsageError
from fdi.live.hearing import Hearing
from fdi.live.window import Parameters, Window, as_of, since_boot
from fdi.methods.columns import with_columns
from fdi.methods.table import methods_of
from fdi.model.naming import component_words
from fdi.residuals import Residuals
from fdi.residuals.latency import with_lags
from fdi.telemetry import Flight, Log
from fdi.telemetry.airtime import in_air
from fdi.telemetry.message import Floats
from fdi.units import hundredths
from fdi.windows import runs_of

FIRST_S: Final = 300.0
LEARNED_S: Final = 30.0
"""In the air: the reference of constants after the settling, and some seconds more."""
EVERY_S: Final = 5.0
WINDOW_S: Final = 90.0
EDGE_S: Final = 15.0
"""From the window's begin: the longest mean, and what settles. There no alarm begins."""
SHARE: Final = 0.06
"""Of a core, on average."""
LEAST_S: Final = 2.0
MOST_KEPT: Final = 500
_STALE_S: Final = 5.0

Sink = Callable[[Floats, Floats], None]
"""Is given t (n,) s since boot, and residuals (r, n) of a window."""


class TestAlarm(NamedTuple):
    """A test in alarm: its row in the bank, from when to when, s since boot."""

    row: int
    start: float
    end: float


class Accused(NamedTuple):
    """An accused component, in a person's words too: since when, s since boot; when told; 0..1."""

    component: str
    words: str
    onset: float
    told: float
    confidence: float


@dataclass(frozen=True, slots=True, eq=False)
class Learned:
    """What the first half minute told; ``base``: s, from its log's clock to s since boot."""

    chain: Chain
    told: Told
    scale: float
    flight: Flight
    base: float


@dataclass(slots=True)
class Watching:
    """The bank of a link; see the module."""

    policy: Policy = field(default_factory=lambda: load_policy("default"))
    model: str | Path = "auto"
    given: Log | None = None
    sink: Sink | None = None
    share: float = SHARE
    clock: Callable[[], float] = time.process_time
    """s; what a tick costs is read from it."""
    learned: Learned | None = None
    alarms: Alarms | None = None
    offset: float = 0.0
    says: tuple[str, ...] = ()
    """What an alarm of each test means, in the order of the bank."""
    known: list[TestAlarm] = field(default_factory=list)
    accused: list[Accused] = field(default_factory=list)
    waits_for: str = "a vehicle"
    _first: Window = field(default_factory=lambda: Window("the link", FIRST_S))
    _last: Window = field(default_factory=lambda: Window("the link", WINDOW_S + EDGE_S))
    _next: float = -np.inf

    def __post_init__(self) -> None:
        """Refuse a policy that knows its thresholds only once the flight is over."""
        if not isinstance(self.policy.decision, PredictedSpread):
            raise UsageError(
                f"the policy {self.policy.name} takes its thresholds from a whole flight",
                hint="watch with default, or one that was calibrated",
            )

    def take(self, records: bytes, hearing: Hearing) -> None:
        """Keep records of the vehicle."""
        self._last.take(records, hearing.boot_s)
        if self.learned is None:
            self._first.take(records, hearing.boot_s)

    def begin_anew(self, *, why: str) -> None:
        """Forget the flight; what was told of it stays told."""
        self.learned = self.alarms = None
        self.known, self.accused = [], []
        self._first.clear()
        self._last.clear()
        self._next = -np.inf
        self.waits_for = f"a take-off ({why})"

    def tick(self, hearing: Hearing, parameters: Parameters) -> list[str]:
        """Compute what has come since, and return what is to tell.

        Raises
        ------
        LogError, ModelError
            The vehicle sends nothing that a model could use, or the model does not fit it.
        """
        if hearing.boot_s < self._next:
            return []
        since = self.clock()
        learned = self.learned
        lines = self._follow(hearing, learned) if learned else self._learn(hearing, parameters)
        cost = self.clock() - since
        least = LEAST_S if learned else EVERY_S
        # what the link brings faster than in real time is computed as often, of its own clock
        self._next = hearing.boot_s + max(least, cost / self.share if learned else least)
        return lines

    def _learn(self, hearing: Hearing, parameters: Parameters) -> list[str]:
        before, self.waits_for = self.waits_for, "a take-off"
        log = self._first.log(hearing, parameters) if hearing.armed else None
        if log is not None and self.given is not None:
            log = as_of(log, log.vehicle, {**self.given.parameters, **log.parameters}, log.frame)
        if log is not None and log.flights and log.flights[-1].flew:
            self.waits_for = f"{LEARNED_S:.0f} s in the air, which tell what is usual"
            start, end = in_air(log.flights[-1])
            if end - start >= LEARNED_S and np.isfinite(since_boot(log)):
                return self._adopt(log)
        return [f"waiting for {self.waits_for}"] if self.waits_for != before else []

    def _adopt(self, log: Log) -> list[str]:
        chain = residuals_of(log, self.model, self.policy)
        recipe = chain.policy.decision
        assert isinstance(recipe, PredictedSpread)
        alarms = chain.policy.decide(chain.residuals)
        told = told_by(chain.residuals, recipe)
        base = since_boot(log)
        begin, _ = in_air(log.flights[-1])
        begin += base
        self._last.beginning = self._first.between(begin - EDGE_S, begin + LEARNED_S)
        self.learned = Learned(chain, told, alarms.scale, log.flights[-1], base)
        self.says = alarm_sentences(chain.bank)
        self._first.clear()
        count = len(chain.bank.generators)
        text = f"watching {count} tests of the model {chain.airframe.name}"
        return [text, *chain.silent, *self._tell(alarms, base)]

    def _follow(self, hearing: Hearing, learned: Learned) -> list[str]:
        residuals, offset = self._residuals(hearing, learned)
        if residuals is None:
            return []
        recipe, policy = learned.chain.policy.decision, learned.chain.policy
        assert isinstance(recipe, PredictedSpread)
        bounds = held_against(residuals, learned.told, recipe)
        return self._tell(judge(residuals, bounds, recipe, policy.use, learned.scale), offset)

    def _residuals(self, hearing: Hearing, learned: Learned) -> tuple[Residuals | None, float]:
        """Return the residuals over the window, and what makes s since boot of its times."""
        log, chain = self._last.log(hearing), learned.chain
        if log is None or not np.isfinite(since_boot(log)):
            return None, 0.0
        offset, known = since_boot(log), chain.log
        log = as_of(log, known.vehicle, known.parameters, known.frame)
        # the flight as it began: the window does not show that it did
        log._cache["flights"] = (_moved(learned.flight, learned.base - offset, log.span[1]),)
        log, _ = with_columns(log, methods_of(chain.policy.methods))
        rate, origin = chain.signals.rate_hz, float(chain.signals.t[0]) + learned.base - offset
        low = max(log.span[0], log.span[1] - WINDOW_S)
        low = origin + np.ceil((low - origin) * rate) / rate
        if not low + EDGE_S < log.span[1]:
            return None, 0.0
        grid = replace(chain.policy.sampling, rate_hz=rate, window=(low, log.span[1]))
        signals = log.signals(with_lags(chain.bank.system.channels, chain.lags), grid)
        signals = replace(signals, period=chain.signals.period, spacing=chain.signals.spacing)
        found = chain.bank.evaluate(signals, chain.policy.differentiation)
        if self.sink is not None:
            self.sink(signals.t + offset, found.values)
        return found, offset

    def _tell(self, alarms: Alarms, offset: float) -> list[str]:
        """Return what is new in a window's alarms."""
        assert self.learned is not None
        self.alarms, self.offset = alarms, offset
        t, bank = alarms.residuals.t + offset, alarms.residuals.bank
        now, lines = float(t[-1]), []
        edge = float(t[0]) + EDGE_S
        for one in _runs(alarms.alarm, t):
            if one.end >= edge and self._is_new(one):
                lines.append(
                    f"in alarm: {self.says[one.row]} ({bank.generators[one.row].id}), "
                    f"{_moment(one.start, now)}"
                )
        if any(one.end >= now - _STALE_S for one in self.known):
            lines += self._accuse(alarms, now, offset)
        return lines

    def _is_new(self, one: TestAlarm) -> bool:
        for place, other in enumerate(self.known):
            if other.row == one.row and one.start <= other.end and one.end >= other.start:
                start, end = min(one.start, other.start), max(one.end, other.end)
                self.known[place] = TestAlarm(one.row, start, end)
                return False
        self.known.append(one)
        del self.known[:-MOST_KEPT]
        return True

    def _accuse(self, alarms: Alarms, now: float, offset: float) -> list[str]:
        lines = []
        for one in diagnose(alarms, alarms.residuals.bank).findings:
            if one.component in (other.component for other in self.accused):
                continue
            onset = one.onset + offset
            words = component_words(one.component, alarms.residuals.bank.system.components)
            self.accused.append(Accused(one.component, words, onset, now, one.confidence))
            sure = f"{hundredths(one.confidence)} % sure"
            lines.append(f"ACCUSED: {words}, {sure}, {_moment(onset, now)}")
        return lines


def _moment(since: float, now: float) -> str:
    """Return when something began, s since boot, and how much later it is told."""
    return f"from {since:.1f} s since boot on, told {now - since:.1f} s later"


def _moved(flight: Flight, by: float, end: float) -> Flight:
    """Return a flight on another clock, that lasts till now."""

    def at(t: float | None) -> float | None:
        return None if t is None else t + by

    return replace(
        flight,
        start=flight.start + by,
        end=end,
        takeoff=at(flight.takeoff),
        climbed=at(flight.climbed),
        aloft=((flight.aloft[0][0] + by, end),) if flight.aloft else (),
        landing=None,
        impact=None,
        approach=None,
    )


def _runs(alarm: np.ndarray[tuple[int, int], np.dtype[np.bool_]], t: Floats) -> list[TestAlarm]:
    """Return the runs of alarms, row by row."""
    found = []
    for row in np.flatnonzero(alarm.any(axis=1)).tolist():
        for low, high in runs_of(alarm[row]):
            found.append(TestAlarm(row, float(t[low]), float(t[high - 1])))
    return found
