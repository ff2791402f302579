"""Was the navigation estimator healthy, and what made it fail?

Given a log; sought ratios, innovations, bits, cores and resets of its estimator in one table for
all formats, and the fault trees of the autopilot's own rules with the moment at which each node
became true. `Log` -> `EstimatorHealth`.

- ``health.py``: the value of the whole, `estimator_health`
- ``records.py``: which message holds the records of a core
- ``ratios.py``: the common table, each ratio against its own level in the flight
- ``innovations.py``: innovations with their variances
- ``bits.py``: faults, timeouts, rejections and solution by name
- ``cores.py``: the selected core, its changes; ``resets.py``: jumps of the state
- ``spans.py``: from when to when something holds in records
- ``tree.py``: the value of a fault tree, and the path through it
- ``validity.py``: the commander's tree of PX4; ``aiding.py``: the branch below dead reckoning
- ``unhealthy.py``: the tree of PX4's selector
- ``failsafe.py``: the EKF failsafe of ArduPilot's copters; ``lanes.py``: its lane selection
- ``columns.py``: whom its complaints point to, over time, for the analysis
- ``moments.py``: when the vehicle was upset, when the estimator first complained
- ``findings.py``: what a person has to know of it
"""

from fdi.methods.estimator.health import EstimatorHealth, estimator_health

__all__ = ["EstimatorHealth", "estimator_health"]
