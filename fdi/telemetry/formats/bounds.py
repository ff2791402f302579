"""How much of what a log says about itself is kept?

Parameters, texts and senders become objects of Python, ten times as large as their bytes in the
file. No vehicle has as many as the bounds allow; a damaged or made-up log may. What is beyond is
not kept, and told: memory stays in proportion to the file by construction.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.telemetry.quality import QualityRecord

MOST_NAMES: Final = 1 << 14
"""Parameters: ten times what ArduPilot (1,400) or PX4 (1,500) has."""

MOST_VALUES: Final = 1 << 15
"""Records of parameters: twenty complete downloads, or as many changes."""

MOST_TEXTS: Final = 1 << 14
"""One a second for four and a half hours. The first and the last half of them are kept: what the
vehicle is stands at the beginning, how it ended at the end."""

MOST_SENDERS: Final = 1 << 10
"""Fifty times what an autopilot of ArduPilot forwards for (20)."""

SINGLE: Final = 20
"""Findings of one kind; more are told as one."""


def kept_texts(count: int) -> NDArray[np.int64] | None:
    """Return which of so many texts are kept, ascending; None: all."""
    if count <= MOST_TEXTS:
        return None
    half = MOST_TEXTS // 2
    return np.concatenate((np.arange(half), np.arange(count - half, count)))


def kept_values(rows: NDArray[Any]) -> NDArray[Any] | None:
    """Return the first of these records of parameters that are kept; None: all."""
    return None if rows.size <= MOST_VALUES else rows[:MOST_VALUES]


def left_out(count: int, what: str) -> Iterator[QualityRecord]:
    """Yield a record where anything is left out: how many there are of what."""
    if count > 0:
        said = f"{count} {what} are left out; no vehicle has so many"
        yield QualityRecord("left_out", None, None, None, count, said)


def records_left_out(values: int, names: int, texts: int) -> Iterator[QualityRecord]:
    """Yield what is left out of so many records of parameters and texts.

    ``names``: how many of the records are left out because their names are too many.
    """
    yield from left_out(values - MOST_VALUES, f"records of parameters beyond {MOST_VALUES}")
    yield from left_out(names, f"records of parameters beyond {MOST_NAMES} names")
    yield from left_out(texts - MOST_TEXTS, f"texts between the first and last {MOST_TEXTS // 2}")
