"""Sets several flights of one vehicle beside each other, so that the odd one stands out.

Given analyses of flights with one model; sought the tests by which a flight differs most from the
healthy ones, such that no healthy flight differs by more than one from the others. Analyses ->
``Comparison``.

- ``values.py``: the values of this stage
- ``aligned.py``: what can be compared: the same tests, from take-off on
- ``band.py``: what healthy flights do at a time, and how far another one is off
- ``differ.py``: by which tests flights differ most
- ``settings.py``: what was set and identified otherwise
- ``comparing.py``: the stage itself
"""

from fdi.comparison.comparing import compare
from fdi.comparison.values import (
    Band,
    Compared,
    Comparison,
    Course,
    Difference,
    Identified,
    Setting,
    Test,
)

__all__ = [
    "Band",
    "Compared",
    "Comparison",
    "Course",
    "Difference",
    "Identified",
    "Setting",
    "Test",
    "compare",
]
