"""Do real flights show injected steps from the sizes on that their noise foretells?

    .venv/bin/python benchmarks/injected.py [PART OF A FLIGHT'S NAME]

In: an ArduPilot and a PX4 flight of ../shared. A step of 5 s is added to a channel at four moments
of the flight, at 1/4 to 4 times the size that is said to be seen there. Out: a Markdown table by
fault and size: how many steps should be seen, how many the best test of each window sees in the
flight's own residuals (less their medians over the flight), and at how many the default policy
raises an alarm in a test of that fault that it does not raise on the flight as it is. Size 0 is the
flight as it is: what a best test says there is false.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from evaluation import ROOT
from scipy.special import ndtr, ndtri

from fdi.chain import Chain, residuals_of
from fdi.model.evaluate import wrap
from fdi.residuals.distinguish import at_smallest, best_test, distinguishability, smallest_size
from fdi.residuals.window import Window, window_of
from fdi.telemetry import read
from fdi.telemetry.airtime import time_in_air

FLIGHTS = ROOT.parent / "shared" / "flights"
NAMES = ("real/forum_13645_7.bin", "healthy/no_battery_monitor.ulg")
COMPONENTS = ("gps", "compass", "barometer", "accelerometer", "gyroscope", "airspeed")
LENGTH_S, ALPHA = 5.0, 5 / 3600
SIZES = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
PLACES = (0.2, 0.4, 0.6, 0.8)


def foretold(times: float) -> float:
    """Return the share of steps that the best test sees, if the noise is as stated."""
    limit = ndtri(1 - ALPHA / 2)
    mean = times * (limit + ndtri(0.9))
    return float(ndtr(mean - limit) + ndtr(-mean - limit))


def chosen(chain: Chain) -> list[str]:
    """Return the channels of the components that are asked about."""
    equations = chain.bank.system.equations
    return [
        fault.name
        for fault in chain.bank.system.faults
        if fault.component in COMPONENTS and equations[fault.equation].measurement is not None
    ]


def firsts(chain: Chain, sizes: np.ndarray, names: tuple[str, ...]) -> dict[str, str]:
    """Return of every component the first channel that has a size in most of the windows."""
    of = {fault.name: fault.component for fault in chain.bank.system.faults}
    known = np.isfinite(sizes).sum(axis=0)
    found: dict[str, str] = {}
    for name in sorted(names, key=lambda one: -known[names.index(one)]):
        if known[names.index(name)]:
            found.setdefault(of[name], name)
    return {component: found[component] for component in COMPONENTS if component in found}


def rows(chain: Chain, windows: list[Window], sizes: list[float], fault: str) -> list[str]:
    """Return the rows of the table of one fault; sizes are signed, one for each window."""
    bank, signals = chain.bank, chain.signals
    own = next(f for f in bank.system.faults if f.name == fault)
    measurement = bank.system.equations[own.equation].measurement
    circular = bank.system.variables[measurement.variable].circular
    tests = [i for i, g in enumerate(bank.generators) if fault in g.faults]
    when = [(signals.t >= one.start_s) & (signals.t < one.start_s + LENGTH_S) for one in windows]
    usual = np.nanmedian(chain.residuals.values, axis=1)
    weights = [best_test(window, fault) for window in windows]
    before = chain.policy.decide(chain.residuals).alarm[tests]
    limit = float(ndtri(1 - ALPHA / 2))
    table = []
    for times in SIZES:
        column = signals.columns[measurement.channel].copy()
        for one, during in zip(sizes, when, strict=True):
            column[during] += times * one
        column = wrap(column) if circular else column
        changed = replace(signals, columns={**signals.columns, measurement.channel: column})
        residuals = bank.evaluate(changed, chain.residuals.recipe)
        alarm = chain.policy.decide(residuals).alarm[tests]
        off = residuals.values - usual[:, None]
        best = [
            abs(_best(window, own, off, residuals.t)) > limit
            for window, own in zip(windows, weights, strict=True)
        ]
        alarms = [(alarm[:, during] & ~before[:, during]).any() for during in when]
        table.append(
            f"| {fault} | {np.median(np.abs(sizes)):.3g} | {times:g} | {foretold(times):.0%} "
            f"| {sum(best)} of {len(best)} | {sum(alarms)} of {len(alarms)} |"
        )
    return table


def _best(window: Window, weights: np.ndarray, values: np.ndarray, t: np.ndarray) -> float:
    first = int(np.searchsorted(t, window.start_s - 0.5 * (t[1] - t[0])))
    return float(weights @ np.nan_to_num(values[window.residual, first + window.sample]))


def main() -> None:
    """Print the tables."""
    asked = sys.argv[1:]
    for name in NAMES:
        if asked and not any(word in name for word in asked):
            continue
        chain = residuals_of(read(FLIGHTS / name))
        low, high = max(time_in_air(chain.signals), key=lambda span: span[1] - span[0])
        starts = [low + place * (high - low) for place in PLACES]
        windows = [
            at_smallest(
                window_of(chain.residuals, start, LENGTH_S, faults=chosen(chain)),
                chain.residuals,
                ALPHA,
            )
            for start in starts
        ]
        sizes = np.array(
            [smallest_size(distinguishability(one).detected, ALPHA) for one in windows]
        )
        print(f"\n`{name}`, steps at {', '.join(f'{start:.0f}' for start in starts)} s\n")
        print("| fault | smallest size | times | foretold | best test | policy |")
        print("| --- | ---: | ---: | ---: | ---: | ---: |")
        for fault in firsts(chain, sizes, windows[0].names).values():
            place = windows[0].names.index(fault)
            known = [i for i in range(len(windows)) if np.isfinite(sizes[i, place])]
            sign = [-1.0 if windows[i].at[place] < 0 else 1.0 for i in known]
            signed = [s * float(sizes[i, place]) for s, i in zip(sign, known, strict=True)]
            print("\n".join(rows(chain, [windows[i] for i in known], signed, fault)), flush=True)


if __name__ == "__main__":
    main()
