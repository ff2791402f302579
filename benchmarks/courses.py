"""Are courses that people report told right, whatever the format, the vehicle and the wind?

    .venv/bin/python benchmarks/courses.py FOLDER ... [--workers N]

FOLDER holds simulated flights, closed_loop.tar.xz of ../shared/flights for instance. Four courses
are made of each flight by leaving out, changing and adding records of its own format:

- begins: the first third of the time in the air is missing, definitions and parameters are not
- stops: a third of the time in the air is recorded, nothing after it
- parameter: half through the first third a gain is set to six times its value
- net: what the autopilot does at a low battery, a lost radio or ground station and a fence is off

and held against the analysis of the whole flight. Prints by format and vehicle how many are told
right, in calm and in wind, then what is not.

    .venv/bin/python benchmarks/courses.py --count FOLDER ...

counts in whatever logs FOLDER holds, and below it, those that end by a restart, that begin in the
air, in which a parameter was set in flight, and what the safety net lacks.
"""

from __future__ import annotations

import argparse
import json
import struct
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi import Analysis, analyze
from fdi.diagnosis.safety_net import safety_net
from fdi.errors import FdiError
from fdi.telemetry import read
from fdi.telemetry.ordered import set_in_flight

GAINS = ("ATC_RAT_RLL_P", "RLL_RATE_P", "MC_ROLLRATE_P", "FW_RR_P")
OFF = (
    *("BATT_FS_LOW_ACT", "BATT_FS_CRT_ACT", "FS_THR_ENABLE", "THR_FAILSAFE", "FENCE_ENABLE"),
    *("COM_LOW_BAT_ACT", "NAV_DLL_ACT", "GF_ACTION"),
)
TIMES = 6.0
COURSES = ("begins", "stops", "parameter", "net")
HEAD = b"\xa3\x95"
STATIC = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "VER", "PARAM_VALUE", "HEARTBEAT")


class Record(NamedTuple):
    """Bytes of a log, their time in us, None for a definition, and what they are."""

    data: bytes
    time: float | None
    name: str


def records(data: bytes, suffix: str) -> Iterator[Record]:
    """Yield the records of a whole log; joined they are the log."""
    return {".tlog": _telemetry, ".bin": _dataflash, ".ulg": _ulog}[suffix.lower()](data)


def _telemetry(data: bytes) -> Iterator[Record]:
    at = 0
    while at + 12 < len(data):
        second = data[at + 8] == 0xFD
        size = data[at + 9] + (12 + 13 * (data[at + 10] & 1) if second else 8)
        number = int.from_bytes(data[at + 15 : at + 18], "little") if second else data[at + 13]
        found = mav.mavlink_map.get(number)
        end = at + 8 + size
        name = found.msgname if found else ""
        yield Record(data[at:end], float(int.from_bytes(data[at : at + 8], "big")), name)
        at = end


def _dataflash(data: bytes) -> Iterator[Record]:
    """Yield the records; of a damaged log what lies between the damage."""
    known, at = {128: (89, "FMT", "", "")}, 0
    while 0 <= at <= len(data) - 3:
        size, name, form, fields = known.get(data[at + 2], (0, "", "", ""))
        if data[at : at + 2] != HEAD or not size or at + size > len(data):
            at = data.find(HEAD, at + 1)
            continue
        one = data[at : at + size]
        if name == "FMT":
            parts = (one[5:9], one[9:25], one[25:89])
            known[one[3]] = (one[4], *(part.rstrip(b"\0").decode("latin-1") for part in parts))
        time = None
        if form[:1] == "Q":
            time = struct.unpack_from("<Q", one, 3)[0]
        elif fields.startswith("TimeMS") and form[:1] == "I":  # before 2015
            time = 1000 * struct.unpack_from("<I", one, 3)[0]
        yield Record(one, time, name)
        at += size


def _ulog(data: bytes) -> Iterator[Record]:
    yield Record(data[:16], None, "header")
    at = 16
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<Hc", data, at)
        one = data[at : at + 3 + size]
        place = {b"D": 5, b"L": 4}.get(kind)
        yield Record(
            one, struct.unpack_from("<Q", one, place)[0] if place else None, kind.decode("latin-1")
        )
        at += 3 + size


