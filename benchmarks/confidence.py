"""Which weights make the confidence of an accusation a probability, and how well does it hold?

    .venv/bin/python benchmarks/confidence.py [--write] [--inject N] [--workers N]

Analyses the labelled flights of ../shared/flights beside the repository, fits the weights to their
accusations, and prints how often accusations are right against what is said of them by weights that
were fitted without their likes. With ``--write`` the weights go into fdi/diagnosis/confidence.json,
the tables between the markers of docs/evaluation.md and the picture into docs/images. To be done
after every change of the rules, before ``benchmarks/evaluation.py --write``; takes as long as that.

With ``--inject N`` it asks instead what N faults in each healthy flight of up to 200 s say of the
weights, and whether it would help to fit these, too.
"""

from __future__ import annotations

import argparse
import os
import sys
import zlib
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from evaluation import LABELS, ROOT, evaluated, progress, put, pyplot, save

from fdi.diagnosis.confidence import FILE, ConfidenceModel
from fdi.diagnosis.values import Grounds
from fdi.errors import UsageError
from fdi.evaluation import Label, load_labels
from fdi.evaluation.calibration import Judged, brier, calibration_error, reliability
from fdi.evaluation.curves import InjectedJob, analyze_injected, sensors
from fdi.evaluation.fitting import (
    Accusation,
    accusations,
    confidence_document,
    cross_validated,
    fit,
    recording,
)
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import InjectedFault
from fdi.evaluation.score import EARLY_S
from fdi.evaluation.tables import reliability_lines
from fdi.fleet import rows
from fdi.report.json_text import json_text
from fdi.telemetry import read

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COMMAND: Final = "benchmarks/confidence.py --write"
DATA: Final = ROOT / "fdi" / "diagnosis" / FILE
LONGEST_S: Final = 200.0
KINDS: Final = ("bias", "drift", "noise", "freeze", "dropout")
SIZES: Final = (2.0, 64.0)
"""In accuracies of the channel; a drift reaches them after `REACHED_S`."""
REACHED_S: Final = 20.0
MEANING: Final = {
    "share": "log odds of the share of the evidence",
    "strength": "logarithm of the strongest early alarm, in thresholds",
    "exclusive": "a test that concerns nobody else is among the first alarms",
    "part": "the accused is a part, not a controller and not computed",
}


def pairs(said: Sequence[float], known: Sequence[Accusation]) -> Judged:
    """Return confidences with whether the accusations are right."""
    return [(c, one.right) for c, one in zip(said, known, strict=True)]


def shares(known: Sequence[Accusation]) -> Judged:
    """Return the shares of the evidence with whether the accusations are right."""
    return pairs([one.grounds.share for one in known], known)


def constant(known: Sequence[Accusation]) -> Judged:
    """Return the share of right accusations, said of each."""
    return pairs([sum(one.right for one in known) / len(known)] * len(known), known)


def told(model: ConfidenceModel, known: Sequence[Accusation], said: Judged) -> str:
    """Return the tables of the page."""
    right = sum(one.right for one in known)
    flights = len({one.recording for one in known})
    lines = [
        f"`{COMMAND}` printed: {right} of {len(known)} accusations on {flights} flights are right.",
        "",
        "Confidence, each by weights that were fitted without flights on which the same component "
        "failed:",
        "",
        *reliability_lines(said),
        "",
        "The share of the evidence, which earlier versions gave instead:",
        "",
        *reliability_lines(shares(known)),
        "",
        f"To say {right / len(known):.2f} of every accusation has a Brier score of "
        f"{brier(constant(known)):.3f}.",
        "",
        "| weight | of | value |",
        "| --- | --- | --- |",
        f"| | intercept | {model.intercept:.2f} |",
        *(f"| {name} | {MEANING[name]} | {value:.2f} |" for name, value in model.weights.items()),
        "",
        "![Confidence against the share of right accusations](images/reliability.png)",
    ]
    return "\n".join(lines)


def diagram(said: Judged, raw: Judged) -> Figure:
    """Draw the share of right accusations, with its interval, against what was said."""
    plt = pyplot()
    figure, axis = plt.subplots(figsize=(4.8, 4.2))
    axis.plot([0, 1], [0, 1], color="0.7", linewidth=1, label="as stated")
    series = (
        (raw, "tab:gray", "s", "share of the evidence"),
        (said, "tab:blue", "o", "confidence, cross-validated"),
    )
    for judged, color, mark, name in series:
        bins = reliability(judged)
        for one in bins:
            axis.plot([one.mean] * 2, one.right.interval, color=color, linewidth=1)
            if judged is said:
                place = (one.mean, one.right.interval[1])
                axis.annotate(f"{one.right.of}", place, ha="center", va="bottom", fontsize=7)
        share = [one.right.share for one in bins]
        axis.plot([one.mean for one in bins], share, mark, color=color, label=name, markersize=4)
    axis.set(xlim=(0, 1.02), ylim=(0, 1.06), xlabel="stated", ylabel="share right, 95 % interval")
    axis.legend(loc="lower right", fontsize=7)
    return figure


