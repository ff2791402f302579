"""Do all sources of heading agree, and which is the odd one out? And what instead of it?

Given a log; sought which block (magnetometer, accelerometer, gyroscope, satellite receiver, camera)
is wrong by a cross-check of headings, and what it would have said.

- ``geodesy.py``: courses and places on the ellipsoid
- ``tilt.py``: roll and pitch by accelerometers, by gyroscopes, by both
- ``compute.py``: headings by compass, course, camera
- ``trees.py``: the decision trees
"""
