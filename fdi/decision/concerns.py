"""Whom does each residual of a bank concern, and how far does a component explain its alarm?

In: a bank. Out: ``Concerns``: of every residual the faults and statements it holds, whom the model
merely suspects, and what disturbs whom. Who accuses asks this, and so does the budget of false
accusations, which must know what would accuse.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from fdi.model.parts import Component, Kind
from fdi.residuals import Bank

SUSPECTED: Final = 0.6
DISTURBED: Final = 0.35
REMOTE: Final = 0.2
"""Shares of an alarm that count where the test only suspects, disturbs, remotely disturbs."""


@dataclass(frozen=True, slots=True)
class Concerns:
    """What the search asks of a bank: whom every residual concerns.

    A residual concerns the faults of its signature; one that is a limit or an equality of which the
    model says whom it concerns stands for that statement, ``@name``, instead. Of those the model
    only ``suspected``. What ``supporting`` tests say counts beside what others say.
    """

    faults: tuple[tuple[str, ...], ...]
    component: Mapping[str, str]
    components: Mapping[str, Component]
    order: Mapping[str, int]
    suspected: frozenset[str]
    column: Mapping[str, int]
    residual: tuple[int, ...]
    supporting: frozenset[int]

    def of(self, row: int) -> frozenset[str]:
        """Return the components that a residual concerns."""
        return frozenset(self.component[fault] for fault in self.faults[row])

    def share(self, component: str, row: int, chosen: frozenset[str]) -> float:
        """Return how far a component explains an alarm of a residual, 0 to 1."""
        held = set(self.faults[row])
        if held & chosen:
            return 1.0
        own = {fault for fault in held if self.component[fault] == component}
        if own & self.suspected:
            return SUSPECTED
        if own:
            return 0.0  # it holds a fault of the component that the other tests speak against
        suspects = {self.component[fault] for fault in held & self.suspected}
        if suspects and self.components[component].group == "sensor":
            return 0.0  # the model lists which sensors it may concern, and not this one
        distance = self._distance(component)
        nearest = min((distance.get(name, 99) for name in self.of(row)), default=99)
        return {1: DISTURBED}.get(nearest, REMOTE if nearest < 99 else 0.0)

    def _distance(self, component: str) -> dict[str, int]:
        found: dict[str, int] = {}
        level = [component]
        for step in range(1, len(self.components) + 1):
            following = [
                name
                for known in level
                if known in self.components
                for name in self.components[known].affects
                if name not in found and name != component
            ]
            found.update(dict.fromkeys(following, step))
            level = following
        return found


def concerns(bank: Bank) -> Concerns:
    """Return whom the residuals of a bank concern."""
    system = bank.system
    component = {fault.name: fault.component for fault in system.faults}
    suspected: set[str] = set()
    faults: list[tuple[str, ...]] = []
    for generator in bank.generators:
        left = system.equations[generator.residual]
        stated = left.kind in (Kind.LIMIT, Kind.EQUALITY) and left.component is not None
        own = [] if stated else list(generator.faults)
        for number in generator.equations:
            equation = system.equations[number]
            whom = [equation.component] if stated and number == generator.residual else []
            for name in (*whom, *equation.suspects):
                label = f"@{equation.name}:{name}"
                component[label] = str(name)
                own.append(label)
                if name not in whom:
                    suspected.add(label)
        faults.append(tuple(own))
    order = {name: i for i, name in enumerate(system.components)}
    column = {fault.name: i for i, fault in enumerate(system.faults)}
    return Concerns(
        tuple(faults),
        component,
        system.components,
        order,
        frozenset(suspected),
        column,
        tuple(generator.residual for generator in bank.generators),
        frozenset(
            row
            for row, generator in enumerate(bank.generators)
            if any(system.equations[i].supports for i in generator.equations)
        ),
    )
