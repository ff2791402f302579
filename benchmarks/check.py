"""How often does `fdi check` find what was set up wrongly, and how often what was not?

    .venv/bin/python benchmarks/check.py [FOLDER...]

FOLDERs hold flights and their `labels.json`; by default `../shared/flights`. Prints three tables in
Markdown: what the checks say of labelled flights as they are; what they say of healthy ones whose
records were changed as a wrong set-up would have changed them; and of take-offs that a rigid body
fails (`tests/methods/setup/build.py`). A change to records is no flight with that mistake: no
controller answers it. The simulated take-offs are the other half of the truth.
"""

import json
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from fdi.errors import FdiError
from fdi.methods.setup import Check, check_setup
from fdi.methods.setup.agreement import check_agreement
from fdi.methods.setup.compass import check_compasses
from fdi.methods.setup.heading import check_heading
from fdi.methods.setup.motors import check_motors
from fdi.methods.setup.mounting import check_mounting
from fdi.methods.setup.rotations import sensor_rotations
from fdi.methods.setup.surfaces import check_surfaces
from fdi.methods.setup.witnesses import decided
from fdi.telemetry import Log, read
from fdi.telemetry.message import Column
from fdi.units import Conversion

ROOT = Path(__file__).parents[1]
FOLDER = ROOT.parent / "shared" / "flights"
RATES = (("ATTITUDE", ("rollspeed", "pitchspeed", "yawspeed")),
         ("RAW_IMU", ("xgyro", "ygyro", "zgyro")))  # fmt: skip
FIELD = ("RAW_IMU", ("xmag", "ymag", "zmag"))
FORCE = ("RAW_IMU", ("xacc", "yacc", "zacc"))
TURNS = {rotation.name: rotation.matrix for rotation in sensor_rotations()}
SIMULATED = ("sitl/", "others/", "motor_stop/", "px4_motor/", "triplex/")
Change = tuple[str, str, Callable[[Log], Iterator[Check]], Log, str]


def with_values(log: Log, key: str, values: dict[str, np.ndarray]) -> Log:
    """Return a log with other values, SI by raw record, in some columns of a message."""
    message = log[key]
    columns = dict(message.columns)
    for name, own in values.items():
        unit = message.unit(name)
        columns[name] = Column(load=lambda own=own: np.array(own), conversion=Conversion(unit))
    return log.with_message(replace(message, columns=columns, _cache={}))


def turned(log: Log, where: tuple[str, tuple[str, ...]], matrix: np.ndarray) -> Log:
    """Return a log in which a sensor reads what it would read turned the other way round."""
    key, fields = where
    if key not in log or any(name not in log[key] for name in fields):
        return log
    values = matrix.T @ np.array([log[key].si_of_records(name) for name in fields])
    return with_values(log, key, dict(zip(fields, values, strict=True)))


def with_turned_rates(log: Log, matrix: np.ndarray) -> Log:
    for where in RATES:
        log = turned(log, where, matrix)
    return log


def swapped(log: Log, one: int, other: int) -> Log:
    motors = log["MOTORS"]
    pair = (f"motor_{one}", f"motor_{other}")
    values = {a: motors.si_of_records(b) for a, b in (pair, pair[::-1])}
    return with_values(log, "MOTORS", values)


def motor_changes(log: Log) -> Iterator[Change]:
    if next(iter(check_motors(log)), None) is None or "MOTORS" not in log:
        return
    count = len(log["MOTORS"].columns)
    for one, other in (
        (1, 2),
        (1, 3),
        (1, 4),
        (2, 3),
        (2, 4),
        (3, 4),
        *(((5, 6),) if count > 4 else ()),
    ):
        words = f"motors {one} and {other} are swapped"
        yield "two motors swapped", "motors", check_motors, swapped(log, one, other), words
    back = with_turned_rates(log, np.diag([1.0, 1.0, -1.0]))
    yield "all propellers reversed", "motors", check_motors, back, "all propellers turn"
    for name in ("YAW_90", "YAW_180", "ROLL_180"):
        word = "upside down" if name == "ROLL_180" else "is turned by"
        yield f"board {name}", "motors", check_motors, with_turned_rates(log, TURNS[name]), word
    kind = log.parameters.get("FRAME_TYPE")
    for other in (0.0, 1.0, 12.0):
        if log.vehicle == "quad" and kind is not None and other != kind:
            told = replace(log, parameters={**log.parameters, "FRAME_TYPE": other}, _cache={})
            yield (
                "another frame type set",
                "motors",
                check_motors,
                told,
                f"FRAME_TYPE fits {kind:.0f}",
            )


def compasses_of(log: Log) -> Iterator[Check]:
    """Yield what is said of the compasses, with what others decide (`witnesses.py`)."""
    looks = (check_compasses, check_agreement, check_heading)
    yield from decided(tuple(check for look in looks for check in look(log)))


def sensor_changes(log: Log) -> Iterator[Change]:
    for name in ("YAW_90", "YAW_180", "ROLL_180", "PITCH_90", "ROLL_180_YAW_45"):
        yield f"compass {name}", "compass 1", compasses_of, turned(log, FIELD, TURNS[name]), name
    mirror = np.diag([1.0, -1.0, 1.0])
    yield (
        "compass mirrored",
        "compass 1",
        compasses_of,
        turned(log, FIELD, mirror),
        "y axis reversed",
    )
    for angle in (90, 180):
        if "ATTITUDE" in log:
            yaw = log["ATTITUDE"].si_of_records("yaw") + np.radians(angle)
            off = with_values(log, "ATTITUDE", {"yaw": (yaw + np.pi) % (2 * np.pi) - np.pi})
            yield f"heading off by {angle}", "heading", check_heading, off, "degrees"
    flat = turned(log, FORCE, TURNS["ROLL_180"])
    yield "accelerometers ROLL_180", "accelerometer 1", check_mounting, flat, ""
    spun = turned(log, RATES[1], TURNS["YAW_90"])
    yield "gyroscopes YAW_90", "gyroscopes", check_mounting, spun, ""


