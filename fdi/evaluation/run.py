"""What do the analyses of these labelled flights score?

In: labels. Out: an `Evaluation`: a score per flight that is labelled for diagnosis, in the order of
the labels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fdi.evaluation.labels import Label
from fdi.evaluation.score import Score, score
from fdi.fleet import Job, Row, rows

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Scores, and the rows of the fleet that they come from."""

    scores: tuple[Score, ...]
    rows: tuple[Mapping[str, Any], ...]


def evaluate(
    labels: Sequence[Label],
    *,
    policy: str = "default",
    workers: int = 1,
    progress: Progress | None = None,
) -> Evaluation:
    """Return the scores of all flights that are labelled for diagnosis.

    Parameters
    ----------
    labels : sequence of Label
    policy : str
        A shipped policy or a file.
    workers : int
        Local processes.
    progress : callable, optional
        Is told the log that is done and the share of all.
    """
    wanted = [label for label in labels if label.use == "diagnosis"]
    jobs = [Job(str(label.path), policy=policy) for label in wanted]
    done: dict[int, Row] = {}
    for number, row in rows(jobs, workers=workers):
        done[number] = row
        if progress:
            progress(wanted[number].path.name, len(done) / len(jobs))
    ordered = tuple(done[i] for i in range(len(wanted)))
    pairs = zip(wanted, ordered, strict=True)
    return Evaluation(tuple(score(label, row) for label, row in pairs), ordered)
