"""Whom does each residual of a bank concern, and how is every component tied to it?

In: a bank. Out: ``Concerns``: of every residual the faults and statements it holds, whom the model
merely suspects, and whom structure lets an alarm be blamed on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from fdi.model.parts import Component, Kind
from fdi.model.system import System
from fdi.residuals import Bank, Generator


class Tie(IntEnum):
    """How a component is tied to a residual, the closest last."""

    NONE = 0
    SUSPECTED = 1
    HELD = 2  # the residual is sensitive to a fault of it, or states something of it


@dataclass(frozen=True, slots=True, eq=False)
class Concerns:
    """What the search asks of a bank: whom every residual concerns.

    A residual concerns the faults of its signature; one that is a limit or an equality of which the
    model says whom it concerns stands for that statement, ``@name``, instead. Of those the model
    only ``suspected``.

    Attributes
    ----------
    faults : tuple of tuple of str
        Of every residual.
    component : mapping of str to str
        Whose each fault is.
    order : mapping of str to int
        The components in the order of the model.
    residual : (r,) int
        The equation left over: residuals that share it say nearly the same.
    supports : (r,) bool
        Residuals that support an accusation and accuse nobody by themselves.
    through : tuple of frozenset of str
        Of every residual the components with no parts that break whose output it reads: what
        disturbs them may show in it, whomever it concerns.
    narrow : (r,) bool
        Residuals that tell of one way to fail (standing still, silence, noise): a sensor that fails
        in another way leaves them quiet.
    """

    faults: tuple[tuple[str, ...], ...]
    component: Mapping[str, str]
    components: Mapping[str, Component]
    order: Mapping[str, int]
    suspected: frozenset[str]
    residual: NDArray[np.intp]
    supports: NDArray[np.bool_]
    through: tuple[frozenset[str], ...]
    narrow: NDArray[np.bool_]

    def of(self, row: int) -> frozenset[str]:
        """Return the components that a residual concerns."""
        return frozenset(self.component[fault] for fault in self.faults[row])

    def disturbed(self, row: int, reach: frozenset[str]) -> frozenset[str]:
        """Return whom of ``reach``, those that a failure disturbs, a residual may show."""
        return (self.of(row) | self.through[row]) & reach

    def held_by(self, row: int) -> frozenset[str]:
        """Return those of them that the model does not merely suspect."""
        held = (fault for fault in self.faults[row] if fault not in self.suspected)
        return frozenset(self.component[fault] for fault in held)

    def in_order(self, row: int) -> list[str]:
        """Return whom a residual concerns: who holds it before whom the model only suspects."""
        held = self.held_by(row)
        return sorted(self.of(row), key=lambda name: (name not in held, self.order[name]))

    def ties(self, component: str) -> NDArray[np.int8]:
        """Return the `Tie` of a component to every residual, (r,)."""
        found = np.full(len(self.faults), Tie.NONE, np.int8)
        for row in range(len(self.faults)):
            if component in self.held_by(row):
                found[row] = Tie.HELD
            elif component in self.of(row):
                found[row] = Tie.SUSPECTED
        return found


def affected(component: str, components: Mapping[str, Component]) -> set[str]:
    """Return the components that a failure disturbs, directly or through others."""
    reached: set[str] = set()
    stack = list(components[component].affects) if component in components else []
    while stack:
        name = stack.pop()
        if name not in reached and name != component:
            reached.add(name)
            stack.extend(components[name].affects if name in components else ())
    return reached


def concerns(bank: Bank) -> Concerns:
    """Return whom the residuals of a bank concern."""
    system = bank.system
    component = {fault.name: fault.component for fault in system.faults}
    suspected: set[str] = set()
    faults: list[tuple[str, ...]] = []
    for generator in bank.generators:
        equation = system.equations[generator.residual]
        speaks = equation.kind in (Kind.LIMIT, Kind.EQUALITY) and equation.component is not None
        own = [] if speaks else list(generator.faults)
        for number in generator.equations:
            used = system.equations[number]
            whom = [used.component] if speaks and number == generator.residual else []
            for name in (*whom, *used.suspects):
                label = f"@{used.name}:{name}"
                component[label] = str(name)
                own.append(label)
                if name not in whom:
                    suspected.add(label)
        faults.append(tuple(own))
    return Concerns(
        tuple(faults),
        component,
        system.components,
        {name: i for i, name in enumerate(system.components)},
        frozenset(suspected),
        np.array([generator.residual for generator in bank.generators], np.intp),
        np.array(
            [any(system.equations[i].supports for i in one.equations) for one in bank.generators],
            bool,
        ),
        tuple(_through(generator, system) for generator in bank.generators),
        np.array([_is_narrow(generator, system) for generator in bank.generators], bool),
    )


def _is_narrow(generator: Generator, system: System) -> bool:
    """Return whether a residual reads how a field behaves, and not what it shows."""
    return any(
        m.behaviour != "" for i in generator.equations if (m := system.equations[i].measurement)
    )


def _through(generator: Generator, system: System) -> frozenset[str]:
    read = {m.component for i in generator.equations if (m := system.equations[i].measurement)}
    return frozenset(n for n in read if n in system.components and system.components[n].computed)
