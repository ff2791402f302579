"""What does a person read when a mapped log is cut short, or its disk fails, while it is read?

The kernel says SIGBUS then, at the very byte that is gone, and would end the process without a
word. A handler of Python's own is of no use: it runs after the access, which is tried again for
ever. One of the C library's kind runs at once; it can only say a line and end the process.
"""

from __future__ import annotations

import os
import signal
import sys
from functools import cache
from typing import Any, Final

from fdi.errors import LogError

_SHOW_CURSOR: Final = "\x1b[?25h"  # a progress bar hides it


def end_with_a_line_on_bus_errors() -> None:
    """Let the process end with the exit code of a bad log where a mapped byte is gone."""
    number = getattr(signal, "SIGBUS", None)
    if number is None:  # Windows does not let a mapped file be cut
        return
    import ctypes

    ctypes.CDLL(None).signal(number, _handler())


@cache  # it has to live as long as the process
def _handler() -> Any:
    import ctypes

    return ctypes.CFUNCTYPE(None, ctypes.c_int)(_end)


def _end(number: int) -> None:
    error = LogError(
        "a log was cut short, or could not be read any more, while it was read",
        hint="copy it first and give the copy",
    )
    begin = _SHOW_CURSOR + "\r" if sys.stderr.isatty() else ""
    os.write(2, f"{begin}fdi: {error}\n".encode())
    os._exit(error.exit_code)