def surface_changes(log: Log) -> Iterator[Change]:
    if log.vehicle not in ("plane", "vtol"):
        return
    rows = (("ailerons", 0), ("elevator", 1), ("rudder", 2))
    for name, axis in rows:
        signs = np.ones(3)
        signs[axis] = -1.0
        yield (
            f"{name} reversed",
            name,
            check_surfaces,
            with_turned_rates(log, np.diag(signs)),
            "reversed",
        )


def flights(folders: list[Path]) -> Iterator[tuple[str, bool, Log]]:
    """Yield name, whether it is healthy, and log of every labelled flight."""
    for folder in folders:
        for name, label in json.loads((folder / "labels.json").read_text())["flights"].items():
            if label.get("use") != "diagnosis":
                continue
            try:
                yield name, not label["faults"], read(folder / name)
            except FdiError as error:
                print(f"left out: {error}", file=sys.stderr)


def outcome(checks: Iterator[Check], name: str, words: str) -> str:
    """Return ``named``, ``found`` by another name, or the verdict."""
    check = next((c for c in checks if c.name == name), None)
    if check is None:
        return "absent"
    if check.verdict != "wrong":
        return check.verdict
    return "named" if words in check.text else "found"


def flips() -> Iterator[str]:
    """Yield rows for take-offs that fail, by rate and mistake."""
    sys.path.insert(0, str(ROOT / "tests"))
    from methods.setup.build import Quad, write

    quarter, half = ((0, -1, 0), (1, 0, 0), (0, 0, 1)), ((-1, 0, 0), (0, -1, 0), (0, 0, 1))
    mistakes = {
        "motors 1 and 2 swapped": ({"places": (1, 0, 2, 3)}, "motors 1 and 2 are swapped"),
        "motors 3 and 4 swapped": ({"places": (0, 1, 3, 2)}, "motors 3 and 4 are swapped"),
        "motors 1 and 3 swapped": ({"places": (2, 1, 0, 3)}, "motors 1 and 3 are swapped"),
        "Betaflight's order": ({"places": (3, 0, 1, 2)}, "FRAME_TYPE fits 12"),
        "propellers reversed": ({"turns": -1.0}, "all propellers turn"),
        "board turned by 90": ({"board": quarter}, "is turned by"),
        "board turned by 180": ({"board": half}, "is turned by"),
        "motor 2 dead": ({"effect": (1, 0, 1, 1)}, "motor 2 has no effect"),
        "nothing wrong": ({}, "no words"),
    }
    yield "| mistake | 4 Hz | 10 Hz | 25 Hz | 50 Hz |"
    yield "|---" * 5 + "|"
    for name, (how, words) in mistakes.items():
        cells = []
        for rate in (4, 10, 25, 50):
            counts: Counter[str] = Counter()
            for seed in range(10):
                with tempfile.TemporaryDirectory() as folder:
                    path = write(Path(folder, "x.tlog"), Quad(rate=rate, seed=seed, **how))
                    counts[outcome(check_motors(read(path)), "motors", words)] += 1
            cells.append(", ".join(f"{n} {what}" for what, n in counts.most_common()))
        yield f"| {name} | {' | '.join(cells)} |"


def main(folders: list[Path]) -> None:
    """Print the three tables."""
    asis: dict[tuple[str, bool], Counter[str]] = defaultdict(Counter)
    changed: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    accused = []
    for name, healthy, log in flights(folders):
        for check in check_setup(log):
            kind = check.name.rstrip(" 123")
            asis[kind, healthy][check.verdict] += 1
            if check.verdict == "wrong":
                accused.append(
                    f"- {'healthy' if healthy else 'faulty'}: {name}: {check.name}: {check.text}"
                )
        if healthy:
            origin = "simulated" if name.startswith(SIMULATED) or folders_of(name) else "recorded"
            for make in (motor_changes, sensor_changes, surface_changes):
                for what, which, ask, made, words in make(log):
                    changed[what, origin][outcome(ask(made), which, words)] += 1
        print(".", end="", file=sys.stderr, flush=True)
    verdicts = ("wrong", "in order", "not known")
    print(
        "| check | healthy: wrong | in order | not known | faulty: wrong | in order | not known |"
    )
    print("|---" * 7 + "|")
    for kind in sorted({kind for kind, _ in asis}):
        cells = [asis[kind, healthy][v] for healthy in (True, False) for v in verdicts]
        print(f"| {kind} | {' | '.join(map(str, cells))} |")
    print("\n" + "\n".join(accused) + "\n")
    results = ("named", "found", "in order", "not known", "absent")
    print(f"| change | flights | {' | '.join(results)} |")
    print("|---" * (2 + len(results)) + "|")
    for (what, origin), counts in sorted(changed.items()):
        print(f"| {what} | {origin} | {' | '.join(str(counts[r]) for r in results)} |")
    print()
    print("\n".join(flips()))


def folders_of(name: str) -> bool:
    """Return whether a flight lies beside its labels, as those of the closed loop do."""
    return "/" not in name


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]] or [FOLDER])
