"""From a log to its residuals: the one way that every user of them goes.

In: a log, a model, a policy. Out: a `Chain`, the value of every stage up to the residuals.
`fdi.analyze`, `fdi calibrate`, benchmarks, notebooks and whoever scripts call `residuals_of`, so
that nobody gets another answer by leaving a step out. `Policy.decide` and `fdi.diagnose` follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from fdi.decision import Policy, load_policy
from fdi.errors import LogError, ModelError
from fdi.methods.columns import with_columns
from fdi.methods.table import METHODS, methods_of
from fdi.model import Airframe, System, load_airframe
from fdi.model.choose import choose_model
from fdi.model.parameters import with_learned
from fdi.residuals import Bank, Residuals
from fdi.residuals.cache import cached_bank
from fdi.residuals.identify import identified
from fdi.residuals.latency import Lag, sample
from fdi.shown import Shown, clean
from fdi.telemetry import Log, Signals

Stage = Callable[[str, float], AbstractContextManager[None]]
"""Is told the stage that begins and the share of an analysis done before it."""


@dataclass(frozen=True, slots=True, eq=False)
class Chain(Shown):
    """The value of every stage from a log to its residuals.

    Attributes
    ----------
    log : Log
        With the columns of the policy's methods.
    lags : tuple of Lag
        How late sensors come against the estimator, by the log; none where the policy takes the
        model's word.
    silent : tuple of str
        Which of the methods are not weighed with this log, and why; which that the model names are
        none.
    """

    log: Log
    airframe: Airframe
    policy: Policy
    system: System
    bank: Bank
    signals: Signals
    lags: tuple[Lag, ...]
    residuals: Residuals
    silent: tuple[str, ...]

    def __repr__(self) -> str:
        return (
            f"<Chain of {clean(self.log.name)}: {self.airframe.name}, {self.policy.name}, "
            f"{len(self.bank.generators)} residuals>"
        )


def residuals_of(
    log: Log,
    model: str | Path | Airframe = "auto",
    policy: str | Path | Policy = "default",
    *,
    stage: Stage = lambda name, share: nullcontext(),
) -> Chain:
    """Return the residuals of a log, with all that led to them.

    Parameters
    ----------
    log : Log
    model : str, Path or Airframe
        A shipped model, a file, one that was loaded, or ``auto``: by the type of the vehicle.
    policy : str, Path or Policy
        A shipped policy, a file, or one that was loaded.
    stage : callable, optional
        A context around every stage, for who measures or tells progress.

    Raises
    ------
    LogError
        The log holds nothing that the model chosen by it could use.
    ModelError
        The model or policy is wrong, or the model named has no test with this telemetry.

    Examples
    --------
    ::

        chain = fdi.residuals_of(fdi.read("flight.tlog"))
        alarms = chain.policy.decide(chain.residuals)
        diagnosis = fdi.diagnose(alarms, chain.bank)
    """
    recipe = policy if isinstance(policy, Policy) else load_policy(policy)
    with stage("methods", 0.25):
        log, silent = with_columns(log, methods_of(recipe.methods))
    with stage("observe", 0.3):
        airframe = _airframe(log, model)
        system = airframe.observe(
            log, repeated=recipe.copies == "kept", commands=recipe.commands == "used"
        )
    _check_model(recipe, airframe)
    if recipe.calibration is not None:
        system = with_learned(system, recipe.calibration.parameters, where=recipe.name)
    with stage("derive", 0.4):
        bank = cached_bank(system, recipe.tests, integrate=recipe.integrate)
    _check(bank, log, chosen=model == "auto")
    with stage("sample", 0.5):
        signals, lags = sample(
            log,
            bank,
            recipe.sampling,
            recipe.differentiation,
            lags=recipe.latencies == "estimated",
            accuracies=recipe.accuracies == "reported",
        )
    with stage("identify", 0.55):
        bank = identified(bank, signals, recipe.differentiation)
    with stage("evaluate", 0.6):
        residuals = bank.evaluate(signals, recipe.differentiation)
    silent += tuple(_unknown_methods(airframe, log))
    return Chain(log, airframe, recipe, bank.system, bank, signals, lags, residuals, silent)


def _airframe(log: Log, model: str | Path | Airframe) -> Airframe:
    if isinstance(model, Airframe):
        return model
    return load_airframe(choose_model(log) if str(model) == "auto" else model)


def _unknown_methods(airframe: Airframe, log: Log) -> Iterator[str]:
    """Yield the methods that a model names and nobody carried out, because there are none."""
    named = {m.made_by: m.channel.source for m in airframe.measurements if m.made_by}
    for name, message in named.items():
        if name not in METHODS and message not in log:
            yield (
                f"the model takes {message} from the method {name}, which there is not "
                f"(there are {', '.join(METHODS)}): what it would show is left out"
            )


def _check(bank: Bank, log: Log, *, chosen: bool) -> None:
    """Refuse a model without a test."""
    if not bank.generators:
        # where the log chose the model, nobody named a wrong one: the log holds too little
        raise (LogError if chosen else ModelError)(
            f"has no residual generator with the telemetry of {log.name}",
            where=bank.system.name,
            hint="; ".join(bank.system.warnings[:3]) or "choose another model with --model",
        )


def _check_model(recipe: Policy, airframe: Airframe) -> None:
    """Refuse a policy that was learned for another model."""
    learned = recipe.calibration
    if learned is not None and learned.model != airframe.name:
        raise ModelError(
            f"was learned for the model {learned.model}, not for {airframe.name}", where=recipe.name
        )
