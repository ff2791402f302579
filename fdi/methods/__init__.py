"""Diagnosers beside the bank of residual generators: each asks logs a question of its own.

Given a log; sought what one published method says of it, such that whoever knows the method finds
its quantities, rules and units again. A method knows logs and models, never findings. What it shows
over time comes in by one door, as columns that stand beside the sensors'.

- ``columns.py``: the door: a method's columns as one more message of the log
- ``table.py``: which methods give columns
- ``estimator/``: was the autopilot's own estimator healthy, and whom does that point to
- ``observer/``: does a multicopter move as its motors are told, by a linear observer
- ``heading/``: do compass, course, gyroscopes and estimator agree on the heading, and what instead
- ``response.py``: does a vehicle turn as its motors or ailerons are asked to, from arming on
- ``setup/``: what was set up wrongly: motors, surfaces, sensors, thrust
- ``voting/``: which of several autopilots of one vehicle is in charge, and how soon
- ``reliability.py``: how probably a system of several units still works
"""
