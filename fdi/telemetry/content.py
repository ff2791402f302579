"""Which bytes does the file at this path hold, and did it hold still while they were read?

In: a path. Out: the bytes, and afterwards a finding if the file grew or shrank meanwhile. Only
regular files are opened: a FIFO would block, a device never end.

Up to ``COPIED`` bytes a file is copied into memory, which costs 0.06 s for the full 256 MB: what
somebody then does to the file does not matter, and a bad sector is an error with a place. A larger
file is mapped, so that the memory it needs can be taken back; before that it is read through once
(0.06 s per GB when cached), because a sector that cannot be read would otherwise end the process
with a bus error instead of a message.

The trap for a maintainer: a *mapped* file that somebody cuts short ends the process (SIGBUS) as
soon as a page beyond its new end is touched, and Python cannot catch that; the command line says a
line then (`fdi.cli.bus_error`). Whoever wants to analyse such a large log while it is overwritten
in place has to copy it first.
"""

from __future__ import annotations

import io
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.quality import QualityRecord

COPIED: Final = 256 << 20
_BLOCK: Final = 8 << 20


@contextmanager
def opened(path: Path) -> Iterator[io.FileIO]:
    """Open a log's file for reading.

    Raises
    ------
    LogError
        It is missing, no regular file, empty, or must not be read.
    """
    try:
        # not blocking: the path may have become a FIFO since it was looked at
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise _no_file(path)
        file = io.FileIO(os.open(path, flags))
    except FileNotFoundError as error:
        raise LogError("no such file", where=str(path)) from error
    except (OSError, ValueError) as error:
        raise LogError(f"cannot be read: {_reason(error)}", where=str(path)) from error
    with file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise LogError("is no regular file", where=str(path))
        if not status.st_size:
            raise LogError("is empty", where=str(path))
        yield file


def content(file: io.FileIO, path: Path) -> NDArray[np.uint8]:
    """Return the bytes that the file has now, (n,) uint8, read-only.

    Raises
    ------
    LogError
        A part of it cannot be read.
    """
    size = os.fstat(file.fileno()).st_size
    is_copied = size <= COPIED
    data = np.empty(size if is_copied else min(size, _BLOCK), np.uint8)
    done = 0
    try:
        while done < size:
            here = data[done : done + _BLOCK] if is_copied else data[: size - done]
            count = file.readinto(here.data)
            if not count:
                break  # it was cut short meanwhile; `change` tells
            done += count
        if not is_copied:
            data = np.memmap(file, np.uint8, "r", shape=(done,)).view(np.ndarray)
    except (OSError, ValueError) as error:
        raise LogError(
            f"cannot be read beyond byte {done} of {size}: {_reason(error)}",
            where=str(path),
            hint="copy what is left of it with a tool such as ddrescue",
        ) from error
    if not done:
        raise LogError("was emptied while it was read", where=str(path))
    data = data[:done]
    data.flags.writeable = False
    return data


def change(file: io.FileIO, data: NDArray[np.uint8]) -> tuple[QualityRecord, ...]:
    """Return the finding that the file is longer or shorter now than what was read of it."""
    size = os.fstat(file.fileno()).st_size
    if size == data.size:
        return ()
    how = "grew" if size > data.size else "was cut short"
    text = f"the file {how} while it was read: {data.size} bytes were read, {size} are there now"
    return (QualityRecord("truncated", None, None, None, max(size - data.size, 0), text),)


def _no_file(path: Path) -> LogError:
    if path.is_dir():
        hint = "name a file in it; fdi batch analyses all of them"
        return LogError("is a directory, not a log", where=str(path), hint=hint)
    return LogError("is no regular file", where=str(path))


def _reason(error: Exception) -> str:
    reason = getattr(error, "strerror", None) or str(error)
    return f"{reason[:1].lower()}{reason[1:]}"
