"""What does a check of the set-up say? One `Check` for each thing that was looked at.

Values only. A check is ``wrong`` only where the records leave no doubt, ``in order`` where they
would have shown it, and ``not known`` in all other cases, with the reason. What is not known may
yet strike: what was measured lies on the wrong side, and its interval reaches to the right one.
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
class Setting(Shown):
    """A parameter of the autopilot, as it is and as it should be.

    Attributes
    ----------
    now, suggested : float or None
        None where the log does not tell it, or the vehicle has to.
    why : str
        What speaks for it.
    """

    name: str
    now: float | None
    suggested: float | None = None
    why: str = ""


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
        What the sentence rests on, by name; the unit is in the name, SI where none is. The interval
        of a number stands in ``_least`` and ``_most`` after its name.
    settings : tuple of Setting
        Parameters that would make it right, where something is wrong.
    strikes : bool
        Whether what was measured speaks against the set-up, though not beyond doubt.
    rests_on : tuple of str
        Components that must be sound for it, beside the one that is looked at.
    """

    name: str
    verdict: Verdict
    text: str
    numbers: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    settings: tuple[Setting, ...] = ()
    strikes: bool = False
    rests_on: tuple[str, ...] = ()

    @property
    def stands_out(self) -> bool:
        """Whether a person should be told: it is wrong, or strikes."""
        return self.strikes or self.verdict == "wrong"
