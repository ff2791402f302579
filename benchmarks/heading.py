"""Which block does `fdi heading` name, and how far off is what it recovers?

    .venv/bin/python benchmarks/heading.py [FOLDER...]

FOLDERs hold flights and their `labels.json`; by default `../shared/flights`, of which the simulated
ones of `sitl/` count. Prints three tables in Markdown: which block is named on labelled flights of
compass, receiver and gyroscopes, and on healthy ones; positions recovered on healthy flights whose
receiver is made to fail in six ways; headings and tilts recovered on healthy flights where a sensor
is assumed to have failed. A fault in records reaches no controller: the vehicle flies on as it did,
which is how the truth is known.
"""

import json
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fdi.errors import FdiError
from fdi.methods.heading import (
    COMPONENTS,
    HeadingCheck,
    Named,
    Recovery,
    cross_check,
    recover,
)
from fdi.methods.heading.check import SILENCE
from fdi.methods.heading.geodesy import metres_per_radian, wrap
from fdi.methods.heading.increments import GATE
from fdi.methods.heading.motion import Fixes
from fdi.telemetry import Log, read
from fdi.telemetry.message import Column
from fdi.units import Conversion

ROOT = Path(__file__).parents[1]
FOLDER = ROOT.parent / "shared" / "flights"
FAILED = ("compass", "gps", "gyroscope")
AFTER_S = (5, 10, 30, 60)
LEARNT_S = 40.0
"""In the air before a receiver fails."""
SHORTEST_S = 75.0
EARLY_S = 1.0
"""By which a label may be late: sensors are sampled, labels are exact."""
Values = dict[str, np.ndarray]


