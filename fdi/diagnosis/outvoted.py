"""Which alarms of what a part disturbs cannot come from that part, by a test that stays quiet?

In: whom the tests of a bank concern. Out: `Denial`s. Two sensors and an estimator that show the
same make three tests. Where both tests of the estimator alarm and that between the two sensors is
quiet, the estimator is off by itself: a sensor that had led it astray would be off against the
other sensor at least as far. This holds of any three that show one thing, by structure alone, and
of each of the three faults only where it enters both of its tests.

A quiet test is no proof: its threshold may be wide. So a sensor is not cleared by it, and what
alarms between it and the estimator still speaks against it; the other alarm does not.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.diagnosis.concerns import Concerns

Pair = tuple[str, str]


class Denial(NamedTuple):
    """An alarm, a test ``row``, is not a component's doing if ``apart`` alarms, ``quiet`` not.

    ``apart`` is the test between the component and what it disturbs, ``quiet`` that between the
    component and who else the alarm concerns.
    """

    component: str
    row: int
    quiet: int
    apart: int


def denials(whom: Concerns, reach: Mapping[str, frozenset[str]]) -> tuple[Denial, ...]:
    """Return what quiet tests could deny, for all components.

    Parameters
    ----------
    whom : Concerns
    reach : mapping
        Of every component those that its failure disturbs.
    """
    return tuple(_denials(whom, reach))


def _denials(whom: Concerns, reach: Mapping[str, frozenset[str]]) -> Iterator[Denial]:
    pairs = _pairs(whom)
    of: dict[str, set[str]] = defaultdict(set)
    for one, other in pairs:
        of[one].add(other)
    for (fault, follower), rows in pairs.items():
        name = whom.component[fault]
        if whom.component[follower] not in reach.get(name, ()):
            continue
        for witness in of[follower] & of[fault]:
            if whom.component[witness] in (name, whom.component[follower]):
                continue
            for row in pairs[follower, witness]:
                for quiet in pairs[fault, witness]:
                    yield from (Denial(name, row, quiet, apart) for apart in rows)


def _pairs(whom: Concerns) -> dict[Pair, list[int]]:
    """Return the tests that hold just two components' faults, by each two faults of theirs."""
    found: dict[Pair, list[int]] = defaultdict(list)
    for row in range(len(whom.faults)):
        held = whom.held_by(row)
        if len(held) != 2 or whom.supports[row] or whom.narrow[row]:
            continue
        own = [fault for fault in whom.faults[row] if fault not in whom.suspected]
        for one in own:
            for other in own:
                if whom.component[one] != whom.component[other]:
                    found[one, other].append(row)
    return found


def denied(
    known: Sequence[Denial], alarmed: NDArray[np.bool_], judged: NDArray[np.bool_]
) -> dict[str, NDArray[np.bool_]]:
    """Return of components the alarms, (r,), that show nobody led astray by them.

    Parameters
    ----------
    known : sequence of Denial
    alarmed, judged : (r,) bool
        Of the tests around a moment.
    """
    quiet = judged & ~alarmed
    found: dict[str, NDArray[np.bool_]] = {}
    for one in known:
        if alarmed[one.row] and alarmed[one.apart] and quiet[one.quiet]:
            rows = found.setdefault(one.component, np.zeros(len(alarmed), np.bool_))
            rows[[one.row, one.apart]] = True
    return found
