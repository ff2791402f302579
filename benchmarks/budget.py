"""Does noise alarm as often as the budget says, as docs/evaluation.md tells?

    .venv/bin/python benchmarks/budget.py [--write] [--hours H] [--every K]

On each healthy flight of ../shared/flights the scale of the thresholds for 0.1, 1 and 10 false
alarms per flight hour is taken as an analysis takes it. Then the flight's noise is generated anew,
with other seeds and by other code than the estimate has (a recursion in time, innovations drawn as
they are), for many more hours, and judged as an analysis judges: the original flight's thresholds
times the scale, and persistence. What is counted are alarms, those within 10 s as one, and beside
them the accusations that the whole diagnosis makes of them. ``--write`` puts the table between the
markers of docs/evaluation.md.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from fdi.chain import residuals_of
from fdi.decision import load_policy
from fdi.decision.alarms import Alarms, Use
from fdi.decision.bounds import Bounds, learn
from fdi.decision.budget import STRETCH_S, Noise, noise_of, scale_for, simulated
from fdi.decision.judging import judge
from fdi.decision.resampling import ROUNDING
from fdi.diagnosis.alarm_runs import find_runs
from fdi.diagnosis.answer import causes_of
from fdi.errors import FdiError
from fdi.residuals import Residuals
from fdi.telemetry import Flight, read
from fdi.telemetry.airtime import time_in_air

ROOT = Path(__file__).resolve().parents[1]
FLIGHTS = ROOT.parent / "shared" / "flights"
PAGE = ROOT / "docs" / "evaluation.md"
BUDGETS: Final = (0.1, 1.0, 10.0)
HOURS: Final = {0.1: 30.0, 1.0: 12.0, 10.0: 3.0}
"""To be generated per flight, so that the rarer alarms are counted too."""
AT_ONCE: Final = 20_000  # samples
PAUSE_S: Final = 30.0  # between generated flights: no alarm reaches across
RUN_UP: Final = 200  # samples before a generated flight, to forget how the recursion began
USE: Final = Use("majority", True, 0.0)


def generated(noise: Noise, flights: int, rng: np.random.Generator) -> np.ndarray:
    """Return new noise, (r, flights, n), from the model's filters by a recursion in time."""
    model = noise.model
    order = model.whitening.shape[1] - 1
    size = model.samples + RUN_UP
    rows, moments = model.innovations.shape
    out = np.zeros((size + order, rows, flights))
    past = -model.whitening[:, :0:-1].T[:, :, None]  # oldest first
    spread = np.zeros(rows)
    for step in range(size):
        drawn = model.innovations[:, rng.integers(0, moments, flights)]
        out[step + order] = drawn + (past * out[step : step + order]).sum(axis=0)
    out = out[order + RUN_UP :].transpose(1, 2, 0)
    spread = out.std(axis=(1, 2))
    varies = spread > ROUNDING * model.deviation
    scale = np.divide(model.deviation, spread, out=np.zeros(rows), where=varies)
    return out * scale[:, None, None] + model.mean[:, None, None]


def moments(alarms: Alarms) -> int:
    """Return how many alarms there are, those within a stretch of each other counted once."""
    count = 0
    for start, end in time_in_air(alarms.residuals.signals):
        last = -np.inf
        for run in find_runs(alarms, start, end):
            count += run.onset > last + STRETCH_S
            last = run.onset
    return count


class Subject:
    """A healthy flight, its noise and its thresholds."""

    def __init__(self, path: Path) -> None:
        self.policy = load_policy("default")
        self.recipe = self.policy.decision
        self.residuals = residuals_of(read(path), policy=self.policy).residuals
        self.bounds = learn(self.residuals, self.recipe)
        self.alarms = judge(self.residuals, self.bounds, self.recipe, USE)
        self.noise = noise_of(self.alarms, self.bounds)

    def scale(self, budget: float) -> float:
        """Return the scale that an analysis takes for a budget."""
        return scale_for(budget, self.noise, self.recipe)

    def counted(self, drawn: np.ndarray, scale: float) -> np.ndarray:
        """Return how many alarms and findings generated flights, (r, k, n), have at a scale."""
        if not drawn.shape[1]:
            return np.zeros(2, int)
        residuals, bounds = self._laid_out(drawn)
        alarms = judge(residuals, bounds, self.recipe, USE, scale)
        return np.array([moments(alarms), len(causes_of(alarms))])

    def _laid_out(self, drawn: np.ndarray) -> tuple[Residuals, Bounds]:
        """Return generated flights one after another, as one log of several flights."""
        noise, signals = self.noise, self.residuals.signals
        count = drawn.shape[1]
        pause = round(PAUSE_S * noise.rate_hz)

        def times(array: np.ndarray, blank: float = np.nan) -> np.ndarray:
            padded = np.full((len(array), array.shape[1] + pause), blank)
            padded[:, : array.shape[1]] = array
            return np.tile(padded, count)

        values = drawn * noise.unit[:, None] + noise.bounds.told.centre[:, None, None]
        values = np.where(noise.known[:, None], values, np.nan)
        # what the model states, and what is not judged, stays quiet
        varies = np.isin(np.arange(len(values)), noise.rows)
        still = np.where(noise.known | noise.bounds.told.stated[:, None], 0.0, np.nan)
        values[~varies] = still[~varies][:, None] + noise.bounds.told.centre[~varies, None, None]
        padded = np.full((*values.shape[:2], values.shape[2] + pause), np.nan)
        padded[..., : values.shape[2]] = values
        t = np.arange(padded.shape[1] * padded.shape[2]) / noise.rate_hz
        length = padded.shape[2] / noise.rate_hz
        first = signals.t[noise.first]
        flights = []
        for number in range(count):
            for start, end in time_in_air(signals):
                begin, stop = (number * length + x - first for x in (start, end))
                stop = min(stop, number * length + values.shape[2] / noise.rate_hz)
                flights.append(Flight(begin, stop, takeoff=begin, landing=stop))
        residuals = replace(
            self.residuals,
            values=padded.reshape(len(values), -1),
            spread=times(noise.bounds.spread),
            signals=replace(signals, t=t, flights=tuple(flights), columns={}),
        )
        bounds = replace(
            noise.bounds,
            tolerance=times(noise.bounds.tolerance),
            noise=times(noise.bounds.noise),
            spread=times(noise.bounds.spread, 0.0),
            settled=times(noise.bounds.settled[None].astype(float), 0.0)[0] > 0,
            mean_spread=times(noise.bounds.mean_spread),
            mean_bound=times(noise.bounds.mean_bound),
        )
        return residuals, bounds


