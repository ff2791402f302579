"""Are accusations given a confidence of 0.8 right in 80 of 100 cases?

In: confidences, and whether the accusations were right. Out: bins of confidence with the share that
was right, and two figures: the Brier score and the calibration error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from fdi.evaluation.score import EARLY_S, is_right
from fdi.evaluation.totals import Rate

if TYPE_CHECKING:
    from fdi.evaluation.labels import Label
    from fdi.evaluation.run import Evaluation

EDGES: Final = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


@dataclass(frozen=True, slots=True)
class Bin:
    """Accusations with a confidence from ``low`` to ``high``, their mean, and how many hold."""

    low: float
    high: float
    mean: float
    right: Rate


Judged = Sequence[tuple[float, bool]]
"""Confidences, each with whether the accusation was right."""


def judged(found: Evaluation) -> Iterator[tuple[Label, Mapping[str, Any], bool]]:
    """Yield every accusation that counts: its flight, the finding, and whether it is right.

    On a flight without a fault that of a component which its label accepts does not: whoever
    labelled it could not say that it was sound, nor that it had failed.
    """
    for one, row in zip(found.scores, found.rows, strict=True):
        until = one.label.evaluate_until
        true = one.label.onset
        for finding in row["findings"]:
            if until is not None and finding["onset_s"] > until:
                continue
            names = is_right(finding["component"], one.label)
            if true is None and names:
                continue
            in_time = true is not None and finding["onset_s"] >= true - EARLY_S
            yield one.label, finding, in_time and names


def stated(found: Evaluation) -> Judged:
    """Return the confidence and the rightness of every accusation that counts."""
    return [(finding["confidence"], right) for _, finding, right in judged(found)]


def reliability(pairs: Judged) -> tuple[Bin, ...]:
    """Return the bins that hold any accusation."""
    bins = []
    for low, high in pairwise(EDGES):
        own = [(c, right) for c, right in pairs if low <= c < high or c == high == EDGES[-1]]
        if own:
            mean = sum(c for c, _ in own) / len(own)
            bins.append(Bin(low, high, mean, Rate(sum(r for _, r in own), len(own))))
    return tuple(bins)


def brier(pairs: Judged) -> float | None:
    """Return the mean squared error of confidences, 0 at best; None of none.

    References
    ----------
    Brier, Monthly Weather Review 78 (1950), 1.

    Examples
    --------
    >>> round(brier([(0.9, True), (0.6, False)]), 3), brier([(0.5, True), (0.5, False)])
    (0.185, 0.25)
    """
    return sum((c - right) ** 2 for c, right in pairs) / len(pairs) if pairs else None


def brier_of_constant(pairs: Judged) -> float | None:
    """Return the Brier score of saying the share that is right of every accusation.

    Examples
    --------
    >>> brier_of_constant([(0.9, True), (0.6, False), (0.9, True), (0.9, True)])
    0.1875
    """
    share = sum(right for _, right in pairs) / len(pairs) if pairs else 0.0
    return brier([(share, right) for _, right in pairs])


def calibration_error(pairs: Judged) -> float | None:
    """Return how far the share right lies from the mean confidence, mean over the bins' members.

    Examples
    --------
    >>> round(calibration_error([(0.9, True), (0.92, True), (0.6, False), (0.6, True)]), 3)
    0.095
    """
    off = (abs(b.right.hits - b.mean * b.right.of) for b in reliability(pairs))
    return sum(off) / len(pairs) if pairs else None
