"""Which accusations were a passing disturbance, and no failure?

A component that failed stays failed, or at least shows it in several ways. What one test or two
see for a few seconds, and then no more while the flight goes on, is a gust, a manoeuvre or a sample
gone wrong. A test that sees nothing but changes is left out of this: a step shows there only
while it happens.
"""

from __future__ import annotations

from typing import Final

from fdi.diagnosis.ranking import Cause
from fdi.residuals import Bank

PASSING_S: Final = 8.0
"""Alarms none of which lasts longer may be passing. Chosen: of the right accusations on labelled
flights none that ended in flight, by one test or two, lasted less than 8.6 s."""
MOST_TESTS: Final = 2
"""What more tests see is no chance."""
QUIET_S: Final = 10.0
"""So long the flight must go on without them."""


def has_passed(cause: Cause, end: float, bank: Bank) -> bool:
    """Return whether the alarms of a cause were passing.

    Parameters
    ----------
    cause : Cause
    end : float
        s, of what counts of the flight.
    bank : Bank
        Whose generators the runs' rows are.
    """
    tests = {bank.generators[run.row].residual for run in cause.runs}
    if len(tests) > MOST_TESTS or any(sees_changes_only(run.row, bank) for run in cause.runs):
        return False
    over = max(run.end for run in cause.runs)
    longest = max(run.end - run.onset for run in cause.runs)
    return longest < PASSING_S and end - over >= QUIET_S


def sees_changes_only(row: int, bank: Bank) -> bool:
    """Return whether every channel reaches a residual through a derivative."""
    stack = [bank.generators[row].node]
    while stack:
        node = bank.nodes[stack.pop()]
        if node.kind == "channel":
            return False
        if node.kind != "derivative":
            stack.extend(number for _, number in node.arguments)
    return True
