"""What does a person have to know of the estimator's health in this flight?

In: what the other files found. Out: `Finding`s in the order of time, a sentence each: a source no
longer fused, a whipsaw of the selector, a ratio that rises before the first symptom, one that grows
for a minute, rejected measurements; and whether the vehicle was upset before the estimator
complained: then the estimator is a consequence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.grid import checked
from fdi.methods.estimator.bits import Bits
from fdi.methods.estimator.cores import MANY_S, RETURN_S, Selection
from fdi.methods.estimator.moments import Moment
from fdi.methods.estimator.ratios import GROWN, REJECTED, Ratio
from fdi.methods.estimator.records import table
from fdi.methods.estimator.spans import Span, spans_of
from fdi.methods.estimator.tree import joined

Floats = NDArray[np.float64]
Kind = Literal[
    "consequence", "not fused", "whipsaw", "before symptom", "rise", "drift", "rejected", "fault"
]

STILL_S: Final = 5.0
"""PX4 and ArduPilot give up a source after 5 s without it (EKF2_NOAID_TOUT and alike)."""
STILL_TIMES: Final = 5.0
"""So many times longer than usual a ratio must keep its value: slow sources are no lost ones."""
HUNDREDTHS: Final = 1e-6
"""A column of whole hundredths repeats itself by rounding: it cannot show a ratio at rest."""
FALL_S: Final = 1.0
"""A shorter break of a source is a change of reference, not its loss."""
RELATED_S: Final = 10.0
"""A rise that was over for longer when the first symptom came is none before it (choice)."""
DRIFT_S: Final = 60.0
DRIFT_STEPS: Final = 5
"""A minute in so many parts, each with a larger median than the one before."""
DRIFT_GROWTH: Final = 2.0
"""What healthy flights show of slow growth by wind and speed stays below twice."""
_SOLUTION: Final = {
    "pos_horiz_abs": "the absolute horizontal position",
    "velocity_horiz": "the horizontal velocity",
    "pos_vert_abs": "the height",
    "attitude": "the attitude",
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing a person has to know.

    Attributes
    ----------
    kind : Kind
    t, end : float, float or None
        s, from when to when.
    text : str
        The sentence.
    source : str
        The channel or quantity it is read from.
    is_late : bool
        The vehicle was upset before it: a consequence.
    """

    kind: Kind
    t: float
    end: float | None
    text: str
    source: str = ""
    is_late: bool = False


def findings_of(
    ratios: Sequence[Ratio],
    bits: Bits,
    selection: Selection,
    air: Span,
    symptom: Moment | None,
    upset: Moment | None,
    complaint: Moment | None,
) -> tuple[Finding, ...]:
    """Return the findings in the order of time.

    Parameters
    ----------
    ratios : sequence of Ratio
        Of the core that flew.
    bits, selection
    air : (from, to), s
    symptom, upset, complaint : Moment or None
        The first symptom of the vehicle, its first roll-over, loss of control or impact, and the
        estimator's first complaint.
    """
    found = [
        *_still(ratios, air),
        *_fallen(bits, selection, air),
        *_whipsaws(selection),
        *_rises(ratios, symptom),
        *_drifts(ratios, air),
        *_rejected(ratios),
        *_faults(bits, air),
    ]
    if upset is not None:
        found = [replace(one, is_late=one.t >= upset.t) for one in found]
        found.extend(_consequence(upset, complaint))
    return tuple(sorted(found, key=lambda one: (one.t, one.kind, one.text)))


def _still(ratios: Sequence[Ratio], air: Span) -> Iterator[Finding]:
    for ratio in ratios:
        found = standing(ratio.t, ratio.value, air)
        if found:
            low, high = found[0]
            value = float(ratio.value[np.searchsorted(ratio.t, low)])
            more = f", {len(found)} times in all" if len(found) > 1 else ""
            text = (
                f"{ratio.quantity} is no longer fused: its ratio stands still at {value:.4g} "
                f"for {high - low:.1f} s{more}"
            )
            yield Finding("not fused", low, high, text, ratio.channel)


