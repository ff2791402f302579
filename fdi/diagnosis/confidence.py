"""How sure is an accusation: of a hundred on grounds like these, how many were right?

In: the `Grounds` of an accusation. Out: a probability, by a logistic model with a weight for each
of them, none below zero: more evidence never makes an accusation less sure. The weights were fitted
to labelled flights and lie in ``confidence.json`` beside this file, with the command that wrote
them and what they are worth (``fdi/evaluation/fitting.py``, ``benchmarks/confidence.py``).

Candidates are compared by evidence and findings ordered by onset, never by this number; what it
holds for hardly ever right accuses nobody (``passing.py``).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from math import exp, log
from typing import Final

from fdi.decision.accusing import WEIGHING_S
from fdi.decision.concerns import Concerns
from fdi.diagnosis.ranking import Cause
from fdi.diagnosis.values import Grounds
from fdi.diagnosis.weighing import MOST_PEAK

FILE: Final = "confidence.json"
MOST_SHARE: Final = 0.999
"""A larger share of the evidence counts as this one: its odds would count without bound."""
AUTOPILOT: Final = "autopilot"
"""The group of controllers: programs, which do badly because something else has failed."""


@dataclass(frozen=True, slots=True)
class ConfidenceModel:
    """The log odds of being right: ``intercept`` and a weight, zero or more, for each value.

    ``most``: no confidence is larger, and none smaller than what is left of one. So sure as this is
    who has seen as many accusations as were fitted, all right (Laplace's rule of succession).
    """

    intercept: float
    weights: Mapping[str, float]
    most: float

    def confidence(self, grounds: Grounds) -> float:
        """Return the probability, 0 to 1 with both ends excluded, that an accusation is right.

        Examples
        --------
        >>> model = ConfidenceModel(0.0, {"exclusive": 1.0, "strength": 0.5}, 0.99)
        >>> weak, strong = Grounds(0.9, 1.0, False, True), Grounds(0.9, 7.4, True, True)
        >>> model.confidence(weak), round(model.confidence(strong), 2)
        (0.5, 0.88)
        """
        known = values(grounds)
        odds = self.intercept + sum(w * known[name] for name, w in self.weights.items())
        sure = 1.0 / (1.0 + exp(-odds))
        return min(max(sure, 1.0 - self.most), self.most)


def values(grounds: Grounds) -> dict[str, float]:
    """Return what the weights are for, by name; each grows with the evidence.

    ``share``: its log odds; ``strength``: its logarithm; ``exclusive``, ``part``: 1 or 0.
    """
    share = min(max(grounds.share, 1.0 - MOST_SHARE), MOST_SHARE)
    return {
        "share": log(share / (1.0 - share)),
        "strength": log(min(max(grounds.strength, 1.0), MOST_PEAK)),
        "exclusive": float(grounds.exclusive),
        "part": float(grounds.part),
    }


def load_confidence() -> ConfidenceModel:
    """Return the model that the package holds."""
    tree = json.loads(files("fdi.diagnosis").joinpath(FILE).read_text("utf-8"))
    return ConfidenceModel(tree["intercept"], tree["weights"], tree["most"])


def grounds_of(cause: Cause, whom: Concerns) -> Grounds:
    """Return what an accusation rests on, by the alarms within `WEIGHING_S` of its onset.

    Parameters
    ----------
    cause : Cause
    whom : Concerns
        Of the bank whose alarms these are.
    """
    name = cause.component
    component = whom.components[name]
    soon = [run for run in cause.runs if run.onset <= cause.runs[0].onset + WEIGHING_S]
    return Grounds(
        share=cause.share,
        strength=min(max(max(run.peak for run in soon), 1.0), MOST_PEAK),
        exclusive=any(whom.of(run.row) == {name} for run in soon),
        part=not component.computed and component.group != AUTOPILOT,
    )
