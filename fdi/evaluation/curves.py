"""How big must a fault be before this vehicle's telemetry shows it?

In: healthy flights, a kind of fault. Out: per flight and channel the share of injected faults that
were detected and named, against their size. Sizes are multiples of the accuracy that the model
states for the channel (a drift: reached after `REACHED_S`). Each is injected at several moments of
the flight and lasts to its end; one of them alone is a log of its own, analysed like any other.

A log that cannot be analysed with the fault counts as one on which it was not detected.

*Detected*: a component is accused, with an onset no more than 2 s before the fault, that is not
accused on the healthy flight. *Named*: the channel's own component is, in the first place.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from fdi.errors import FdiError, LogError, UsageError
from fdi.evaluation.inject import home, injected
from fdi.evaluation.injected_fault import InjectedFault
from fdi.evaluation.labels import Label
from fdi.evaluation.score import EARLY_S
from fdi.evaluation.totals import Rate
from fdi.fleet import Job, Row, analyze_log, failed, rows
from fdi.model import load_airframe
from fdi.model.choose import choose_model
from fdi.report.words import clean, number
from fdi.telemetry import Log, read
from fdi.units import customary

Progress = Callable[[str, float], None]
CurveKind = Literal["bias", "drift", "noise"]

STEPS: Final = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
"""Sizes, in accuracies of the channel."""
REACHED_S: Final = 20.0
_GROUP: Final = "sensor"


@dataclass(frozen=True, slots=True)
class InjectedJob(Job):
    """A log that is analysed with a fault; ``fault`` None: as it is."""

    fault: InjectedFault | None = None


@dataclass(frozen=True, slots=True)
class Point:
    """What became of the faults of one size, in the channel's SI unit (a drift: per second)."""

    size: float
    detected: Rate
    named: Rate


@dataclass(frozen=True, slots=True)
class Curve:
    """Detection against size at one channel of one flight."""

    flight: str
    channel: str
    component: str
    unit: str
    accuracy: float
    points: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class Sensor:
    """A channel into which faults can be put; ``accuracy`` in its SI unit."""

    channel: str
    component: str
    unit: str
    accuracy: float


def curves(
    labels: Sequence[Label],
    *,
    kind: CurveKind = "bias",
    moments: int = 2,
    channels: Sequence[str] = (),
    steps: Sequence[float] = STEPS,
    policy: str = "default",
    workers: int = 1,
    progress: Progress | None = None,
) -> tuple[Curve, ...]:
    """Return the curves of every sensor's channels on the healthy ones of some flights.

    Parameters
    ----------
    labels : sequence of Label
    kind : str
    moments : int
        How often each fault is injected into a flight, evenly over its time in the air.
    channels : sequence of str
        Only these; by default all that the model measures as they are.
    steps : sequence of float
        The sizes, in accuracies.
    policy, workers, progress
        As of `evaluate`.

    Raises
    ------
    UsageError
        No flight is healthy, or in a format that can be rewritten.
    LogError
        A healthy flight cannot be analysed.
    """
    healthy = [one for one in labels if one.use == "diagnosis" and not one.faults]
    if not healthy:
        raise UsageError("no flight is healthy, so nothing can be injected")
    plans = []
    for label in healthy:
        log = read(label.path)
        subjects = [s for s in sensors(log) if not channels or s.channel in channels]
        starts = _moments(log, moments, label.evaluate_until)
        plain = InjectedJob(str(label.path), policy=policy)
        faults = [
            InjectedFault(one.channel, kind, size, start, float("inf"))
            for one in subjects
            for size in _sizes(one, kind, steps)
            for start in starts
        ]
        own = [plain, *(replace(plain, fault=fault) for fault in faults)]
        plans.append((label, subjects, own))
    jobs = [job for _, _, each in plans for job in each]
    done: dict[int, Row] = {}
    for i, row in rows(jobs, workers=workers, work=analyze_injected):
        done[i] = row
        if progress:
            progress(Path(jobs[i].path).name, len(done) / len(jobs))
    made: list[Curve] = []
    at = 0
    for label, subjects, own in plans:
        found = [done[i] for i in range(at, at + len(own))]
        at += len(own)
        made += _curves_of(label, subjects, own, found)
    return tuple(made)


def analyze_injected(job: Job) -> Row:
    """Return the row of a log with the job's fault; like `analyze_log`, it never raises."""
    if not isinstance(job, InjectedJob) or job.fault is None:
        return analyze_log(job)
    with tempfile.TemporaryDirectory(prefix="fdi-") as folder:
        path = Path(folder) / "log"
        try:
            path.write_bytes(injected(read(job.path), job.fault, model=job.model))
        except (FdiError, OSError) as error:
            return failed(job, error)
        return {**analyze_log(Job(str(path), job.model, job.policy)), "path": job.path}


