"""Was the estimator healthy in this flight? The value of the whole method.

In: a log. Out: `EstimatorHealth`. One flight is looked at, by default the last one that flew:
levels, trees and findings are of that flight; bits, ratios and innovations of the whole log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from fdi.errors import UsageError
from fdi.methods.estimator.bits import Bits, bits_of
from fdi.methods.estimator.cores import Score, Selection, scores_of, selection_of
from fdi.methods.estimator.failsafe import COPTERS, failsafe_tree, solution_of
from fdi.methods.estimator.findings import Finding, findings_of
from fdi.methods.estimator.innovations import Innovation, innovations_of
from fdi.methods.estimator.lanes import lane_tree
from fdi.methods.estimator.moments import Moment, complaint_of, upset_of
from fdi.methods.estimator.ratios import (
    LEAST_RECORDS,
    LEVEL_S,
    Ratio,
    ratios_of,
)
from fdi.methods.estimator.records import (
    TELEMETRY,
    Core,
    Family,
    cores_of,
    family_of,
    flown,
    table,
)
from fdi.methods.estimator.resets import Reset, resets_of
from fdi.methods.estimator.spans import Span
from fdi.methods.estimator.tree import Node, cut
from fdi.methods.estimator.unhealthy import unhealthy_tree
from fdi.methods.estimator.validity import validity_tree
from fdi.shown import Shown
from fdi.telemetry import Log
from fdi.telemetry.airtime import in_air

OLD_LANES: Final = ("ArduPilot EKF1", "ArduPilot EKF2")
EKF3: Final = 3
POSITION: Final = (
    "local position invalid",
    "local velocity invalid",
    "global position invalid",
    "height invalid",
)
"""Nodes of the commander's tree that it acts upon."""
_CHOICES: Final = ("AHRS_EKF_TYPE", "AHRS_EKF_USE")
"""ArduPilot's parameters of which 0 leaves the attitude to the direction cosines; the latter until
Copter 3.3."""


@dataclass(frozen=True, slots=True, eq=False)
class EstimatorHealth(Shown):
    """What a log says of its estimator's health.

    Attributes
    ----------
    family : Family
        Which estimator, and where its records stand.
    flight : int or None
        Which of the log's flights, from 0; None: the log shows no flight, all of it is looked at.
    air, armed : (from, to), s
        In the air; from arming to disarming.
    cores : tuple of Core
        Everyone that the log tells of.
    ratios : tuple of Ratio
        Of the core that flew, by the table that all formats share.
    core_ratios : tuple of (core, tuple of Ratio)
        Of every core.
    innovations : tuple of Innovation
    bits : Bits
    selection : Selection
    scores : tuple of Score
    resets : tuple of Reset
    trees : tuple of Node
        The autopilot's own rules as fault trees, cut to the time from take-off to disarming.
    upset, complaint, symptom : Moment or None
        When the vehicle was upset, when the estimator first complained, the first symptom of all.
    findings : tuple of Finding
    notes : tuple of str
        What this log cannot say, a sentence each.
    """

    family: Family
    flight: int | None
    air: Span
    armed: Span
    cores: tuple[Core, ...]
    ratios: tuple[Ratio, ...]
    core_ratios: tuple[tuple[int, tuple[Ratio, ...]], ...]
    innovations: tuple[Innovation, ...]
    bits: Bits
    selection: Selection
    scores: tuple[Score, ...]
    resets: tuple[Reset, ...]
    trees: tuple[Node, ...]
    upset: Moment | None
    complaint: Moment | None
    symptom: Moment | None
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]


def estimator_health(log: Log, flight: int | None = None) -> EstimatorHealth:
    """Return the health of a log's estimator.

    Parameters
    ----------
    log : Log
    flight : int, optional
        Which flight, from 0; by default the last one that flew.

    Raises
    ------
    LogError
        There is not one message of an estimator's health.
    UsageError
        There is no such flight.
    """
    family = family_of(log)
    cores = cores_of(log, family)
    number, air, armed = _when(log, flight)
    core = flown(log, family, cores)
    ratios = ratios_of(core, air, armed)
    bits = bits_of(log, cores)
    selection = selection_of(log, family, armed)
    scores = scores_of(log, family, cores)
    trees = tuple(
        cut(tree, (air[0], armed[1]))
        for tree in _trees(log, family, cores, core, bits, selection, scores, air[0])
    )
    upset = None if number is None else upset_of(log, number, log.flights[number])
    complaint = complaint_of(ratios, _complaints(trees), selection, air[0])
    moments = [m for m in (upset, _first_top(trees)) if m is not None]
    symptom = min(moments, key=lambda one: one.t, default=None)
    innovations = innovations_of(log, cores, air)
    return EstimatorHealth(
        family,
        number,
        air,
        armed,
        cores,
        ratios,
        tuple((one.number, ratios_of(one, air, armed)) for one in cores),
        innovations,
        bits,
        selection,
        scores,
        resets_of(log, cores, armed),
        trees,
        upset,
        complaint,
        symptom,
        findings_of(ratios, bits, selection, air, symptom, upset, complaint),
        tuple(_notes(log, cores, ratios, bits, selection, innovations, number)),
    )


