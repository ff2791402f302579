"""How surely is an airspeed found that shows too much or too little, by flights that turn?

    .venv/bin/python benchmarks/airspeed.py LOG... [--scale 0.6 ...] [--at 0.35] [--workers 2]

LOGs are healthy flights of planes with an airspeed sensor. From a share ``--at`` of each flight's
time in the air on the sensor's pressure is multiplied by each ``--scale``, so that what it shows is
multiplied by the square root; nothing else in the log changes. That leaves out what follows from
it: an autopilot that holds a wrong speed, an estimator whose wind goes astray. Prints for every
made log how far the ground course turned afterwards, whom the analysis accuses and when, and
whether the airspeed is ruled out; then the share that is found of those that turned by 90 degrees
or more.
"""

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from fdi import analyze
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import parse_fault
from fdi.telemetry import Log, read

SCALES = (0.6, 0.7, 0.8, 1.2, 1.3, 1.4)
TURNS_DEG = 90.0
PRESENT = "onboard_control_sensors_present"
SENSOR = 1 << 4  # MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
SLOW = 5.0  # m/s over ground: below, the course tells nothing


class Row(NamedTuple):
    """What one made log showed; ``scale`` 1 is the log as it was flown."""

    log: str
    scale: float
    at: float
    turned: float
    accused: tuple[tuple[str, float, float], ...]
    cleared: bool

    @property
    def found(self) -> bool:
        """Whether the airspeed is accused first, after the change."""
        return bool(self.accused) and self.accused[0][0] == "airspeed"


def main(argv: list[str]) -> int:
    """Print the table; return 2 where no log has an airspeed sensor."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("--scale", type=float, action="append")
    parser.add_argument("--at", type=float, default=0.35)
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args(argv)
    jobs = [(path, tuple(asked.scale or SCALES), asked.at) for path in asked.logs]
    with ProcessPoolExecutor(asked.workers) as pool:
        rows = [row for some in pool.map(_tried, jobs) for row in some]
    if not rows:
        print("no log of a plane with an airspeed sensor", file=sys.stderr)
        return 2
    for row in rows:
        told = ", ".join(
            f"{who} {share:.2f} at {t - row.at:+.1f} s" for who, share, t in row.accused
        )
        print(
            f"{row.log:44s} {row.scale:4.2f} from {row.at:6.1f} s, turned {row.turned:4.0f}: "
            f"{told or '-'}{'; AIRSPEED RULED OUT' if row.cleared and row.scale != 1 else ''}"
        )
    made = [row for row in rows if row.scale != 1]
    turned = [row for row in made if row.turned >= TURNS_DEG]
    whole = [row for row in rows if row.scale == 1]
    print(
        f"turned by {TURNS_DEG:g} degrees or more: {sum(r.found for r in turned)} of {len(turned)}"
    )
    for scale in asked.scale or SCALES:
        own = [row for row in turned if row.scale == scale]
        print(f"  pressure times {scale:g}: {sum(row.found for row in own)} of {len(own)}")
    less = [row for row in made if row.turned < TURNS_DEG]
    print(f"turned less: {sum(row.found for row in less)} of {len(less)}")
    print(f"as flown, somebody accused: {sum(bool(row.accused) for row in whole)} of {len(whole)}")
    print(f"airspeed ruled out with a change: {sum(row.cleared for row in made)} of {len(made)}")
    return 0


def _tried(job: tuple[Path, tuple[float, ...], float]) -> list[Row]:
    path, scales, share = job
    log = read(path)
    flown = [flight.airborne for flight in log.flights if flight.flew]
    if not flown or not _has_sensor(log):
        return []
    low, high = max(flown, key=lambda span: span[1] - span[0])
    at = low + share * (high - low)
    return list(_rows(log, scales, at, _turned(log, at, high)))


def _rows(log: Log, scales: tuple[float, ...], at: float, turned: float) -> Iterator[Row]:
    with TemporaryDirectory(prefix="fdi-") as folder:
        for scale in (1.0, *scales):
            path = Path(log.path)
            if scale != 1:
                path = Path(folder) / path.name
                fault = parse_fault(f"airspeed:scale={scale**0.5}@{at}")
                path.write_bytes(injected(log, fault))
            found = analyze(path)
            accused = tuple((f.component, f.confidence, f.onset) for f in found.findings)
            cleared = any(one.component == "airspeed" for one in found.ruled_out)
            yield Row(Path(log.path).name, scale, at, turned, accused, cleared)


def _has_sensor(log: Log) -> bool:
    """Whether a plane's log shows an airspeed that a sensor measured."""
    shown = log.messages.get("AIRSPEED", log.messages.get("VFR_HUD"))
    if log.vehicle not in ("plane", "vtol") or shown is None or "airspeed" not in shown:
        return False
    told = log.messages.get("SYS_STATUS")
    if told is None or PRESENT not in told:  # DataFlash, ULog: an own message; others may estimate
        is_fitted = "AIRSPEED" in log.messages
    else:
        is_fitted = bool(np.any(told.si(PRESENT).astype(int) & SENSOR))
    if not is_fitted:
        return False
    return bool(np.nanmax(shown.si("airspeed"), initial=0.0) > SLOW)


def _turned(log: Log, low: float, high: float) -> float:
    """Return by how far the course over ground went to both sides together, degrees."""
    where = log.messages.get("GLOBAL_POSITION_INT")
    if where is None or "vx" not in where:
        return 0.0
    east, north = where.si("vy"), where.si("vx")
    on = (where.t >= low) & (where.t <= high) & (np.hypot(east, north) > SLOW)
    course = np.degrees(np.unwrap(np.arctan2(east[on], north[on])))
    return float(np.ptp(course)) if course.size else 0.0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
