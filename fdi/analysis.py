"""From a log to the answer: the corridor, one readable function that calls the stages in order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from fdi import __version__
from fdi.chain import Chain, residuals_of
from fdi.decision import load_policy
from fdi.diagnosis import Diagnosis, diagnose, stood_out, with_facts
from fdi.diagnosis.advising import advised
from fdi.diagnosis.recording_end import recording_end
from fdi.diagnosis.safety_net import mistakes
from fdi.diagnosis.set_in_flight import orders_by_parameter
from fdi.errors import LogError, UsageError
from fdi.methods.estimator import EstimatorHealth, estimator_health
from fdi.methods.estimator.columns import ESTIMATOR
from fdi.methods.heading.replaced import with_recovered
from fdi.methods.setup import Check, check_setup
from fdi.model import Airframe, System
from fdi.model.choose import is_general, kind_of, made_for
from fdi.model.hints import would_test
from fdi.result import Analysis
from fdi.telemetry import Log, join, read
from fdi.telemetry.catalogue import recorded_message
from fdi.telemetry.meaning import MOTORS, unwired

Progress = Callable[[str, float], None]

STOPPED_S: Final = 10.0
"""A message that is missing for so long while others go on has stopped (chosen)."""
LEAST_RECORDS: Final = 20
"""Of fewer nobody expects the next."""


class _Watch:
    """Times the stages and tells how far the analysis is."""

    def __init__(self, progress: Progress | None) -> None:
        self.timings: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def stage(self, name: str, share: float) -> Iterator[None]:
        if self._progress:
            self._progress(name, share)
        start = time.perf_counter()
        yield
        self.timings[name] = time.perf_counter() - start


def analyze(
    path: str | Path | Log | Sequence[str | Path | Log],
    *,
    model: str | Path | Airframe = "auto",
    policy: str | Path = "default",
    window: tuple[float, float] | None = None,
    rate: float | None = None,
    budget: float | None = None,
    methods: Sequence[str] | None = None,
    recovered: str | Path | None = None,
    system: int | None = None,
    command: Sequence[str] = (),
    progress: Progress | None = None,
) -> Analysis:
    """Return the analysis of a log: the whole chain.

    Parameters
    ----------
    path : str, Path or Log, or several
        The log, or the file that holds it; of several logs of one flight, by several recorders,
        the better channel of each is used, on the clock of the first.
    model : str, Path or Airframe
        A shipped model, a file, one that was loaded, or ``auto``: by the type of the vehicle.
    policy : str or Path
        A shipped policy or a file.
    window : (float, float), optional
        From when to when, s of the log's clock, both ends included.
    rate : float, optional
        Samples per second; by default from the channels' own rates.
    budget : float, optional
        False alarms by noise that an hour in the air may hold; by default the policy's.
    methods : sequence of str, optional
        Whose columns are weighed with the model's tests; by default the policy's.
    recovered : str or Path, optional
        What ``fdi heading --recover`` wrote of this log, used in place of the block that failed.
    system : int, optional
        Which vehicle of the files, by its MAVLink system id.
    command : sequence of str
        What the user called, for the record.
    progress : callable, optional
        Is told the stage that begins and the share of work done.

    Returns
    -------
    Analysis
        The answer (``verdict``, ``findings``, ``ruled_out``, ``open``, ``not_testable``) and the
        value of every stage; ``report(folder)`` writes it, ``document()`` is its JSON.

    Raises
    ------
    LogError, ModelError, UsageError
        The log, the model or policy, or an argument is wrong.

    Examples
    --------
    >>> analysis = analyze("examples/crash_logs/copter_motor_failure_crash.tlog")
    >>> [finding.component for finding in analysis.findings]
    ['motor_1']
    """
    watch = _Watch(progress)
    with watch.stage("load", 0.0):
        recipe = load_policy(policy).resample(window=window, rate_hz=rate).within(budget)
        recipe = recipe.using(methods)
    with watch.stage("read", 0.05):
        given = [path] if isinstance(path, (str, Path, Log)) else path
        log = join([one if isinstance(one, Log) else read(one, system=system) for one in given])
        if recovered is not None:
            log = with_recovered(log, recovered)
    _check_window(window, log)
    chain = residuals_of(log, model, recipe, stage=watch.stage)
    with watch.stage("decide", 0.8):
        alarms = recipe.decide(chain.residuals)
    with watch.stage("diagnose", 0.9):
        diagnosis = _hinted(diagnose(alarms, chain.bank), chain)
        noticed = _estimator(chain)
    with watch.stage("setup", 0.95):
        checks = _setup(log)
        facts = (
            *stood_out(checks, alarms, diagnosis),
            *recording_end(log),
            *orders_by_parameter(alarms),
            *mistakes(log),
        )
        diagnosis = advised(with_facts(diagnosis, facts), chain.log, chain.bank)
    told = (
        *_choice(log, system),
        *_fit(log, chain.airframe, chosen=model == "auto"),
        *_stopped(log, chain.system),
    )
    return Analysis(
        log=chain.log,
        airframe=chain.airframe,
        policy=recipe,
        system=chain.system,
        bank=chain.bank,
        signals=chain.signals,
        lags=chain.lags,
        residual_values=chain.residuals,
        alarms=alarms,
        diagnosis=diagnosis,
        estimator=noticed,
        setup=checks,
        stood_out=facts,
        warnings=(
            *told,
            *chain.silent,
            *chain.system.warnings,
            *chain.bank.notes,
            *chain.residuals.notes(),
        ),
        timings=watch.timings,
        command=tuple(command),
        version=__version__,
    )


def _estimator(chain: Chain) -> EstimatorHealth | None:
    """Return what the autopilot's own estimator noticed, where the method is asked for."""
    if ESTIMATOR.name not in chain.policy.methods:
        return None
    try:
        return estimator_health(chain.log)
    except LogError:  # it has no such message, as `chain.silent` says
        return None


