"""Decides which residuals are beyond what health explains.

Given residual columns with their predicted spread and a policy; sought for every residual and
sample whether it is triggered, quiet or unknown, and which triggers persist, such that noise,
stated tolerances and gaps raise no alarm. ``Residuals`` + ``Policy`` -> ``Alarms``.

- ``alarms.py``: the value of this stage
- ``policy.py``, ``schema.py``: the recipe of an analysis, read from YAML (``policies/*.yaml``)
- ``recipes.py``: what each way to decide takes from a policy
- ``noise.py``: centre and spread of a residual in the flight's own calm part
- ``bounds.py``: how far each residual of a flight may stray
- ``straying.py``: what healthy vehicles of other people stray (``tolerances.json``)
- ``learned.py``: what healthy flights of one vehicle say about each test
- ``resampling.py``: other noise of the same kind as a flight's own
- ``scatter.py``: whether a residual has begun to scatter
- ``judging.py``: which residuals are beyond their bounds, and which triggers are alarms
- ``budget.py``: how high thresholds must be for noise to alarm as seldom as asked for
- ``critical.py``: how small the scale of thresholds would have to be for an alarm
- ``detectors.py``: the ways to decide that a policy may name
"""

from fdi.decision.alarms import Alarms
from fdi.decision.policy import Policy, load_policy

__all__ = ["Alarms", "Policy", "load_policy"]
