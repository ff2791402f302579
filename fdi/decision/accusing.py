"""What is enough to accuse? The numbers that both the search for causes and the budget go by.

The budget of false accusations must know what the search would make of an alarm of noise, so these
stand here, below both.
"""

from __future__ import annotations

from typing import Final

from fdi.residuals import Bank

WEIGHING_S: Final = 10.0
"""Alarms within this time after the onset are weighed for the cause."""
EVIDENCE: Final = 2.0
"""Less evidence accuses nobody, unless a test that concerns no other component alarms."""
EVIDENCE_NEARLY: Final = 1.7
"""What is enough where a test concerns beside the component only what is computed."""
EVIDENCE_COMPUTED: Final = 4.0
"""What has no parts that break is accused on several tests only, and after all others."""

PASSING_S: Final = 8.0
"""Alarms none of which lasts longer may be passing. Chosen: of the right accusations on labelled
flights none that ended in flight, by one test or two, lasted less than 8.6 s."""
MOST_TESTS: Final = 2
"""What more tests see is no chance."""
QUIET_S: Final = 10.0
"""So long the flight must go on without them."""

CLEARLY: Final = 1.4
"""Times its threshold. The level of noise comes from a few blocks of the flight, so it is uncertain
itself; of the right accusations on labelled flights that rest on tests of noise the weakest reached
1.7, and of the wrong ones three did not reach 1.35."""


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
