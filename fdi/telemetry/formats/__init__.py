"""Which format has this file, and who reads it?

Decided by content, never by name. A format is one file here: ``is_x(data)`` looks at the bytes,
``read_x(path, data, system=...)`` returns the `Log`.

dataflash.py          ArduPilot DataFlash log
dataflash_layouts.py  definitions and units of its records
dataflash_records.py  finds records and damage in the bytes
dataflash_tables.py   records to columns
dataflash_clock.py    when each record was made
dataflash_log.py      puts the log together, binary or text
dataflash_events.py   modes, arming, texts, parameters
dataflash_text.py     DataFlash log in text form: definitions, what was lost
dataflash_lines.py    lines, words and the numbers in them
dataflash_columns.py  lines to columns
texts.py              rows of bytes: which are alike, and what they say
compiled.py           loops over bytes as machine code, where numba is at hand
gather.py             bytes at many offsets
repeated.py           which rows of bytes are the same
meaning.py            what another format says, in MAVLink's words
meaning_sources.py    how the table of correspondences is written
outputs.py            which surface every output of a plane drives
tlog.py               MAVLink telemetry log: puts the log together
mavlink_frames.py     finds frames and damage in the bytes
mavlink_checksum.py   whether a frame is what was sent
mavlink_kernels.py    the same as loops over bytes
mavlink_groups.py     frames by sender and message
mavlink_vehicle.py    which sender is the vehicle
mavlink_times.py      when was each record made
mavlink_columns.py    payloads to columns
mavlink_events.py     modes, arming, texts, parameters
mavlink_signs.py      which way is up
bounds.py             how much of what a log says about itself is kept
mavlink_repeats.py    frames that came twice
mavlink_quality.py    what was lost
ulog.py               PX4 log: puts the log together
ulog_definitions.py   formats, subscriptions, keys
ulog_walk.py          finds messages and damage in the bytes
ulog_records.py       messages by topic
ulog_columns.py       decodes their fields
ulog_times.py         when was each record made
ulog_units.py         units of its fields
ulog_events.py        modes, arming, texts, parameters
ulog_quality.py       what was lost
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.dataflash import is_dataflash, read_dataflash
from fdi.telemetry.formats.dataflash_text import is_dataflash_text, read_dataflash_text
from fdi.telemetry.formats.tlog import is_tlog, read_tlog
from fdi.telemetry.formats.ulog import is_ulog, read_ulog
from fdi.telemetry.log import Log

Data = NDArray[np.uint8]

FORMATS: Final[dict[str, tuple[Callable[[Data], bool], Callable[..., Log]]]] = {
    "ulog": (is_ulog, read_ulog),  # the cheaper looks first
    "dataflash": (is_dataflash, read_dataflash),
    "dataflash_text": (is_dataflash_text, read_dataflash_text),
    "tlog": (is_tlog, read_tlog),
}

# What a file begins with that this version does not read: refused by name.
NOT_READ: Final[dict[str, bytes]] = {
    "an encrypted ULog (.ulge)": b"ULogEnc",
    "a gzip archive": b"\x1f\x8b",
    "a zip archive": b"PK\x03\x04",
    "a zstandard archive": b"\x28\xb5\x2f\xfd",
    "a bzip2 archive": b"BZh",
    "an xz archive": b"\xfd7zXZ\x00",
    "a 7z archive": b"7z\xbc\xaf\x27\x1c",
}

__all__ = ["FORMATS", "NOT_READ"]
