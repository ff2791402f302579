"""What is a bank of residual generators? The values of the derive stage.

A bank is one graph of computations over whole columns, shared by all generators: what two of them
compute alike (the same equation solved for the same unknown from the same arguments) is one
``Node``. A ``Generator`` is a test set with its matching and the node of its residual. Over a
flight a bank gives ``Residuals``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats
from fdi.model.system import System
from fdi.residuals.between import STRETCH_S
from fdi.residuals.differentiate import Differentiation
from fdi.residuals.evaluate import context_of, evaluate_nodes
from fdi.residuals.node import Node
from fdi.residuals.reads import channels_read, faults_reaching
from fdi.residuals.rules import Reason
from fdi.shown import Shown
from fdi.telemetry import Channel, Signals
from fdi.telemetry.airtime import first_known

if TYPE_CHECKING:
    import pandas

SURE: Final = 2.0
"""Standard deviations by which a constant that was identified may be off."""


@dataclass(frozen=True, slots=True)
class Generator(Shown):
    """A residual generator.

    Attributes
    ----------
    id : str
        ``r1``, ``r2``, ... in the order of the bank.
    equations : tuple of int
        That it uses, ascending.
    faults : tuple of str
        Those that its equations bring: what its alarm speaks of. All that it is sensitive to, its
        signature, is in ``Bank.sensitivity``.
    node : int
        The node of its residual.
    residual : int
        The equation left over.
    steps : tuple of (int, str)
        Matched equations and what they are solved for, in computing order.
    restricted : bool
        Whether no non-invertible edge is matched.
    origin : str
        ``mtes``, ``cross_check`` for a test that minimality would have thrown away, ``selected``
        where not all sets were listed.
    """

    id: str
    equations: tuple[int, ...]
    faults: tuple[str, ...]
    node: int
    residual: int
    steps: tuple[tuple[int, str], ...]
    restricted: bool
    origin: Literal["mtes", "cross_check", "selected"] = "mtes"


@dataclass(frozen=True, slots=True)
class NotImplementable(Shown):
    """A test set that no residual generator can implement, and why: in words and as a reason."""

    equations: tuple[int, ...]
    faults: tuple[str, ...]
    why: str
    origin: Literal["mtes", "cross_check", "selected"]
    reason: Reason


@dataclass(frozen=True, eq=False)
class Bank:
    """Residual generators for one system, compiled.

    Attributes
    ----------
    system : System
    nodes : tuple of Node
        Every node after its arguments.
    generators : tuple of Generator
    not_implementable : tuple of NotImplementable
    listed : bool
        Whether generators and not implementable sets are all sets of the kind that was asked for.
    notes : tuple of str
        Where a selection stands for sets too many to be listed, in words.
    """

    system: System
    nodes: tuple[Node, ...]
    generators: tuple[Generator, ...]
    not_implementable: tuple[NotImplementable, ...]
    listed: bool = True
    notes: tuple[str, ...] = ()

    @cached_property
    def incidence(self) -> NDArray[np.bool_]:
        """Return which faults the equations bring, (generators, faults) bool, read-only."""
        place = {fault.name: i for i, fault in enumerate(self.system.faults)}
        matrix = np.zeros((len(self.generators), len(place)), dtype=bool)
        for row, generator in enumerate(self.generators):
            matrix[row, [place[name] for name in generator.faults]] = True
        matrix.flags.writeable = False
        return matrix

    @property
    def sensitivity(self) -> NDArray[np.bool_]:
        """Return the signatures, (generators, faults) bool, in the system's order of faults.

        A residual is sensitive to more than what its equations bring: to the faults of channels
        that it reads as trusted inputs, or of which a condition takes account.
        """
        matrix = np.zeros((len(self.generators), len(self.system.faults)), dtype=bool)
        for row, own in enumerate(self.generators):
            reaching = faults_reaching(self.system, self.nodes, own.node, own.equations)
            matrix[row, sorted(reaching)] = True
        return matrix

    def signature_names(self) -> tuple[tuple[str, ...], ...]:
        """Return the signature of every generator by the names of the faults."""
        names = [fault.name for fault in self.system.faults]
        return tuple(tuple(names[i] for i in np.flatnonzero(row)) for row in self.sensitivity)

    def channels(self, generator: Generator) -> tuple[Channel, ...]:
        """Return the channels of the log that a generator reads, those of conditions included."""
        return channels_read(self.system, self.nodes, generator.node)

    def methods(self) -> tuple[str, ...]:
        """Return of every generator the method whose columns it reads, "" where there is none."""
        made = [e.measurement.made_by if e.measurement else "" for e in self.system.equations]
        return tuple(
            next(filter(None, (made[number] for number in generator.equations)), "")
            for generator in self.generators
        )

    @property
    def signatures(self) -> pandas.DataFrame:
        """Return the signatures as a frame, residuals by faults."""
        import pandas as pd

        return pd.DataFrame(
            self.sensitivity,
            index=[generator.id for generator in self.generators],
            columns=[fault.name for fault in self.system.faults],
        )

    def evaluate(self, signals: Signals, differentiation: Differentiation) -> Residuals:
        """Return every residual over the whole flight, with its predicted spread."""
        context = context_of(self.system, self.nodes, signals, differentiation)
        found = evaluate_nodes([generator.node for generator in self.generators], context)
        values, ago = self._against_others(found.values, signals)
        equations = self.system.equations
        tolerance = np.array([equations[g.residual].tolerance for g in self.generators])
        tolerance.flags.writeable = False
        return Residuals(
            self,
            values,
            found.spread,
            found.allowance,
            found.swing,
            found.unsure,
            tolerance,
            found.delay_s,
            found.response,
            signals,
            differentiation,
            found.ambiguous,
            found.swung,
            {**found.ago, **ago},
        )

    def _against_others(self, values: Floats, signals: Signals) -> tuple[Floats, dict[int, Floats]]:
        """Return residuals, (r, n), and how long ago began what those against other flights show.

        These are asked where this flight departs from the others, in the stretch that tells so; and
        it has departed since it began.
        """
        values, ago = values.copy(), {}
        departs = {one.zero for one in self.system.parameters.values() if one.departs}
        since = min((flight.airborne[0] for flight in signals.flights), default=0.0)
        for row, generator in enumerate(self.generators):
            equation = self.system.equations[generator.residual]
            if equation.taught:
                early = first_known(np.isfinite(values[row]), signals, STRETCH_S)
                asked = early & bool(departs & equation.edges.keys())
                values[row] = np.where(asked, values[row], np.nan)
                ago[row] = signals.t - since
        values.flags.writeable = False
        return values, ago

    def describe(self, generator: Generator) -> str:
        """Return the equations of a generator as one line a person can read."""
        return ", ".join(self.system.equations[i].name for i in generator.equations)

    def __repr__(self) -> str:
        return (
            f"<Bank {self.system.name}: {len(self.generators)} residual generators, "
            f"{len(self.nodes)} nodes, {len(self.not_implementable)} sets not implementable>"
        )

    def _repr_html_(self) -> Any:
        return self.signatures._repr_html_()  # type: ignore[operator]


@dataclass(frozen=True, slots=True, eq=False)
class Residuals(Shown):
    """Residual columns, in the order of the bank's generators.

    Attributes
    ----------
    values : (r, n) float
        In each residual's own unit; NaN where an input is unknown or a condition does not hold.
    spread : (r, n) float
        Predicted standard deviation in health; 0 where the model states no accuracy.
    allowance : (r, n) float
        How far a constant offset of healthy sensors may move it.
    swing : (r, n) float
        By what share of itself the constant found at the beginning may have changed, because it is
        one of a field that the vehicle turns in.
    unsure : (r, n) float
        One standard deviation of what constants that the model does not know exactly make of it.
    tolerance : (r,) float
        How far it may stray by the model's own statement.
    delay_s : (r,) float
        How long after a sample the data that its value needs are complete.
    response : (r, f) float
        How far one standard deviation of a fault's channel moves a residual, the median over time;
        NaN where the fault is no channel's or the channel's accuracy is not stated.
    signals : Signals
        Handed on with the log's events, flights and parameters.
    recipe : Differentiation
        How derivatives were taken.
    ambiguous : (r, n) bool or None
        Where it is unknown because several roots fit and no channel tells which is meant.
    swung : (r, n) float or None
        The part of ``spread`` that is of such a constant: it is one for the whole flight, and what
        a flight is calmer than stated does not tell of it.
    ago : mapping of int to (n,) float, s
        For the rows that tell it: how long ago began what they show, at every sample.
    """

    bank: Bank
    values: Floats
    spread: Floats
    allowance: Floats
    swing: Floats
    unsure: Floats
    tolerance: Floats
    delay_s: Floats
    response: Floats
    signals: Signals
    recipe: Differentiation
    ambiguous: NDArray[np.bool_] | None = None
    swung: Floats | None = None
    ago: Mapping[int, Floats] = field(default_factory=dict)

    @property
    def lasting(self) -> Floats:
        """Return how far it may stray for as long as it likes, (r, n); no mean wears that off."""
        allowed: Floats = self.tolerance[:, None] + SURE * np.nan_to_num(self.unsure)
        return allowed

    @property
    def t(self) -> Floats:
        """Return the grid, (n,) s of the log's clock."""
        return self.signals.t

    def notes(self) -> tuple[str, ...]:
        """Return in words which residuals an ambiguous root makes unknown, and how often."""
        if self.ambiguous is None:
            return ()
        return tuple(
            f"{generator.id} ({self.bank.describe(generator)}) is unknown for {share:.0%} of the "
            f"time: several roots fit, and no channel tells which is meant"
            for generator, share in zip(
                self.bank.generators, self.ambiguous.mean(axis=1), strict=True
            )
            if share
        )

    def frame(self) -> pandas.DataFrame:
        """Return the values as a frame, time by residual."""
        import pandas as pd

        columns = [generator.id for generator in self.bank.generators]
        return pd.DataFrame(self.values.T, index=pd.Index(self.t, name="t"), columns=columns)

    def __repr__(self) -> str:
        return f"<Residuals {len(self.values)} over {len(self.t)} samples>"