def standing(t: Floats, value: Floats, air: Span) -> tuple[Span, ...]:
    """Return where a ratio that else changes keeps its value for 5 s or longer, in the air.

    Not where it is 0 (nothing was ever fused) or above 1 (rejected, and at the end of its scale).
    """
    inside = (t >= air[0]) & (t <= air[1]) & np.isfinite(value)
    at, kept = t[inside], value[inside]
    if at.size < 3 or np.all(np.abs(kept * 100 - np.rint(kept * 100)) < HUNDREDTHS):
        return ()
    starts = np.flatnonzero(np.concatenate(([True], kept[1:] != kept[:-1])))
    first = at[starts]
    last = at[np.append(starts[1:], at.size) - 1]
    usual = float(np.median(np.diff(first))) if starts.size > 2 else np.inf
    least = max(STILL_S, STILL_TIMES * usual)
    rests = (kept[starts] > 0.0) & (kept[starts] <= REJECTED)
    rows = np.flatnonzero((last - first >= least) & rests)
    return tuple((float(first[i]), float(last[i])) for i in rows)


def _fallen(bits: Bits, selection: Selection, air: Span) -> Iterator[Finding]:
    for core in sorted({mask.core for mask in bits.masks}):
        who = core_name(bits, core)
        for source, names in table("masks")["fused"].items():
            spans = [bits.spans("control", name, core) for name in names]
            known = [span for one in spans if one is not None for span in one]
            for low, high in fallen(joined(known), _told(bits, "control", core, air)):
                if flies(selection, core, low):
                    text = f"{source} is no longer used by {who} (its bit falls)"
                    yield Finding("not fused", low, high, text, f"control bits: {', '.join(names)}")
        for name, what in _SOLUTION.items():
            own = bits.spans("solution", name, core) or ()
            for low, high in fallen(own, _told(bits, "solution", core, air)):
                if flies(selection, core, low):
                    text = f"{who} gives up {what} ({name} falls)"
                    yield Finding("not fused", low, high, text, f"solution bit {name}")


def _told(bits: Bits, kind: str, core: int, air: Span) -> Span:
    """Return the part of the flight of which bits tell: what they end with may go on."""
    return air[0], min(air[1], bits.until(kind, core))


def fallen(spans: Sequence[Span], air: Span) -> tuple[Span, ...]:
    """Return where a bit that was set is not, in the air, for a second or longer."""
    ends = [*(low for low, _ in spans[1:]), *([air[1]] if spans else [])]
    found = [(high, min(low, air[1])) for (_, high), low in zip(spans, ends, strict=True)]
    return tuple((a, b) for a, b in found if a > air[0] and b - a >= FALL_S)


def core_name(bits: Bits, core: int) -> str:
    """Return what a sentence calls a core: by number only where there are several."""
    return f"estimator {core}" if len({mask.core for mask in bits.masks}) > 1 else "the estimator"


def flies(selection: Selection, core: int, t: float) -> bool:
    """Return whether a core was the selected one just before a time; True where nobody knows."""
    if not selection.t.size:
        return True
    row = int(np.searchsorted(selection.t, t, side="left")) - 1
    return int(selection.number[max(row, 0)]) == core


def _whipsaws(selection: Selection) -> Iterator[Finding]:
    for low, high in selection.whipsaws:
        changes = [c for c in selection.changes if low <= c.t <= high]
        reasons = sorted({c.reason for c in changes if c.reason})
        why = f"; the autopilot's reason: {', '.join(reasons)}" if reasons else ""
        text = (
            f"the selector whips to and fro: {len(changes)} changes of the core from {low:.1f} "
            f"to {high:.1f} s (3 within {MANY_S:g} s, or back within {RETURN_S:g} s){why}"
        )
        yield Finding("whipsaw", low, high, text, selection.source)