def _when(log: Log, flight: int | None) -> tuple[int | None, Span, Span]:
    """Return which flight, its time in the air, and from arming to disarming."""
    if flight is not None and not 0 <= flight < len(log.flights):
        raise UsageError(
            f"{log.name} has no flight {flight + 1}", hint=f"it has {len(log.flights)}"
        )
    flew = [i for i, one in enumerate(log.flights) if one.flew]
    number = flight if flight is not None else flew[-1] if flew else None
    if number is None:
        return None, log.span, log.span
    one = log.flights[number]
    air = in_air(one) if one.flew else (one.start, one.end)
    return number, air, (one.start, one.end)


def _trees(
    log: Log,
    family: Family,
    cores: Sequence[Core],
    core: Core,
    bits: Bits,
    selection: Selection,
    scores: Sequence[Score],
    takeoff: float,
) -> list[Node]:
    if log.autopilot == "px4":
        first = int(selection.number[0]) if selection.number.size else cores[0].number
        trees = [validity_tree(log, bits, first, core, takeoff)]
        if family.status == "estimator_status":
            trees.extend(unhealthy_tree(log, one, bits) for one in cores)
        return trees
    trees = []
    check: Node | None = None  # none where the failsafe is switched off
    solution = solution_of(log, cores, selection)
    if log.vehicle in COPTERS:
        trees.append(failsafe_tree(log, core, solution))
        check = next(iter(trees[-1].children), None)
    kind = log.parameters.get("AHRS_EKF_TYPE", EKF3)
    if family.name not in OLD_LANES and kind == EKF3:
        trees.append(lane_tree(log, core, scores, selection, bits, check))
    return trees


def _tops(trees: Sequence[Node]) -> list[Node]:
    """Return the trees that speak of the whole estimator: of one core nobody complains."""
    return [tree for tree in trees if not tree.name.startswith("estimator ")]


def _complaints(trees: Sequence[Node]) -> list[Node]:
    """Return the nodes by which the autopilot complains of its estimator.

    Not the attitude's: in healthy flights its flag falls and rises many times a minute.
    """
    nodes = [node for tree in _tops(trees) for node in (tree, *tree.children)]
    tops = {tree.name for tree in _tops(trees)}
    return [node for node in nodes if node.name in tops or node.name in POSITION]


def _first_top(trees: Sequence[Node]) -> Moment | None:
    found = [Moment(low, tree.name) for tree in _tops(trees) for low, _ in tree.spans or ()]
    return min(found, key=lambda one: one.t, default=None)


def _notes(
    log: Log,
    cores: Sequence[Core],
    ratios: Sequence[Ratio],
    bits: Bits,
    selection: Selection,
    innovations: Sequence[Innovation],
    flight: int | None,
) -> list[str]:
    notes = []
    if flight is None:
        notes.append("the log shows no flight: levels are those of its first 20 s")
    unused = next((name for name in _CHOICES if log.parameters.get(name) == 0), None)
    if unused is not None and log.autopilot == "ardupilot":
        notes.append(f"the vehicle does not fly on this estimator but on its DCM: {unused} is 0")
    if len(cores) == 1:
        alone = not selection.source and cores[0].source not in TELEMETRY
        what = "one core only is" if alone else "only the core that flew is"
        notes.append(f"{what} in this log: there is no other to compare it with")
    elif not selection.source:
        notes.append("which core flew is not in this log")
    known = {ratio.quantity for ratio in ratios}
    absent = [quantity for quantity in table("records")["quantities"] if quantity not in known]
    if absent:
        notes.append(f"not used, or not in this log: the ratio of {', '.join(absent)}")
    unknown = [r.quantity for r in ratios if r.level is None]
    if unknown:
        notes.append(
            f"the own level of {', '.join(unknown)}, so that no rise can show: fewer than "
            f"{LEAST_RECORDS} records in the first {LEVEL_S:g} s"
        )
    if not innovations:
        notes.append("innovations are not in this log")
    elif all(one.variance is None for one in innovations):
        notes.append("variances of the innovations are not in this log")
    if not bits.masks:
        notes.append("fault, timeout and solution bits are not in this log")
    return [*notes, *_doubts(bits)]


def _doubts(bits: Bits) -> list[str]:
    """Return what is not certain about the names of bits that are set, a line for each reason."""
    is_set = {bit.source for bit in bits.set}
    sources: dict[str, list[str]] = {}
    for mask in bits.masks:
        if mask.doubt and mask.source in is_set:
            sources.setdefault(mask.doubt, []).append(mask.source)
    return [f"{', '.join(names)}: {doubt}" for doubt, names in sources.items()]
