"""Tells what a flight shows of its vehicle that may change from flight to flight.

Given an ``Analysis``; sought numbers that an operator follows over the flights of one vehicle, each
with its uncertainty, such that what a log does not tell is missing and never zero. ``Analysis`` ->
``Trend``s.

- ``values.py``: the value of this stage
- ``blocks.py``: the mean of a flight, and how well it is known
- ``battery.py``: the internal resistance of a battery
- ``quantities.py``: which quantities there are; the stage itself
"""

from fdi.trends.quantities import trends_of
from fdi.trends.values import Trend

__all__ = ["Trend", "trends_of"]
