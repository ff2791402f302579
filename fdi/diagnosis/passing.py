"""Which accusations were a passing disturbance, hardly more than noise, or rarely right?

A component that failed stays failed, or at least shows it in several ways. What one test or two
see for a few seconds, and then no more while the flight goes on, is a gust, a manoeuvre or a sample
gone wrong. A test that sees nothing but changes shows a step only while it happens: there a
disturbance has passed when what changed has come back, a record that went wrong or a load for a
moment. Nor is it a failure what nowhere goes clearly beyond what the flight's own noise
reaches: that level is an estimate itself. A sensor that disagrees only after control was lost did
not lose it. And what on such grounds was hardly ever right accuses nobody.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from fdi.decision import Alarms
from fdi.decision.accusing import CLEARLY, MOST_TESTS, PASSING_S, QUIET_S, sees_changes_only
from fdi.decision.alarms import QUIET
from fdi.decision.concerns import concerns
from fdi.diagnosis.confidence import grounds_of, load_confidence
from fdi.diagnosis.episodes import Run
from fdi.diagnosis.ranking import Cause
from fdi.model.parts import Kind
from fdi.residuals import Bank

_MEASURING: Final = ("sensor", "navigation")
BACK: Final = 0.5
"""Share of a change that is left when it counts as undone."""
LEAST_CONFIDENCE: Final = 0.1
"""Who accuses on such grounds is wrong nine times of ten."""


def is_no_failure(cause: Cause, end: float, alarms: Alarms) -> bool:
    """Return whether a cause is no failure: passing, marginal, unlikely, or after the cause.

    Parameters
    ----------
    cause : Cause
    end : float
        s, of what counts of the flight.
    alarms : Alarms
        Of which the runs are.
    """
    bank = alarms.residuals.bank
    if has_passed(cause, end, alarms) or is_marginal(cause, bank) or is_unlikely(cause, bank):
        return True
    return follows_loss_of_control(cause, alarms)


def follows_loss_of_control(cause: Cause, alarms: Alarms) -> bool:
    """Return whether a sensor or the estimator is blamed only after control was lost.

    A vehicle that tumbles turns its aerials to the ground and its sensors beyond their range; what
    made it tumble shows before. Motors, surfaces and the autopilot are not meant: how they answer
    in the fall says what they are, until a vehicle with rotors lies on its back for good.
    """
    group = alarms.residuals.bank.system.components[cause.component].group
    onset = min(run.onset for run in cause.runs)
    for end in alarms.residuals.signals.ends:
        since = end.lost_control if group in _MEASURING else end.overturned
        if since is not None and since <= onset <= end.at:
            return True
    return False


def is_unlikely(cause: Cause, bank: Bank) -> bool:
    """Return whether accusations on such grounds are hardly ever right."""
    return load_confidence().confidence(grounds_of(cause, concerns(bank))) < LEAST_CONFIDENCE


def has_passed(cause: Cause, end: float, alarms: Alarms) -> bool:
    """Return whether the alarms of a cause were passing.

    Parameters
    ----------
    cause : Cause
    end : float
        s, of what counts of the flight.
    alarms : Alarms
        Of which the runs are: a test that is unknown after its alarm does not say that it is over.
    """
    bank = alarms.residuals.bank
    tests = {bank.generators[run.row].residual for run in cause.runs}
    if len(tests) > MOST_TESTS:
        return False
    changes = [run for run in cause.runs if sees_changes_only(run.row, bank)]
    if changes:
        of_row = {run.row: [one for one in changes if one.row == run.row] for run in changes}
        return len(changes) == len(cause.runs) and all(
            comes_back(runs, alarms) for runs in of_row.values()
        )
    over = max(run.end for run in cause.runs)
    longest = max(run.end - run.onset for run in cause.runs)
    rows = sorted({run.row for run in cause.runs})
    after = (alarms.residuals.t >= over) & (alarms.residuals.t < end)
    quiet = (alarms.state[rows][:, after] == QUIET).any(axis=0)
    quiet_s = quiet.sum() / alarms.residuals.signals.rate_hz
    return bool(longest < PASSING_S and quiet_s >= QUIET_S)


def comes_back(runs: Sequence[Run], alarms: Alarms) -> bool:
    """Return whether what changed during the alarms of one test is soon as it was before.

    Notes
    -----
    The residual is a rate: its sum is what changed beyond what the model explains.
    """
    row, t = runs[0].row, alarms.residuals.t
    onset, end = min(run.onset for run in runs), max(run.end for run in runs)
    begin, over, later = np.searchsorted(t, [onset, end, onset + PASSING_S]).tolist()
    rate = np.nan_to_num(alarms.residuals.values[row, begin:later] - alarms.centre[row])
    change = np.abs(np.cumsum(rate))
    return bool(begin < over < later and change[over - begin :].min() < BACK * change.max())


def is_marginal(cause: Cause, bank: Bank) -> bool:
    """Return whether no test goes clearly beyond noise, and none beyond what the model states.

    Of the tests that hold a fault of the component, where there are any: what only suspects it may
    support an accusation, and does not make up for them.

    Parameters
    ----------
    cause : Cause
    bank : Bank
        Whose generators the runs' rows are.
    """
    system = bank.system
    left = [system.equations[bank.generators[run.row].residual] for run in cause.runs]
    if any(e.kind in (Kind.LIMIT, Kind.EQUALITY) for e in left):
        return False
    own = {fault.name for fault in system.faults if fault.component == cause.component}
    holding = [run for run in cause.runs if own.intersection(bank.generators[run.row].faults)]
    return max(run.peak for run in holding or cause.runs) < CLEARLY
