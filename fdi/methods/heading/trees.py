"""Which source of three is the one that disagrees? Two decision trees, and any three of a kind.

In: which pairs disagree, each True, False, or None where one of the two is absent. Out: the set of
verdicts that are still possible; one where all that matters is known. A verdict is a block, or
``none``, ``undecided`` (one pair alone is near its limit: wait) and ``unrecognised`` (all three
differ, no one of them is right).

The tables are the consistent ones: of the published trees (heading by compass, satellite and
camera; compass by two tilts) the printed leaves contradict themselves, docs/methods.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Final

State = bool | None
Table = Mapping[tuple[bool, bool, bool], str]

NONE: Final = "none"
UNDECIDED: Final = "undecided"
UNRECOGNISED: Final = "unrecognised"
NAMELESS: Final = frozenset({NONE, UNDECIDED, UNRECOGNISED})
"""Verdicts that accuse no block."""


def odd_one_out(first: str, second: str, third: str) -> Table:
    """Return the verdicts by the pairs first-second, first-third, second-third."""
    names = {
        (True, True, False): first,
        (True, False, True): second,
        (False, True, True): third,
        (False, False, False): NONE,
        (True, True, True): UNRECOGNISED,
    }
    return {
        pairs: names.get(pairs, UNDECIDED)
        for pairs in ((a, b, c) for a, b, c in product((False, True), repeat=3))
    }


TREE_A: Final = odd_one_out("inertial", "satellite", "optical")
"""Pairs inertial-satellite, inertial-optical, satellite-optical."""

TREE_B: Final[Table] = {
    (False, False, False): NONE,
    (False, True, False): NONE,
    (False, False, True): "angular_rate",
    (False, True, True): "angular_rate",
    (True, False, False): "magnetometer",
    (True, False, True): "magnetometer",
    (True, True, False): "accelerometer",
    (True, True, True): UNRECOGNISED,
}
"""Pairs compass by accelerometer tilt-satellite, that-compass by gyroscope tilt, this-satellite."""

_TILTS_APART: Final = frozenset({"accelerometer", "angular_rate"})
_TILTS_AGREE: Final = frozenset({NONE, "magnetometer"})


def possible(table: Table, pairs: tuple[State, State, State]) -> frozenset[str]:
    """Return the verdicts that a table still allows; ``none`` alone where nothing disagrees.

    With one source absent a pair that disagrees leaves either of the two; whatever speaks for the
    absent source or for no block is not listed, and a pair that agrees accuses neither.
    """
    known = [pair for pair in pairs if pair is not None]
    if not known or not any(known):
        return frozenset({NONE}) if known else frozenset()
    found = frozenset(
        table[a, b, c]
        for a, b, c in product((False, True), repeat=3)
        if all(p is None or p == q for p, q in zip(pairs, (a, b, c), strict=True))
    )
    return found if len(found) == 1 else found - NAMELESS


def tree_a(pairs: tuple[State, State, State]) -> frozenset[str]:
    """Return the verdicts on inertial, satellite and optical heading."""
    return possible(TREE_A, pairs)


def tree_b(pairs: tuple[State, State, State]) -> frozenset[str]:
    """Return the verdicts on what the compass heading is made of.

    Without the satellite, tilts that agree tell nothing of the magnetometer, and tilts that do not
    leave accelerometer and gyroscope.
    """
    by_accelerometer, tilts, by_gyroscope = pairs
    if by_accelerometer is None and by_gyroscope is None and tilts is not None:
        return _TILTS_APART if tilts else _TILTS_AGREE
    return possible(TREE_B, pairs)
