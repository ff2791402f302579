"""Is this flight unlike those that the policy was learned from, and whom would that concern?

In: residuals, whose bank knows what earlier flights told of its parameters. Out: a `Departed` where
the beginning of the flight, all parameters together, is as far from that as few healthy flights
are. Something differed before the parameters were fitted: a shortened propeller, a load, another
vehicle. It accuses nobody: which test that leaves farthest off, with the learned values, is told
for a person to check. A test that is far enough off raises an alarm besides, as everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.model.system import ParameterValue
from fdi.residuals import Residuals
from fdi.residuals.between import STRETCH_S, departure
from fdi.telemetry.airtime import reference_mask

LEAST_SHARE: Final = 0.001
"""The tails of the distribution are not known better than that."""


@dataclass(frozen=True, slots=True)
class OffBy:
    """How far a test of a component is off its tolerance at the flight's beginning, the median.

    ``std``: what the learned values, known so well only, make of it.
    """

    component: str
    test: str
    value: float
    std: float


@dataclass(frozen=True, slots=True)
class Departed:
    """A flight unlike others: ``share`` of healthy ones are as far off; tests, farthest first."""

    share: float
    parameters: tuple[str, ...]
    tests: tuple[OffBy, ...]
    text: str


def departed(residuals: Residuals) -> Departed | None:
    """Return how a flight departs from what the policy has learned; None where it does not."""
    parameters = residuals.bank.system.parameters
    found = departure(parameters)
    if found is None or not found.rare:
        return None
    tests = sorted(_tests(residuals), key=lambda one: -one.value)
    names = sorted(found.distances, key=lambda name: -abs(found.distances[name]))
    told = "; ".join(_told(name, parameters[name]) for name in names)
    share = f"{found.share:.1%}" if found.share >= LEAST_SHARE else f"less than {LEAST_SHARE:.1%}"
    text = (
        f"{told}. Of healthy flights {share} are as far off. Damage, load or another vehicle: it "
        "was there before, so the learned values are kept"
    )
    if tests:
        first = tests[0]
        text += (
            f". With them {first.test}, of {first.component}, is the farthest beyond its "
            f"tolerance: by {first.value:.2g} +- {first.std:.2g}"
        )
    return Departed(found.share, tuple(names), tuple(tests), text)


def _told(name: str, own: ParameterValue) -> str:
    assert own.learned is not None
    assert own.flight is not None
    flights = f"{own.learned.flights} flight{'s' * (own.learned.flights != 1)}"
    return (
        f"{name} is {own.flight.value:.3g} +- {own.flight.std:.2g} instead of "
        f"{own.learned.value:.3g} +- {own.learned.std:.2g} on {flights}"
    )


def _tests(residuals: Residuals) -> Iterator[OffBy]:
    """Yield the tests that need a parameter and are beyond their tolerance at the beginning."""
    system = residuals.bank.system
    beginning = reference_mask(residuals.signals, STRETCH_S)
    for row, generator in enumerate(residuals.bank.generators):
        equation = system.equations[generator.residual]
        known = beginning & np.isfinite(residuals.values[row])
        if equation.component is None or not known.any():
            continue
        unsure = float(np.median(residuals.unsure[row, known]))
        value = float(np.median(residuals.values[row, known]))
        # a residual is the right side less the left one
        size = {"above": -value, "below": value}.get(equation.side, abs(value))
        off = size - float(residuals.tolerance[row])
        if np.isfinite(unsure) and unsure > 0 and off > 0:
            yield OffBy(equation.component, equation.name, off, unsure)
