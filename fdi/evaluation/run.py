"""What do the analyses of these labelled flights score?

In: labels. Out: an `Evaluation`: a score per flight that is labelled for diagnosis, in the order of
the labels, and what their tests did, for weights that have not seen a flight. Where that is asked
for, every flight is analysed a second time without the tests that read a recorded command: they see
how a fault was made rather than what it does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from fdi.decision import Policy, load_policy
from fdi.decision.policy import policy_text
from fdi.diagnosis.answer import clearable
from fdi.diagnosis.hypotheses import inquire
from fdi.evaluation.fitting import Flown
from fdi.evaluation.labels import Label
from fdi.evaluation.score import Score, score
from fdi.fleet import Job, Row, row_of_log, rows, told
from fdi.shown import Shown

if TYPE_CHECKING:
    from fdi.result import Analysis

Progress = Callable[[str, float], None]

ASKED: Final = "asked"
"""The key of a row under which a worker hands over what its tests did."""


@dataclass(frozen=True, slots=True)
class Evaluation(Shown):
    """Scores, the rows of the fleet that they come from, and the flights that had an analysis."""

    scores: tuple[Score, ...]
    rows: tuple[Mapping[str, Any], ...]
    flown: tuple[Flown, ...] = ()


def evaluate(
    labels: Sequence[Label],
    *,
    policy: str = "default",
    methods: Sequence[str] | None = None,
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
    methods : sequence of str, optional
        Whose columns are weighed with the model's tests; by default the policy's.
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
        own = load_policy(policy).using(methods)
        policies = [policy if methods is None else _written(own, folder, "with_methods")]
        if bare:
            policies.append(_written(replace(own, commands="left_out"), folder, "without_commands"))
        jobs = [Job(str(label.path), policy=recipe) for recipe in policies for label in wanted]
        for number, row in rows(jobs, workers=workers, work=analyze_and_inquire):
            done[number] = row
            if progress:
                progress(wanted[number % len(wanted)].path.name, len(done) / len(jobs))
    asked = [done[i].pop(ASKED, None) for i in range(len(wanted))]
    ordered = tuple(done[i] for i in range(len(wanted)))
    second = [done.get(i + len(wanted)) for i in range(len(wanted))]
    pairs = zip(wanted, ordered, second, strict=True)
    flown = [
        Flown(label, found[0], origin(label, row), found[1])
        for label, row, found in zip(wanted, ordered, asked, strict=True)
        if found is not None
    ]
    return Evaluation(tuple(score(*one) for one in pairs), ordered, tuple(flown))


def analyze_and_inquire(job: Job) -> Row:
    """Return the row of a log with what its tests did and who could be ruled out, under `ASKED`."""
    return row_of_log(job, _asked)


def _asked(found: Analysis) -> Row:
    cleared = tuple(one.component for one in clearable(found.alarms))
    return {**told(found), ASKED: (inquire(found.alarms), cleared)}


def origin(label: Label, row: Mapping[str, Any]) -> str:
    """Return where a flight comes from: a recording, or which simulation of what."""
    if label.origin == "recorded" or row["autopilot"] is None:
        return label.origin
    kind = "" if row["autopilot"] == "px4" else " plane" if row["vehicle"] == "plane" else " copter"
    return f"{label.origin}, {row['autopilot']}{kind}"


def _written(policy: Policy, folder: str, name: str) -> str:
    """Return a file with a policy, for who works in another process."""
    path = Path(folder) / f"{name}.yaml"
    path.write_text(policy_text(policy), encoding="utf-8")
    return str(path)
