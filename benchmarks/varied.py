"""Whom do healthy flights accuse if their logs lack something?

    .venv/bin/python benchmarks/varied.py LABELS.json ... [--seed N] [--workers N] [--all]

LABELS.json names flights, as `fdi evaluate` takes it. Of each recorded one without a fault (--all:
of each simulated one as well) five variants are made by leaving out records of its own format:

- half, quarter: every second and fourth record of what comes three times a second or more
- begins, stops: what is before a moment, or after it, drawn at random
- lacks: a fifth of its messages, drawn at random; of telemetry and DataFlash logs time, modes and
  the receiver stay, of a ULog any topic may go

The models were mended by what seeds 1 to 3 showed: others are variants that nobody has seen, of
flights that were. Prints who is accused of them who is not of the flight itself, nor accepted by
its label: it is accused for what the log lacks. Then how many of each kind are.
"""

from __future__ import annotations

import argparse
import random
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from zlib import crc32

from courses import STATIC, Record, records

from fdi import analyze
from fdi.errors import FdiError
from fdi.evaluation import load_labels

STAYS = frozenset({*STATIC, "GPS", "GPS_RAW_INT", "SYSTEM_TIME", "MODE", "ARM", "EV"})
OFTEN_HZ = 3.0
KINDS = ("half", "quarter", "begins", "stops", "lacks")


def name_of(one: Record) -> str:
    """Return what a record is one of; of a ULog the number of its topic."""
    return one.name if one.name != "D" else f"topic {struct.unpack_from('<H', one.data, 3)[0]}"


def variants(log: Sequence[Record], rng: random.Random) -> Iterator[tuple[str, list[Record]]]:
    """Yield what is left of a log, by the name of the variant."""
    timed = [one for one in log if one.time is not None and one.name not in STATIC]
    low, high = min(one.time for one in timed), max(one.time for one in timed)
    often = (high - low) / 1e6 * OFTEN_HZ
    counts = Counter(name_of(one) for one in timed)
    quick = {name for name, count in counts.items() if count > often} - STAYS
    yield "half", list(_thinned(log, quick, 2))
    yield "quarter", list(_thinned(log, quick, 4))
    fixed = {id(one) for one in log if one.time is None or one.name in STATIC}
    begin, end = (low + (high - low) * rng.uniform(*part) for part in ((0.2, 0.6), (0.4, 0.8)))
    yield "begins", [one for one in log if id(one) in fixed or one.time >= begin]
    yield "stops", [one for one in log if one.time is None or one.time <= end]
    names = sorted(set(counts) - STAYS)
    left_out = set(rng.sample(names, len(names) // 5))
    yield "lacks", [one for one in log if name_of(one) not in left_out]


def _thinned(log: Sequence[Record], quick: set[str], every: int) -> Iterator[Record]:
    """Yield every second or fourth moment of what comes quickly: all instances of it."""
    moment: dict[str, float | None] = {}
    number: Counter[str] = Counter()
    for one in log:
        name = name_of(one)
        if name not in quick or one.time is None:
            yield one
            continue
        if moment.get(name) != one.time:
            moment[name] = one.time
            number[name] += 1
        if number[name] % every == 0:
            yield one


def look(path: Path, accepted: Sequence[str], seed: int) -> list[tuple[str, list[str]]]:
    """Return for each variant who is newly accused, and how surely."""
    rng = random.Random(seed + crc32(path.name.encode()))
    known = {*accepted, *(one.component for one in analyze(path).findings)}
    found = []
    log = list(records(path.read_bytes(), path.suffix))
    if not any(one.time is not None and one.name not in STATIC for one in log):
        return []
    with TemporaryDirectory() as folder:
        made = Path(folder) / path.name
        for name, left in variants(log, rng):
            made.write_bytes(b"".join(one.data for one in left))
            try:
                new = [one for one in analyze(made).findings if one.component not in known]
            except FdiError:
                continue  # too little is left of it
            found.append((name, [f"{one.component} {one.confidence:.0%}" for one in new]))
    return found


def main() -> int:
    """Print who is accused, and how many."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("labels", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--all", action="store_true")
    arguments = parser.parse_args()
    flights = [
        one
        for file in arguments.labels
        for one in load_labels(file)
        if one.use == "diagnosis" and not one.faults and (arguments.all or one.origin == "recorded")
    ]
    flights = [one for one in flights if one.path.suffix.lower() in (".tlog", ".bin", ".ulg")]
    tried, accused = Counter(), Counter()
    with ProcessPoolExecutor(arguments.workers) as pool:
        paths, accept = [one.path for one in flights], [one.accept for one in flights]
        for path, found in zip(
            paths, pool.map(partial(look, seed=arguments.seed), paths, accept), strict=True
        ):
            for name, new in found:
                tried[name] += 1
                accused[name] += bool(new)
                if new:
                    print(f"{path.parent.name}/{path.name}, {name}: {', '.join(new)}")
    for name in KINDS:
        print(f"{name:>8}  {accused[name]} of {tried[name]}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
