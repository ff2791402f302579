"""Which format has this file, who reads it, and who writes it?

Decided by content, never by name. A format is a room here: ``is_x(data)`` looks at the bytes,
``read_x(path, data, system=...)`` returns the `Log`, ``write_x(log, changes)`` the bytes of a
changed one.

tlog/       MAVLink telemetry logs
dataflash/  ArduPilot DataFlash logs, binary and in text form
ulog/       PX4 logs
table.py    CSV and Parquet tables of somebody's own
bytes/      rows of bytes, by whatever format: gathered, told apart, looped over
bounds.py   how much of what a log says about itself is kept
commands.py which commands from outside are told
change.py   what becomes of a message's records, for who writes
gaps.py     when most messages are silent together
wording.py  how texts and names read
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.change import Change
from fdi.telemetry.formats.dataflash import (
    is_dataflash,
    is_dataflash_text,
    read_dataflash,
    read_dataflash_text,
    write_dataflash,
)
from fdi.telemetry.formats.table import is_table, read_table
from fdi.telemetry.formats.tlog import is_tlog, read_tlog, write_tlog
from fdi.telemetry.formats.ulog import is_ulog, read_ulog, write_ulog
from fdi.telemetry.log import Log

Data = NDArray[np.uint8]


class Format(NamedTuple):
    """Who recognises a format, reads it, writes it (None: nobody yet); what its files are."""

    is_it: Callable[[Data], bool]
    read: Callable[..., Log]
    write: Callable[[Log, Mapping[str, Change]], bytes] | None
    called: str


FORMATS: Final[dict[str, Format]] = {
    "ulog": Format(is_ulog, read_ulog, write_ulog, "PX4's .ulg"),  # the cheaper looks first
    "dataflash": Format(is_dataflash, read_dataflash, write_dataflash, "ArduPilot's .bin"),
    "dataflash_text": Format(is_dataflash_text, read_dataflash_text, None, "its text .log"),
    "table": Format(is_table, read_table, None, "a table .csv or .parquet"),
    "tlog": Format(is_tlog, read_tlog, write_tlog, "a ground station's .tlog"),
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

__all__ = ["FORMATS", "NOT_READ", "Format"]
