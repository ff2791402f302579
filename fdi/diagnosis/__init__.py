"""Finds the components whose failure explains the alarms.

Given alarms over time and the signatures of the residuals; sought the components that failed first,
such that every alarm is explained and no quiet test speaks against them. ``Alarms`` + ``Bank`` ->
``Diagnosis``.

- ``values.py``: the values of this stage
- ``answer.py``: the stage itself, from alarms to the answer
- ``marking.py``: which fault is marked when, over the flight
- ``episodes.py``: which alarms a flight holds, and which belong together
- ``ranking.py``: which component explains an episode of alarms, and which follow from it
- ``weighing.py``: how well a component explains alarms
- ``passing.py``: which accusations were a passing disturbance
- ``confidence.py``: how sure an accusation is
- ``isolability.py``: which faults can be seen and told apart
- ``direction.py``: how far the residuals have moved along a fault's direction
- ``size.py``: by how much a sensor is wrong
- ``explain.py``: what is said about it in words
"""

from fdi.diagnosis.answer import diagnose
from fdi.diagnosis.values import (
    Consequence,
    Diagnosis,
    Evidence,
    FaultGrid,
    Finding,
    Grounds,
    Isolability,
    NotTestable,
    RuledOut,
    Size,
    runs,
)

__all__ = [
    "Consequence",
    "Diagnosis",
    "Evidence",
    "FaultGrid",
    "Finding",
    "Grounds",
    "Isolability",
    "NotTestable",
    "RuledOut",
    "Size",
    "diagnose",
    "runs",
]
