"""What do the analyses of these labelled flights score?

In: labels. Out: an `Evaluation`: a score per flight that is labelled for diagnosis, in the order of
the labels. Where that is asked for, every flight is analysed a second time without the tests that
read a recorded command: they see how a fault was made rather than what it does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fdi.decision import load_policy
from fdi.decision.policy import policy_text
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
    bare: bool = False,
    workers: int = 1,
    progress: Progress | None = None,
) -> Evaluation:
    """Return the scores of all flights that are labelled for diagnosis.

    Parameters
    ----------
    labels : sequence of Label
    policy : str
        A shipped policy or a file.
    bare : bool
        Whether all is scored a second time without the tests that read a recorded command.
    workers : int
        Local processes.
    progress : callable, optional
        Is told the log that is done and the share of all.
    """
    wanted = [label for label in labels if label.use == "diagnosis"]
    done: dict[int, Row] = {}
    with TemporaryDirectory(prefix="fdi-") as folder:
        policies = [policy, *([_without_commands(policy, folder)] if bare else [])]
        jobs = [Job(str(label.path), policy=recipe) for recipe in policies for label in wanted]
        for number, row in rows(jobs, workers=workers):
            done[number] = row
            if progress:
                progress(wanted[number % len(wanted)].path.name, len(done) / len(jobs))
    ordered = tuple(done[i] for i in range(len(wanted)))
    second = [done.get(i + len(wanted)) for i in range(len(wanted))]
    told = zip(wanted, ordered, second, strict=True)
    return Evaluation(tuple(score(*one) for one in told), ordered)


def _without_commands(policy: str, folder: str) -> str:
    """Return a file with the policy, and with recorded commands left out as evidence."""
    path = Path(folder) / "without_commands.yaml"
    text = policy_text(replace(load_policy(policy), commands="left_out"))
    path.write_text(text, encoding="utf-8")
    return str(path)
