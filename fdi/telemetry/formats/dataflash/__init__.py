"""ArduPilot DataFlash logs, binary (`.bin`) and in text form (`.log`).

reader.py        binary logs: recognises them, tells their damage
layouts.py       definitions and units of the records
records.py       finds records and damage in the bytes
kernels.py       the same as loops over bytes
tables.py        records to columns
text_reader.py   logs in text form: definitions, what was lost
text_lines.py    lines, words and the numbers in them
text_columns.py  lines to columns
log.py           puts the log together, binary or text
clock.py         when each record was made
events.py        modes, arming, texts, parameters
vehicle.py       which vehicle, by greeting, parameters or records
writer.py        a binary log with other values
"""

from fdi.telemetry.formats.dataflash.reader import is_dataflash, read_dataflash
from fdi.telemetry.formats.dataflash.text_reader import is_dataflash_text, read_dataflash_text
from fdi.telemetry.formats.dataflash.writer import write_dataflash

__all__ = [
    "is_dataflash",
    "is_dataflash_text",
    "read_dataflash",
    "read_dataflash_text",
    "write_dataflash",
]
