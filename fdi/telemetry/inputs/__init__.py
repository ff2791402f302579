"""Does a command, a demand or a state that tests read do what its name says in this log?

values.py    `Input`: one of them, whether it is believed, and why
outputs.py   what motors and surfaces are given: is it what drives them?
attitude.py  the estimated attitude: does the accelerometer feel the same down?
velocity.py  estimated position and velocity over ground: does anything tell them?
demands.py   the demanded attitude: does anything follow it?
steering.py  the outputs: does the autopilot move anything?
battery.py   charge and current: are they measured?
belief.py    all of them, and a log without what is not believed
"""

from fdi.telemetry.inputs.belief import Judge, believed, inputs_of
from fdi.telemetry.inputs.values import Input

__all__ = ["Input", "Judge", "believed", "inputs_of"]
