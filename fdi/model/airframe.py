"""What is known about a vehicle, before any log, and which of it holds with one?

The value of the load stage, ``Airframe``, and the observe stage: with a log it gives a ``System``.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from fdi.errors import LogError
from fdi.model.copied import find_copies, infallible, witnesses
from fdi.model.dimensions import Dimension
from fdi.model.naming import placed
from fdi.model.observe import (
    faults_of,
    first_inputs,
    is_present,
    measurement_equation,
    relation_equation,
    request_of,
    usable,
    with_latency,
)
from fdi.model.parameters import assumptions, value_of, without_unset
from fdi.model.parts import Component, Equation, Measurement, ModelFile, Parameter, Variable
from fdi.model.system import System
from fdi.model.world import undated
from fdi.shown import Shown
from fdi.telemetry import Copy, Log, Request
from fdi.telemetry.meaning import LINK


@dataclass(frozen=True, slots=True, eq=False)
class Airframe(Shown):
    """A whole model; knows no file syntax and no log.

    Attributes
    ----------
    vehicles : tuple of str
        The vehicle types it is chosen for when the user names no model.
    sha256 : str
        Over the bytes of the file and of what it includes.
    files : tuple of ModelFile
        All of them, included ones first.
    warnings : tuple of str
        What is not wrong and may not be meant.
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
    files: tuple[ModelFile, ...] = ()
    warnings: tuple[str, ...] = ()

    def observe(
        self,
        log: Log | None = None,
        *,
        also: Collection[str] = (),
        repeated: bool = False,
        commands: bool = True,
    ) -> System:
        """Return the equations that hold with the telemetry of a log, and the faults they bring.

        Parameters
        ----------
        log : Log, optional
            Without one, every measurement counts as present.
        also : collection of str
            Messages that count as present though the log lacks them, to see what they would show.
        repeated : bool
            Whether a channel that repeats another one by the data is a witness all the same.
        commands : bool
            Whether statements that read a recorded command as evidence are among the equations.

        Raises
        ------
        LogError
            The log has no channel that the model measures.
        """
        warnings = list(self.warnings)
        parameters = {name: value_of(p, log) for name, p in self.parameters.items()}
        present = first_inputs(
            with_latency(m, parameters)
            for m in self.measurements
            if m.channel.source in also or self._shows(log, m, warnings)
        )
        if all(m.channel.message == LINK for m in present):  # that tells nothing of a vehicle
            raise LogError(
                f"holds no message that the model {self.name!r} measures",
                where=log.name if log else "",
                hint="choose another model with --model",
            )

        def request(measurement: Measurement) -> Request:
            return request_of(measurement, self.variables[measurement.variable], parameters)

        equations = tuple(e for e in self.equations if commands or not e.command)
        copies: tuple[Copy, ...] = ()
        if log is not None and not repeated:
            copies = find_copies(log, present, equations, self.variables, request)
        implied = infallible(equations, copies, present, self.variables, parameters)
        measurements = witnesses(present, self.measurements, copies)
        present = witnesses(present, present, copies)
        relations = [equation for equation in equations if equation.name not in implied]
        relations, told = without_unset(relations, self.parameters, log)
        relations, curtailed = usable(
            relations, measurements, present, self.components, log, warnings
        )
        warnings += [*told, *assumptions(self.parameters, relations, present, log)]
        if log is not None and any(p.world for p in self.parameters.values()):
            warnings += undated(log)
        holding = [relation_equation(e, self.variables) for e in relations]
        holding += [measurement_equation(m, self.variables) for m in present]
        unknowns = {name for equation in holding for name in equation.edges}
        return System(
            name=self.name,
            sha256=self.sha256,
            equations=tuple(holding),
            unknowns=tuple(sorted(unknowns)),
            faults=tuple(faults_of(holding, self.components)),
            channels=tuple(request(m) for m in present),
            variables=self.variables,
            parameters=parameters,
            components=placed(self.components, log),
            curtailed=curtailed,
            warnings=tuple(warnings),
            copies=copies,
            implied=implied,
        )

    def _shows(self, log: Log | None, measurement: Measurement, warnings: list[str]) -> bool:
        unit = self.variables[measurement.variable].unit
        return is_present(measurement, log, unit, self.parameters, self.units, warnings)

    def __repr__(self) -> str:
        return (
            f"<Airframe {self.name}: {len(self.equations)} equations, "
            f"{len(self.variables)} variables, {len(self.measurements)} measurements>"
        )
