"""Do the sizes of faults that findings state hold, and how often within two of their sigmas?

    .venv/bin/python benchmarks/direction.py [--only PATTERN] [--inject LOG ...] [--workers N]

Analyses the flights in ../shared/flights whose labels state a size with a unit ("11.1 m to the
east") for a step, bias or drift of a sensor, and prints what the first finding about that sensor
says. With ``--inject`` a bias of 16 and a drift of 2 accuracies a second are put into each of a few
channels of healthy logs instead, at two moments of each.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, Final

import fdi
from fdi.diagnosis import Size

ROOT = Path(__file__).resolve().parents[1]
FLIGHTS = ROOT.parent / "shared" / "flights"
KINDS: Final = {"step", "bias", "ramp"}
STATED: Final = re.compile(r"-?([\d.]+) (m/s2|m/s|m|rad/s|mGauss)\b")
SI: Final = {"mGauss": 1e-7}
CHANNELS: Final = (
    *(f"GPS_RAW_INT.{field}" for field in ("lat", "vel", "alt")),
    *(f"RAW_IMU.{field}" for field in ("xacc", "ygyro", "ymag")),
    "SCALED_PRESSURE.press_abs",
    "VFR_HUD.airspeed",
)
EARLY_S: Final = 2.0
MOMENTS: Final = (0.8 / 3, 1.6 / 3)
"""Shares of the time in the air, two moments as `fdi evaluate --inject` takes them."""


def labelled(pattern: str) -> Iterator[tuple[str, str, float, str, float]]:
    """Yield flight, component, size, what the label says, and onset."""
    flights = json.loads((FLIGHTS / "labels.json").read_text("utf-8"))["flights"]
    for key, label in flights.items():
        for fault in label["faults"][:1] if fnmatch(key, pattern) else ():
            stated = STATED.match(str(fault["size"]))
            if label["use"] == "diagnosis" and fault["kind"] in KINDS and stated:
                size = float(stated[1]) * SI.get(stated[2], 1.0)
                yield key, fault["component"], size, fault["size"], fault["onset"]


def found(path: Path, component: str, onset: float) -> tuple[bool, Size | None]:
    """Return whether a component is accused from an onset on, and the size that is stated."""
    findings = [
        f
        for f in fdi.analyze(path).findings
        if f.component == component and f.onset >= onset - EARLY_S
    ]
    return bool(findings), next((f.size for f in findings if f.size is not None), None)


def of_label(case: tuple[str, str, float, str, float]) -> tuple[str, str, bool, Any]:
    key, component, size, stated, onset = case
    accused, own = found(FLIGHTS / key, component, onset)
    if own is None:
        return key, stated, accused, None
    # a place and a pressure are labelled by what they mean, in metres
    shown = own.shown if own.shown is not None and own.shown_unit == "m" else abs(own.value)
    sigma = own.sigma * shown / abs(own.value)
    return key, stated, accused, (shown, sigma, (shown - size) / sigma, own.channels)


def of_injected(case: tuple[str, str, str, str, float, float]) -> tuple[str, str, bool, Any]:
    from fdi.evaluation.inject import injected
    from fdi.evaluation.injected_fault import InjectedFault
    from fdi.telemetry import read

    log, channel, component, kind, size, start = case
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"log{Path(log).suffix}"
        fault = InjectedFault(channel, kind, size, start, float("inf"))  # type: ignore[arg-type]
        path.write_bytes(injected(read(log), fault))
        accused, own = found(path, component, start)
    name = f"{Path(log).name} {channel} {start:.0f} s"
    if own is None:
        return name, f"{kind} {size:.3g}", accused, None
    sign = -1.0 if channel in own.against else 1.0
    value = sign * own.value
    # a fault of another shape or channel is a miss, whatever its number
    right = channel in (*own.channels, *own.against) and own.shape == kind
    error = (value - size) / own.sigma if right else float("inf")
    return name, f"{kind} {size:.3g}", accused, (value, own.sigma, error, own.channels)


def cases_of(log: str) -> Iterator[tuple[str, str, str, str, float, float]]:
    """Yield log, channel, component, kind, size and start of what is put into a healthy log."""
    from fdi.evaluation.curves import sensors
    from fdi.telemetry import read

    healthy = read(log)
    low, high = max((flight.airborne for flight in healthy.flights), key=lambda e: e[1] - e[0])
    for share in MOMENTS:
        start = low + share * (high - low)
        for one in sensors(healthy):
            if one.channel in CHANNELS:
                yield log, one.channel, one.component, "bias", 16 * one.accuracy, start
                yield log, one.channel, one.component, "drift", 2 * one.accuracy, start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="*")
    parser.add_argument("--inject", nargs="*", default=[])
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    with ProcessPoolExecutor(given.workers) as pool:
        if given.inject:
            cases = [case for log in given.inject for case in cases_of(log)]
            rows = list(pool.map(of_injected, cases))
        else:
            rows = list(pool.map(of_label, labelled(given.only)))
    print("| flight | fault | stated | error in sigmas |\n| --- | --- | --- | --- |")
    for name, fault, accused, own in rows:
        if own is None:
            print(f"| {name} | {fault} | {'no size' if accused else 'not accused'} | |")
            continue
        value, sigma, error, channels = own
        said = f"{value:.3g} +- {sigma:.1g} ({', '.join(channels)})"
        print(f"| {name} | {fault} | {said} | {error:.1f} |")
    told = [own[2] for *_, own in rows if own is not None]
    within = sum(abs(error) <= 2.0 for error in told)
    accused = sum(row[2] for row in rows)
    print(
        f"\n{len(rows)} faults, {accused} accused, {len(told)} with a size, {within} within 2 sigma"
    )


if __name__ == "__main__":
    main()
