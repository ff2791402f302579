"""What does a check of the set-up say? One `Check` for each thing that was looked at.

Values only. A check is ``wrong`` only where the records leave no doubt, ``in order`` where they
would have shown it, and ``not known`` in all other cases, with the reason.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, Literal

from fdi.shown import Shown

Verdict = Literal["wrong", "in order", "not known"]
VERDICTS: Final[tuple[Verdict, ...]] = ("wrong", "in order", "not known")


@dataclass(frozen=True, slots=True)
class Check(Shown):
    """One thing that was looked at.

    Attributes
    ----------
    name : str
        What was looked at, in a pilot's words: ``motors``, ``compass 1``.
    verdict : Verdict
    text : str
        One sentence for a person: what is wrong and by which numbers, what was found in order, or
        why nothing can be said.
    numbers : Mapping[str, float]
        What the sentence rests on, by name; the unit is in the name, SI where none is.
    """

    name: str
    verdict: Verdict
    text: str
    numbers: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
