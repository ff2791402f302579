"""Which small part of an input fails in the same way?"""

from __future__ import annotations

import signal
import time
import warnings
from pathlib import Path
from typing import Final

from .worker import check, stop

BUDGET_S: Final = 20.0


def smaller(data: bytes, what: str, number: int, folder: Path) -> bytes:
    """Return the input with every part taken out without which it fails likewise."""
    signal.signal(signal.SIGPROF, stop)
    deadline = time.monotonic() + BUDGET_S
    size = len(data) // 2
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        while size and time.monotonic() < deadline:
            at = 0
            while at < len(data) and time.monotonic() < deadline:
                rest = data[:at] + data[at + size :]
                failure = check(rest, number, folder)
                if failure is not None and failure["what"] == what:
                    data = rest
                else:
                    at += size
            size //= 2
    return data
