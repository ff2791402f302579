"""Which weights make the confidence of accusations a probability?

In: accusations on labelled flights with what they rest on, and whether they were right. Out: a
`ConfidenceModel`, and for every accusation what a model says that was fitted without its likes.

A logistic regression with weights of zero or more: penalised log likelihood, a weight normal with
a standard deviation of one over that of its value, the intercept free. A recording in two formats
counts once, half for each. Its likes are the accusations on flights on which the same component
failed, whichever way and of whichever vehicle, and those on the same recording: none of them helps
to judge it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.confidence import ConfidenceModel, values
from fdi.diagnosis.values import Grounds
from fdi.errors import UsageError
from fdi.evaluation.calibration import judged
from fdi.evaluation.totals import plain

if TYPE_CHECKING:
    from fdi.evaluation.labels import Label
    from fdi.evaluation.run import Evaluation

Floats = NDArray[np.float64]

PENALTY: Final = 1.0
"""One over the variance of a weight before any flight is seen, for values of unit deviation."""


@dataclass(frozen=True, slots=True)
class Accusation:
    """An accusation on a labelled flight.

    Attributes
    ----------
    recording : str
        The flight, whatever the format.
    likes : frozenset of str
        The kinds of components that failed on it, and the recording: what it has in common with
        others that must not help to judge it.
    copies : int
        In so many formats the flight is labelled.
    """

    recording: str
    likes: frozenset[str]
    copies: int
    grounds: Grounds
    stated: float
    right: bool


def accusations(found: Evaluation) -> tuple[Accusation, ...]:
    """Return the accusations of an evaluation that count, in its order."""
    copies = Counter(recording(score.label) for score in found.scores)
    return tuple(
        Accusation(
            recording=(own := recording(label)),
            likes=frozenset({own, *(plain(fault.component) for fault in label.faults)}),
            copies=copies[own],
            grounds=Grounds(**finding["grounds"]),
            stated=finding["confidence"],
            right=right,
        )
        for label, finding, right in judged(found)
    )


def recording(label: Label) -> str:
    """Return the name of a flight, the same for all formats that it is kept in."""
    return str(PurePosixPath(label.key).with_suffix(""))


def fit(known: Sequence[Accusation]) -> ConfidenceModel:
    """Return the model that suits some accusations best.

    Raises
    ------
    UsageError
        All of them are right, or none: nothing can be learned from them.
    """
    from scipy.optimize import minimize

    right = np.array([one.right for one in known], float)
    if not len(known) or right.min() == right.max():
        raise UsageError(
            f"{len(known)} accusations, {int(right.sum())} of them right, teach no confidence",
            hint="give flights with right and wrong accusations",
        )
    names = list(values(known[0].grounds))
    rows = np.array([list(values(one.grounds).values()) for one in known])
    counts = np.array([1.0 / one.copies for one in known])
    width = rows.std(axis=0)
    unit = np.where(width > 0, width, 1.0)
    found = minimize(
        _loss(rows / unit, right, counts),
        np.zeros(len(names) + 1),
        jac=True,
        method="L-BFGS-B",
        bounds=[(None, None)] + [(0.0, None)] * len(names),
    ).x
    seen = counts.sum()
    weights = (float(w) for w in found[1:] / unit)
    return ConfidenceModel(
        float(found[0]), dict(zip(names, weights, strict=True)), float((seen + 1) / (seen + 2))
    )


def _loss(rows: Floats, right: Floats, counts: Floats) -> Callable[[Floats], tuple[float, Floats]]:
    """Return the penalised negative log likelihood with its gradient."""

    def loss(at: Floats) -> tuple[float, Floats]:
        odds = at[0] + rows @ at[1:]
        off = counts * (1.0 / (1.0 + np.exp(-odds)) - right)
        value = counts @ (np.logaddexp(0.0, odds) - right * odds) + PENALTY / 2 * at[1:] @ at[1:]
        return float(value), np.append(off.sum(), rows.T @ off + PENALTY * at[1:])

    return loss


def cross_validated(known: Sequence[Accusation]) -> tuple[float, ...]:
    """Return the confidence of every accusation by a model that has seen none of its likes."""
    made: dict[int, float] = {}
    for asked in _folds(known):
        likes = frozenset().union(*(known[i].likes for i in asked))
        model = fit([one for one in known if not one.likes & likes])
        made.update((i, model.confidence(known[i].grounds)) for i in asked)
    return tuple(made[i] for i in range(len(known)))


def _folds(known: Sequence[Accusation]) -> Iterator[list[int]]:
    """Yield the numbers of accusations that are judged together, each once."""
    left = dict.fromkeys(range(len(known)))
    while left:
        likes = known[next(iter(left))].likes
        asked = [i for i in left if known[i].likes & likes]
        for i in asked:
            del left[i]
        yield asked


def confidence_document(model: ConfidenceModel, about: dict[str, Any]) -> dict[str, Any]:
    """Return the content of ``confidence.json``: a model, and what is said about it."""
    return {
        "format": 1,
        **about,
        "intercept": round(model.intercept, 4),
        "weights": {name: round(weight, 4) for name, weight in model.weights.items()},
        "most": round(model.most, 4),
    }
