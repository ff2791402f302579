"""Where do the seconds between a fault and its accusation go?

    .venv/bin/python benchmarks/delays.py [--write] [--closed-loop DIR] [--workers N]

In: the labelled flights of ../shared/flights on which the right component is accused, the
closed-loop ones among them. Out: medians by kind of fault, s from the onset of the label:

- *visible*: two samples in a row of a test that concerns the component are beyond 1.5 times all
  that this test has shown before. Whoever looks for that has to know the onset and the component:
  it tells what the log holds, not what could be decided.
- *begins*: the accusation's onset.
- *alarm*: it was certain. The difference to *begins* is persistence, and what a test looks ahead.

With ``--write`` the table goes between the markers of docs/evaluation.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from evaluation import LABELS, add_options, closed_loop, missing, put
from numpy.typing import NDArray

import fdi
from fdi.decision import Alarms
from fdi.diagnosis.concerns import Tie, concerns
from fdi.errors import FdiError
from fdi.evaluation import Label, load_labels
from fdi.evaluation.score import EARLY_S, is_right
from fdi.telemetry.airtime import airborne_mask

COMMAND: Final = "benchmarks/delays.py --write"
BEYOND: Final = 1.5
"""Times the largest value before the fault."""
LEAST: Final = 40
"""Samples before the fault; fewer tell no largest value."""
TIED: Final = "motor_stop/"
"""Recordings in which a motor first gets a fixed output and stops more than a second later."""


class Seen(NamedTuple):
    """Of a flight: seconds from the onset of its fault; infinite where never."""

    source: str
    key: str
    kind: str
    motor: bool
    visible: float
    begins: float
    alarm: float


def seen(label: Label) -> Seen | None:
    """Return when a fault was visible and accused, None where no right component is accused."""
    try:
        found = fdi.analyze(label.path)
    except FdiError:
        return None
    onset = label.onset
    right = [
        one
        for one in found.findings
        if is_right(one.component, label) and one.onset >= onset - EARLY_S
    ]
    if not right:
        return None
    first = min(right, key=lambda one: one.alarm)
    kinds = {fault.kind for fault in label.faults}
    return Seen(
        "/".join(Path(label.source).parts[-2:]),
        label.key,
        "ramps" if "ramp" in kinds else "steps",
        any(fault.component.startswith("motor_") for fault in label.faults),
        visible(found.alarms, label) - onset,
        first.onset - onset,
        first.alarm - onset,
    )


def visible(alarms: Alarms, label: Label) -> float:
    """Return when a test of a right component first left all that it had shown, s, or infinity."""
    residuals = alarms.residuals
    t, whom = residuals.t, concerns(residuals.bank)
    names = [name for name in residuals.bank.system.components if is_right(name, label)]
    ties = np.max([whom.ties(name) for name in names], axis=0)
    until = t[-1] if label.evaluate_until is None else label.evaluate_until
    air = airborne_mask(residuals.signals)
    when = np.inf
    for row in np.flatnonzero(ties >= Tie.SUSPECTED):
        size = np.abs(residuals.values[row] - alarms.centre[row])
        late = float(alarms.delay_s[row])
        before = size[(t < label.onset - late - 0.5) & air & np.isfinite(size)]
        after = (t >= label.onset) & (t <= until) & np.isfinite(size)
        if len(before) >= LEAST:
            own = _second_in_a_row(size[after] > max(BEYOND * before.max(), 1e-9))
            when = min(when, float(t[after][own]) + late if own is not None else np.inf)
    return when


def _second_in_a_row(mask: NDArray[np.bool_]) -> int | None:
    place = np.flatnonzero(mask[1:] & mask[:-1])
    return int(place[0]) + 1 if len(place) else None


def table(found: Sequence[Seen]) -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| flights of | faults | accused rightly | visible | begins | alarm |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for source in dict.fromkeys(one.source for one in found):
        own = [one for one in found if one.source == source]
        kinds = {kind: [one for one in own if one.kind == kind] for kind in ("steps", "ramps")}
        motors = [one for one in kinds["steps"] if one.motor]
        kinds["motors, steps"] = motors
        if tied := [one for one in motors if one.key.startswith(TIED)]:
            kinds["of these, an output overridden"] = tied
            kinds["of these, all others"] = [one for one in motors if one not in tied]
        for kind, these in kinds.items():
            times = zip(*((one.visible, one.begins, one.alarm) for one in these), strict=True)
            cells = " | ".join(f"{np.median(column):.1f}" for column in times)
            yield f"| {source} | {kind} | {len(these)} | {cells} |"


def main() -> int:
    """Print the table, and write it where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put it into docs/evaluation.md")
    add_options(parser)
    given = parser.parse_args()
    if reason := missing(given.closed_loop):
        print(f"skipped: {reason}")
        return 0
    with closed_loop(given.closed_loop) as others:
        labels = [one for path in (LABELS, others / LABELS.name) for one in load_labels(path)]
        faulty = [one for one in labels if one.use == "diagnosis" and one.faults]
        with get_context("spawn").Pool(given.workers) as pool:
            found = [one for one in pool.imap(seen, faulty, chunksize=4) if one]
    text = f"`{COMMAND}` printed (medians, s):\n\n" + "\n".join(table(found)) + "\n"
    print(text)
    if given.write:
        put(text, "delays")
    return 0


if __name__ == "__main__":
    sys.exit(main())
