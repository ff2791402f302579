"""In which ways can the motors of a multicopter be arranged otherwise than the log says?

In: a log and the motors of its frame. Out: `Arrangement`s: what each motor's thrust would do to
roll, pitch and yaw, and in words what was then set up wrongly. The first is the frame as set. Ways
that no motion can tell apart (all propellers reversed, or H set where the frame is an X) are one
arrangement with several words. What differs from the frame as set by little (a V for an X) is left
out: real frames differ by as much.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, permutations, product
from typing import Final, NamedTuple

import numpy as np

from fdi.methods.setup.values import Setting
from fdi.telemetry import Log
from fdi.telemetry.message import Floats
from fdi.telemetry.motors import Motor, motors_of

ALIKE: Final = 0.95
"""Cosine of two rows from which on they are taken to be the same: 18 degrees between them.

A V differs from an X by 0.994, an octocopter without one motor from itself by 0.935.
"""
_EDGE: Final = "on its edge"
_SMALL: Final = 4  # motors that are tried in every order; six have 720
_TYPES: Final = {
    **{0: "plus", 1: "X", 2: "V", 3: "H", 12: "Betaflight X", 13: "DJI X", 14: "clockwise X"},
}
_RARE_TYPES: Final = {
    **{4: "V-tail", 5: "A-tail", 6: "plus, reversed", 15: "I", 18: "Betaflight X, reversed"},
    **{19: "Y4"},
}
"""FRAME_TYPE, ArduPilot AP_Motors_Class.h; those without yaw control (16, 17) cannot be told."""


COMMON: Final = -3.0
"""Log of how often a mistake that people make is met, against a vehicle that is set up well."""
STRANGE: Final = -8.0
"""The same of what hardly anybody does: any order, a board on its edge, a motor upside down."""


class Arrangement(NamedTuple):
    """``directions`` (3, m): what each motor does to roll, pitch, yaw. ``words``: what is wrong.

    ``setting``: the parameter that would make it right, where it is one.

    ``prior`` is the log of how likely that is before the flight is seen. Where a flight shows
    little (one that flips on take-off turns one way only), the common mistakes come first.
    """

    directions: Floats
    words: tuple[str, ...]
    prior: float = 0.0
    setting: Setting | None = None


class _Way(NamedTuple):
    matrix: Floats
    words: str
    setting: Setting | None = None


def arrangements(log: Log, motors: tuple[Motor, ...]) -> tuple[Arrangement, ...]:
    """Return the frame as set and all others, each once.

    Parameters
    ----------
    log : Log
        Of the frame, for other frames that its autopilot knows.
    motors : tuple of Motor
        At least one of them yaws.
    """
    told = directions_of(motors)
    made: dict[bytes, Arrangement] = {_key(told): Arrangement(told, ())}
    ways = [(COMMON, _common(log, told)), (STRANGE, _strange(log, told))]
    for prior, each in ways:
        for matrix, words, setting in each:
            key = _key(matrix)
            known = made.setdefault(key, Arrangement(matrix, (), prior, setting))
            if key != _key(told) and prior == known.prior and words not in known.words:
                made[key] = known._replace(words=(*known.words, words))
    return tuple(
        way
        for way in made.values()
        if not way.words or np.any(cosines(way.directions, told) < ALIKE)
    )


def directions_of(motors: tuple[Motor, ...]) -> Floats:
    """Return what each motor does to roll, pitch and yaw, (3, m); yaw is 0 where nobody says."""
    rows = np.array([[m.roll for m in motors], [m.pitch for m in motors], [m.yaw for m in motors]])
    rows[~np.isfinite(rows).all(axis=1)] = 0.0
    return rows


def _common(log: Log, told: Floats) -> Iterator[_Way]:
    count = told.shape[1]
    for i, j in combinations(range(count), 2):
        order = list(range(count))
        order[i], order[j] = j, i
        yield _Way(told[:, order], f"motors {i + 1} and {j + 1} are swapped")
    reversed_yaw = told * np.array([[1.0], [1.0], [-1.0]])
    yield _Way(reversed_yaw, "all propellers turn the other way")
    yield from _other_frames(log, told, _TYPES)
    yield from (each for each in _turned(told) if _EDGE not in each.words)
    for i in range(count):
        matrix = told.copy()
        matrix[:, i] = 0.0
        yield _Way(matrix, f"motor {i + 1} has no effect")


def _strange(log: Log, told: Floats) -> Iterator[_Way]:
    count = told.shape[1]
    yield from _other_frames(log, told, _RARE_TYPES)
    yield from (each for each in _turned(told) if _EDGE in each.words)
    for i in range(count):
        matrix = told.copy()
        matrix[:, i] *= -1.0
        yield _Way(matrix, f"motor {i + 1} pushes down instead of up")
    for order in permutations(range(count)) if count <= _SMALL else ():
        places = ", ".join(f"{i + 1} where {k + 1} belongs" for i, k in enumerate(order) if i != k)
        yield _Way(told[:, order], f"motors stand in another order: {places}")


def _other_frames(log: Log, told: Floats, types: Mapping[int, str]) -> Iterator[_Way]:
    """Yield the other types that ArduPilot knows of this class of frame."""
    if log.autopilot != "ardupilot":
        return
    name = "FRAME_TYPE" if "FRAME_TYPE" in log.parameters else "FRAME"
    for kind, called in types.items():
        motors = motors_of({**log.parameters, name: float(kind)}, log.autopilot, log.vehicle)
        matrix = directions_of(motors) if motors else told
        if matrix.shape == told.shape and np.any(matrix[2]):
            now = log.parameters[name]
            why = f"The motors turn the vehicle as those of a {called} frame would"
            words = f"{name} fits {kind} ({called}), not {now:.0f}"
            yield _Way(matrix, words, Setting(name, now, float(kind), why))


def _turned(told: Floats) -> Iterator[_Way]:
    """Yield the autopilot's board turned by quarters in every way, seen from its own axes."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.zeros((3, 3))
        turn[range(3), order] = signs
        if np.linalg.det(turn) > 0 and not np.array_equal(turn, np.eye(3)):
            yield _Way(turn @ told, f"the autopilot's board is {_how(turn)}")


def _how(turn: Floats) -> str:
    """Return in words how a board is turned whose axes see the vehicle's by this rotation."""
    if turn[2, 2] == 1.0:
        right = np.degrees(np.arctan2(turn[0, 1], turn[0, 0])) % 360
        return f"turned by {right:.0f} degrees to the right"
    return "upside down" if turn[2, 2] == -1.0 else _EDGE


def _key(matrix: Floats) -> bytes:
    size = np.linalg.norm(matrix, axis=1, keepdims=True)
    return bytes(np.round(matrix / np.where(size, size, 1.0) + 0.0, 3).tobytes())


def cosines(one: Floats, other: Floats) -> Floats:
    """Return how alike two arrangements are, (3,), by roll, pitch, yaw; 1 where one has none."""
    sizes = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    products = (one * other).sum(axis=1)
    return np.where(sizes, products / np.where(sizes, sizes, 1.0), 1.0)
