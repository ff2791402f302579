"""What is in the log at this path?

`read` takes the file's bytes (`content.py`), finds their format from what they are and hands over
to the format's reader.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fdi.errors import LogError
from fdi.telemetry.content import change, content, opened
from fdi.telemetry.formats import FORMATS, NOT_READ
from fdi.telemetry.log import Log
from fdi.telemetry.quality import QualityRecord


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
    with opened(where) as file:
        data = content(file, where)
        log = _parsed(where, data, system)
        changed = change(file, data)
    return replace(log, quality=(*changed, *log.quality)) if changed else log


def _parsed(where: Path, data: NDArray[np.uint8], system: int | None) -> Log:
    for name, magic in NOT_READ.items():
        if data[: len(magic)].tobytes() == magic:
            raise LogError(
                f"is {name}, which this version does not read",
                where=str(where),
                hint="give a .tlog, an ArduPilot .bin or a PX4 .ulg",
            )
    for form in FORMATS.values():
        if form.is_it(data):
            log = form.read(where, data, system=system).believing()
            return replace(log, quality=(*log.quality, *_pace(log)))
    raise LogError(
        f"{data.size} bytes of no known format",
        where=str(where),
        hint=f"known: {', '.join(form.called for form in FORMATS.values())}",
    )


def _pace(log: Log) -> Iterator[QualityRecord]:
    """Yield that the vehicle's clock does not go as satellite time does."""
    off = 100 * (1 - 1 / log.clock.pace)
    if off:
        text = (
            f"the vehicle's clock runs {abs(off):.1f} % {'slow' if off > 0 else 'fast'} against "
            "satellite time: tests take rates of change by that, times are the clock's own"
        )
        yield QualityRecord("repaired", None, None, None, 0, text)
