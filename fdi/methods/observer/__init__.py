"""Does the vehicle move as its motors are told? The linear diagnostic observer of a multicopter.

Given a log; sought thirteen residuals, what is measured less what a linear observer expects from
what the motors are given, such that each is the error of one equation through one low pass, and
which of them are beyond noise and what the model leaves out. `Log` -> `Observation`.

- ``observation.py``: the value of the whole, `observe`
- ``states.py``: names and units; ``vehicle.py``: mass, inertia, arms; the reference quadrotor
- ``model.py``: the linear equations at a heading, and the nonlinear ones
- ``gain.py``: observability, placed poles, the steady Kalman gain
- ``hold.py``: an exact step; ``observer.py``: one more record
- ``doubts.py``: by how much the equations may be off where nothing is wrong
- ``records.py``: outputs and inputs from a log
- ``fitted.py``: what the flight tells of its vehicle
- ``columns.py``: residuals and motors as columns that an analysis may weigh
- ``limits.py``: centres, noise, alarms; ``motor.py``: which motor is weak, by the signs
"""

from fdi.methods.observer.observation import Observation, observe
from fdi.methods.observer.vehicle import REFERENCE_QUADROTOR, Vehicle, read_vehicle

__all__ = ["REFERENCE_QUADROTOR", "Observation", "Vehicle", "observe", "read_vehicle"]
