"""Which logs need a look, and why?

In: rows of `fdi.fleet`. Out: words. A flight is flagged that ended badly or in which somebody is
accused. One that ends in the air is not: every second log does, and says no more by it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from fdi.report.words import per_cent

ENDS: Final = (
    "impact", "restarted", "control_lost", "tipped_over", "failsafe", "in_air", "landed",
    "on_ground",
)  # fmt: skip
"""How a flight may end, the worst first."""
BADLY: Final = {
    "impact": "hit the ground",
    "restarted": "the autopilot started anew in the air",
    "failsafe": "ended in a failsafe",
    "tipped_over": "tipped over on the ground",
}


def bad_end(row: Mapping[str, Any]) -> str:
    """Return how a flight ended badly, "" where none did."""
    words = []
    if row["lost_control_s"] is not None:
        words.append(f"lost control, {row['lost_control_s']:.1f} s")
    elif row["ended"] == "control_lost":
        words.append(f"lost control before {row['end_s']:.1f} s")
    if row["ended"] in BADLY:
        speed = "" if row["end_speed"] is None else f" at {row['end_speed']:.1f} m/s"
        words.append(f"{BADLY[row['ended']]}{speed}, {row['end_s']:.1f} s")
    return ", ".join(words)


def is_flagged(row: Mapping[str, Any]) -> bool:
    """Return whether a flight of a log ended badly, or somebody is accused."""
    return bool(row["accused"] or bad_end(row))


def reasons(row: Mapping[str, Any]) -> Iterator[str]:
    """Yield why a log needs a look; nothing where it does not."""
    if row["error"] is not None:
        yield f"no analysis: {row['error'].removeprefix(row['path'] + ': ')}"
    if end := bad_end(row):
        yield end
    if row["accused"]:
        names, sure = names_of(row), surest(row)
        told = (f"{names[one]} ({per_cent(sure[one])})" for one in row["accused"])
        yield f"accused: {', '.join(told)}"


def names_of(row: Mapping[str, Any]) -> Mapping[str, str]:
    """Return what a person calls each component of a row."""
    keys = (*row["accused"], *row["consequences"], *row["ruled_out"], *row["not_testable"])
    return {**{key: key for key in keys}, **{one["component"]: one["name"] for one in row["names"]}}


def surest(row: Mapping[str, Any]) -> dict[str, float]:
    """Return how sure the surest finding of each accused component is, 0..1."""
    found = dict.fromkeys(row["accused"], 0.0)
    for one in row["findings"]:
        found[one["component"]] = max(found.get(one["component"], 0.0), one["confidence"])
    return found


def flights_of(rows: Iterable[Mapping[str, Any]]) -> int:
    """Return of how many flights rows are: logs of one flight count once."""
    return len({row["same_flight_as"] or row["path"] for row in rows})


def worst_first(rows: Sequence[Mapping[str, Any]]) -> list[int]:
    """Return the places of rows: flagged ones first, then those without an analysis.

    Of the flagged the worst end first, of those alike the surest accusation.
    """

    def order(place: int) -> tuple[int, int, float]:
        row = rows[place]
        if row["error"] is not None:
            return 1, 0, 0.0
        sure = max(surest(row).values(), default=0.0)
        return 0 if is_flagged(row) else 2, rank_of(row), -sure

    return sorted(range(len(rows)), key=order)


def rank_of(row: Mapping[str, Any]) -> int:
    """Return the place of a row's end in `ENDS`, after them where there is none."""
    if row["lost_control_s"] is not None and row["ended"] != "impact":
        return ENDS.index("control_lost")
    return ENDS.index(row["ended"]) if row["ended"] in ENDS else len(ENDS)
