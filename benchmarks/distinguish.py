"""Are the smallest sizes of faults what they are said to be?

    .venv/bin/python benchmarks/distinguish.py [--policy] [PART OF A FLIGHT'S NAME]

In: three flights of ../shared. Out: a Markdown table by fault: the smallest size predicted (a step,
5 s, power 0.9), the same from draws of the noise through the bank itself, and how often steps of
that size and none at all raised an alarm; then for every flight how many of all faults agree within
10 %. With ``--policy`` also from which size on the default policy has an alarm in a test of that
fault, when the step is added to the flight's own channel, among 1, 1.4, 2, 2.8, ... times the
predicted size. ``--all``: rows of all faults.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from evaluation import ROOT

from fdi.chain import Chain, residuals_of
from fdi.model.evaluate import wrap
from fdi.residuals.bank import Residuals
from fdi.residuals.distinguish import at_smallest, best_test, distinguishability, smallest_size
from fdi.residuals.respond import respond
from fdi.residuals.window import Window, drawn, place_of, sources, window_of
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
LENGTH_S, ALPHA, POWER = 5.0, 5 / 3600, 0.9
DRAWS, FAULTY, AT_ONCE = 800, 300, 100
TIMES = 2.0 ** (np.arange(14) / 2)


class Trial:
    """Draws of the noise through the bank over one window, with a fault and without."""

    def __init__(self, residuals: Residuals, window: Window) -> None:
        place = place_of(residuals, window.start_s, window.length_s)
        number = {row: i for i, row in enumerate(place.rows)}
        self.rows = [
            number[int(row)] * place.samples + int(sample)
            for row, sample in zip(window.residual, window.sample, strict=True)
        ]
        self.place, self.piece = place, place.pieces(AT_ONCE)
        self.step = np.tile((np.arange(place.size) >= place.reach).astype(float), AT_ONCE)
        noise, rng = tuple(sources(place)), np.random.default_rng(1)
        self.added = [drawn(noise, rng, AT_ONCE)[0] for _ in range(DRAWS // AT_ONCE)]
        self.of = {fault.name: fault.equation for fault in residuals.bank.system.faults}
        self.quiet = np.vstack([self._moved(one) for one in self.added])

    def _moved(self, added: dict) -> np.ndarray:
        moved = self.place.seen(respond(self.piece, added))[:, self.rows]
        return np.nan_to_num(moved)  # unknown by noise: nothing is said

    def values(self, window: Window, fault: str, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the best test's values without the fault and with it, less its mean in health."""
        weights, own = best_test(window, fault), self.of[fault]
        quiet = self.quiet @ weights
        loud = [
            self._moved({**one, own: one.get(own, 0.0) + size * self.step}) @ weights
            for one in self.added[: FAULTY // AT_ONCE]
        ]
        return quiet - quiet.mean(), np.concatenate(loud) - quiet.mean()


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
    policy, every = "--policy" in sys.argv, "--all" in sys.argv
    print("| flight, fault | unit | predicted | drawn | ratio | alarms with | without |", end="")
    print(" policy, times |" if policy else "")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |" + (" ---: |" if policy else ""))
    asked = [word for word in sys.argv[1:] if not word.startswith("-")]
    limit, summary = float(smallest_size(np.array(0.5), ALPHA, 0.5)), []
    for name, (start, shown) in CASES.items():
        if asked and not any(word in name for word in asked):
            continue
        chain = residuals_of(read(FLIGHTS / name))
        window = window_of(chain.residuals, start, LENGTH_S)
        window = at_smallest(window, chain.residuals, ALPHA, POWER)
        sizes = smallest_size(distinguishability(window).detected, ALPHA, POWER)
        trial, ratios = Trial(chain.residuals, window), {}
        for fault, unit, size, at in zip(window.names, window.units, sizes, window.at, strict=True):
            if not np.isfinite(size):
                continue
            quiet, loud = trial.values(window, fault, float(np.copysign(size, at)))
            moved = loud.mean() - quiet[: len(loud)].mean()
            own = float(smallest_size((moved / size / quiet.std()) ** 2 / 2, ALPHA, POWER))
            ratios[fault] = own / float(size)
            hit, false = (np.abs(found) > limit for found in (loud, quiet))
            if not every and fault not in shown:
                continue
            row = f"| `{name}`, {fault} | {unit} | {size:.3g} | {own:.3g} | {own / size:.2f} |"
            row += f" {hit.mean():.0%} | {false.mean():.1%} |"
            if policy:
                row += f" {smallest_of_policy(chain, start, fault, float(size)):.3g} |"
            print(row, flush=True)
        off = {fault: f"{one:.2f}" for fault, one in ratios.items() if abs(one - 1) > 0.1}
        summary.append(f"{name}: {len(ratios) - len(off)} of {len(ratios)} within 10 %; {off}")
    print("\n" + "\n".join(summary))


if __name__ == "__main__":
    main()
