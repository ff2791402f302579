"""Finds the components whose failure explains the alarms.

Given alarms over time and the signatures of the residuals; sought the components that failed first,
such that every alarm is explained and no quiet test speaks against them. ``Alarms`` + ``Bank`` ->
``Diagnosis``.

- ``values.py``: the values of this stage
- ``answer.py``: the stage itself, from alarms to the answer
- ``marking.py``: which fault is marked when, over the flight
- ``alarm_runs.py``: which alarms a flight holds
- ``concerns.py``: whom each residual concerns
- ``hypotheses.py``: who could have made them, at every moment
- ``features.py``: what speaks for and against a component, as numbers
- ``likelihood.py``: how probable each is, and nobody
- ``naming.py``: who is accused, and which alarms only follow
- ``others.py``: why it was not another part
- ``isolability.py``: which faults can be seen and told apart
- ``direction.py``: how far the residuals have moved along a fault's direction
- ``size.py``: by how much a sensor is wrong
- ``kind.py``: in which way a component failed
- ``plain.py``: what an alarm means in a pilot's words
- ``agreement.py``: whether other methods accuse the same component
- ``explain.py``: the evidence for a finding in words
- ``clearing.py``: who is ruled out, and how small a fault would have shown
- ``together.py``: who together explains all alarms, where one is not the whole answer
- ``undecided.py``: who is neither accused nor cleared, who could not be tested
- ``ending.py``: what was first where a flight ended badly
- ``verdict.py``: the answer in words
"""

from fdi.diagnosis.answer import diagnose
from fdi.diagnosis.values import (
    Agreement,
    Consequence,
    Diagnosis,
    Ending,
    Evidence,
    FaultGrid,
    Finding,
    First,
    Isolability,
    NotTestable,
    Open,
    Other,
    Outlook,
    RuledOut,
    Size,
    Term,
    Together,
    WouldShow,
    runs,
)

__all__ = [
    "Agreement",
    "Consequence",
    "Diagnosis",
    "Ending",
    "Evidence",
    "FaultGrid",
    "Finding",
    "First",
    "Isolability",
    "NotTestable",
    "Open",
    "Other",
    "Outlook",
    "RuledOut",
    "Size",
    "Term",
    "Together",
    "WouldShow",
    "diagnose",
    "runs",
]
