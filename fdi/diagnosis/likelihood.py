"""How probable is each candidate of a case, and that it is nobody?

In: a `Case`. Out: probabilities by a conditional logit over the candidates with "nobody" among
them,

    P(c) = exp(w x(c)) / (1 + sum over those who explain any alarm that c explains of exp(w x)),

the 1 for nobody: noise, a gust, a manoeuvre, an error of the model. The weights were fitted to
labelled flights (``fdi fit``) and lie in ``likelihood.json`` beside this file, each with its
interval; what they are worth on flights that they have not seen stands in docs/evaluation.md.

References
----------
McFadden, "Conditional logit analysis of qualitative choice behavior", in Zarembka (ed.), Frontiers
in Econometrics, 1974.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.concerns import Tie
from fdi.diagnosis.features import FEATURES
from fdi.diagnosis.hypotheses import Case
from fdi.model.evaluate import Floats

FILE: Final = "likelihood.json"


@dataclass(frozen=True, slots=True)
class Fitted:
    """The weights of the features, by name.

    ``most``: no probability is larger. So sure as this is who has seen as many flights as were
    fitted, all right (Laplace's rule of succession).
    """

    weights: Mapping[str, float]
    most: float

    @property
    def vector(self) -> Floats:
        """Return the weights in the order of `FEATURES`."""
        return np.array([self.weights[name] for name in FEATURES])

    def probabilities(self, case: Case, failed: Mapping[str, float] | None = None) -> Floats:
        """Return how probable every candidate of a case is, (c,).

        Parameters
        ----------
        case : Case
        failed : mapping of str to float, optional
            Who is said to have failed before in this flight, with the probability: what failed
            stays failed, so that replaces what is thought before any evidence.

        Notes
        -----
        What is left is nobody's, or that of others who explain some of the same alarms. Candidates
        that share no alarm do not compete: both may have failed.
        """
        odds = case.features @ self.vector
        for i, name in enumerate(case.names):
            if failed and name in failed:
                odds[i] += np.log(failed[name] / (1.0 - failed[name])) - self.weights["one"]
        top = float(odds.max(initial=0.0))
        shares = np.exp(odds - top)
        explains = (case.ties > Tie.NONE).astype(float)
        rivals = (explains @ explains.T > 0) | np.eye(len(shares), dtype=bool)
        found: NDArray[np.float64] = shares / (rivals @ shares + np.exp(-top))
        return np.minimum(found, self.most)


@cache
def load_fitted() -> Fitted:
    """Return the weights that the package holds."""
    return fitted_of(json.loads(files("fdi.diagnosis").joinpath(FILE).read_text("utf-8")))


def fitted_of(tree: Mapping[str, Any]) -> Fitted:
    """Return the weights of a document as `fdi fit` writes it."""
    weights = {name: float(tree["weights"][name]["value"]) for name in FEATURES}
    return Fitted(weights, float(tree["most"]))
