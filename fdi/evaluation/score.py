"""Was this analysis right about this flight?

In: a label and what an analysis found. Out: a `Score`.

*Detected*: any component is accused with an onset from 2 s before the true one to the end of what
counts. *Named*: rank 1 is a right component. *In three*: one of the first three ranks is. *Timely*:
a right component has its onset within 5 s of the true one, 20 s for a ramp. *False*: accused on a
healthy flight, or more than 2 s before the true onset. *Wrong*: accused, whenever that begins, and
neither right nor failed. *Cleared wrongly*: failed, and ruled out. Right are the components that
the label names and those it accepts; where the label itself says ``motor`` or ``propeller``,
whichever motor, and then all motors that it accepts must be ruled out to count as cleared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fdi.evaluation.labels import Label
from fdi.shown import Shown

EARLY_S: Final = 2.0
STEP_S: Final = 5.0
RAMP_S: Final = 20.0
FIRST: Final = 3
_ANY_MOTOR: Final = ("motor", "propeller")


@dataclass(frozen=True, slots=True)
class Score(Shown):
    """One flight, scored.

    Attributes
    ----------
    delay : float or None
        Alarm minus onset of the first right accusation, s.
    false : tuple of str
        The components that were accused on a healthy flight or too early, each once.
    wrong : tuple of str
        The components that were accused and had nothing to do with it, each once.
    cleared : tuple of str
        The components that failed and are ruled out.
    fate : str
        What the analysis says of the components that failed: ``accused``, ``consequence``, ``ruled
        out``, ``not testable``, or ``unknown`` for nothing; "" on a healthy flight.
    error : str or None
        Why there is no analysis.
    bare : Score or None
        The same with the tests left out that read a recorded command; None where nobody asked.
    """

    label: Label
    detected: bool
    named: bool
    in_three: bool
    timely: bool
    delay: float | None
    false: tuple[str, ...]
    wrong: tuple[str, ...]
    cleared: tuple[str, ...]
    accused: tuple[tuple[str, float], ...]
    fate: str
    airborne_s: float
    error: str | None
    bare: Score | None = None

    @property
    def is_faulty(self) -> bool:
        """Whether something failed on this flight."""
        return bool(self.label.faults)


def is_right(component: str, label: Label) -> bool:
    """Return whether accusing a component is a right answer.

    Examples
    --------
    >>> from fdi.evaluation.labels import Fault
    >>> from pathlib import Path
    >>> propeller = Fault("propeller", "scale", 3.0)
    >>> label = Label("a", Path("a"), "quad", "", "diagnosis", (propeller,), frozenset(), None)
    >>> is_right("motor_3", label), is_right("gps", label)
    (True, False)
    """
    return component in label.accept or _failed(component, label)


def _failed(component: str, label: Label) -> bool:
    """Return whether a component is one that failed, as far as the label tells."""
    names = {fault.component for fault in label.faults}
    return component in names or (
        not names.isdisjoint(_ANY_MOTOR) and component.startswith("motor_")
    )


def _cleared(label: Label, ruled_out: Sequence[str]) -> tuple[str, ...]:
    """Return the components that failed and are ruled out."""
    failed = {fault.component for fault in label.faults}
    found = failed.intersection(ruled_out)
    if not failed.isdisjoint(_ANY_MOTOR):
        motors = {name for name in label.accept if name.startswith("motor_")}
        found |= motors if motors and motors <= set(ruled_out) else set()
    return tuple(sorted(found))


def score(label: Label, row: Mapping[str, Any], bare: Mapping[str, Any] | None = None) -> Score:
    """Return the score of one flight.

    Parameters
    ----------
    label : Label
    row : mapping
        What `fdi.fleet.analyze_log` said of it.
    bare : mapping, optional
        What it said with the tests left out that read a recorded command.
    """
    until = float("inf") if label.evaluate_until is None else label.evaluate_until
    findings = [f for f in row["findings"] if f["onset_s"] <= until]
    true = label.onset
    early = [f for f in findings if true is None or f["onset_s"] < true - EARLY_S]
    if true is None:
        right: list[Mapping[str, Any]] = []
    else:
        right = [f for f in findings if f not in early and is_right(f["component"], label)]
    return Score(
        label,
        detected=len(findings) > len(early),
        named=any(f["rank"] == 1 for f in right),
        in_three=any(f["rank"] <= FIRST for f in right),
        timely=any(_is_timely(f, label) for f in right),
        delay=_delay(right, label),
        false=_false(early, label),
        wrong=tuple(
            dict.fromkeys(f["component"] for f in findings if not is_right(f["component"], label))
        ),
        cleared=_cleared(label, row["ruled_out"]),
        accused=tuple((f["component"], f["onset_s"]) for f in findings),
        fate=_fate(label, row, right) if label.faults else "",
        airborne_s=float(row["airborne_s"] or 0.0),
        error=row["error"],
        bare=None if bare is None else score(label, bare),
    )


def _false(early: Sequence[Mapping[str, Any]], label: Label) -> tuple[str, ...]:
    """Return the components accused without a fault.

    Of a flight on which nothing failed what the label accepts is none: whoever labelled it could
    not say that this component was sound.
    """
    named = dict.fromkeys(f["component"] for f in early)
    return tuple(one for one in named if label.faults or one not in label.accept)


def _fate(label: Label, row: Mapping[str, Any], right: Sequence[Mapping[str, Any]]) -> str:
    said = {
        "accused": [f["component"] for f in right],
        "consequence": row["consequences"],
        "ruled out": row["ruled_out"],
        "not testable": row["not_testable"],
    }
    found = (fate for fate, names in said.items() if any(_failed(n, label) for n in names))
    return next(found, "unknown")


def _is_timely(finding: Mapping[str, Any], label: Label) -> bool:
    return any(
        abs(finding["onset_s"] - fault.onset) <= (RAMP_S if fault.is_slow else STEP_S)
        for fault in label.faults
    )


def _delay(right: Sequence[Mapping[str, Any]], label: Label) -> float | None:
    if not right or label.onset is None:
        return None
    return min(float(f["alarm_s"]) for f in right) - label.onset
