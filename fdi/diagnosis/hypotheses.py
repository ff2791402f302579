"""Who could have made these alarms, and what speaks for and against each?

In: alarms. Out: an `Inquiry` for every flight: what its tests did, and whom they concern. At every
alarm it has a `Case`: the components that structure lets explain what begins or stands there, with
their features. Nobody is among them of whom no alarming test speaks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.decision import Alarms
from fdi.decision.alarms import UNKNOWN
from fdi.diagnosis.alarm_runs import Run, find_runs
from fdi.diagnosis.concerns import Concerns, Tie, affected, concerns
from fdi.diagnosis.features import LEAST, MOST, SIMULTANEOUS_S, Doings, features
from fdi.diagnosis.outvoted import Denial, denials, denied
from fdi.model.evaluate import Floats
from fdi.telemetry.airtime import time_in_air
from fdi.telemetry.ends import FlightEnd

WINDOW_S: Final = 10.0
"""What begins within this time after an alarm is weighed with it."""
KNOWN_SHARE: Final = 0.5
"""A test that is known for less of a window is not judged in it."""
_MEASURING: Final = ("sensor", "navigation")
OUTSIDE: Final = "outside_model"
"""What no component of the model stands for; it cannot be accused."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """Whom the alarms around a moment, s, could be blamed on.

    Attributes
    ----------
    names : tuple of str
        The candidates, in the order of the model.
    features : (c, k) float
        Of every candidate the values of `FEATURES`.
    ties : (c, a) int8
        Of every candidate the `Tie` to each of the tests that alarm.
    """

    at: float
    names: tuple[str, ...]
    features: Floats
    ties: NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class Inquiry:
    """What the tests did in one flight, and whom they concern; r tests, n samples.

    Attributes
    ----------
    flight : int
    start, end : float
        s, of what counts of the flight.
    t : (n,) float
    share : (r, n) float32
        Of its threshold that a test reaches; NaN where that is not known.
    runs : tuple of Run
        The alarms that may accuse, in the order of onset.
    ending : FlightEnd or None
    whom : Concerns
    command : (r,) bool
        Tests that read a recorded command as evidence.
    denials : tuple of Denial
        Whose doing an alarm is not, by tests that are quiet.
    """

    flight: int
    start: float
    end: float
    t: Floats
    share: NDArray[np.float32]
    runs: tuple[Run, ...]
    ending: FlightEnd | None
    whom: Concerns
    command: NDArray[np.bool_]
    ties: dict[str, NDArray[np.int8]]
    reach: dict[str, frozenset[str]]
    denials: tuple[Denial, ...]

    def case(self, at: float, runs: Sequence[Run]) -> Case:
        """Return the case of a moment, s, by those of the runs that stand or begin soon after."""
        done = self.doings(at, runs)
        outvoted = denied(self.denials, done.alarmed, done.judged)
        ties = self.ties | {
            name: np.where(rows & (self.ties[name] < Tie.HELD), np.int8(Tie.NONE), self.ties[name])
            for name, rows in outvoted.items()
        }
        names = tuple(name for name in ties if (ties[name][self._accusing(name, done)] > 0).any())
        alarming = [ties[name][done.alarmed] for name in names]
        return Case(
            at,
            names,
            features(names, ties, self.reach, done, self.whom, outvoted),
            np.array(alarming, np.int8).reshape(len(names), int(done.alarmed.sum())),
        )

    def _accusing(self, name: str, done: Doings) -> NDArray[np.bool_]:
        """Return the alarms, (r,), on which a component may be accused.

        A vehicle that tumbles turns its aerials to the ground and its sensors beyond their range:
        what measures is not accused on alarms that came after control was lost.
        """
        accusing = done.alarmed & ~self.whom.supports
        lost = None if self.ending is None else self.ending.lost_control
        if lost is not None and self.whom.components[name].group in _MEASURING:
            accusing &= done.onset < lost - SIMULTANEOUS_S
        return accusing

    def cases(self) -> Iterator[Case]:
        """Yield the case of every alarm, as long as nobody is accused."""
        after = -np.inf
        for run in self.runs:
            if run.onset > after:
                after = run.onset + SIMULTANEOUS_S
                case = self.case(run.onset, self.runs)
                if case.names:
                    yield case

    def without_commands(self) -> Inquiry:
        """Return what the tests did that read no recorded command as evidence."""
        share = np.where(self.command[:, None], np.float32(np.nan), self.share)
        runs = tuple(run for run in self.runs if not self.command[run.row])
        return replace(self, share=share, runs=runs)

    def _explained(self, at: float, here: Sequence[Run]) -> Iterator[Run]:
        """Yield the alarms around a moment that are not among those asked about."""
        asked = set(here)
        return (run for run in self.runs if _is_here(run, at) and run not in asked)

    def doings(self, at: float, runs: Sequence[Run]) -> Doings:
        """Return what the tests did around a moment, s, of the runs those that are asked about."""
        count = len(self.share)
        alarmed = np.zeros(count, bool)
        onset, over = np.full(count, np.inf), np.full(count, -np.inf)
        peak = np.zeros(count)
        here = [run for run in runs if _is_here(run, at)]
        for run in here:
            alarmed[run.row] = True
            onset[run.row] = min(onset[run.row], run.onset)
            peak[run.row] = max(peak[run.row], run.peak)
        for run in runs:
            if run.end >= at and alarmed[run.row]:
                over[run.row] = max(over[run.row], run.end)
        low, high = np.searchsorted(self.t, [at, at + WINDOW_S])
        window = self.share[:, low : max(high, low + 1)].astype(float)
        known = np.isfinite(window)
        reached = np.where(known, window, 0.0).max(axis=1, initial=0.0)
        near = np.log(np.clip(np.maximum(reached, peak), LEAST, MOST))
        judged = alarmed | (known.mean(axis=1) > KNOWN_SHARE)
        # what is explained already is no quiet test
        judged[[run.row for run in self._explained(at, here) if not alarmed[run.row]]] = False
        rest = slice(low, int(np.searchsorted(self.t, self.end)))
        return Doings(at, alarmed, judged, onset, over, near, self.t[rest], self.share[:, rest])


def _is_here(run: Run, at: float) -> bool:
    """Return whether an alarm stands at a moment, s, or begins soon after it."""
    return run.end >= at and run.onset <= at + WINDOW_S


def _runs(
    alarms: Alarms, span: tuple[float, float], since: float, ending: FlightEnd | None
) -> tuple[Run, ...]:
    """Return the alarms of a flight that may accuse: what begins on its back is no cause."""
    over = None if ending is None else ending.overturned
    found = find_runs(alarms, *span, since)
    return tuple(run for run in found if over is None or run.onset < over)


def inquire(alarms: Alarms) -> tuple[Inquiry, ...]:
    """Return what the tests did in every flight.

    Parameters
    ----------
    alarms : Alarms
    """
    residuals = alarms.residuals
    bank = residuals.bank
    whom = concerns(bank)
    names = [name for name in bank.system.components if name != OUTSIDE]
    ties = {name: whom.ties(name) for name in names}
    reach = {name: frozenset(affected(name, whom.components)) for name in names}
    known = denials(whom, reach)
    equations = bank.system.equations
    command = [any(equations[i].command for i in one.equations) for one in bank.generators]
    share = np.where(alarms.state == UNKNOWN, np.nan, alarms.strength).astype(np.float32)
    ends = {end.flight: end for end in residuals.signals.ends}
    spans = time_in_air(residuals.signals)
    over = [-np.inf, *(end for _, end in spans)]  # the flight before
    return tuple(
        Inquiry(
            flight=number,
            start=start,
            end=end,
            t=residuals.t,
            share=share,
            runs=_runs(alarms, (start, end), over[number], ends.get(number)),
            ending=ends.get(number),
            whom=whom,
            command=np.array(command, bool),
            ties=ties,
            reach=reach,
            denials=known,
        )
        for number, (start, end) in enumerate(spans)
    )
