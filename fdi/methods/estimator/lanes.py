"""Why does ArduPilot's EKF3 change the core it flies on? The lane selection.

In: a log, the core that flew and the others. Out: the tree below a change: the score of the flown
core above 1, the core unhealthy, a better one (relative error -0.5 or less), or the request of the
copter's failsafe check one count before it trips.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.bits import Bits
from fdi.methods.estimator.cores import Score, Selection
from fdi.methods.estimator.failsafe import CHECKS, tripped
from fdi.methods.estimator.ratios import combined_ratio
from fdi.methods.estimator.records import Core
from fdi.methods.estimator.spans import period, spans_of
from fdi.methods.estimator.tree import Node, all_of, any_of, joined
from fdi.telemetry import Log

Floats = NDArray[np.float64]

SCORE: Final = 1.0
BETTER: Final = -0.5
"""EKF3's BETTER_THRESH: an accumulated relative error so low makes a core the better one."""
_PARTS: Final = ("velocity", "horizontal position", "height")


def lane_tree(
    log: Log,
    flown: Core,
    scores: Sequence[Score],
    selection: Selection,
    bits: Bits,
    check: Node | None,
) -> Node:
    """Return the tree of the lane selection.

    Parameters
    ----------
    flown : Core
        The ratios of the core that flew.
    check : Node or None
        The failsafe's check, where the vehicle has one.
    """
    children = [_score(flown), _unhealthy(flown, bits), _better(scores)]
    if check is not None:
        children.append(_asked(log, check))
    name = "the selector changes the core"
    spans = None if not selection.source else tuple((c.t, c.t) for c in selection.changes)
    because = selection.source or "not in this log"
    step = period(selection.t)
    return Node(name, spans, because, "any", tuple(children), step)


def _score(flown: Core) -> Node:
    name = f"its score is above {SCORE:g}"
    if any(part not in flown.ratios for part in _PARTS):
        return Node(name, None, "not in this log")
    parts = [flown.ratios[part] for part in _PARTS]
    with np.errstate(invalid="ignore"):
        over = combined_ratio(parts[0], parts[1], parts[2], squared=True) > SCORE
    because = "max((velocity^2 + position^2)/2, height^2) of the root ratios"
    return Node(name, spans_of(flown.t, over), because, resolution=period(flown.t))


def _unhealthy(flown: Core, bits: Bits) -> Node:
    faults = bits.of("fault")
    known = any(mask.kind == "fault" for mask in bits.masks)
    spans = joined([span for bit in faults for span in bit.spans]) if known else None
    fault = Node("filter fault of a core", spans, "its fault mask" if known else "not in this log")
    beyond = []
    for part in _PARTS:
        title = f"{part} ratio above 1"
        if part not in flown.ratios:
            beyond.append(Node(title, None, "not in this log"))
            continue
        with np.errstate(invalid="ignore"):
            over = spans_of(flown.t, flown.ratios[part] > 1.0)
        beyond.append(Node(title, over, flown.channels[part], resolution=period(flown.t)))
    return any_of("it is unhealthy", (fault, all_of("all three ratios above 1", beyond)))


def _better(scores: Sequence[Score]) -> Node:
    name = "another core is better"
    known = [score for score in scores if np.isfinite(score.relative).any()]
    if not known:
        return Node(name, None, "relative errors are not in this log")
    spans = joined(
        [
            span
            for score in known
            for span in spans_of(score.t, np.nan_to_num(score.relative) <= BETTER)
        ]
    )
    because = f"its relative error is {BETTER:g} or less"
    return Node(name, spans, because, resolution=max(period(score.t) for score in known))


def _asked(log: Log, check: Node) -> Node:
    name = "the EKF check asks for another core"
    because = f"{CHECKS - 1} of {CHECKS} failed checks"
    if check.spans is None:
        return Node(name, None, check.because, "any", check.children)
    bad = [span for child in check.children for span in child.spans or ()]
    spans = tripped(joined(bad), log.span, CHECKS - 1, records=log.records)
    return Node(name, spans, because, "any", check.children, check.resolution)