def write(model: ConfidenceModel, known: Sequence[Accusation], said: Judged, text: str) -> None:
    """Write the weights, the tables and the picture."""
    about = {
        "command": COMMAND,
        "date": datetime.now(UTC).date().isoformat(),
        "accusations": len(known),
        "right": sum(one.right for one in known),
        "brier_cross_validated": round(brier(said) or 0.0, 3),
        "brier_of_the_share": round(brier(shares(known)) or 0.0, 3),
        "calibration_error_cross_validated": round(calibration_error(said) or 0.0, 3),
    }
    DATA.write_text(json_text(confidence_document(model, about)), "utf-8")
    save(diagram(said, shares(known)), "reliability.png")
    put(text, "confidence")


def faults(label: Label, count: int) -> Iterator[InjectedFault]:
    """Yield so many faults of a flight's sensors, at one channel or at all of a component."""
    log = read(label.path)
    until = float("inf") if label.evaluate_until is None else label.evaluate_until
    subjects = list(sensors(log))
    if not subjects or not log.flights or log.duration > LONGEST_S:
        return
    low, high = max((flight.airborne for flight in log.flights), key=lambda ends: ends[1] - ends[0])
    rng = np.random.default_rng(zlib.crc32(label.key.encode()))
    components = sorted({one.component for one in subjects})
    for _ in range(count):
        name = components[rng.integers(len(components))]
        own = [one for one in subjects if one.component == name]
        one = own[rng.integers(len(own))]
        kind = KINDS[rng.integers(len(KINDS))]
        size = one.accuracy * float(np.exp(rng.uniform(*np.log(SIZES)))) * rng.choice((-1, 1))
        size = {"bias": size, "drift": size / REACHED_S, "noise": abs(size)}.get(kind, 1.0)
        start = low + (min(high, until) - low) * rng.uniform(0.2, 0.8)
        target = name if rng.random() < 0.5 else one.channel
        fault = InjectedFault(target, kind, size, start, float("inf"))  # type: ignore[arg-type]
        try:
            injected(log, fault)
        except UsageError:  # the channels of this component have several units
            fault = InjectedFault(one.channel, kind, size, start, float("inf"))  # type: ignore[arg-type]
        yield fault


def accusations_after_faults(count: int, workers: int) -> list[Accusation]:
    """Return the accusations that faults in healthy flights bring."""
    plans = []
    for label in load_labels(LABELS):
        if label.use == "diagnosis" and not label.faults:
            plain = InjectedJob(str(label.path))
            plans.append((label, plain, ""))
            names = {one.channel: one.component for one in sensors(read(label.path))}
            plans += [
                (label, InjectedJob(plain.path, fault=f), names.get(f.target, f.target))
                for f in faults(label, count)
            ]
    done = {}
    for i, row in rows([job for _, job, _ in plans], workers=workers, work=analyze_injected):
        done[i] = row
        progress(Path(row["path"]).name, len(done) / len(plans))
    found = []
    healthy: set[str] = set()
    for i, (label, job, component) in enumerate(plans):
        if job.fault is None:
            healthy = {f["component"] for f in done[i]["findings"]}
            continue
        until = float("inf") if label.evaluate_until is None else label.evaluate_until
        own = recording(label)
        for finding in done[i]["findings"]:
            if (
                job.fault.start - EARLY_S <= finding["onset_s"] <= until
                and finding["component"] not in healthy
            ):
                right = finding["component"] == component
                grounds = Grounds(**finding["grounds"])
                likes = frozenset({own, component})
                found.append(Accusation(own, likes, 1, grounds, finding["confidence"], right))
    return found


def asked_by_injection(known: Sequence[Accusation], count: int, workers: int) -> str:
    """Return what injected faults say of the weights."""
    made = accusations_after_faults(count, workers)
    model = fit(known)
    both = [*known, *made]
    with_them = cross_validated(both)[: len(known)]
    said = pairs([model.confidence(one.grounds) for one in made], made)
    return "\n".join(
        [
            f"`benchmarks/confidence.py --inject {count}` printed: {sum(a.right for a in made)} of "
            f"{len(made)} accusations after injected faults are right. Confidence by the weights:",
            "",
            *reliability_lines(said),
            "",
            f"The share of the evidence has a Brier score of {brier(shares(made)):.3f} there, to "
            f"say the same of all {brier(constant(made)):.3f}. Weights that are fitted to them as "
            f"well have one of {brier(pairs(with_them, known)):.3f} on the labelled flights "
            f"(cross-validated), weights fitted without them "
            f"{brier(pairs(cross_validated(known), known)):.3f}.",
        ]
    )


def main() -> int:
    """Print the tables, and write them where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="into the package and the page")
    parser.add_argument("--inject", type=int, default=0, metavar="N", help="faults a flight")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    if not LABELS.is_file():
        print(f"skipped: {LABELS} is not here")
        return 0
    known = accusations(evaluated(given.workers))
    if given.inject:
        text = asked_by_injection(known, given.inject, given.workers)
        print(text)
        if given.write:
            put(text, "confidence-injected")
        return 0
    said = pairs(cross_validated(known), known)
    model = fit(known)
    text = told(model, known, said)
    print(text)
    if given.write:
        write(model, known, said, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
