"""Scores analyses against labelled flights, and asks how big a fault must be to be seen.

Given flights of which somebody says what failed and when (``labels.json``), and what an analysis
said of each; sought how often it was right, early enough, and how often it accused wrongly, such
that a figure can be judged: with its interval, beside what a constant answer would score.

- ``labels.py``: the labels file
- ``score.py``: one analysis against one label
- ``totals.py``: rates over many flights
- ``calibration.py``: confidence against rightness
- ``fitting.py``: which weights make the probabilities of candidates true
- ``unseen.py``: what the flights score by weights that have not seen them
- ``unseen_tables.py``: these figures as text and as plain values
- ``tables.py``: the figures as text and as plain values
- ``run.py``: labels file -> scored flights
- ``injected_fault.py``: what a channel reads with a known fault
- ``inject.py``: a healthy log with a known fault
- ``curves.py``: how big must a fault be before it shows
"""

from fdi.evaluation.labels import Fault, Label, load_labels, select
from fdi.evaluation.run import Evaluation, evaluate
from fdi.evaluation.score import Score, score
from fdi.evaluation.totals import Rate, totals

__all__ = [
    "Evaluation",
    "Fault",
    "Label",
    "Rate",
    "Score",
    "evaluate",
    "load_labels",
    "score",
    "select",
    "totals",
]
