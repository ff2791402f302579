"""How far off are take-off, landing and impact of recorded flights from what a person reads?

    .venv/bin/python benchmarks/flight_times.py FLIGHTS...

FLIGHTS are folders that hold the logs of ``flight_times.json`` by their names (those of
`../shared/flights`, and of the archives of recorded flights, unpacked). The readings were made from
plots of raw pressure, acceleration, turn rates, outputs and speed, each with its own uncertainty
(s), before anybody looked at an answer; of a log with several flights the first and the last.
Prints errors beyond a second, flights that are missed or invented, and the summary.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from fdi.telemetry import Flight, read

READ = Path(__file__).with_suffix(".json")
TOLD_S = 1.0
"""Errors beyond are told one by one."""


def main(folders: list[Path]) -> int:
    """Print how far off the times are; return 2 where no log is there."""
    errors: dict[str, list[tuple[float, str]]] = {"takeoff": [], "landing": [], "impact": []}
    amiss, shares, known = [], [], {}
    for one in json.loads(READ.read_text(encoding="utf-8")):
        name = one["log"].partition("#")[0]
        path = next((folder / name for folder in folders if (folder / name).exists()), None)
        if path is None:
            continue
        if name not in known:
            known[name] = [flight for flight in read(path).flights if flight.flew]
        own = _same(one, known[name])
        if own is None or one["takeoff"] == "noflight":
            if (own is None) != (one["takeoff"] == "noflight"):
                amiss.append(f"{one['log']}: {'missed' if own is None else 'invented'}")
            continue
        up, (down, how) = own.takeoff, _down(own)
        _add(errors["takeoff"], one["takeoff"], up, one["log"])
        _add(
            errors[one["kind"] if one["kind"] == "impact" else "landing"],
            one["land"],
            down,
            one["log"],
        )
        if down is not None and one["land"] is None:
            amiss.append(f"{one['log']}: {how} at {down:.1f} s, none read")
        if one["vehicle"] == "plane" and None not in (one["takeoff"], one["land"], up, down):
            shares.append((down - up) / (one["land"] - one["takeoff"]) - 1)
    if not known:
        print(f"none of the logs of {READ.name} is in these folders", file=sys.stderr)
        return 2
    for what, found in errors.items():
        for error, log in sorted(found, key=lambda pair: -abs(pair[0])):
            if abs(error) > TOLD_S:
                print(f"{what:8s} {error:+7.2f} s  {log}")
    print(*amiss, sep="\n")
    for what, found in errors.items():
        size = np.abs([error for error, _ in found])
        beyond = [f"{np.count_nonzero(size > most)} beyond {most:g} s" for most in (TOLD_S, 3.0)]
        middle, most = np.quantile(size, [0.5, 0.9])
        print(f"{what}: {size.size}, median {middle:.2f} s, 90 % {most:.2f}, {', '.join(beyond)}")
    print("planes, time in the air:", ", ".join(f"{share:+.0%}" for share in shares))
    return 0


def _same(one: dict[str, Any], flights: list[Flight]) -> Flight | None:
    """Return the flight that overlaps most with one that was read."""
    low = one["takeoff"] if isinstance(one["takeoff"], float) else -np.inf
    high = one["land"] if isinstance(one["land"], float) else np.inf
    best, most = None, 0.0
    for flight in flights:
        up = flight.start if flight.takeoff is None else flight.takeoff
        down = _down(flight)[0]
        over = min(high, flight.end if down is None else down) - max(low, up)
        if over > most:
            best, most = flight, over
    return best


def _down(flight: Flight) -> tuple[float | None, str]:
    return (flight.impact, "impact") if flight.impact is not None else (flight.landing, "landing")


def _add(
    into: list[tuple[float, str]], read_at: float | None, told: float | None, log: str
) -> None:
    if read_at is not None and told is not None:
        into.append((told - read_at, log))


if __name__ == "__main__":
    sys.exit(main([Path(one) for one in sys.argv[1:]]))
