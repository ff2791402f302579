"""How strongly may a finding be said, and of whom?

In: a `Finding` with its probabilities. Out: a `Claim`: one part, or the set of those that the data
do not tell apart, with the probability that belongs to it, everybody else, and nobody. A part that
is less probable than all others together is no answer: then the set is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from fdi.diagnosis.values import Finding
from fdi.model.naming import component_words, inside
from fdi.model.parts import Component
from fdi.units import hundredths

SURE: Final = 0.9
PROBABLE: Final = 0.7
EVEN: Final = 0.5
"""From these probabilities on it is said that a part failed, that it probably did, and of one part
at all. Stated choices: what the words mean to a reader; they decide nobody's guilt."""
WORTH_TELLING: Final = 0.05
"""That it was another part, or nobody, is told from here on where a claim is less than probable."""

MOST: Final = 0.99
"""Of several together: each of their probabilities is rounded already."""

Level = Literal["sure", "probable", "possible"]
_VERBS: Final[Mapping[str, Mapping[Level, str]]] = {
    "first": {
        "sure": "failed first",
        "probable": "probably failed first",
        "possible": "may have failed first",
    },
    "later": {"sure": "failed", "probable": "probably failed", "possible": "may have failed"},
    "after": {"sure": "is accused", "probable": "is suspected", "possible": "is one suspect"},
    "take-off": {
        "sure": "was wrong from take-off on",
        "probable": "was probably wrong from take-off on",
        "possible": "may have been wrong from take-off on",
    },
    "ground": {
        "sure": "was wrong before take-off",
        "probable": "was probably wrong before take-off",
        "possible": "may have been wrong before take-off",
    },
    "gap": {
        "sure": "left a gap in the recording",
        "probable": "probably left a gap in the recording",
        "possible": "may have left a gap in the recording",
    },
}
When = Literal["first", "later", "after", "take-off", "ground", "gap"]
"""Nobody is accused of an earlier failure; somebody is; it shows only after control was lost; it
was there when the flight began, which no test could see before; or one could; or, whenever it was,
the recording is what it failed, by itself not the vehicle."""


@dataclass(frozen=True, slots=True)
class Claim:
    """Whom a finding names, and how sure that is.

    Attributes
    ----------
    names : tuple of str
        The accused, or the accused and all that explain the alarms as well.
    share : float
        0..1, that it was one of ``names``.
    nobody : float
        0..1, that nothing failed.
    others : tuple of (str, float)
        Who else would explain it as well, with its probability; none where ``names`` holds them.
    """

    names: tuple[str, ...]
    share: float
    nobody: float
    others: tuple[tuple[str, float], ...]

    @property
    def level(self) -> Level:
        """Return how strongly it may be said."""
        if self.share >= SURE:
            return "sure"
        return "probable" if self.share >= PROBABLE else "possible"

    def subject(self, components: Mapping[str, Component]) -> str:
        """Return whom it names, as the beginning of a sentence."""
        words = [component_words(name, components) for name in self.names]
        rest = [inside(word) for word in words[1:]]
        return " or ".join(filter(None, (", ".join([words[0], *rest[:-1]]), *rest[-1:])))

    def verb(self, when: When) -> str:
        """Return what is said of whom it names."""
        return _VERBS[when][self.level]

    def odds(self, components: Mapping[str, Component]) -> str:
        """Return how sure it is and what else may be, to stand behind the name."""
        sure = f"{hundredths(self.share)} % sure"
        if len(self.names) > 1:
            sure += " that it was one of them, the data do not tell which"
        told = [
            f"{inside(component_words(name, components))} {hundredths(share)} %"
            for name, share in self.others
        ]
        if self.level == "possible":
            another = 1.0 - self.share - self.nobody - sum(share for _, share in self.others)
            more = (("another part", another), ("nothing at all", self.nobody))
            told += [f"{who} {hundredths(p)} %" for who, p in more if p >= WORTH_TELLING]
        return "; ".join([sure, *told])


def claim_of(finding: Finding) -> Claim:
    """Return how a finding may be said.

    Parameters
    ----------
    finding : Finding
    """
    shares = dict(finding.rivals)
    equals = [(name, shares.get(name, 0.0)) for name in finding.inseparable_from]
    nobody = max(0.0, 1.0 - finding.confidence - sum(shares.values()))
    if not equals or finding.confidence >= EVEN:
        return Claim((finding.component,), finding.confidence, nobody, tuple(equals))
    together = min(finding.confidence + sum(share for _, share in equals), MOST)
    names = (finding.component, *(name for name, _ in equals))
    return Claim(names, together, nobody, ())