def flights(folder: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    labels = json.loads((folder / "labels.json").read_text(encoding="utf-8"))["flights"]
    for name, label in labels.items():
        own = name.startswith("sitl/") or not (folder / "sitl").is_dir()
        if label["use"] == "diagnosis" and own:
            yield folder / name, label


def checked(path: Path) -> tuple[Log, HeadingCheck] | None:
    log = read(path)
    try:
        return log, cross_check(log)
    except FdiError:
        return None


def verdicts(folder: Path) -> None:
    rows: dict[str, list[str]] = defaultdict(list)
    delays: list[float] = []
    shown: list[float] = []
    for path, label in flights(folder):
        components = {fault["component"] for fault in label["faults"]}
        kind = next(iter(components), "healthy")
        if components and not components & set(FAILED):
            kind = "another fault"
        found = checked(path)
        if found is None:
            rows[kind].append("refused")
            continue
        check = found[1]
        until = label["evaluate_until"] or np.inf
        named = [one for one in check.named if one.start <= until]
        onset = label["faults"][0]["onset"] if components else 0.0
        rows[kind].append(outcome(named, components, onset, is_asked=kind in FAILED))
        if kind in FAILED and label["faults"][0]["kind"] == "step":
            first = first_record(check, kind, onset)
            shown.append(largest(check, onset, first))
            if rows[kind][-1] == "right":
                delays.append((named[0].start - first) / check.ride.cycle)
    print(f"\n| {folder.name} | flights | right | right, by silence | nobody | wrong | refused |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for kind in (*sorted(set(rows) & set(FAILED)), "another fault", "healthy"):
        counts = [rows[kind].count(x) for x in ("right", "silent", "nobody", "wrong", "refused")]
        print(f"| {kind} | {len(rows[kind])} | " + " | ".join(map(str, counts)) + " |")
    sick = [one for kind in FAILED for one in rows[kind]]
    right = sick.count("right") + sick.count("silent")
    quick = sum(delay <= 1.0 for delay in delays)
    print(f"\nfaults: {right} named of {len(sick)}, {sick.count('silent')} of these by silence; of "
          f"{len(shown)} steps {sum(one > GATE for one in shown)} show beyond {GATE:g} deviations "
          f"within a cycle of the first record, {quick} of the {len(delays)} named are named by "
          f"then, median {np.median(delays) if delays else np.nan:.1f} cycles; the others show "
          + ", ".join(f"{one:.1f}" for one in sorted(shown) if one <= GATE))  # fmt: skip


def first_record(check: HeadingCheck, component: str, onset: float) -> float:
    """Return when the part that fails is recorded for the first time after the onset, s."""
    fixes = check.ride.fixes
    t = fixes.t if component == "gps" and fixes is not None else check.ride.t
    return float(t[min(np.searchsorted(t, onset), t.size - 1)])


def largest(check: HeadingCheck, onset: float, first: float) -> float:
    """Return how far any pair is off within a cycle of a fault's first record, in deviations."""
    cycles = (check.t >= onset - EARLY_S) & (check.t <= first + check.ride.cycle)
    apart = [np.abs(pair.off[cycles]) / pair.sigma[cycles] for pair in check.pairs]
    return float(np.max(np.nan_to_num(apart), initial=0.0))


def outcome(named: list[Named], components: set[str], onset: float, *, is_asked: bool) -> str:
    """Return how right it is; of a flight that is not asked about, that nobody is named."""
    if not named:
        return "nobody" if is_asked else "right"
    first = named[0]
    if COMPONENTS[first.block] not in components or first.start < onset - EARLY_S:
        return "wrong"
    return "silent" if first.by == (SILENCE,) else "right"


def with_values(log: Log, values: Values) -> Log:
    """Return a log with other values, SI by raw record, of its receiver."""
    message = log["GPS_RAW_INT"]
    columns = dict(message.columns)
    for name, own in values.items():
        unit = message.unit(name)
        columns[name] = Column(load=lambda own=own: np.array(own), conversion=Conversion(unit))
    return log.with_message(replace(message, columns=columns, _cache={}))


def held(values: np.ndarray, fails: np.ndarray) -> np.ndarray:
    return np.where(fails, values[max(int(np.argmax(fails)) - 1, 0)], values)


def failures(t: np.ndarray, since: float, own: Values) -> Iterator[tuple[str, Values]]:
    """Yield six ways in which a receiver fails."""
    fails, lat, lon = t >= since, own["lat"], own["lon"]
    first = max(int(np.argmax(fails)) - 1, 0)
    metre = 1 / 6.371e6
    yield "zero", {name: np.where(fails, 0.0, own[name]) for name in ("lat", "lon", "vel")}
    yield "scale", {x: np.where(fails, own[x][first] + 1.5 * (own[x] - own[x][first]), own[x])
                    for x in ("lat", "lon")}  # fmt: skip
    spikes = fails & (np.cumsum(fails) % 20 == 1)
    yield "spike", {"lat": lat + np.where(spikes, 50 * metre, 0.0)}
    yield "freeze", {name: held(own[name], fails) for name in ("lat", "lon", "vel", "cog")}
    yield "drift", {"lon": lon + np.where(fails, (t - since) * metre / np.cos(lat), 0.0)}
    yield "dropout", {"fix_type": np.where(fails, 0.0, own["fix_type"])}


def position_errors(recovery: Recovery, truth: Fixes) -> Iterator[tuple[int, float, float, float]]:
    """Yield seconds after, error, its predicted deviation, and the distance flown, m."""
    place, per = truth.position(), metres_per_radian(truth.lat[0])
    for after in AFTER_S:
        when = recovery.start + after
        if when > min(recovery.end, truth.t[-1]):
            continue
        was = [np.interp(when, truth.t, row) for row in place]
        lat, lon = (np.radians(np.interp(when, recovery.t, recovery.columns[x]))
                    for x in ("lat_deg", "lon_deg"))  # fmt: skip
        said = [(lat - truth.lat[0]) * per[0], wrap(lon - truth.lon[0]) * per[1]]
        sigma = np.sqrt(2) * np.interp(when, recovery.t, recovery.columns["sigma_m"])
        rows = (truth.t >= recovery.start) & (truth.t <= when)
        speed = np.hypot(truth.north[rows], truth.east[rows])
        way = float((speed[1:] * np.diff(truth.t[rows])).sum())
        yield after, float(np.hypot(*np.subtract(said, was))), float(sigma), way


def positions(folder: Path) -> None:
    errors: dict[tuple[str, int], list[tuple[float, float, float]]] = defaultdict(list)
    told: dict[str, list[bool]] = defaultdict(list)
    for path, label in flights(folder):
        found = None if label["faults"] else checked(path)
        if found is None or found[1].ride.fixes is None:
            continue
        log, ride = found[0], found[1].ride
        if ride.air[1] - ride.air[0] < SHORTEST_S:
            continue
        message = log["GPS_RAW_INT"]
        t = message.stamp - message.stamp[message.kept[0]] + message.t[0]
        names = ("lat", "lon", "vel", "cog", "fix_type")
        own = {name: message.si_of_records(name) for name in names}
        vehicle = "wings" if ride.has_wings else "rotors"
        for kind, values in failures(t, ride.air[0] + LEARNT_S, own):
            changed = with_values(log, values)
            try:
                recovery = recover(changed, cross_check(changed))
            except FdiError:
                told[kind].append(False)
                continue
            told[kind].append(recovery.block == "satellite")
            if recovery.block == "satellite":
                for after, *rest in position_errors(recovery, ride.fixes):
                    errors[f"{kind}, {vehicle}", after].append(tuple(rest))
    print("\n| receiver fails by | told | vehicle | " + " | ".join(f"{x} s" for x in AFTER_S)
          + " | within 2 sigma |")  # fmt: skip
    print("| --- | --- | --- |" + " --- |" * (len(AFTER_S) + 1))
    for kind, all_of in told.items():
        for vehicle in ("rotors", "wings"):
            row = [errors.get((f"{kind}, {vehicle}", after), []) for after in AFTER_S]
            share = f"{sum(all_of)}/{len(all_of)}"
            print(f"| {kind} | {share} | {vehicle} | "
                  + " | ".join(map(in_metres, row)) + f" | {within(row)} |")  # fmt: skip


def in_metres(all_of: list[tuple[float, float, float]]) -> str:
    if not all_of:
        return "–"
    error, _, way = np.array(all_of).T
    moved = way > 5.0  # a share of no distance is none
    share = f"{100 * np.median(error[moved] / way[moved]):.1f} %" if moved.any() else "–"
    return f"{np.median(error):.1f} m, {share} ({len(all_of)})"


def within(row: list[list[tuple[float, float, float]]]) -> str:
    flat = np.array([one for all_of in row for one in all_of])
    return "–" if not flat.size else f"{100 * np.mean(flat[:, 0] <= 2 * flat[:, 1]):.0f} %"


def angles(folder: Path) -> None:
    errors: dict[tuple[str, int], list[tuple[float, float, float]]] = defaultdict(list)
    for path, label in flights(folder):
        found = None if label["faults"] else checked(path)
        if found is None or found[1].ride.angles is None:
            continue
        log, check = found
        for since in np.arange(check.ride.air[0] + LEARNT_S, check.ride.air[1] - 10, 45.0):
            for block in ("magnetometer", "accelerometer", "angular_rate", "satellite"):
                try:
                    recovery = recover(log, check, block, float(since))
                except FdiError:
                    continue
                errors_of = height_errors if block == "satellite" else angle_errors
                for after, *rest in errors_of(recovery, check):
                    errors[block, after].append(tuple(rest))
    print("\n| failed | recovered | " + " | ".join(f"{x} s" for x in AFTER_S)
          + " | within 2 sigma |")  # fmt: skip
    print("| --- | --- |" + " --- |" * (len(AFTER_S) + 1))
    for block, what, unit in (("magnetometer", "heading", "deg"),
                              ("accelerometer", "tilt by gyroscopes", "deg"),
                              ("angular_rate", "tilt by accelerometers", "deg"),
                              ("satellite", "height", "m")):  # fmt: skip
        row = [errors.get((block, after), []) for after in AFTER_S]
        cells = [f"{np.median([x[0] for x in each]):.1f} {unit} ({len(each)})" if each else "–"
                 for each in row]  # fmt: skip
        print(f"| {block} | {what} | " + " | ".join(cells) + f" | {within(row)} |")


def height_errors(
    recovery: Recovery, check: HeadingCheck
) -> Iterator[tuple[int, float, float, float]]:
    """Yield seconds after, error and deviation, m, of the height."""
    fixes = check.ride.fixes
    for after in AFTER_S:
        when = recovery.start + after
        if fixes is None or when > min(recovery.end, fixes.t[-1]):
            continue
        said, sigma = (np.interp(when, recovery.t, recovery.columns[x])
                       for x in ("height_m", "sigma_height_m"))  # fmt: skip
        yield after, abs(float(said - np.interp(when, fixes.t, fixes.height))), float(sigma), 0.0


def angle_errors(
    recovery: Recovery, check: HeadingCheck
) -> Iterator[tuple[int, float, float, float]]:
    """Yield seconds after, error and deviation, deg, of the angle that is further off."""
    ride = check.ride
    assert ride.angles is not None
    known = dict(
        zip(("roll_deg", "pitch_deg", "heading_deg"), np.degrees(ride.angles), strict=True)
    )
    sigma = next(x for name, x in recovery.columns.items() if name.startswith("sigma_"))
    wrapped: Callable[[float], float] = lambda x: abs((x + 180) % 360 - 180)  # noqa: E731
    for after in AFTER_S:
        at = int(np.searchsorted(recovery.t, recovery.start + after))
        if at >= recovery.t.size:
            continue
        row = int(np.searchsorted(ride.t, recovery.t[at]))
        off = [wrapped(float(recovery.columns[x][at] - own[row])) for x, own in known.items()
               if x in recovery.columns]  # fmt: skip
        if np.isfinite(off).all():
            yield after, max(off), float(sigma[at]), 0.0


def main() -> None:
    for folder in [Path(one) for one in sys.argv[1:]] or [FOLDER]:
        verdicts(folder)
        positions(folder)
        angles(folder)


if __name__ == "__main__":
    main()
