"""What a log means, in words that do not depend on who wrote it.

messages.py  what another format says, in MAVLink's words
values.py    what a source says at the records of another message
restarts.py  for how long an autopilot that started anew gave nothing
silence.py   what MAVLink sends of a sensor that says nothing
sources.py   how the table of correspondences is written
outputs.py   which surface every output of a plane drives
mixed.py     what surfaces are asked for that do the work of two
motors.py    which motor every output of a multicopter drives
rotors.py    how fast every motor turns, as its controller says
link.py      for how long nothing has come over the link
"""

from fdi.telemetry.meaning.link import LINK, link_of, with_link
from fdi.telemetry.meaning.messages import as_ardupilot, as_mavlink, origin
from fdi.telemetry.meaning.motors import MOTORS, unwired, with_motors
from fdi.telemetry.meaning.outputs import with_outputs
from fdi.telemetry.meaning.restarts import RESTART, with_restarts
from fdi.telemetry.meaning.rotors import ROTORS

__all__ = [
    "LINK",
    "MOTORS",
    "RESTART",
    "ROTORS",
    "as_ardupilot",
    "as_mavlink",
    "link_of",
    "origin",
    "unwired",
    "with_link",
    "with_motors",
    "with_outputs",
    "with_restarts",
]
