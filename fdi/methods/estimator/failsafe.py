"""Why does an ArduPilot copter call its estimator failed? The EKF failsafe.

In: a log, the ratios of the core that flew and its solution. Out: the tree: ten checks at 10 Hz
fail more often than they pass; a check fails without a horizontal position, or with two of three
ratios at FS_EKF_THRESH or above (velocity alone counts twice from twice the limit on).

The rule is ``Copter::ekf_check`` of 4.x. Older releases lack the double count of velocity; 4.6 and
later pass the ratios through a filter of FS_EKF_FILT Hz, faster than the checks, left out here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.grid import uniform
from fdi.methods.estimator.aiding import gps_stopped
from fdi.methods.estimator.cores import Selection
from fdi.methods.estimator.records import Core
from fdi.methods.estimator.spans import Span, period, spans_of
from fdi.methods.estimator.tree import Node, joined
from fdi.telemetry import Log

Floats = NDArray[np.float64]

THRESHOLD: Final = 0.8
"""FS_EKF_THRESH where the log has none: ArduPilot's default."""
CHECK_S: Final = 0.1
STAMP_S: Final = 1e-6
"""Logs stamp in us: finer differences are rounding."""
CHECKS: Final = 10
"""Failed checks, less passed ones, that trip it; as many passed ones clear it."""
TWICE: Final = 2.0
COPTERS: Final = ("quad", "hexa", "octa", "helicopter")
REL: Final = 3
ABS: Final = 4
CONST: Final = 7
"""Bits of the solution: relative and absolute horizontal position, constant-position mode."""
_TRIPPED: Final = re.compile(r"EKF variance|EKF Failsafe: |EKF check: |EKF failsafe: ")
_CLEARED: Final = re.compile(r"EKF Failsafe Cleared|EKF (?:check|failsafe) is over")


def failsafe_tree(log: Log, core: Core, solution: tuple[Floats, NDArray[np.int64]]) -> Node:
    """Return the tree of the EKF failsafe.

    Parameters
    ----------
    log : Log
    core : Core
        The one that flew.
    solution : (n,) float s, (n,) int
        Its solution's bits.
    """
    limit = log.parameters.get("FS_EKF_THRESH", THRESHOLD)
    said = "FS_EKF_THRESH" if "FS_EKF_THRESH" in log.parameters else "ArduPilot's default"
    name = "EKF failsafe"
    if limit <= 0.0:
        return Node(name, (), "switched off: FS_EKF_THRESH is 0")
    checks = checks_node(log, core, solution, limit, said)
    told = [e for e in log.reported if e.kind in ("text", "failsafe")]
    if not told:
        return Node(name, checks.spans, "by the checks below", "any", (checks,), checks.resolution)
    # who is disarmed has no failsafe any more (ekf_check.cpp)
    cleared = [e.t for e in told if _CLEARED.search(e.text)]
    cleared += [e.t for e in log.reported if e.kind == "disarm"]
    spans = _told([e.t for e in told if _TRIPPED.search(e.text)], cleared, log.span[1])
    return Node(name, spans, "the autopilot's texts and errors", "any", (checks,), CHECK_S)


def checks_node(
    log: Log, core: Core, solution: tuple[Floats, NDArray[np.int64]], limit: float, said: str
) -> Node:
    """Return the node "the checks failed for a second", with what makes one fail."""
    over = _over(core, limit, said)
    lost = _no_position(log, solution)
    bad = [node.spans for node in (over, lost) if node.spans is not None]
    name = f"EKF check failed for {CHECKS * CHECK_S:g} s"
    step = period(core.t)
    because = f"ten failed checks at 10 Hz, less the passed ones, by records every {step:.2g} s"
    if not bad:
        return Node(name, None, "not in this log", "any", (lost, over), step)
    joint = joined([span for spans in bad for span in spans])
    spans = tripped(joint, log.span, records=log.records)
    return Node(name, spans, because, "any", (lost, over), step)


