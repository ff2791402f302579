"""Are accusations given a confidence of 0.8 right in 80 of 100 cases?

In: an evaluation. Out: accusations in bins of confidence, with the share that was right.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from fdi.evaluation.score import EARLY_S, is_right
from fdi.evaluation.totals import Rate

if TYPE_CHECKING:
    from fdi.evaluation.run import Evaluation

EDGES: Final = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


@dataclass(frozen=True, slots=True)
class Bin:
    """Accusations with a confidence from ``low`` to ``high``, their mean, and how many hold."""

    low: float
    high: float
    mean: float
    right: Rate


def judged(found: Evaluation) -> Iterator[tuple[float, bool]]:
    """Yield confidence and rightness of every accusation that counts."""
    for one, row in zip(found.scores, found.rows, strict=True):
        until = one.label.evaluate_until
        true = one.label.onset
        for finding in row["findings"]:
            if until is not None and finding["onset_s"] > until:
                continue
            in_time = true is not None and finding["onset_s"] >= true - EARLY_S
            yield finding["confidence"], in_time and is_right(finding["component"], one.label)


def reliability(found: Evaluation) -> tuple[Bin, ...]:
    """Return the bins that hold any accusation."""
    pairs = list(judged(found))
    bins = []
    for low, high in pairwise(EDGES):
        own = [(c, right) for c, right in pairs if low <= c < high or c == high == EDGES[-1]]
        if own:
            mean = sum(c for c, _ in own) / len(own)
            bins.append(Bin(low, high, mean, Rate(sum(r for _, r in own), len(own))))
    return tuple(bins)
