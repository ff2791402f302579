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
- ``outvoted.py``: whose doing an alarm is not, by a test that is quiet
- ``likelihood.py``: how probable each is, and nobody
- ``naming.py``: who is accused, and which alarms only follow
- ``episodes.py``: several accusations of one part are one, dated by the episode that lasts
- ``claim.py``: how strongly a finding may be said, and of whom
- ``worth.py``: how often so sure an accusation was right
- ``others.py``: why it was not another part
- ``isolability.py``: which faults can be seen and told apart
- ``direction.py``: how far the residuals have moved along a fault's direction
- ``size.py``: by how much a sensor is wrong
- ``kind.py``: in which way a component failed
- ``plain.py``: what an alarm means in a pilot's words
- ``agreement.py``: whether other methods accuse the same component
- ``explain.py``: the evidence for a finding in words
- ``straying.py``: which tests left health, and which statements were violated all along
- ``clearing.py``: who is ruled out; ``would_show.py``: how small a fault would have shown
- ``together.py``: who together explains all alarms, where one is not the whole answer
- ``straying.py``: which tests left health, and for how long
- ``undecided.py``: who is neither accused nor cleared, who could not be tested
- ``ending.py``: what was first where a flight ended badly
- ``verdict.py``: the answer in words
- ``stood_out.py``: facts beside it that accuse nobody, of the set-up above all
- ``recording_end.py``: another, of a recording that stops in flight
- ``set_in_flight.py``: others, of parameters that were set in flight
- ``safety_net.py``: which failsafes and checks were off, by ``advice/safety_net.yaml``
- ``advising.py``: what to do next; ``advice_book.py``: what may be advised, with sources
"""

from fdi.diagnosis.answer import diagnose
from fdi.diagnosis.stood_out import Fact, stood_out, with_facts
from fdi.diagnosis.values import (
    Advice,
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
    "Advice",
    "Agreement",
    "Consequence",
    "Diagnosis",
    "Ending",
    "Evidence",
    "Fact",
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
    "stood_out",
    "with_facts",
]
