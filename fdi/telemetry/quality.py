"""What was lost, repaired or guessed while a log was read?

Damage in a log is no exception: it is a `QualityRecord`, and the rest of the log is returned.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from fdi.shown import Shown

Kind = Literal[
    "lost_bytes",
    "bad_checksum",
    "unknown_message",
    "truncated",
    "gap",
    "clock_jump",
    "reboot",
    "duplicate",
    "invalid_values",
    "repaired",
    "joined",
    "left_out",
]

ANEW: Final = "the vehicle started anew"
"""What a reboot is called, among the findings and the events."""


@dataclass(frozen=True, slots=True)
class QualityRecord(Shown):
    """One finding about the data themselves.

    Attributes
    ----------
    kind : Kind
        What happened; ``joined``: what several logs of one flight were put together from;
        ``left_out``: more of a kind than any vehicle has.
    channel : str or None
        Whom it concerns: ``MESSAGE``, ``MESSAGE[1]`` or ``MESSAGE.field``; None for the whole log.
    start, end : float or None
        s of the log's clock; None where it has no place in time.
    count : int
        How many bytes (lost_bytes, truncated), records or values are concerned.
    text : str
        One line for a person, with the numbers.
    """

    kind: Kind
    channel: str | None
    start: float | None
    end: float | None
    count: int
    text: str