Measured = dict[float, tuple[float, np.ndarray, float]]


def measured(subject: Subject, share: float, seed: int) -> Measured:
    """Return, by budget, the scale, alarms and accusations, and the hours they were counted in."""
    noise, rng = subject.noise, np.random.default_rng(seed)
    scales = {budget: subject.scale(budget) for budget in BUDGETS}
    counts = {budget: np.zeros(2, int) for budget in BUDGETS}
    hours = dict.fromkeys(BUDGETS, 0.0)
    flights = max(1, AT_ONCE // noise.model.samples)
    while hours[BUDGETS[0]] < share * HOURS[BUDGETS[0]]:
        drawn = generated(noise, flights, rng)
        found = simulated(noise, drawn[noise.rows], subject.recipe)
        highest = np.max([own.max(axis=1) for own in found.values()], axis=0)
        for budget, scale in scales.items():
            if hours[budget] < share * HOURS[budget]:
                heard = np.flatnonzero(highest > scale)
                counts[budget] += subject.counted(drawn[:, heard], scale)
                hours[budget] += flights * noise.hours
    return {budget: (scales[budget], counts[budget], hours[budget]) for budget in BUDGETS}


def table(results: dict[str, Measured]) -> str:
    """Return the figures as text for docs/evaluation.md."""
    lines = [
        "| asked for, per hour | alarms, all flights | accusations | flights within a factor of 3 |"
        " of 2 | hours | scale: median (least to most) |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for budget in BUDGETS:
        own = [result[budget] for result in results.values()]
        (total, accused), hours = sum(n for _, n, _ in own), sum(h for _, _, h in own)
        rates = np.array([n[0] / h for _, n, h in own])
        within = [int(((rates >= budget / k) & (rates <= budget * k)).sum()) for k in (3, 2)]
        scales = [scale for scale, _, _ in own]
        lines.append(
            f"| {budget:g} | **{total / hours:.2g}** ({total}) | {accused / hours:.2g} |"
            f" {within[0]} of {len(own)} | {within[1]} of {len(own)} | {hours:.0f} |"
            f" {np.median(scales):.2f} ({min(scales):.2f} to {max(scales):.2f}) |"
        )
    return "\n".join(lines)


def main() -> int:
    """Measure, print, and write where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    parser.add_argument("--hours", type=float, default=HOURS[0.1], help="per flight, for 0.1")
    parser.add_argument("--every", type=int, default=1, help="only every so manieth flight")
    parser.add_argument("--first", type=int, default=0, help="which flight to begin with")
    given = parser.parse_args()
    if not FLIGHTS.is_dir():
        print(f"skipped: {FLIGHTS} is not here")
        return 0
    labels = json.loads((FLIGHTS / "labels.json").read_text("utf-8"))["flights"]
    healthy = [n for n, x in labels.items() if x["use"] == "diagnosis" and not x["faults"]]
    results = {}
    for number, name in enumerate(healthy[given.first :: given.every]):
        begun = time.process_time()
        try:
            subject = Subject(FLIGHTS / name)
        except FdiError as error:
            print(f"{name}: {error}", file=sys.stderr)
            continue
        if not len(subject.noise.rows):
            continue
        results[name] = measured(subject, given.hours / HOURS[0.1], seed=1000 + number)
        told = ", ".join(
            f"{b:g}/h: scale {s:.2f}, {n} in {h:.1f} h" for b, (s, n, h) in results[name].items()
        )
        print(f"{name}: {told} ({time.process_time() - begun:.0f} s)", flush=True)
    print(table(results))
    if given.write:
        from evaluation import put

        put(
            f"`benchmarks/budget.py --hours {given.hours:g}` printed:\n\n{table(results)}", "budget"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