def sensors(log: Log) -> Iterator[Sensor]:
    """Yield the channels of sensors that the model measures as they are, with an accuracy.

    One that reads the same all the time (zeros: no sensor is fitted) is none to put a fault into.
    """
    system = load_airframe(choose_model(log)).observe(log)
    seen = set()
    for equation in system.equations:
        one = equation.measurement
        if one is None or one.group != _GROUP or not one.accuracy or equation.fault is None:
            continue
        name = str(one.channel)
        _, value, unit = log.channel(one.channel)
        is_still = np.nanmin(value) == np.nanmax(value)
        if name in seen or one.raw or one.value is not None or not unit or is_still:
            continue
        try:
            home(log, one.channel)
        except UsageError:  # made of several fields of the log
            continue
        seen.add(name)
        yield Sensor(name, one.component, unit, one.accuracy)


def _sizes(one: Sensor, kind: CurveKind, steps: Sequence[float]) -> list[float]:
    reached = REACHED_S if kind == "drift" else 1.0
    return [one.accuracy * step / reached for step in steps]


def _moments(log: Log, count: int, until: float | None) -> list[float]:
    """Return moments evenly within the log's longest flight, none in its last fifth."""
    if not log.flights:
        raise UsageError("holds no flight into which a fault could be injected", where=log.name)
    low, high = max((flight.airborne for flight in log.flights), key=lambda ends: ends[1] - ends[0])
    span = 0.8 * (min(high, until if until is not None else high) - low)
    if not span > 0:
        raise UsageError("holds no flight into which a fault could be injected", where=log.name)
    return [low + span * (k + 1) / (count + 1) for k in range(count)]


def _curves_of(
    label: Label, subjects: Sequence[Sensor], jobs: Sequence[InjectedJob], found: Sequence[Row]
) -> Iterator[Curve]:
    if found[0]["error"] is not None:
        raise LogError(f"cannot be analysed: {found[0]['error']}", where=label.key)
    until = float("inf") if label.evaluate_until is None else label.evaluate_until
    healthy = {f["component"] for f in found[0]["findings"] if f["onset_s"] <= until}
    for one in subjects:
        results: dict[float, list[tuple[bool, bool]]] = {}
        for job, row in zip(jobs[1:], found[1:], strict=True):
            if job.fault is not None and job.fault.target == one.channel:
                outcome = _outcome(row, job.fault.start, one.component, until, healthy)
                results.setdefault(job.fault.size, []).append(outcome)
        points = tuple(
            Point(
                size,
                Rate(sum(detected for detected, _ in own), len(own)),
                Rate(sum(named for _, named in own), len(own)),
            )
            for size, own in results.items()
        )
        if points:
            yield Curve(label.key, one.channel, one.component, one.unit, one.accuracy, points)


def _outcome(
    row: Row, start: float, component: str, until: float, healthy: set[str]
) -> tuple[bool, bool]:
    new = [
        f
        for f in row["findings"]
        if start - EARLY_S <= f["onset_s"] <= until and f["component"] not in healthy
    ]
    named = bool(new) and min(new, key=lambda f: int(f["rank"]))["component"] == component
    return bool(new), named


def smallest(curve: Curve, of: Callable[[Point], Rate], share: float = 1.0) -> float | None:
    """Return the size from which on such a share is detected (or named); None: not within these."""
    found = None
    for point in sorted(curve.points, key=lambda p: -p.size):
        if (of(point).share or 0.0) < share:
            break
        found = point.size
    return found


def curves_text(found: Sequence[Curve], kind: CurveKind) -> str:
    """Return the table: from which size on half of the faults, or all, are detected, and named."""
    head = ("flight", "channel", "component", "accuracy", "half detected", "all detected")
    lines = [f"| {' | '.join((*head, 'half named', 'all named'))} |", "| --- " * 8 + "|"]
    for one in found:
        sizes = [
            smallest(one, of, share)
            for of in (lambda p: p.detected, lambda p: p.named)
            for share in (0.5, 1.0)
        ]
        last = max(point.size for point in one.points)
        told = [
            f"not up to {sized(last, one.unit, kind)}"
            if size is None
            else f"from {sized(size, one.unit, kind)}"
            for size in sizes
        ]
        accuracy = sized(one.accuracy, one.unit)
        cells = (clean(one.flight), one.channel, one.component, accuracy, *told)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def sized(value: float, unit: str, kind: CurveKind = "bias") -> str:
    """Return a difference of values in a customary unit."""
    name, scale, _ = customary(unit)
    return f"{number(scale * value, 3)} {name}{'/s' if kind == 'drift' else ''}"


def curves_document(found: Sequence[Curve], kind: CurveKind) -> dict[str, Any]:
    """Return the curves as plain values."""
    return {
        "schema_version": 1,
        "kind": kind,
        "curves": [
            {
                "log": one.flight,
                "channel": one.channel,
                "component": one.component,
                "unit": one.unit,
                "accuracy": one.accuracy,
                "points": [
                    {
                        "size": p.size,
                        "of": p.detected.of,
                        "detected": p.detected.hits,
                        "named": p.named.hits,
                    }
                    for p in one.points
                ],
            }
            for one in found
        ],
    }
