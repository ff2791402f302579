"""Which equations hold with one log, over which unknowns, and which faults do they bring?

The values of the observe stage: every relation, limit and equality of the model is in a ``System``;
a measurement is in it when its channel is in the log, and brings one equation and one fault.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from fdi.model.expression import Expression, differential, regressed, symbols
from fdi.model.parts import Amount, Component, Kind, Measurement, Side, Variable, read_by
from fdi.shown import Shown
from fdi.structure import Fault as StructuralFault
from fdi.structure import Model
from fdi.telemetry import Copy, Request

EdgeKind = Literal["solvable", "fixed", "derivative", "integral"]
DIFFERENTIAL: Final = ("derivative", "integral")
IN_AIR: Final = frozenset({"airborne", "aloft", "wing_borne", "rotor_borne", "phase"})
"""The flight state that tells whether a vehicle flies, and what carries it."""


@dataclass(frozen=True, slots=True)
class SystemEquation:
    """An equation over the unknowns of one system.

    Attributes
    ----------
    edges : mapping of str to EdgeKind
        For every unknown it holds: ``solvable`` for it, ``fixed`` (non-invertible), or its
        ``derivative`` or ``integral`` edge.
    circular : bool
        Whether its two sides are angles, so that their difference wraps.
    measurement : Measurement or None
        The channel, where the equation is one.
    """

    name: str
    kind: Kind
    left: Expression
    right: Expression
    edges: Mapping[str, EdgeKind]
    circular: bool = False
    when: Expression | None = None
    cost: float = 1.0
    fault: str | None = None
    component: str | None = None
    tolerance: float = 0.0
    window: float = 0.0
    offset: float = 0.0
    side: Side = ""
    swings: tuple[Expression, ...] = ()
    errors: tuple[Expression, ...] = ()
    supports: bool = False
    steady: bool = False
    always: bool = False
    taught: bool = False
    command: bool = False
    elapsed: bool = False
    says: str = ""
    unit: str = ""
    suspects: tuple[str, ...] = ()
    amounts: tuple[Amount, ...] = ()
    measurement: Measurement | None = None
    text: str = ""

    @property
    def way(self) -> int:
        """Return the sign of a residual that violates it, 0 where either does.

        A residual is the right side less the left one, so what exceeds a limit is below zero.
        """
        if self.kind is Kind.LIMIT:
            return -1
        return {"above": -1, "below": 1}.get(self.side, 0)

    @property
    def differential(self) -> tuple[str, str] | None:
        """Return (derivative, state) of ``y = der(x)``, else None."""
        return differential(self.left, self.right)

    @property
    def regressed(self) -> tuple[str, tuple[str, ...]] | None:
        """Return (y, the arguments) of ``y = slope(v, u, ...)`` or ``jump``, else None."""
        return regressed(self.left, self.right)


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of a system, by the equation that it enters."""

    name: str
    component: str
    group: str
    equation: int


@dataclass(frozen=True, slots=True)
class Estimate:
    """What ``flights`` tell of a parameter: its value, and one standard deviation of that."""

    value: float
    std: float
    flights: int = 1


@dataclass(frozen=True, slots=True)
class ParameterValue(Shown):
    """The value a parameter has in this system; ``source`` is default, log, identified or policy.

    Attributes
    ----------
    std : float or None
        How well a constant that is to be identified is known; None for one that counts as exact.
    bounds : (float, float) or None
        Between which it is identified, by the model.
    zero : str
        The variable that is zero where its value is right.
    wanders : float
        By how much it seems to go up and down, one sigma, for all that the model leaves out.
    learned : Estimate or None
        What healthy flights before this one told, by the policy.
    flight : Estimate or None
        What the beginning of this flight alone tells.
    shares : tuple of (str, float)
        Of what ``std`` is made: standard deviations that are independent of each other, each named
        by a parameter, and shared with those identified together. Empty: its own alone.
    """

    value: float
    unit: str
    source: Literal["default", "log", "identified", "policy"]
    std: float | None = None
    bounds: tuple[float, float] | None = None
    zero: str = ""
    wanders: float = 0.0
    learned: Estimate | None = None
    flight: Estimate | None = None
    shares: tuple[tuple[str, float], ...] = ()

    @property
    def departs(self) -> bool:
        """Return whether this flight tells another value than what others taught, and held."""
        return self.source == "policy" and self.learned is not None and self.flight is not None

    @property
    def width(self) -> float:
        """Return the standard deviation that the model's bounds state, over all vehicles."""
        assert self.bounds is not None
        low, high = self.bounds
        return (high - low) / 4  # bounds hold what two standard deviations hold


