"""Small systems from text, and alarms set by hand: what the diagnose stage is given."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fdi.decision import Alarms, load_policy
from fdi.diagnosis.likelihood import Fitted
from fdi.model import load_airframe
from fdi.residuals import Residuals, build_bank
from fdi.telemetry import Flight, Signals
from fdi.telemetry.events import flight_state

RATE = 4.0
READING = 1e-12
"""Of every channel: next to nothing, but a channel that reads 0 all along measures nothing."""
THRESHOLD = 2.0
CONFIRM_S = 1.25
POLICY = load_policy("default")
FLIGHTS = (Flight(0, 100),)
WEIGHTS = Fitted(
    {
        "one": -4.0,
        "tests": 3.5,
        "alone": 2.5,
        "fit": 5.5,
        "near": 1.5,
        "quiet": 0.5,
        "healed": -0.75,
        "late": -1.5,
        "explains": 1.5,
        "computed": -4.5,
        "controller": -3.0,
    },
    0.99,
)
"""Round numbers with the signs that weights have: no test here depends on a fit."""


def model(shown, affects=None, more="", unit="m"):
    """A model where every component shows the variables that ``shown`` lists for it.

    A channel is named by component and variable: ``GPS.x``. ``affects`` also gives the order.
    """
    affects = dict.fromkeys(shown, ()) | (affects or {})
    variables = sorted({name for names in shown.values() for name in names})
    lines = ["format: 1", "name: small", "components:"]
    lines += [f"  {c}: {{affects: [{', '.join(to)}]}}" for c, to in affects.items()]
    lines += ["variables:", *(f"  {v}: {{unit: {unit}}}" for v in variables)]
    lines += ["measurements:"]
    for component, names in shown.items():
        if names:
            lines += [f"  {component.upper()}:", f"    component: {component}", "    fields:"]
        lines += [f"      {name}: {{variable: {name}, accuracy: 1 {unit}}}" for name in names]
    return "\n".join(lines) + "\n" + more


def bank_of(text, tests="mtes+cross_checks"):
    with TemporaryDirectory() as folder:
        path = Path(folder) / "small.yaml"
        path.write_text(text, encoding="utf-8")
        return build_bank(load_airframe(path).observe(), tests)


def row(bank, *faults):
    """The residual whose signature is ``faults``."""
    (found,) = [i for i, g in enumerate(bank.generators) if set(g.faults) == set(faults)]
    return found


def limit_row(bank, name):
    """The residual that is the limit of that name."""
    equations = bank.system.equations
    (found,) = [i for i, g in enumerate(bank.generators) if equations[g.residual].name == name]
    return found


def alarms_of(
    bank,
    raised,
    *,
    unknown=None,
    flights=FLIGHTS,
    seconds=100,
    peak=3.0,
    policy=POLICY,
    ends=(),
    events=(),
    **changes,
):
    """Alarms of a bank: ``raised`` and ``unknown`` are rows with the intervals, s, of each.

    Each interval ends where the next sample would be quiet; the residual is ``peak`` times its
    threshold of 2 in there, and 0 elsewhere.
    """
    count, t = len(bank.generators), np.arange(round(seconds * RATE)) / RATE
    alarm, blank = np.zeros((2, count, len(t)), dtype=bool)
    for mask, where in ((alarm, raised), (blank, unknown or {})):
        for place, intervals in where.items():
            for start, end in intervals:
                mask[place, (t >= start) & (t < end)] = True
    state = np.where(blank, -1, alarm.astype(int)).astype(np.int8)
    shown, strength = peak * alarm, np.where(blank, np.nan, abs(peak) * alarm)
    zero = np.zeros(count)
    every = np.zeros((count, len(t)))
    columns = {request.channel: np.full(len(t), READING) for request in bank.system.channels}
    period = dict.fromkeys(columns, 1 / RATE)
    state_ = flight_state(t, events, flights)
    signals = Signals(
        t, columns, period, state_, RATE, tuple(events), flights, {}, "by hand", ends=ends
    )
    response = np.full((count, len(bank.system.faults)), np.nan)
    residuals = Residuals(
        bank,
        THRESHOLD * np.where(blank, np.nan, shown),
        every + 0.4,
        every,
        every,
        every,
        zero,
        zero,
        response,
        signals,
        POLICY.differentiation,
    )
    threshold = np.full(state.shape, THRESHOLD)
    made = Alarms(
        residuals,
        policy.use,
        threshold,
        zero,
        state,
        alarm,
        strength,
        certain=_certain(alarm),
        delay_s=zero,
        unfit=np.zeros(count, bool),
        mean=np.full(state.shape, np.nan),
        mean_threshold=np.full(state.shape, np.nan),
        stray=zero,
        scatter=np.full(state.shape, np.nan),
    )
    return replace(made, **changes)


def _certain(alarm):
    """From ``CONFIRM_S`` after the beginning of every alarm on."""
    late = round(CONFIRM_S * RATE)
    certain = alarm.copy()
    for place in range(alarm.shape[1]):
        certain[:, place] = alarm[:, max(0, place - late) : place + 1].all(axis=1) & (place >= late)
    return certain


def named(items):
    """The components of findings, consequences and the like, in order."""
    return [item.component for item in items]
