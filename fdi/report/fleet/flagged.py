"""Which logs need a look, and why?

In: rows of `fdi.fleet`. Out: words. A flight is flagged that ended badly or in which somebody is
accused. One that ends in the air is not: every second log does, and says no more by it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

ENDS: Final = ("impact", "control_lost", "failsafe", "in_air", "landed", "on_ground")
"""How a flight may end, the worst first."""
BADLY: Final = {"impact": "hit the ground", "failsafe": "ended in a failsafe"}


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
        yield f"{', '.join(row['accused'])} accused"
