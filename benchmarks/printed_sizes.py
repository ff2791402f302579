"""Is what is ruled out really out, and would the printed sizes have shown?

    .venv/bin/python benchmarks/printed_sizes.py labelled [--every N] [LABELS ...]
    .venv/bin/python benchmarks/printed_sizes.py injected [LOG ...]

``labelled``: over flights with labels (../shared/flights, and files given), who is ruled out how
often, and how often one that failed. ``injected``: into healthy logs of every format a change of
each printed size is put, 1 and 1.5 times as large, in each direction for which it is printed, from
the middle of the flight to its end: into one channel, and into all channels of its kind alike. Out:
Markdown tables; what is ruled out wrongly must be none.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
from evaluation import LABELS

from fdi.chain import residuals_of
from fdi.decision import Alarms
from fdi.diagnosis import Diagnosis, WouldShow, diagnose
from fdi.errors import FdiError
from fdi.evaluation import load_labels
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import InjectedFault
from fdi.model import System
from fdi.telemetry import Log, read
from fdi.telemetry.airtime import time_in_air

HEALTHY: Final = (
    "sitl/plane/p02_rect_wind_land.tlog",
    "sitl/plane/p01_rect_calm.BIN",
    "sitl/copter/c01_ref_slow_line.tlog",
    "sitl/copter/c01_ref_slow_line.BIN",
    "healthy/no_battery_monitor.ulg",
    "healthy/quad_short.bin",
    "real/pyulog_sample.ulg",
    "alfa/no_failure_2.tlog",
)
"""Landed or not, recorded and simulated, of all three formats that can be rewritten."""
TIMES: Final = (1.02, 1.5)


def analysed(path: Path) -> tuple[Log, Alarms, Diagnosis]:
    """Return a log with what its alarms say."""
    log = read(path)
    chain = residuals_of(log)
    alarms = chain.policy.decide(chain.residuals)
    return log, alarms, diagnose(alarms, chain.bank)


def labelled(files: Sequence[Path], every: int) -> None:
    """Print who is ruled out on flights with labels, and who of them had failed."""
    cleared: Counter[str] = Counter()
    wrong: list[str] = []
    flights = faulty = 0
    for label in [one for file in files for one in load_labels(file)][::every]:
        if label.use != "diagnosis":
            continue
        try:
            _, _, found = analysed(label.path)
        except FdiError as error:
            print(f"{label.key}: {error}", file=sys.stderr)
            continue
        flights, faulty = flights + 1, faulty + bool(label.faults)
        own = [one.component for one in found.ruled_out]
        cleared.update(own)
        failed = {fault.component for fault in label.faults}
        wrong += [f"{label.key}: {name}" for name in own if name in failed]
        told = "; ".join(f"{one.component}: {one.text}" for one in found.ruled_out)
        print(f"{label.key}: {told or 'nobody'}", file=sys.stderr, flush=True)
    print(f"\n{flights} flights, {faulty} with a fault; ruled out wrongly: {len(wrong)}")
    print("\n".join(wrong))
    print("\n| ruled out | flights |\n| --- | ---: |")
    for name, count in cleared.most_common():
        print(f"| {name} | {count} |")


def into(log: Log, channels: Sequence[str], change: float, start: float, folder: Path) -> Path:
    """Return a file in which channels read so much more from a moment on."""
    for number, channel in enumerate(channels):
        data = injected(log, InjectedFault(channel, "bias", change, start, float("inf")))
        path = folder / f"{number}{Path(log.name).suffix}"
        path.write_bytes(data)
        log = read(path)
    return path


def of_channel(
    change: float, one: WouldShow, channels: Sequence[str], log: Log, air: tuple[float, float]
) -> float:
    """Return a change in the unit of the channels: of a level, that of what it is a level of.

    By the medians in the air, the largest of them: the level of no channel rises by less there.
    """
    if one.unit != "dB":
        return change
    told = [log.channel(name) for name in channels]
    inside = [one.value[(one.t >= air[0]) & (one.t < air[1])] for one in told]
    usual = max(float(np.nanmedian(values)) for values in inside)
    return (1.0 + usual) * (10.0 ** (change / 20.0) - 1.0)


def groups(one: WouldShow, component: str, system: System) -> Iterator[tuple[str, list[str]]]:
    """Yield the channel of a size, and all channels of its part that show the same unit."""
    own = {
        fault.name: system.variables[shown.variable].unit
        for fault in system.faults
        if fault.component == component
        and (shown := system.equations[fault.equation].measurement) is not None
        and not shown.behaviour
    }
    if one.fault in own:
        alike = [name for name, unit in own.items() if unit == one.unit]
        yield "one channel", [one.fault]
        if len(alike) > 1:
            yield "all alike", alike


def put_in(paths: Sequence[Path]) -> None:
    """Print what became of changes of the printed sizes."""
    made: Counter[tuple[str, str, float]] = Counter()
    noticed, still = (Counter[tuple[str, str, float]]() for _ in range(2))
    for path in paths:
        log, alarms, found = analysed(path)
        low, high = max(time_in_air(alarms.residuals.signals), key=lambda span: span[1] - span[0])
        before = {row for row in range(len(alarms.alarm)) if alarms.alarm[row].any()}
        for item in found.ruled_out:
            for one in item.would_show:
                signs = {"changes": (1, -1), "rises": (1,), "falls": (-1,)}.get(one.how, ())
                for kind, channels in groups(one, item.component, alarms.residuals.bank.system):
                    for sign, times in ((s, t) for s in signs for t in TIMES):
                        change = sign * times * one.size
                        with TemporaryDirectory() as folder:
                            try:
                                start = (low + high) / 2
                                put = of_channel(change, one, channels, log, (start, high))
                                own = into(log, channels, put, start, Path(folder))
                                _, then, said = analysed(own)
                            except FdiError as error:
                                print(f"{path.name} {one.fault}: {error}", file=sys.stderr)
                                continue
                        raised = {row for row in range(len(then.alarm)) if then.alarm[row].any()}
                        key = (item.component, kind, times)
                        made[key] += 1
                        noticed[key] += bool(raised - before)
                        out = item.component in {one.component for one in said.ruled_out}
                        still[key] += out
                        if out or not raised - before:
                            print(
                                f"{path.name} {one.fault} {change:+.3g} {kind}: "
                                f"{'ruled out' if out else 'not noticed'}",
                                file=sys.stderr,
                            )
    print("| part | changed | times the size | put in | noticed | ruled out wrongly |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    for key in sorted(made):
        name, kind, times = key
        print(f"| {name} | {kind} | {times:g} | {made[key]} | {noticed[key]} | {still[key]} |")


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(description="Check what is ruled out.")
    parser.add_argument("what", choices=["labelled", "injected"])
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--every", type=int, default=1, help="take every Nth flight")
    asked = parser.parse_args()
    if asked.what == "labelled":
        labelled(asked.files or [LABELS], asked.every)
    else:
        put_in(asked.files or [LABELS.parent / name for name in HEALTHY])


if __name__ == "__main__":
    main()