def _rises(ratios: Sequence[Ratio], symptom: Moment | None) -> Iterator[Finding]:
    for ratio in ratios:
        before = [
            span
            for span in ratio.rises
            if symptom is not None and span[0] < symptom.t <= span[1] + RELATED_S
        ]
        for low, high in before[:1] or ratio.rises[:1]:
            inside = (ratio.t >= low) & (ratio.t <= high)
            most = float(np.nanmax(ratio.excess[inside]))
            level = ratio.level or 0.0
            text = (
                f"{ratio.quantity} ratio rises to {most:.1f} times its own level of {level:.2g}, "
                f"limit {GROWN:g}; that is {most * level:.2f} of its gate"
            )
            if symptom is not None and before:
                text += f", {symptom.t - low:.1f} s before the first symptom: {symptom.what}"
            kind: Kind = "before symptom" if before else "rise"
            yield Finding(kind, low, high, text, ratio.channel)


def _drifts(ratios: Sequence[Ratio], air: Span) -> Iterator[Finding]:
    for ratio in ratios:
        if ratio.level is None:
            continue
        for low, high, growth in growing(ratio.t, ratio.value, air, ratio.level):
            text = (
                f"{ratio.quantity} ratio grows for {high - low:.0f} s, to {growth:.1f} times: "
                f"a slow drift"
            )
            yield Finding("drift", low, high, text, ratio.channel)


def growing(
    t: Floats, value: Floats, air: Span, level: float
) -> tuple[tuple[float, float, float], ...]:
    """Return (from, to, growth) where the median of each 12 s is above the one before.

    For a minute or longer, to twice the first one or more and to twice the level or more.
    """
    width = DRIFT_S / DRIFT_STEPS
    count = int((air[1] - air[0]) // width)
    if count < DRIFT_STEPS:
        return ()
    edges = air[0] + width * np.arange(checked(count, t.size, f"{air[1] - air[0]:g} s") + 1)
    place = np.searchsorted(edges, t, side="right") - 1
    medians = np.array([_median(value[place == i]) for i in range(count)])
    with np.errstate(invalid="ignore"):
        rises = medians[1:] > medians[:-1]
    found = []
    for low, high in spans_of(np.arange(rises.size, dtype=np.float64), rises):
        # the last true step has no record after it where the rise lasts to the end
        steps = int(high - low) + int(high == rises.size - 1 and bool(rises[-1]))
        first, last = medians[int(low)], medians[int(low) + steps]
        growth = float(last / max(first, level))
        if steps >= DRIFT_STEPS - 1 and growth >= DRIFT_GROWTH:
            found.append((float(edges[int(low)]), float(edges[int(low) + steps + 1]), growth))
    return tuple(found)


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size >= 3 else np.nan


def _rejected(ratios: Sequence[Ratio]) -> Iterator[Finding]:
    for ratio in ratios:
        if ratio.rejected:
            low, high = ratio.rejected[0]
            times = len(ratio.rejected)
            whole = sum(end - start for start, end in ratio.rejected)
            more = f", {times} times in all, {whole:.1f} s together" if times > 1 else ""
            text = f"{ratio.quantity} is rejected: its ratio is above 1 for {high - low:.1f} s"
            yield Finding("rejected", low, high, text + more, ratio.channel)


def _faults(bits: Bits, air: Span) -> Iterator[Finding]:
    for bit in bits.of("fault"):
        spans = [span for span in bit.spans if span[1] >= air[0] and span[0] <= air[1]]
        if spans:
            low, high = spans[0]
            times = f", {len(spans)} times" if len(spans) > 1 else ""
            if low < air[0] and high >= air[1]:
                times = ", which was there before and all through the flight"
            text = f"filter fault {bit.name} of {core_name(bits, bit.core)}{times}"
            yield Finding("fault", max(low, air[0]), high, text, bit.source)


def _consequence(upset: Moment, complaint: Moment | None) -> Iterator[Finding]:
    if complaint is not None and complaint.t > upset.t:
        text = (
            f"{upset.what} {complaint.t - upset.t:.1f} s before the estimator first complains "
            f"({complaint.what} at {complaint.t:.1f} s): the estimator is a consequence"
        )
        yield Finding("consequence", upset.t, complaint.t, text)
