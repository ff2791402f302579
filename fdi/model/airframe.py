"""What is known about a vehicle, before any log? The value of the load stage."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from fdi.model.dimensions import Dimension
from fdi.model.parts import Component, Equation, Measurement, Parameter, Variable
from fdi.model.system import System, build_system
from fdi.telemetry import Log


@dataclass(frozen=True, slots=True, eq=False)
class Airframe:
    """A whole model; knows no file syntax and no log.

    Attributes
    ----------
    vehicles : tuple of str
        The vehicle types it is chosen for when the user names no model.
    sha256 : str
        Over the bytes of the file and of what it includes.
    units : dict of str to Dimension
        What the unit texts of variables and of logs stand for, as far as that is known without
        reading them anew.
    """

    name: str
    description: str
    vehicles: tuple[str, ...]
    components: dict[str, Component]
    variables: dict[str, Variable]
    parameters: dict[str, Parameter]
    equations: tuple[Equation, ...]
    measurements: tuple[Measurement, ...]
    sha256: str
    units: dict[str, Dimension] = field(default_factory=dict)

    def observe(self, log: Log | None = None, *, also: Collection[str] = ()) -> System:
        """Return the equations that hold with the telemetry of a log, and the faults they bring.

        Parameters
        ----------
        log : Log, optional
            Without one, every measurement counts as present.
        also : collection of str
            Messages that count as present though the log lacks them, to see what they would show.

        Raises
        ------
        LogError
            The log has no channel that the model measures.
        """
        return build_system(self, log, also)

    def __repr__(self) -> str:
        return (
            f"<Airframe {self.name}: {len(self.equations)} equations, "
            f"{len(self.variables)} variables, {len(self.measurements)} measurements>"
        )