@dataclass(frozen=True, slots=True, eq=False)
class System(Shown):
    """The equations that hold with one log.

    Attributes
    ----------
    channels : tuple of Request
        What to ask of the log: every measured channel.
    curtailed : frozenset of str
        Components of which a relation fell away because the log lacks what it needs beside them.
    warnings : tuple of str
        What of the model could not be used with this log, and why.
    copies : tuple of Copy
        Channels that repeat another one by the data, and therefore are no witnesses.
    implied : mapping of str to Copy
        The equations of the model that are left out because of a copy: they would hold whatever
        happened, or need what only a copy shows.
    """

    name: str
    sha256: str
    equations: tuple[SystemEquation, ...]
    unknowns: tuple[str, ...]
    faults: tuple[Fault, ...]
    channels: tuple[Request, ...]
    variables: Mapping[str, Variable]
    parameters: Mapping[str, ParameterValue]
    components: Mapping[str, Component]
    curtailed: frozenset[str] = frozenset()
    warnings: tuple[str, ...] = ()
    copies: tuple[Copy, ...] = ()
    implied: Mapping[str, Copy] = field(default_factory=dict)

    @property
    def inputs(self) -> Mapping[str, int]:
        """Return the variables that inputs show, with the equations that do."""
        return {
            equation.measurement.variable: number
            for number, equation in enumerate(self.equations)
            if equation.kind is Kind.INPUT and equation.measurement
        }

    @property
    def flies(self) -> bool:
        """Return whether a statement of the model asks how the vehicle flies.

        Where none does, the model is of what drives or swims. That a channel stands still is asked
        in the air only, of any vehicle.
        """
        own = [e.when for e in self.equations if not e.elapsed]
        own += [e.measurement.when for e in self.equations if e.measurement]
        return any(not IN_AIR.isdisjoint(symbols(when)) for when in own if when is not None)

    def structure(self, *, limits: bool = True, trusting: bool = True) -> Model:
        """Return the incidence of the system, as pure structure.

        A variable that an input shows is known, so it is no unknown here.

        Parameters
        ----------
        limits : bool
            False leaves limits and equalities out: they are no redundancy for a cross-check. The
            names of the equations, not their numbers, then lead back to the system.
        trusting : bool
            Whether a fault enters its own equation alone, which is how tests are looked for. False:
            that of a channel enters wherever the channel is read, as an input too. The conditions
            of equations are left out: what they read is known once they are implemented.
        """
        left_out = (Kind.INPUT,) if limits else (Kind.INPUT, Kind.LIMIT, Kind.EQUALITY)
        kept = [i for i, equation in enumerate(self.equations) if equation.kind not in left_out]
        row_of = {number: row for row, number in enumerate(kept)}
        known = self.inputs
        entering = [(f.equation,) for f in self.faults] if trusting else self._entering()
        used = {name for i in kept for name in self.equations[i].edges}
        names = [name for name in self.unknowns if name in used and name not in known]
        place = {name: column for column, name in enumerate(names)}
        edges = [
            (row_of[i], place[name], kind)
            for i in kept
            for name, kind in self.equations[i].edges.items()
            if name in place
        ]
        return Model(
            equations=tuple(self.equations[i].name for i in kept),
            unknowns=tuple(names),
            rows=tuple(
                tuple(sorted(place[n] for n in self.equations[i].edges if n in place)) for i in kept
            ),
            faults=tuple(
                StructuralFault(fault.name, tuple(row_of[i] for i in entered if i in row_of))
                for fault, entered in zip(self.faults, entering, strict=True)
                if fault.equation in row_of
            ),
            derivative=tuple((i, j, kind[0]) for i, j, kind in edges if kind in DIFFERENTIAL),
            nonsolvable=tuple((i, j) for i, j, kind in edges if kind == "fixed"),
            name=self.name,
        )

    def _entering(self) -> list[tuple[int, ...]]:
        """Return the equations that every fault enters, with those that read its channel."""
        read = [
            set(read_by(e.measurement, self.parameters)) if e.measurement else set()
            for e in self.equations
        ]
        inputs = self.inputs
        for number, equation in enumerate(self.equations):
            for name in equation.edges.keys() & inputs.keys():
                read[number] |= read[inputs[name]]
        found = []
        for fault in self.faults:
            shown = self.equations[fault.equation].measurement
            reading = [i for i, own in enumerate(read) if shown and shown.channel in own]
            found.append(tuple(sorted({fault.equation, *reading})))
        return found

    def __repr__(self) -> str:
        return (
            f"<System {self.name}: {len(self.equations)} equations, "
            f"{len(self.unknowns)} unknowns, {len(self.faults)} faults>"
        )
