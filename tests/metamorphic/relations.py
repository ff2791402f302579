"""What must hold between a flight and its edited twin?

In: a labelled flight and a folder to write into. Out: nothing, or an AssertionError that says what
does not hold. `RELATIONS` names them all, each with the flights that it is asked of; a relation
that has nothing to say about a flight raises `NotAskedError`.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from flights import (
    SHARED,
    Case,
    Document,
    accusations,
    accused,
    assert_same_answer,
    components,
    document_of,
    labels,
)

from fdi.analysis import analyze
from fdi.errors import FdiError
from fdi.evaluation.curves import InjectedJob, analyze_injected, sensors
from fdi.evaluation.inject import home, injected
from fdi.evaluation.injected_fault import InjectedFault
from fdi.model import load_airframe
from fdi.model.choose import choose_model
from fdi.telemetry import Channel, Log, Message, read
from fdi.telemetry.writing import Change, rewritten

from .edits import later, twice, until, with_garbage

BEFORE_S = 1.0  # a prefix ends so long before the true onset
SECONDS = 7.25  # later
STEPS = (4.0, 16.0, 64.0)  # accuracies: sizes of a fault that grows
LOST = 0.1  # of the records; recorders and links lose up to 6 % on recorded flights
NOISE = 0.5  # accuracies, one sigma: with the sensor's own it is still within what is stated
ORDERS = {"quad": [(2, 1, 4, 3), (3, 4, 1, 2)], "hexa": [(2, 1, 4, 3, 6, 5)]}
"""New numbers of the motors of a vehicle that is turned by half, and of a mirrored one."""

Relation = Callable[[Case, Path], None]


class NotAskedError(Exception):
    """The relation says nothing about this flight."""


def analysed(data: bytes, case: Case, folder: Path) -> Document:
    """Return analysis.json of a flight's edited bytes, with the model of the flight as it is."""
    path = folder / case.path.name
    path.write_bytes(data)
    return analyze(path, model=document_of(case.path)["model"]["name"]).document()


def prefix(case: Case, folder: Path) -> None:
    """A flight that ends before anything failed accuses nobody."""
    if case.onset < 5.0:
        raise NotAskedError("nothing is before the onset")
    try:
        document = analysed(until(case.onset - BEFORE_S, case.path.read_bytes()), case, folder)
    except FdiError:  # to refuse what holds no flight is to say nothing
        return
    assert not document["findings"], accusations(document)


def shift(case: Case, folder: Path) -> None:
    """Another start of the recorder's clock changes nothing."""
    other = analysed(later(SECONDS, case.path.read_bytes()), case, folder)
    assert_same_answer(document_of(case.path), other)


def place(case: Case, folder: Path) -> None:
    """Another take-off place, half a degree east, changes nothing."""
    log = read(case.path)
    changes = {}
    for key, message in own_messages(log):
        own = {name: moved(log, key, name) for name in message.fields if is_longitude(name)}
        if own:
            changes[key] = Change(own)
    if not changes:
        raise NotAskedError("no position")
    assert_same_answer(
        document_of(case.path), analysed(rewritten(log, changes), case, folder), within=0.26
    )


def own_messages(log: Log) -> Iterator[tuple[str, Message]]:
    yield from ((k, m) for k, m in log.messages.items() if m.made_from is None and m.stamp.size)


def is_longitude(field: str) -> bool:
    return field.rpartition(".")[2].lower() in ("lon", "lng", "longitude", "ref_lon", "home_lon")


