"""What is in the log at this path?

`read` opens the file, finds its format from the content and hands over to the format's reader. The
file is mapped, not copied.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.formats import FORMATS, NOT_READ, TEXT_LOG
from fdi.telemetry.log import Log

_FREE_LINES: Final = 4096  # bytes in which a text log's first definition stands


def read(path: str | os.PathLike[str], *, system: int | None = None) -> Log:
    """Return the log.

    Parameters
    ----------
    path : path-like
        Any readable format; the name does not matter.
    system : int, optional
        Which MAVLink system to take where the log holds several.

    Raises
    ------
    LogError
        Missing, no regular file, empty, of no known format, or without any message.
    UsageError
        The log has no such system.
    """
    where = Path(path)
    data = _mapped(where)
    for name, magic in NOT_READ.items():
        is_later = magic == TEXT_LOG and b"\n" + magic in data[:_FREE_LINES].tobytes()
        if is_later or data[: len(magic)].tobytes() == magic:
            raise LogError(
                f"is {name}, which this version does not read",
                where=str(where),
                hint="give a .tlog or an ArduPilot .bin",
            )
    for is_it, read_it in FORMATS.values():
        if is_it(data):
            return read_it(where, data, system=system)
    known = ", ".join(FORMATS)
    raise LogError(
        f"{data.size} bytes of no known format", where=str(where), hint=f"known: {known}"
    )


def _mapped(path: Path) -> NDArray[np.uint8]:
    try:
        status = os.stat(path)
        if stat.S_ISDIR(status.st_mode):
            raise LogError("is a directory, not a log", where=str(path))
        if not stat.S_ISREG(status.st_mode):  # a FIFO would block, a device never end
            raise LogError("is no regular file", where=str(path))
        if not status.st_size:
            raise LogError("is empty", where=str(path))
        mapped = np.memmap(path, np.uint8, "r", shape=(status.st_size,))
        return mapped.view(np.ndarray)
    except FileNotFoundError as error:
        raise LogError("no such file", where=str(path)) from error
    except (OSError, ValueError) as error:
        raise LogError(f"cannot be read: {error}", where=str(path)) from error
