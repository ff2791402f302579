"""Several logs of one flight as one log.

Given logs of one vehicle, sought what they hold together, such that all times are of one clock,
each message is that of the log that has it best, each event is told once, and it is said what came
from where. Logs that are not of one flight are refused.

joining.py     `join`: logs to one `Log`
placing.py     how one log lies on another's clock
track.py       `Track`: few numbers that tell which logs are of one flight
agreement.py   how well two logs agree at a shift in time, and at which shift best
messages.py    which log's records stand for a message
happenings.py  events and parameters, each once
"""

from fdi.telemetry.together.joining import join

__all__ = ["join"]