def _setup(log: Log) -> tuple[Check, ...]:
    """Return what the log shows of how the vehicle was set up, as ``fdi check`` does."""
    try:
        return check_setup(log)
    except LogError:  # it holds nothing that any check looks at
        return ()


def _hinted(diagnosis: Diagnosis, chain: Chain) -> Diagnosis:
    """Return a diagnosis that says which telemetry would test what this one cannot show."""
    untested = [one.component for one in diagnosis.not_testable]
    hints = would_test(untested, chain.airframe, chain.log, chain.system)
    told = []
    for one in diagnosis.not_testable:
        hint = hints.get(one.component)
        text = f"{one.text}; {hint}" if hint else one.text
        told.append(replace(one, text=text, wanted=hint.wanted if hint else ""))
    return replace(diagnosis, not_testable=tuple(told))


def _choice(log: Log, system: int | None) -> tuple[str, ...]:
    """Return which vehicle was taken where nobody said which."""
    others = [f"{source.system} ({source.vehicle})" for source in log.other_vehicles]
    if not others or system is not None:
        return ()
    taken = f"system {log.system_id} ({log.vehicle}) was taken, which sent most"
    return (f"there are other vehicles in the log, system {', '.join(others)}: {taken}",)


def _fit(log: Log, airframe: Airframe, *, chosen: bool) -> Iterator[str]:
    """Yield what the model does not know of this vehicle."""
    if chosen and is_general(airframe.name):
        yield (
            f"no shipped model is made for a vehicle of type {log.frame or log.vehicle}: "
            f"{airframe.name} knows what all have in common, no motors, engine or control surfaces"
        )
    fitting = made_for(airframe.name)
    own = kind_of(log)
    if fitting and not is_general(airframe.name) and own not in fitting:
        yield f"{airframe.name} is a model of {', '.join(fitting)}, and the log is of {own}"
    if any(measurement.channel.source == MOTORS for measurement in airframe.measurements):
        yield from unwired(log.messages, log.parameters, log.autopilot, log.vehicle)


def _stopped(log: Log, system: System) -> Iterator[str]:
    """Yield the messages of the model that stop long before the last; those together in a line."""
    read = sorted({reading.channel.source for reading in system.channels})
    used = {source: log[source].t for source in read if source in log}  # not what a method makes
    end = max((t[-1] for t in used.values() if len(t)), default=0.0)
    stops: dict[float, set[str]] = {}
    for source, t in sorted(used.items(), key=lambda item: float(item[1][-1:].sum())):
        if len(t) >= LEAST_RECORDS and end - t[-1] > max(STOPPED_S, 5 * np.median(np.diff(t))):
            near = next((at for at in stops if t[-1] - at <= STOPPED_S), float(t[-1]))
            told_by = recorded_message(source)
            goes_on = told_by in log and log[told_by].t[-1] - t[-1] > STOPPED_S
            stops.setdefault(near, set()).add(source if goes_on else told_by)
    for at, names in stops.items():
        stop, show = ("stops", "it shows") if len(names) == 1 else ("stop", "they show")
        yield (
            f"{', '.join(sorted(names))} {stop} at {at:.1f} s, {end - at:.1f} s before the other "
            f"messages do: what {show} is unknown from then on"
        )


def _check_window(window: tuple[float, float] | None, log: Log) -> None:
    """Refuse a window that holds nothing of the log."""
    if window is not None and (window[1] < log.span[0] or window[0] > log.span[1]):
        raise UsageError(
            f"the window {window[0]:g}:{window[1]:g} lies outside the log, which spans "
            f"{log.span[0]:z.1f} to {log.span[1]:.1f} s",
            where=log.name,
        )
