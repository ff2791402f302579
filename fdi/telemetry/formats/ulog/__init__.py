"""PX4 logs (`.ulg`).

reader.py       puts the log together
definitions.py  formats, subscriptions, keys
walk.py         finds messages and damage in the bytes
kernels.py      the same as loops over bytes
records.py      messages by topic
columns.py      decodes their fields
times.py        when was each record made
units.py        units of the fields
events.py       modes, arming, texts, parameters
quality.py      what was lost
writer.py       the log with other values
"""

from fdi.telemetry.formats.ulog.reader import is_ulog, read_ulog
from fdi.telemetry.formats.ulog.writer import write_ulog

__all__ = ["is_ulog", "read_ulog", "write_ulog"]
