"""Which block is the odd one out, cycle by cycle? The value of the cross-check.

In: a log. Out: `HeadingCheck`. Each cycle of the slowest source has one verdict, from these
witnesses, each a table of which pairs disagree:

- increments of heading (compass, gyroscope, estimator) and of attitude (accelerometer, gyroscope,
  compass), over windows of three lengths: who disagrees with both others while these agree
- heights of receiver, barometer and specific force: whether the receiver is the odd one out
- the receiver's positions against its own velocity: nobody else is in it
- jumps of the magnetic field, which no turn makes and which change its strength
- the two trees of absolute headings
- silence: a receiver that had a fix and has none, a compass that told something and tells nothing

A block is named where all that name one agree. The estimator is made of the others: that it is the
odd one out is told, and accuses no block. A source that is absent from the beginning, or where it
cannot be told (a course at walking speed), is not silent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fdi.errors import LogError
from fdi.methods.heading.forces import force_pair
from fdi.methods.heading.geodesy import wrap
from fdi.methods.heading.increments import (
    GATE,
    WINDOW_S,
    Pair,
    gyroscopes_apart,
    heading_pairs,
    jump_pairs,
    receiver_pairs,
    sensor_pairs,
)
from fdi.methods.heading.motion import GAP_S, Bools, Ride, ride_of
from fdi.methods.heading.sources import Source, sources_of
from fdi.methods.heading.trees import (
    NAMELESS,
    NONE,
    TREE_A,
    UNDECIDED,
    UNRECOGNISED,
    State,
    Table,
    odd_one_out,
    possible,
    tree_b,
)
from fdi.methods.heading.vertical import height_pairs
from fdi.telemetry import Log
from fdi.telemetry.message import Floats

BLOCKS: Final = ("magnetometer", "accelerometer", "angular_rate", "satellite", "optical")
COMPONENTS: Final = {
    "magnetometer": "compass",
    "accelerometer": "accelerometer",
    "angular_rate": "gyroscope",
    "satellite": "gps",
    "optical": "optical_flow",
}
"""What a person replaces, by block."""
ESTIMATOR: Final = "estimator"
PERSISTS: Final = 2
"""Cycles within a window that name a block: one odd record makes no fault."""
CONFIRMS: Final = 2.0
"""Deviations by which other pairs must be off that a block is in: what 95 % of healthy ones are
not."""
STRENGTH: Final = 4.0
"""Deviations of the field's strength with which a jump of the field accuses (choice: 2 to 5 name
and accuse the same flights; a healthy compass near its motors comes to 3, for one cycle)."""
_HEADING: Final = odd_one_out("magnetometer", "angular_rate", ESTIMATOR)
_ATTITUDE: Final = odd_one_out("accelerometer", "angular_rate", "magnetometer")
_HEIGHT: Final = odd_one_out("satellite", "barometer", "accelerometer")
LENGTHS_S: Final = (WINDOW_S, 10.0)
"""Of windows: a bias adds up with the time, what records miss with its root (choice)."""
RECEIVER: Final = "the receiver against itself"
JUMPS: Final = "jumps of the field"
SILENCE: Final = "silence"
_INERTIAL: Final = frozenset({"magnetometer", "accelerometer", "angular_rate"})

Verdicts = frozenset[str]


@dataclass(frozen=True, slots=True)
class Named:
    """A stretch over which a block was named again and again, and no other one.

    Attributes
    ----------
    block : str
    start, end : float
        s, of the first and the last cycle.
    by : tuple of str
        Which witnesses named it.
    is_late : bool
        Another block was named before: it may be a consequence.
    """

    block: str
    start: float
    end: float
    by: tuple[str, ...]
    is_late: bool


@dataclass(frozen=True, slots=True, eq=False)
class HeadingCheck:
    """What the cross-check says of one flight.

    Attributes
    ----------
    ride : Ride
    sources : Mapping[str, Source]
    t : (m,) float
        s, one a cycle.
    verdicts : tuple of str
        By cycle: a block, ``none``, ``undecided`` or ``unrecognised``; "" where nothing could be
        compared.
    possible : tuple of frozenset
        By cycle the blocks that are not excluded by a pair that disagrees.
    pairs : tuple of Pair
        On ``t``.
    named : tuple of Named
        In the order of time.
    """

    ride: Ride
    sources: dict[str, Source]
    t: Floats
    verdicts: tuple[str, ...]
    possible: tuple[Verdicts, ...]
    pairs: tuple[Pair, ...]
    named: tuple[Named, ...]

    @property
    def accused(self) -> Named | None:
        """The block that was named first."""
        return self.named[0] if self.named else None


def cross_check(log: Log, flight: int | None = None) -> HeadingCheck:
    """Return which headings of a flight agree, and who is the odd one out.

    Parameters
    ----------
    log : Log
    flight : int, optional
        Which one, from 0; by default the last one that flew.

    Raises
    ------
    LogError
        There is no compass, no flight, or records are too far apart.
    UsageError
        There is no such flight.
    """
    return _checked(log, ride_of(log, flight))


def _checked(log: Log, ride: Ride) -> HeadingCheck:
    if ride.field is None:
        raise LogError(
            "no compass: there is no heading to check against others",
            where=log.name,
            hint="looked for xmag, ymag, zmag of RAW_IMU",
        )
    sources = sources_of(log, ride)
    grid = ride.grid(WINDOW_S)
    received, climbed = receiver_pairs(ride, grid), height_pairs(ride, grid)
    force, jumps = force_pair(ride, grid), jump_pairs(ride, grid)
    jumped = jumps[0].disagrees == 1.0
    by_force = np.ones(grid.size, np.bool_) if force is None else _off(force)
    pairs: list[Pair] = []
    witnesses = {}
    for length in LENGTHS_S:
        turned = heading_pairs(ride, grid, length)
        leant = _without_receiver(sensor_pairs(ride, grid, length), received)
        by_field = _off(leant[2]) & (_off(leant[1]) | _lately(jumped, grid, length))
        by_heading = _confirmed(_by_pairs(turned, _HEADING), "magnetometer", by_field)
        alone = np.ones(grid.size, np.bool_)
        for other in gyroscopes_apart(ride, grid, length):
            alone &= ~(np.abs(other.off) <= CONFIRMS * other.sigma)
        witnesses[f"increments of heading over {length:g} s"] = _confirmed(
            by_heading, "angular_rate", alone
        )
        witnesses[f"increments of attitude over {length:g} s"] = _confirmed(
            _by_pairs(leant, _ATTITUDE), "accelerometer", by_force
        )
        pairs += [replace(one, name=f"{one.name} {length:g} s") for one in (*turned, *leant)]
    witnesses[JUMPS] = [
        frozenset({"magnetometer"}) if one else frozenset()
        for one in jumped & _off(jumps[1], STRENGTH)
    ]
    witnesses[RECEIVER] = _by_receiver(received, grid.size)
    witnesses["heights"] = _by_heights(climbed, grid.size)
    witnesses[SILENCE] = _by_silence(ride, grid)
    suspect = [found == {"satellite"} for found in witnesses[RECEIVER]]
    witnesses["headings"] = _by_trees(ride, sources, grid, suspect)
    verdicts, open_to, by = _together(witnesses, grid.size)
    named = tuple(_stretches(grid, verdicts, by))
    return HeadingCheck(
        ride, sources, grid, verdicts, open_to, (*pairs, *jumps, *received, *climbed), named
    )


def _without_receiver(pairs: Sequence[Pair], received: Sequence[Pair]) -> tuple[Pair, ...]:
    """Return pairs, unknown those of accelerometers where the receiver contradicts itself.

    It tells the accelerations that are taken off what they read.
    """
    doubted = np.zeros(pairs[0].off.size, np.bool_)
    for one in received:
        doubted |= one.disagrees == 1.0
    return tuple(
        replace(pair, off=np.where(doubted, np.nan, pair.off))
        if pair.name.startswith("accelerometer")
        else pair
        for pair in pairs
    )


def _by_pairs(pairs: Sequence[Pair], table: Table) -> list[Verdicts]:
    columns = np.array([pair.disagrees for pair in pairs]).T
    return [possible(table, _known(row)) for row in columns]


def _known(row: Floats) -> tuple[State, State, State]:
    first, second, third = (None if np.isnan(x) else bool(x) for x in row)
    return first, second, third


def _lately(holds: Bools, grid: Floats, length: float) -> Bools:
    """Return where something held in the window before, s, or at its end."""
    count = np.insert(np.cumsum(holds), 0, 0)
    first = np.searchsorted(grid, grid - length, side="right")
    return np.asarray(count[1:] > count[first])


def _off(pair: Pair, limit: float = CONFIRMS) -> Bools:
    """Return where a pair is off by so many deviations; not where it is unknown."""
    return np.asarray(np.abs(pair.off) > limit * pair.sigma)


def _confirmed(found: list[Verdicts], block: str, also: Bools) -> list[Verdicts]:
    """Return verdicts that accuse a block only where others of its pairs are off as well.

    A heading depends on the tilt that levels it, and an estimator follows a wrong gyroscope: that
    it is the compass shows the field, against gyroscopes and against gravity. Instead of gravity it
    may have jumped: no gyroscope is off so much at once. The tilt by an accelerometer depends on
    accelerations, which specific force against the receiver's velocity has in full. And a gyroscope
    with which another one agrees is not off alone: an estimator that takes its heading anew from
    a compass near iron leaves both of them.
    """
    wait = frozenset({UNDECIDED})
    return [
        wait if one == {block} and not off else one for one, off in zip(found, also, strict=True)
    ]


def _by_heights(pairs: Sequence[Pair], size: int) -> list[Verdicts]:
    """Return where the receiver's height is the odd one out; others have better witnesses."""
    if not pairs:
        return [frozenset()] * size
    wait = frozenset({UNDECIDED})
    return [one if one <= {"satellite", NONE} else wait for one in _by_pairs(pairs, _HEIGHT)]


