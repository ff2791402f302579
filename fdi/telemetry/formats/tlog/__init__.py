"""MAVLink telemetry logs (`.tlog`), as a ground station keeps them.

reader.py    puts the log together
frames.py    finds frames and damage in the bytes
checksum.py  whether a frame is what was sent
kernels.py   the same as loops over bytes
groups.py    frames by sender and message
repeats.py   frames that came twice
vehicle.py   which sender is the vehicle
times.py     when was each record made
columns.py   payloads to columns
events.py    modes, arming, texts, parameters
signs.py     which way is up
quality.py   what was lost
writer.py    the log with other values
stream.py    whole frames of what a link brings
"""

from fdi.telemetry.formats.tlog.reader import is_tlog, read_tlog
from fdi.telemetry.formats.tlog.writer import write_tlog

__all__ = ["is_tlog", "read_tlog", "write_tlog"]