def moved(log: Log, key: str, field: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the raw longitudes half a degree east."""
    raw = np.asarray(log[key].raw(field), np.float64)
    unit = 1e7 if np.nanmax(np.abs(raw)) > 360 else 1.0
    return raw + 0.5 * unit, raw != 0


def duplicates(case: Case, folder: Path) -> None:
    """Records that came twice change nothing."""
    assert_same_answer(
        document_of(case.path), analysed(twice(case.path.read_bytes()), case, folder)
    )


def garbage(case: Case, folder: Path) -> None:
    """Bytes behind the log that belong to nothing change nothing."""
    assert_same_answer(
        document_of(case.path), analysed(with_garbage(case.path.read_bytes()), case, folder)
    )


def two_formats(case: Case, folder: Path) -> None:
    """The telemetry of a flight and the log of its autopilot accuse the same components."""
    del folder
    said, again = (accused(document_of(p)) for p in (case.path, case.path.with_suffix(".BIN")))
    assert said == again, f"tlog {sorted(said)}, BIN {sorted(again)}"


def motors(case: Case, folder: Path) -> None:
    """Where the motors have other numbers, the accusation follows them."""
    log = read(case.path)
    whole = document_of(case.path)
    orders = ORDERS.get(log.vehicle, [])
    if not orders or "SERVO_OUTPUT_RAW" not in log.messages:
        raise NotAskedError("no motors")
    for order in orders:
        new = {f"motor_{k}": f"motor_{number}" for k, number in enumerate(order, 1)}
        document = analysed(swapped(log, order), case, folder)
        said, again = (
            [
                (names.get(f["component"], f["component"]), f["onset"]["log_s"])
                for f in d["findings"]
            ]
            for names, d in ((new, whole), ({}, document))
        )
        assert again == said, f"{order}: {again} instead of {said}"


def swapped(log: Log, order: tuple[int, ...]) -> bytes:
    """Return the log with output k recorded as output order[k - 1]."""
    names = [f"SERVO_OUTPUT_RAW.servo{k}_raw" for k in range(1, len(order) + 1)]
    homes = [home(log, Channel.parse(name))[:2] for name in names]
    changes: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    for (key, field), number in zip(homes, order, strict=True):
        values = np.asarray(log[key].raw(field), np.float64)
        target, name = homes[number - 1]
        assert target == key
        changes.setdefault(key, {})[name] = values, np.ones(values.size, np.bool_)
    return rewritten(log, {key: Change(own) for key, own in changes.items()})


def removed(case: Case, folder: Path) -> None:
    """Without a stream nobody is accused whom the data had cleared."""
    log = read(case.path)
    cleared = components(document_of(case.path)["ruled_out"])
    blamed = {}
    for key in streams(log):
        lost = np.ones(log[key].stamp.size, np.bool_)
        try:
            less = analysed(rewritten(log, {key: Change({}, lost)}), case, folder)
        except FdiError:  # to refuse is to say nothing
            continue
        wrong = accused(less) & cleared
        if wrong:
            blamed[key] = sorted(wrong)
    assert not blamed, f"cleared, accused without the stream: {blamed}"


def gaps(case: Case, folder: Path) -> None:
    """A tenth of the records lost, one here and one there, accuses nobody else."""
    log, rng = read(case.path), np.random.default_rng(1)
    changes = {key: Change({}, rng.random(log[key].stamp.size) < LOST) for key in streams(log)}
    new = accused(analysed(rewritten(log, changes), case, folder)) - accused(document_of(case.path))
    assert not new, sorted(new)


def streams(log: Log) -> list[str]:
    """Return the log's own messages that its model makes use of."""
    system = load_airframe(choose_model(log)).observe(log)
    used = {request.channel.source for request in system.channels}
    return sorted({log[key].made_from or key for key in used})


def scaled(case: Case, folder: Path) -> None:
    """A larger fault does not hide where a smaller one of the same kind was seen."""
    del folder
    log = read(case.path)
    start = middle(log)
    healthy = accused(document_of(case.path))
    hidden = []
    for one in list(sensors(log))[::5]:
        seen = []
        for step in STEPS:
            fault = InjectedFault(one.channel, "bias", step * one.accuracy, start, float("inf"))
            row = analyze_injected(InjectedJob(str(case.path), fault=fault))
            seen.append(bool(set(row["accused"]) - healthy))
        if seen != sorted(seen):
            hidden.append(f"{one.channel}: {dict(zip(STEPS, seen, strict=True))}")
    assert not hidden, hidden


def middle(log: Log) -> float:
    """Return a moment well within the longest flight."""
    low, high = max((f.airborne for f in log.flights), key=lambda ends: ends[1] - ends[0])
    return low + 0.6 * (high - low)


def noise(case: Case, folder: Path) -> None:
    """Noise within the stated accuracies at every sensor accuses nobody else."""
    path = folder / f"noisy_{case.path.name}"
    path.write_bytes(case.path.read_bytes())
    for one in sensors(read(case.path)):
        log = read(path)
        size = NOISE * one.accuracy
        fault = InjectedFault(one.channel, "noise", size, log.span[0], float("inf"))
        path.write_bytes(injected(log, fault))
    assert path.read_bytes() != case.path.read_bytes()
    document = analysed(path.read_bytes(), case, folder)
    new = accused(document) - accused(document_of(case.path))
    assert not new, sorted(new)


class Asked(NamedTuple):
    """A relation and the flights that it is asked of, by key in the labels."""

    relation: Relation
    flights: tuple[str, ...]


COPTERS = tuple(
    f"sitl/copter/{name}"
    for name in (
        *("c13_motor4_x0.5.tlog", "c21_gps_step_5m_north.tlog", "c42_compass_freeze.tlog"),
        *("c50_baro_drift_both.tlog", "c70_battery_step_1.5V.tlog"),
        *("c10_motor1_x0.7_20s.BIN", "c20_gps_glitch_11m.BIN", "c62_gps_loss_30s_wind.BIN"),
    )
)
PLANES = (
    "sitl/plane/p10_airspeed_stuck.tlog",
    "sitl/plane/p42_gps_loss_20s.tlog",
    "sitl/plane/p51_compass_freeze.tlog",
    "sitl/plane/p20_engine_stop.BIN",
    "alfa/engine_failure_3.tlog",
)
FAULTY = (*COPTERS, *PLANES, "motor_stop/hexa-x_m1.bin", "triplex/gps_fail/instance_0.ulg")
HEALTHY = (
    *("sitl/copter/c02_hover_calm.tlog", "sitl/copter/c04_loiter_sticks_wind.tlog"),
    *("sitl/copter/c07_ref_aggressive.tlog", "sitl/copter/c03_ref_square_wind.BIN"),
    *("sitl/plane/p02_rect_wind_land.tlog", "sitl/plane/p04_loiter_wind.tlog"),
    *("sitl/plane/p01_rect_calm.BIN", "alfa/no_failure_2.tlog", "alfa/no_failure_5.tlog"),
    *("propeller_cut/good_prop_hover_1.bin", "healthy/no_battery_monitor.ulg"),
    "triplex/comm_fail/instance_0.ulg",
)
MOTORS = (
    *(f"sitl/copter/{name}" for name in ("c11_motor2_x0.85.tlog", "c12_motor3_x0.75_20s.tlog")),
    *(f"sitl/copter/{name}" for name in ("c13_motor4_x0.5.tlog", "c14_motor1_x0.35.tlog")),
    *(f"sitl/copter/{name}" for name in ("c16_motor2_wear_ramp.tlog", "c10_motor1_x0.7_20s.BIN")),
    *("sitl/motor_stop/quadx_m1.tlog", "sitl/motor_stop/quadp_m4.tlog"),
    *("sitl/motor_stop/hexax_m2.tlog", "sitl/motor_stop/hexap_m5.tlog"),
    *("motor_stop/hexa-x_m1.bin", "motor_stop/quad-x_m4.bin", "motor_stop/hexa-plus_m3.bin"),
    "triplex/comm_fail/instance_0.ulg",
)


def with_fault() -> tuple[str, ...]:
    """Return every flight on which something fails while it is recorded."""
    return tuple(
        key
        for key, label in labels(SHARED).items()
        if label["use"] == "diagnosis" and label["faults"] and not key.endswith(".log")
    )


def in_two_formats() -> tuple[str, ...]:
    known = labels(SHARED)
    return tuple(k for k in known if k.endswith(".tlog") and f"{k[:-5]}.BIN" in known)


RELATIONS: dict[str, Asked] = {
    "prefix": Asked(prefix, with_fault()),
    "shift of times": Asked(shift, FAULTY),
    "another place": Asked(place, FAULTY),
    "duplicates": Asked(duplicates, FAULTY),
    "garbage behind": Asked(garbage, FAULTY),
    "two formats": Asked(two_formats, in_two_formats()),
    "swapped motors": Asked(motors, MOTORS),
    "removed stream": Asked(removed, FAULTY),
    "lost records": Asked(gaps, (*HEALTHY, *FAULTY)),
    "scaled fault": Asked(scaled, HEALTHY),
    "added noise": Asked(noise, (*HEALTHY, *FAULTY)),
}