def _by_receiver(pairs: Sequence[Pair], size: int) -> list[Verdicts]:
    found = np.full(size, np.nan)
    for pair in pairs:
        found = np.fmax(found, pair.disagrees)
    names = {0.0: frozenset({NONE}), 1.0: frozenset({"satellite"})}
    return [names.get(float(x), frozenset()) for x in found]


def _by_silence(ride: Ride, grid: Floats) -> list[Verdicts]:
    """Return which blocks told something before and have told nothing for a while."""
    found: list[set[str]] = [set() for _ in grid]
    for block, spans in ride.lost.items():
        for low, high in spans:
            if high - low > GAP_S:  # a single record without a fix is none
                for i in np.flatnonzero((grid >= low) & (grid <= high)):
                    found[i].add(block)
    return [frozenset(one) for one in found]


def _by_trees(
    ride: Ride, sources: dict[str, Source], grid: Floats, suspect: Sequence[bool]
) -> list[Verdicts]:
    """Return the verdicts of tree A and, where the satellite is cleared, of tree B below it."""
    at = np.clip(np.searchsorted(ride.t, grid, side="right") - 1, 0, ride.t.size - 1)
    satellite = sources["receiver_yaw"] if not sources["receiver_yaw"].absent else sources["course"]
    inertial, gyro, optical = (sources[x] for x in ("compass", "compass_gyro", "optical"))

    def apart(one: Source, other: Source) -> Floats:
        off = np.abs(wrap(one.heading[at] - other.heading[at]))
        sigma = np.hypot(one.sigma[at], other.sigma[at])
        far = (off > GATE * sigma).astype(float)
        return np.where(np.isfinite(off) & np.isfinite(sigma), far, np.nan)

    of_a = (apart(inertial, satellite), apart(inertial, optical), apart(satellite, optical))
    of_b = (of_a[0], apart(inertial, gyro), apart(gyro, satellite))
    found = []
    for row_a, row_b, doubted in zip(np.array(of_a).T, np.array(of_b).T, suspect, strict=True):
        first = possible(TREE_A, _known(row_a))
        below = tree_b(_known(row_b))
        if first == {"satellite"} or first == {"optical"}:
            found.append(first)
        elif first == {"inertial"}:
            found.append(below - NAMELESS or _INERTIAL)
        elif "inertial" in first:
            rest = (first - {"inertial"}) | (below - NAMELESS or _INERTIAL)
            found.append(frozenset(rest | ({"satellite"} if doubted else set())))
        else:
            found.append(first or (below if below <= {NONE} else frozenset()))
    return found


