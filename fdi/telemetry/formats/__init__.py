"""Which format has this file, and who reads it?

Decided by content, never by name. A format is a room here: ``is_x(data)`` looks at the bytes,
``read_x(path, data, system=...)`` returns the `Log`.

tlog/       MAVLink telemetry logs
dataflash/  ArduPilot DataFlash logs, binary and in text form
ulog/       PX4 logs
bytes/      rows of bytes, by whatever format: gathered, told apart, looped over
bounds.py   how much of what a log says about itself is kept
gaps.py     when most messages are silent together
wording.py  how texts and names read
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.formats.dataflash import (
    is_dataflash,
    is_dataflash_text,
    read_dataflash,
    read_dataflash_text,
)
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
