"""Logs: from a file to columns with units and one clock.

Given a file of an autopilot, sought what it recorded, such that every intact record is there, in
SI, on one clock, and everything that was lost, repaired or guessed is told.

In: a path. Out: `Log`; on request `Signals`, the quantities that a model asks for on one grid.

reading.py    `read`: path to `Log`, format by content
writing.py    `rewritten`: a log with other values, every other byte as it was
search.py     files, folders, globs, URLs: which logs are meant
content.py    the bytes of a file that may be damaged, locked, growing
formats/      a room per log format: its reader, its writer
meaning/      what a log means, in words that do not depend on who wrote it
log.py        `Log`
message.py    `Message`: the columns of one message
channel.py    `Channel`: MESSAGE.field
clock.py      the log's clock, boot time, UTC
thrown.py     times that damage throws far ahead, put back
events.py     `Event`, `Flight`, `FlightState`
airframes.py  the frame of a vehicle with rotors
counters.py   parameters in which the autopilot counts
identity.py   which vehicle: the serial number of its board
motors.py     where every motor stands, and which way it turns
spectra.py    vibrations over time and frequency, by the fastest records
sensors.py    sensors that the autopilot stops using
course.py     `Course`: motion, arming and phases of a log
motion.py     how the vehicle moves, at the times of its height
phases.py     on the ground or in the air, with how sure that is
supply.py     whether power was there at a moment, by the voltages
stretches.py  `Stretch`: what the vehicle did, for a person
impact.py     whether a flight ends with a blow
inputs/       `Input`: which commands, demands, states are believed
flights.py    take-off and landing from all that
lift.py       what carries a VTOL: its rotors or its wings
airtime.py    from when to when a flight is in the air, and settled
ends.py       how each flight ends
ordered.py    who ordered what was in force then
columns.py    `log_from_columns`: arrays of one's own as a log
together/     `join`: several logs of one flight as one
copies.py     `Copy`: channels that say the same twice
signals.py    `Request`, `Sampling`, `Signals`: resampling
quality.py    `QualityRecord`: what was lost or repaired
hardware.py   `hardware_of`: board, sensors, receivers that a log names
catalogue.py  units, sentinels, modes: the tables in data/
dialect.py    MAVLink message definitions
"""

from fdi.telemetry.channel import Channel
from fdi.telemetry.clock import Clock
from fdi.telemetry.columns import log_from_columns
from fdi.telemetry.copies import Copy
from fdi.telemetry.events import Event, Flight, FlightState
from fdi.telemetry.hardware import Hardware, hardware_of
from fdi.telemetry.inputs import Input
from fdi.telemetry.log import Log
from fdi.telemetry.message import Message
from fdi.telemetry.quality import QualityRecord
from fdi.telemetry.reading import read
from fdi.telemetry.signals import Request, Sampling, Signals
from fdi.telemetry.together import join

__all__ = [
    "Channel",
    "Clock",
    "Copy",
    "Event",
    "Flight",
    "FlightState",
    "Hardware",
    "Input",
    "Log",
    "Message",
    "QualityRecord",
    "Request",
    "Sampling",
    "Signals",
    "hardware_of",
    "join",
    "log_from_columns",
    "read",
]