def _together(
    witnesses: dict[str, list[Verdicts]], size: int
) -> tuple[tuple[str, ...], tuple[Verdicts, ...], list[tuple[str, ...]]]:
    verdicts, open_to, by = [], [], []
    for i in range(size):
        row = {name: found[i] for name, found in witnesses.items() if found[i]}
        single = {n: next(iter(f)) for n, f in row.items() if len(f) == 1}
        names = {n: block for n, block in single.items() if block in BLOCKS}
        suspects = frozenset().union(*row.values()) - NAMELESS
        blocks = set(names.values())
        if len(blocks) == 1:
            verdict = blocks.pop()
        elif blocks:
            verdict = UNRECOGNISED
        elif not row:
            verdict = ""
        elif suspects or UNDECIDED in single.values():
            verdict = UNDECIDED
        else:
            verdict = UNRECOGNISED if UNRECOGNISED in single.values() else NONE
        verdicts.append(verdict)
        open_to.append(frozenset({verdict}) if verdict in BLOCKS else suspects)
        by.append(tuple(names))
    return tuple(verdicts), tuple(open_to), by


def _stretches(t: Floats, verdicts: Sequence[str], by: Sequence[tuple[str, ...]]) -> list[Named]:
    """Return where a block is named by at least `PERSISTS` cycles, none of another between.

    Two of them are further apart than `WINDOW_S` at most where they begin anew.
    """
    runs: list[list[int]] = []
    for i in (i for i, verdict in enumerate(verdicts) if verdict in BLOCKS):
        last = runs[-1][-1] if runs else None
        if last is None or verdicts[last] != verdicts[i] or t[i] - t[last] > WINDOW_S:
            runs.append([])
        runs[-1].append(i)
    runs = [run for run in runs if len(run) >= PERSISTS]
    found = []
    for run in runs:
        names = dict.fromkeys(name for i in run for name in by[i])
        span = (float(t[run[0]]), float(t[run[-1]]))
        is_late = verdicts[run[0]] != verdicts[runs[0][0]]
        found.append(Named(verdicts[run[0]], *span, tuple(names), is_late=is_late))
    return found
