"""Draws what a paper prints: one figure of an analysis, as wide as a column.

Given an ``Analysis`` and what to show; sought a figure that can be read at 85 mm, such that every
axis has its unit and nothing is drawn that the analysis does not hold. ``Analysis`` -> matplotlib
``Figure``.

- ``choose.py``: which figures there are, and what each may be asked for
- ``column.py``: sizes and letters of a printed column; times as lines
- ``grid.py``: marked faults over time
- ``track.py``: where the vehicle flew
- ``curves.py``: recorded channels; ``tests.py``: residuals with thresholds
- ``behind.py``: both, around a finding
- ``spectrum.py``: at which frequencies it shook
- ``groups.py``: which faults can be told apart
"""

from fdi.report.paper.choose import DPI, FIGURES, PICTURES, check_request, draw, picture_kind

__all__ = ["DPI", "FIGURES", "PICTURES", "check_request", "draw", "picture_kind"]
