"""What do healthy flights of one vehicle teach about its tests? The policy learned from them.

In: logs of healthy flights of one vehicle, and a policy to begin with. Out: ``Calibrated``: that
policy with the thresholds, stated bounds, constants and identified parameters of this vehicle, and
the check of it: how often each flight is accused by the policy as it was, and by one learned from
the others.

Refused are flights of other vehicles or under another model, and flights that are not healthy: that
end with an impact, or on which a component is accused by far.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Final

from fdi.chain import Chain, residuals_of
from fdi.decision import Policy, load_policy
from fdi.decision.alarms import Alarms
from fdi.decision.bounds import learn
from fdi.decision.judging import judge
from fdi.decision.learned import Reached, learned_from, reached, rounded
from fdi.decision.policy import Calibration
from fdi.decision.recipes import PredictedSpread
from fdi.diagnosis.answer import causes_of
from fdi.errors import LogError, UsageError
from fdi.model.parameters import value_of, with_learned
from fdi.model.parts import Kind
from fdi.model.system import Estimate, ParameterValue
from fdi.residuals import Residuals
from fdi.residuals.between import learned_parameters, tells
from fdi.residuals.identify import identified
from fdi.shown import Shown
from fdi.telemetry import Log, read
from fdi.telemetry.airtime import time_in_air, when_in_air

FAR: Final = 4.0
"""So many thresholds beyond what noise explains no flight is taken for a healthy one: those that
are have reached 3.3 at the most, faulty ones 2 to 14."""
LEAST_S: Final = 20.0
"""In the air; less teaches nothing."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """One healthy log: its residuals, what its tests reached, its hours in the air.

    ``priors``, ``parameters``: what is to be identified, before and after. ``frame``: what the log
    tells of where motors stand and turn, by parameter.
    """

    name: str
    vehicle: str
    model: str
    residuals: Residuals
    reached: Mapping[str, Reached]
    priors: Mapping[str, ParameterValue]
    parameters: Mapping[str, ParameterValue]
    frame: Mapping[str, float]
    hours: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Check(Shown):
    """How many findings a healthy log has under the policy as it was and learned from the others.

    ``after`` is None where there are no others.
    """

    name: str
    hours: float
    before: int
    after: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated(Shown):
    """The policy that was learned, and the check of it."""

    policy: Policy
    checks: tuple[Check, ...]
    warnings: tuple[str, ...]


def calibrate(
    paths: Sequence[str | Path],
    *,
    name: str = "calibrated",
    model: str | Path = "auto",
    policy: str | Path = "default",
    progress: Progress | None = None,
) -> Calibrated:
    """Return the policy that healthy flights of one vehicle teach.

    Parameters
    ----------
    paths : sequence of str or Path
        Logs of healthy flights.
    name : str
        Of the new policy.
    model : str or Path
        A shipped model, a file, or ``auto``: by the type of the vehicle.
    policy : str or Path
        What to begin with.
    progress : callable, optional
        Is told which log is read and the share of work done.

    Raises
    ------
    LogError, ModelError
        A log cannot be read or holds no flight; the model or policy is wrong.
    UsageError
        The logs are not of one vehicle, a flight is not healthy, or the policy cannot learn.
    """
    recipe = load_policy(policy)
    if not isinstance(recipe.decision, PredictedSpread) or not recipe.accuse:
        raise UsageError(f"the policy {recipe.name} has nothing to learn", hint="use default")
    recipe = replace(recipe, decision=replace(recipe.decision, learned={}), calibration=None)
    flown: list[Flown] = []
    for number, path in enumerate(paths):
        if progress:
            progress(Path(path).name, number / (len(paths) + 1))
        flown.append(_fly(path, model, recipe))
        _same_vehicle(flown[0], flown[-1])
    if progress:
        progress("check", len(paths) / (len(paths) + 1))
    return Calibrated(
        _taught(recipe, flown, name),
        tuple(_checks(recipe, flown)),
        tuple(warning for one in flown for warning in one.warnings),
    )


def _fly(path: str | Path, model: str | Path, recipe: Policy) -> Flown:
    assert isinstance(recipe.decision, PredictedSpread)
    log = read(path)
    _refuse_impacts(log)
    chain = residuals_of(log, model, recipe)
    residuals, signals = chain.residuals, chain.signals
    spans = time_in_air(signals)
    seconds = sum(max(0.0, end - start) for start, end in spans)
    if seconds < LEAST_S:
        raise LogError(
            f"has {max(seconds, 0.0):.0f} s in the air that could be tested, {LEAST_S:.0f} s are "
            "needed",
            where=log.name,
            hint="leave it out",
        )
    bounds = learn(residuals, recipe.decision)
    alarms = judge(residuals, bounds, recipe.decision, recipe.use)
    accused = strongest(alarms)
    for component, onset, strength in accused:
        if strength > FAR:
            raise UsageError(
                f"is not healthy: {component} is accused at {onset:.1f} s, {strength:.0f} times "
                "beyond what noise explains",
                where=log.name,
                hint="leave it out",
            )
    found = reached(residuals, bounds, when_in_air(signals), recipe.decision)
    warnings = tuple(
        f"{log.name}: {component} is accused at {onset:.1f} s; its tests are taken to behave so in "
        "health: is the flight healthy?"
        for component, onset, _ in accused
    )
    priors = {
        name: value_of(parameter, chain.log)
        for name, parameter in chain.airframe.parameters.items()
        if parameter.bounds is not None
    }
    parameters = {name: chain.system.parameters[name] for name in priors}
    return Flown(
        log.name,
        log.vehicle,
        chain.airframe.name,
        residuals,
        found,
        priors,
        parameters,
        _frame(chain),
        seconds / 3600.0,
        (*warnings, *_not_told(log.name, parameters)),
    )


def strongest(alarms: Alarms) -> list[tuple[str, float, float]]:
    """Return component, onset, s, and greatest strength of every finding by tests of noise.

    How far a limit is violated says nothing about noise: limits and equalities are left out.
    """
    bank = alarms.residuals.bank
    kinds = [bank.system.equations[generator.residual].kind for generator in bank.generators]
    stated = (Kind.LIMIT, Kind.EQUALITY)
    return [
        (
            cause.component,
            cause.onset,
            max((run.peak for run in cause.runs if kinds[run.row] not in stated), default=0.0),
        )
        for cause in causes_of(alarms)
    ]


def _frame(chain: Chain) -> dict[str, float]:
    """Return the factors of the motors that a log tells, by parameter."""
    own = {name for name, parameter in chain.airframe.parameters.items() if parameter.frame}
    return {
        name: p.value
        for name, p in chain.system.parameters.items()
        if name in own and p.source == "log" and isfinite(p.value)
    }


def _not_told(name: str, parameters: Mapping[str, ParameterValue]) -> Iterator[str]:
    untold = [n for n, p in parameters.items() if not tells(p)]
    if untold:
        yield f"{name}: teaches nothing of {', '.join(untold)}, which it does not tell"


def _refuse_impacts(log: Log) -> None:
    for flight in log.flights:
        if flight.impact is not None:
            raise UsageError(
                f"is not healthy: it ends with an impact at {flight.impact:.1f} s",
                where=log.name,
                hint="leave it out",
            )


def _same_vehicle(first: Flown, other: Flown) -> None:
    for what, one, two in (
        ("vehicle", first.vehicle, other.vehicle),
        ("model", first.model, other.model),
    ):
        if one != two:
            raise UsageError(
                f"is of another {what} ({two}) than {first.name} ({one})",
                where=other.name,
                hint="calibrate each vehicle by itself",
            )
    for name in first.frame.keys() & other.frame.keys():
        if first.frame[name] != other.frame[name]:
            raise UsageError(
                f"has another frame than {first.name}",
                where=other.name,
                hint="calibrate each vehicle by itself",
            )


def _taught(recipe: Policy, flown: Sequence[Flown], name: str) -> Policy:
    """Return the policy with what healthy flights say about its tests."""
    assert isinstance(recipe.decision, PredictedSpread)
    learned = learned_from(one.reached for one in flown)
    names = tuple(one.name for one in flown)
    hours = sum(one.hours for one in flown)
    return replace(
        recipe,
        name=name,
        description=f"Learned from {len(flown)} healthy flights, {60 * hours:.0f} min in the air.",
        decision=replace(recipe.decision, learned=learned),
        calibration=Calibration(
            flown[0].model,
            flown[0].vehicle,
            names,
            rounded(hours),
            {
                key: Estimate(rounded(told.value), rounded(told.std), told.flights)
                for key, told in learned_parameters([one.parameters for one in flown]).items()
            },
        ),
    )


def _checks(recipe: Policy, flown: Sequence[Flown]) -> list[Check]:
    checks = []
    for place, one in enumerate(flown):
        others = [other for number, other in enumerate(flown) if number != place]
        before = len(causes_of(recipe.decide(one.residuals)))
        after = None
        if others:
            taught = _taught(recipe, others, "others")
            after = len(causes_of(taught.decide(_again(one, taught))))
        checks.append(Check(one.name, one.hours, before, after))
    return checks


def _again(one: Flown, taught: Policy) -> Residuals:
    """Return the residuals of a flight with the parameters that others taught."""
    bank, signals = one.residuals.bank, one.residuals.signals
    assert taught.calibration is not None
    parameters = {**bank.system.parameters, **one.priors}
    system = with_learned(
        replace(bank.system, parameters=parameters), taught.calibration.parameters
    )
    bank = identified(replace(bank, system=system), signals, taught.differentiation)
    return bank.evaluate(signals, taught.differentiation)
