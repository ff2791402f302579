"""What does a model show that an older one of it did not? What ``fdi structure --against`` says.

In: the studies of two models with the same telemetry. Out: which equations came, went or changed,
and by how much more, or less, can be detected and told apart by tests that can be implemented. Two
equations, faults or tests are the same where their names are.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, TypeVar

import numpy as np

from fdi.model.system import ParameterValue, SystemEquation
from fdi.report.model_document import ModelStudy

Pair = tuple[str, str]
"""Of faults, of which the first is told from the second."""

_Named = TypeVar("_Named", bound=Hashable)


@dataclass(frozen=True, slots=True)
class NamedTest:
    """A residual generator: the faults it reacts to, and its equations, by name."""

    faults: tuple[str, ...]
    equations: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ModelGain:
    """What a model shows beyond an older one, with the same telemetry.

    Attributes
    ----------
    before, after : ModelStudy
    added, changed, removed : tuple of str
        Equations that hold with this telemetry, measurements and inputs among them; changed are
        those that state, or count, otherwise.
    idle : tuple of str
        What was added to the model and does not hold with this telemetry: equations, and channels.
    new_tests, lost_tests : tuple of NamedTest
    detectable, no_longer_detectable : tuple of str
        Faults.
    told_apart, no_longer_told_apart : tuple of (str, str)
        Pairs of which the first is told from the second, now or before.
    parameters : mapping of str to ParameterValue
        Those that the older model has not.
    """

    before: ModelStudy
    after: ModelStudy
    added: tuple[str, ...]
    changed: tuple[str, ...]
    removed: tuple[str, ...]
    idle: tuple[str, ...]
    new_tests: tuple[NamedTest, ...]
    lost_tests: tuple[NamedTest, ...]
    detectable: tuple[str, ...]
    no_longer_detectable: tuple[str, ...]
    told_apart: tuple[Pair, ...]
    no_longer_told_apart: tuple[Pair, ...]
    parameters: Mapping[str, ParameterValue]


def model_gain(before: ModelStudy, after: ModelStudy) -> ModelGain:
    """Return what a model shows beyond an older one.

    Parameters
    ----------
    before, after : ModelStudy
        With the same telemetry.
    """
    old, new = _equations(before), _equations(after)
    tests, former = _tests(after), _tests(before)
    seen, seen_before = _seen(after), _seen(before)
    pairs, pairs_before = _pairs(after), _pairs(before)
    return ModelGain(
        before,
        after,
        added=_without(new, old),
        changed=tuple(name for name in new if name in old and old[name] != new[name]),
        removed=_without(old, new),
        idle=_idle(before, after),
        new_tests=_without(tests, former),
        lost_tests=_without(former, tests),
        detectable=_without(seen, seen_before),
        no_longer_detectable=_without(seen_before, seen),
        told_apart=_without(pairs, pairs_before),
        no_longer_told_apart=_without(pairs_before, pairs),
        parameters={
            name: value
            for name, value in after.system.parameters.items()
            if name not in before.system.parameters
        },
    )


def _without(some: Iterable[_Named], others: Iterable[_Named]) -> tuple[_Named, ...]:
    known = set(others)
    return tuple(one for one in some if one not in known)


def _equations(found: ModelStudy) -> dict[str, SystemEquation]:
    return {equation.name: equation for equation in found.system.equations}


def _idle(before: ModelStudy, after: ModelStudy) -> tuple[str, ...]:
    """Return what the newer model states beyond the older one, to no effect here."""
    holding = _equations(after)
    channels = {
        str(equation.measurement.channel) for equation in holding.values() if equation.measurement
    }
    stated = _without(
        (e.name for e in after.airframe.equations), (e.name for e in before.airframe.equations)
    )
    shown = _without(
        dict.fromkeys(str(m.channel) for m in after.airframe.measurements),
        (str(m.channel) for m in before.airframe.measurements),
    )
    return (*_without(stated, holding), *_without(shown, channels))


def _tests(found: ModelStudy) -> list[NamedTest]:
    names = [equation.name for equation in found.system.equations]
    return [
        NamedTest(faults, tuple(names[number] for number in generator.equations))
        for faults, generator in zip(
            found.bank.signature_names(), found.bank.generators, strict=True
        )
    ]


def _seen(found: ModelStudy) -> list[str]:
    names = found.implementable.faults
    return [names[i] for i in np.flatnonzero(found.implementable.detectable)]


def _pairs(found: ModelStudy) -> list[Pair]:
    names = found.implementable.faults
    return [(names[i], names[j]) for i, j in np.argwhere(found.implementable.matrix).tolist()]


def gain_document(gain: ModelGain) -> dict[str, Any]:
    """Return what a model shows beyond an older one as plain values."""
    return {
        "model": {"name": gain.before.airframe.name, "sha256": gain.before.airframe.sha256},
        "equations": {
            "added": list(gain.added),
            "changed": list(gain.changed),
            "removed": list(gain.removed),
            "without_effect": list(gain.idle),
        },
        "residual_generators": {
            "before": len(gain.before.bank.generators),
            "now": len(gain.after.bank.generators),
            "all_listed": gain.before.bank.listed and gain.after.bank.listed,
            "added": [_test(one) for one in gain.new_tests],
            "removed": [_test(one) for one in gain.lost_tests],
        },
        "detectable": {
            "added": list(gain.detectable),
            "removed": list(gain.no_longer_detectable),
        },
        "isolable": {
            "added": [list(pair) for pair in gain.told_apart],
            "removed": [list(pair) for pair in gain.no_longer_told_apart],
        },
        "parameters": {name: _parameter(value) for name, value in gain.parameters.items()},
    }


def _parameter(one: ParameterValue) -> dict[str, Any]:
    return {
        "value": one.value if isfinite(one.value) else None,
        "unit": one.unit,
        "source": one.source,
        "identify": None if one.bounds is None else list(one.bounds),
    }


def _test(one: NamedTest) -> dict[str, list[str]]:
    return {"signature": list(one.faults), "equations": list(one.equations)}