def _over(core: Core, limit: float, said: str) -> Node:
    step = period(core.t)
    name = "two of compass, velocity and position ratio over the limit"

    def above(quantity: str, least: float) -> tuple[Node, NDArray[np.bool_]]:
        title = f"{quantity} ratio at {least:g} or above"
        if quantity not in core.ratios:
            return Node(title, None, "not in this log"), np.zeros(core.t.size, bool)
        with np.errstate(invalid="ignore"):
            is_over = core.ratios[quantity] >= least
        channel = core.channels[quantity]
        return Node(title, spans_of(core.t, is_over), channel, resolution=step), is_over

    found = (
        above("compass", limit),
        above("velocity", limit),
        above("horizontal position", limit),
        above("velocity", TWICE * limit),
    )
    nodes = tuple(node for node, _ in found)
    count = np.sum([mask for _, mask in found], axis=0)
    is_known = any(node.spans is not None for node in nodes)
    spans = spans_of(core.t, count >= 2) if is_known else None
    return Node(name, spans, f"limit {limit:g} ({said})", "two", nodes, step)


def _no_position(log: Log, solution: tuple[Floats, NDArray[np.int64]]) -> Node:
    t, bits = solution
    name = "no horizontal position"
    gps = gps_stopped(log)
    if not t.size:
        return Node(name, None, "the solution's bits are not in this log", "any", (gps,))
    constant = bits >> CONST & 1 > 0
    has_one = ((bits >> ABS | bits >> REL) & 1 > 0) & ~constant
    step = period(t)
    held = Node("constant-position mode", spans_of(t, constant), "solution", resolution=step)
    because = "neither relative nor absolute, or constant-position mode"
    return Node(name, spans_of(t, ~has_one), because, "any", (held, gps), step)


def tripped(
    bad: Sequence[Span], span: Span, checks: int = CHECKS, *, records: int
) -> tuple[Span, ...]:
    """Return from when to when the counter of failed checks has tripped, by so many records.

    It counts up at a failed check and down, not below 0, at a passed one; once tripped, as many
    passed checks clear it, whatever comes between.

    Examples
    --------
    >>> tripped([(1.0, 3.05)], (0.0, 6.0), records=60)
    ((1.9, 4.0),)
    """
    t = np.round(uniform(span[0], span[1], CHECK_S, records=records), 9)
    fails = np.zeros(t.size, bool)
    for low, high in bad:
        fails |= (t >= low - STAMP_S) & (t < high - STAMP_S)
    found: list[Span] = []
    at = 0
    while at < t.size:
        steps = np.cumsum(np.where(fails[at:], 1, -1))
        count = steps - np.minimum(np.minimum.accumulate(steps), 0)
        over = np.flatnonzero(count >= checks)
        if not over.size:
            break
        first = at + int(over[0])
        passed = np.flatnonzero(np.cumsum(~fails[first:]) >= checks)
        last = first + int(passed[0]) if passed.size else t.size - 1
        found.append((float(t[first]), float(t[last])))
        at = last + 1
    return tuple(found)


def _told(starts: Sequence[float], ends: Sequence[float], last: float) -> tuple[Span, ...]:
    """Return spans from what was told: from each start to the first end after it."""
    return joined([(t, min((end for end in ends if end > t), default=last)) for t in starts])


def solution_of(
    log: Log, cores: Sequence[Core], selection: Selection
) -> tuple[Floats, NDArray[np.int64]]:
    """Return times and solution bits of the core that flew; empty where the log has none."""
    field = "flags" if cores[0].source.endswith(("REPORT", "STATUS")) else "SS"
    read = [(log[c.source].t, log[c.source].si(field)) for c in cores if field in log[c.source]]
    if len(read) != len(cores):
        return np.empty(0), np.empty(0, np.int64)
    t = read[0][0]
    rows = np.array([_held(t, at, values) for at, values in read])
    which = np.zeros(t.size, np.int64)
    if selection.t.size:
        latest = np.searchsorted(selection.t, t, side="right") - 1
        which = selection.number[np.maximum(latest, 0)]
    numbers = [core.number for core in cores]
    place = np.array([numbers.index(n) if n in numbers else 0 for n in which.tolist()], np.int64)
    bits = rows[place, np.arange(t.size)]
    known = np.isfinite(bits)
    return t[known], bits[known].astype(np.int64)


def _held(at: Floats, t: Floats, values: Floats) -> Floats:
    latest = np.searchsorted(t, at, side="right") - 1
    return np.where(latest >= 0, values[np.maximum(latest, 0)], np.nan)
