"""In which way did an accused component fail?

In: a cause with its alarms, and by how much its sensor is wrong. Out: a `FindingKind`, by what is
read in the alarms that came first: that a channel fell silent, stood still or scattered says so
itself; a size that stays is a step, one that grows a ramp, one that goes with what is measured a
scale. Where alarms say different things, or nothing of all this, it is not known. Of what is no
sensor a channel that stands still or falls silent is the command or the report, and not the part.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from fdi.decision import Alarms
from fdi.diagnosis.alarm_runs import Run
from fdi.diagnosis.explain import scattered
from fdi.diagnosis.features import SIMULTANEOUS_S
from fdi.diagnosis.naming import Cause
from fdi.diagnosis.values import FindingKind, Size
from fdi.model.parts import Kind

_GROWS: Final[Mapping[str, FindingKind]] = {"bias": "step", "drift": "ramp"}


def kind_of(cause: Cause, size: Size | None, alarms: Alarms) -> FindingKind:
    """Return in which way a component failed.

    Parameters
    ----------
    cause : Cause
    size : Size or None
        By how much it is wrong, where that is known.
    alarms : Alarms
    """
    first = [run for run in cause.runs if run.onset <= cause.onset + SIMULTANEOUS_S]
    behaves = {kind for run in first if (kind := _behaviour(run, cause.component, alarms))}
    if len(behaves) == 1:
        return behaves.pop()
    if size is not None and not behaves:
        return _GROWS[size.shape]
    bank = alarms.residuals.bank
    limits = {bank.system.equations[bank.generators[r.row].residual].kind for r in first}
    return "limit" if limits == {Kind.LIMIT} and not behaves else "unknown"


def _behaviour(run: Run, component: str, alarms: Alarms) -> FindingKind | None:
    """Return what an alarm says of how a component behaves, None where it says what it shows."""
    bank = alarms.residuals.bank
    used = [bank.system.equations[i] for i in bank.generators[run.row].equations]
    left = bank.system.equations[bank.generators[run.row].residual]
    for equation in used:
        if equation.measurement is not None and (told := equation.measurement.behaviour):
            return told if bank.system.components[component].group == "sensor" else None
    if left.component == component and any(equation.regressed for equation in used):
        return "scale"
    return "noise" if scattered(run, alarms) is not None else None
