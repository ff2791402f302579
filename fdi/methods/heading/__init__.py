"""Do all sources of heading agree, and which is the odd one out? And what instead of it?

Given a log; sought which block (magnetometer, accelerometer, gyroscope, satellite receiver, camera)
is wrong by a cross-check of headings, and what it would have said. `Log` -> `HeadingCheck`.

- ``check.py``: the value of the whole, `cross_check`
- ``motion.py``: what the log recorded of one flight
- ``sources.py``: all headings, each with its deviation
- ``increments.py``: changes over some seconds, one source against another; ``vertical.py``: heights
- ``trees.py``: the decision trees
- ``recovery.py``: what a failed block would have said; ``reckoning.py``: positions without fixes
- ``replaced.py``: a log with a recovered block in place of the one that failed
- ``columns.py``: who is the odd one out, as columns that an analysis weighs
- ``course.py``: turns on wings against the course
- ``forces.py``: specific force against the receiver; ``twins.py``: gyroscopes of two units
- ``compute.py``: headings by compass, course, camera
- ``tilt.py``: roll and pitch by accelerometers, by gyroscopes, by both
- ``geodesy.py``: courses and places on the ellipsoid
"""

from fdi.methods.heading.check import COMPONENTS, HeadingCheck, Named, cross_check
from fdi.methods.heading.recovery import Recovery, recover

__all__ = ["COMPONENTS", "HeadingCheck", "Named", "Recovery", "cross_check", "recover"]
