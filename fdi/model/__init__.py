"""Describes a vehicle, and which of its equations hold with a log.

Given a model file written by a person and the channels of a log; sought the equations that hold
with this telemetry and the faults that they bring, such that every name is defined and every unit
fits.
YAML -> ``Airframe``; ``Airframe`` + ``Log`` -> ``System``.

- ``load.py``, ``yaml.py``, ``columns.py``, ``repeat.py``, ``schema.py``, ``definitions.py``: from
  files to definitions
- ``cache.py``, ``codec.py``: an assembled airframe on disk
- ``assemble.py``: from definitions to an airframe, all problems reported together;
  ``members.py``: its components, and names that look like a slip
- ``airframe.py``, ``parts.py``: the values
- ``expression.py``, ``evaluate.py``, ``calculus.py``: the language of equations; ``records.py``:
  what a measured field did over a while
- ``given.py``: tables and Python functions for equations
- ``dimensions.py``: units
- ``observe.py``, ``system.py``: what holds with one log, part by part, and as a value
- ``parameters.py``: which values the parameters of a model have with a log, and what was assumed
- ``copied.py``: which channels bring nothing, because another one says the same
- ``world.py``: what is known of the place and day of a flight
- ``choose.py``: which model fits a log
- ``naming.py``: what a person calls a component, and where on the airframe it sits
- ``lacking.py``: what falls away because a log lacks it, in words
- ``placement.py``: which further telemetry would show more; ``hints.py``: what would test a
  component, and by which setting of the autopilot it is logged
"""

from fdi.model.airframe import Airframe
from fdi.model.given import Function, table
from fdi.model.load import load_airframe, shipped_models
from fdi.model.system import System

__all__ = ["Airframe", "Function", "System", "load_airframe", "shipped_models", "table"]
