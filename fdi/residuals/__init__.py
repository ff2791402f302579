"""Turns test sets into ordered computations and runs them over a flight.

Given the equations of a system; sought for every minimal test set a matching and an equation left
over, such that everything can be computed in order from what was measured. ``System`` -> ``Bank``;
``Bank`` + ``Signals`` -> ``Residuals``.

- ``build.py``: from test sets to a bank
- ``sets.py``: which test sets
- ``rules.py``: which matchings are valid, and which are best
- ``solve.py``, ``newton.py``: one equation for one unknown; a loop of several
- ``roots.py``, ``interval.py``: all solutions of a loop, by boxes of which it is proven
- ``node.py``, ``bank.py``: the values
- ``differentiate.py``: derivatives and their noise gain
- ``reads.py``: what a computation is made of: nodes, channels, faults
- ``regress.py``: by what factor one quantity follows another
- ``jump.py``: by how much that factor has changed, and when
- ``latency.py``: how late sensors come, by the log
- ``accuracy.py``: how accurate sensors say that they are, and how far they are believed
- ``identify.py``: unknown parameters, by the flight's beginning; ``between.py``: how they differ
  between healthy flights of one vehicle; ``departed.py``: whether this one is unlike those
- ``evaluate.py``: residual columns with their predicted spread
- ``value.py``: what goes from node to node
- ``observer.py``: residuals behind which states are integrated; ``trajectory.py``: where these
  states go; ``kalman.py`` (``kalman_compiled.py``): the gain, and what each source of noise does
- ``respond.py``: how residuals move when a fault is put into the data
- ``window.py``: what noise and faults do to all residuals over a window
- ``distinguish.py``: how far apart faults are in noise, and how large one must be to be told
- ``suffice.py``: the cheapest tests or sensors that tell faults of given sizes apart
- ``amount.py``: how much it is, where a statement is violated
- ``cache.py``: a compiled bank on disk; ``export.py``: a bank as a Python module of its own
"""

from fdi.residuals.bank import Bank, Generator, NotImplementable, Residuals
from fdi.residuals.build import build_bank
from fdi.residuals.differentiate import Differentiation
from fdi.residuals.rules import Reason

__all__ = [
    "Bank",
    "Differentiation",
    "Generator",
    "NotImplementable",
    "Reason",
    "Residuals",
    "build_bank",
]