def parameter(one: Record) -> tuple[str, float] | None:
    """Return what parameter a record tells."""
    if one.name == "PARAM_VALUE":
        said = mav.MAVLink(None).decode(bytearray(one.data[8:]))
        return said.param_id, said.param_value
    if one.name == "PARM":
        return one.data[11:27].rstrip(b"\0").decode(), struct.unpack_from("<f", one.data, 27)[0]
    if one.name == "P":
        kind, name = one.data[4 : 4 + one.data[3]].decode().split(" ")
        return name, struct.unpack_from(
            "<f" if kind == "float" else "<i", one.data, len(one.data) - 4
        )[0]
    return None


def with_value(one: Record, value: float, time: float | None = None) -> Record:
    """Return the record of a parameter with another value, and at another time."""
    if one.name == "PARAM_VALUE":
        said = mav.MAVLink(None).decode(bytearray(one.data[8:]))
        said.param_value = value
        sender = mav.MAVLink(None, said.get_srcSystem(), said.get_srcComponent())
        frame = said.pack(sender, force_mavlink1=one.data[8] == 0xFE)
        stamp = one.data[:8] if time is None else round(time).to_bytes(8, "big")
        return Record(stamp + frame, time, one.name)
    data = bytearray(one.data)
    if one.name == "PARM":
        if time is not None:
            struct.pack_into("<Q", data, 3, round(time))
        struct.pack_into("<f", data, 27, value)
    else:
        is_real = data[4 : 4 + data[3]].startswith(b"float")
        struct.pack_into(
            "<f" if is_real else "<i", data, len(data) - 4, value if is_real else round(value)
        )
    return Record(bytes(data), time, one.name)


def course(name: str, log: Sequence[Record], cut: float) -> tuple[bytes, tuple[str, ...]] | None:
    """Return a log of the course, cut at ``cut`` us, and the parameters that it sets.

    None where the flight does not tell those parameters.
    """
    told = [(pair, one) for one in log if (pair := parameter(one)) is not None]
    kept, changed = list(log), ()
    gains = [(pair, one) for pair, one in told if pair[0] in GAINS and pair[1]]
    off = {pair[0] for pair, _ in told if pair[0] in OFF}
    if (name == "parameter" and not gains) or (name == "net" and not off):
        return None
    if name == "begins":
        kept = [one for one in log if one.time is None or one.name in STATIC or one.time >= cut]
    elif name == "stops":
        kept = [one for one in log if one.time is None or one.time <= cut]
    elif name == "parameter":
        (gain, value), one = gains[0]
        place = next(i for i, one in enumerate(log) if one.time is not None and one.time >= cut)
        kept.insert(place, with_value(one, TIMES * value, log[place].time))
        changed = (gain,)
    elif name == "net":
        kept = [with_value(o, 0, o.time) if (p := parameter(o)) and p[0] in OFF else o for o in log]
        changed = tuple(off)
    return b"".join(one.data for one in kept), changed


def told_wrong(
    name: str, found: Analysis, whole: Analysis, cut_s: float, changed: Sequence[str]
) -> str:
    """Return what an analysis of a course says that is not so, "" for nothing.

    Of what failed before the log begins only the consequences may be left to see.
    """
    accused = {one.component for one in found.findings}
    known = {one.component for one in whole.findings}
    strangers = accused - known
    if strangers and not (name == "begins" and any(one.onset < cut_s for one in whole.findings)):
        return f"accuses {', '.join(sorted(strangers))}"
    if name in ("begins", "stops"):
        flight, end = found.log.flights[-1], found.log.ends[-1].how
        if not flight.flew or "never seen to fly" in found.verdict:
            return "is not seen to fly"
        if name == "begins" and flight.takeoff is not None:
            return f"takes off at {flight.takeoff:.1f} s"
        if name == "begins" and end != whole.log.ends[-1].how:
            return f"ends as {end}, and not as {whole.log.ends[-1].how}"
        if name == "stops" and end != "in_air":
            return f"ends as {end}"
        later = {one.component for one in whole.findings if one.onset > cut_s + 1}
        missed = later - accused if name == "begins" else set()
        return f"does not accuse {', '.join(sorted(missed))}" if missed else ""
    if accused != known:
        return f"does not accuse {', '.join(sorted(known - accused))}"
    said = {one.parameter for one in safety_net(found.log)}
    if name == "parameter":
        said = {
            word
            for fact in found.stood_out
            if fact.about == "parameter"
            for word in fact.text.split()
        }
    missed = set(changed) - said
    return f"does not tell {', '.join(sorted(missed))}" if missed else ""


