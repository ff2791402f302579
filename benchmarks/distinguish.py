"""Are the smallest sizes of faults what they are said to be?

    .venv/bin/python benchmarks/distinguish.py [--policy] [PART OF A FLIGHT'S NAME]

In: three flights of ../shared. Out: a Markdown table by fault: the smallest size predicted (a step,
5 s, power 0.9), the same from draws of the noise through the bank itself, and how often steps of
that size and none at all raised an alarm. With ``--policy`` also from which size on the default
policy has an alarm in a test of that fault, when the step is added to the flight's own channel,
among 1, 1.4, 2, 2.8, ... times the predicted size.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from evaluation import ROOT

from fdi.chain import Chain, residuals_of
from fdi.model.evaluate import wrap
from fdi.residuals.bank import Residuals
from fdi.residuals.distinguish import (
    Window,
    best_test,
    distinguishability,
    smallest_size,
    window_of,
)
from fdi.residuals.respond import respond, stretch
from fdi.telemetry import read

FLIGHTS = ROOT.parent / "shared" / "flights"
CASES = {
    "sitl/copter/c03_ref_square_wind.tlog": (
        60.0,
        ("GPS_RAW_INT.vel", "RAW_IMU.xgyro", "SCALED_PRESSURE.press_abs", "RAW_IMU.zacc"),
    ),
    "sitl/plane/p01_rect_calm.tlog": (
        60.0,
        ("GPS_RAW_INT.vel", "VFR_HUD.airspeed", "RAW_IMU.ygyro", "SCALED_PRESSURE.press_abs"),
    ),
    "sitl/copter/c02_hover_calm.tlog": (60.0, ("GPS_RAW_INT.alt", "RAW_IMU.zgyro", "RAW_IMU.xacc")),
}
LENGTH_S, ALPHA, POWER, DRAWS = 5.0, 5 / 3600, 0.9, 300
TIMES = 2.0 ** (np.arange(14) / 2)


def drawn(
    residuals: Residuals, window: Window, start: float, fault: str, size: float
) -> np.ndarray:
    """Return the values of the best test over draws of the noise, with and without the fault."""
    rng = np.random.default_rng(1)
    bank, step = residuals.bank, 1 / residuals.signals.rate_hz
    first = int(np.searchsorted(residuals.t, start - step / 2))
    count, reach = round(LENGTH_S / step), _reach(residuals)
    piece = stretch(residuals, slice(first - reach, first + count + reach))
    weights = best_test(window, fault)
    own = next(f.equation for f in bank.system.faults if f.name == fault)
    n = len(piece.t)
    found = np.zeros((2, DRAWS))
    for draw in range(DRAWS):
        added = {}
        for number, equation in enumerate(bank.system.equations):
            m = equation.measurement
            if m is not None and m.accuracy is not None:
                share = min((m.jitter or m.accuracy) / m.accuracy, 1.0)
                fast = share * rng.standard_normal(n)
                slow = np.sqrt(1 - share**2) * rng.standard_normal()
                added[number] = m.accuracy * (fast + slow)
            elif equation.tolerance:
                added[number] = np.full(n, equation.tolerance / 2 * rng.standard_normal())
        for case, moved in enumerate((0.0, size)):
            step_of = {own: added.get(own, 0.0) + moved * (np.arange(n) >= reach)}
            change = respond(piece, {**added, **step_of})
            values = change[window.residual, reach + window.sample]
            found[case, draw] = weights @ np.nan_to_num(values)  # unknown by noise: nothing is said
    return found


def _reach(residuals: Residuals) -> int:
    from fdi.residuals.distinguish import _usable

    longest = max(residuals.delay_s[row] for row in _usable(residuals))
    return round(longest * residuals.signals.rate_hz)


def smallest_of_policy(chain: Chain, start: float, fault: str, size: float) -> float:
    """Return from which size on the policy has an alarm in a test of the fault, inf if none."""
    bank, signals = chain.bank, chain.signals
    own = next(f for f in bank.system.faults if f.name == fault)
    channel = bank.system.equations[own.equation].measurement.channel
    tests = [i for i, g in enumerate(bank.generators) if fault in g.faults]
    when = (signals.t >= start) & (signals.t < start + LENGTH_S)
    before = chain.policy.decide(chain.residuals).state[tests][:, when] == 1
    for times in TIMES:
        column = signals.columns[channel] + times * size * (signals.t >= start)
        if bank.system.variables[bank.system.equations[own.equation].measurement.variable].circular:
            column = wrap(column)
        changed = replace(signals, columns={**signals.columns, channel: column})
        alarms = chain.policy.decide(bank.evaluate(changed, chain.residuals.recipe))
        if ((alarms.state[tests][:, when] == 1) & ~before).any():
            return float(times)
    return np.inf


def main() -> None:
    """Print the table."""
    policy = "--policy" in sys.argv
    print("| flight, fault | unit | predicted | drawn | ratio | alarms with | without |", end="")
    print(" policy, times |" if policy else "")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |" + (" ---: |" if policy else ""))
    asked = [word for word in sys.argv[1:] if not word.startswith("-")]
    for name, (start, faults) in CASES.items():
        if asked and not any(word in name for word in asked):
            continue
        chain = residuals_of(read(FLIGHTS / name))
        known = {fault.name for fault in chain.bank.system.faults}
        names = [fault for fault in faults if fault in known]
        window = window_of(chain.residuals, start, LENGTH_S, faults=names)
        sizes = smallest_size(distinguishability(window).detected, ALPHA, POWER)
        for fault, unit, size in zip(names, window.units, sizes, strict=True):
            quiet, loud = drawn(chain.residuals, window, start, fault, float(size))
            limit = float(smallest_size(np.array(0.5), ALPHA, 0.5))
            per_unit = (loud.mean() - quiet.mean()) / size / quiet.std()
            own = float(smallest_size(per_unit**2 / 2, ALPHA, POWER))
            hit, false = (np.abs(found) > limit for found in (loud, quiet))
            row = f"| `{name}`, {fault} | {unit} | {size:.3g} | {own:.3g} | {own / size:.2f} |"
            row += f" {hit.mean():.0%} | {false.mean():.1%} |"
            if policy:
                row += f" {smallest_of_policy(chain, start, fault, float(size)):.3g} |"
            print(row, flush=True)


if __name__ == "__main__":
    main()