def look(path: Path) -> list[tuple[str, str]]:
    """Return for each course of a flight what is told wrong of it."""
    log, whole = list(records(path.read_bytes(), path.suffix)), analyze(path)
    start, end = whole.log.flights[0].airborne
    zero = min(one.time for one in log if one.time is not None and one.name not in ("PARM", "L"))
    found = []
    for name in COURSES:
        at_s = start + (end - start) / (6 if name == "parameter" else 3)
        cut = _stamp(log, whole, at_s, zero)
        if (made_of := course(name, log, cut)) is None:
            continue
        data, changed = made_of
        with TemporaryDirectory() as folder:
            made = Path(folder) / path.name
            made.write_bytes(data)
            found.append((name, told_wrong(name, analyze(made), whole, at_s, changed)))
    return found


def _stamp(log: Sequence[Record], whole: Analysis, at_s: float, zero: float) -> float:
    """Return a time of the log's clock on the records' own."""
    if whole.log.format != "ulog":
        return zero + at_s * 1e6
    first = struct.unpack_from("<Q", log[0].data, 8)[0]
    return float(first + at_s * 1e6)


def seen(path: Path) -> list[str]:
    """Return which of the courses a log shows, and what its safety net lacks."""
    try:
        log = read(path)
    except FdiError:
        return ["(not read)"]
    found = ["(read)"]
    if any(end.how == "restarted" for end in log.ends):
        found.append("an autopilot that starts anew in the air")
    if any(flight.flew and flight.takeoff is None for flight in log.flights):
        found.append("a beginning in the air")
    if any(set_in_flight(log.events, log.flights)):
        found.append("a parameter set in flight")
    return [*found, *(f"{gap.word}: {gap.parameter}: {gap.means}" for gap in safety_net(log))]


def count(folders: Sequence[Path], workers: int) -> None:
    """Print in how many logs each is seen."""
    paths = [path for folder in folders for path in sorted(folder.rglob("*")) if path.is_file()]
    paths = [path for path in paths if path.suffix.lower() in (".tlog", ".bin", ".ulg", ".log")]
    with ProcessPoolExecutor(workers) as pool:
        numbers = Counter(what for found in pool.map(seen, paths) for what in found)
    for what, number in numbers.most_common():
        print(f"{number:>5}  {what}")


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--count", action="store_true")
    given = parser.parse_args()
    if given.count:
        count(given.folders, given.workers)
        return 0
    paths = [
        path
        for folder in given.folders
        for path in sorted(folder.iterdir())
        if path.suffix.lower() in (".tlog", ".bin", ".ulg")
    ]
    labels = {}
    for folder in given.folders:
        for name in ("labels.json", "../labels.json", "../../labels.json"):
            if (folder / name).is_file():
                labels |= {
                    Path(key).name: one
                    for key, one in json.loads((folder / name).read_text())["flights"].items()
                }
                break
    right: dict[tuple[str, str, bool], dict[str, list[bool]]] = defaultdict(
        lambda: defaultdict(list)
    )
    wrong = []
    with ProcessPoolExecutor(given.workers) as pool:
        for path, found in zip(paths, pool.map(look, paths), strict=True):
            label = labels.get(path.name, {})
            blows = (
                bool(label.get("conditions", {}).get("wind_ne_turbulence")) or "wind" in path.name
            )
            for name, what in found:
                right[path.suffix.lower(), label.get("vehicle", "?"), blows][name].append(not what)
                if what:
                    wrong.append(f"{path.name} {name}: {what}")
    print(f"{'':<24}" + "".join(f"{name:>12}" for name in COURSES))
    for (suffix, vehicle, blows), by_course in sorted(right.items()):
        told = "".join(f"{sum(by_course[c])} of {len(by_course[c])}".rjust(12) for c in COURSES)
        print(f"{suffix} {vehicle} {'wind' if blows else 'calm'}".ljust(24) + told)
    print("\n".join(wrong))
    return 0


if __name__ == "__main__":
    sys.exit(main())
