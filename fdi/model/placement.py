"""Which further telemetry would show more?

In: a model and, where there is one, a log. Out: for every message that the model can use and the
log lacks, what it would add about the faults that this telemetry brings, and the smallest sets of
such messages that add all that can be added. Without a log nothing is lacking; then it is what a
further sensor of each variable would add, and a smallest set of sensors. By structure alone:
whether a test can be implemented is not asked.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from fdi.errors import UsageError
from fdi.model.airframe import Airframe
from fdi.model.hints import is_lacking, recorded_as, setting_of
from fdi.structure import Model
from fdi.structure.additions import Counts, Reach, gained, minimal_additions, reach
from fdi.structure.cheapest import cheapest_additions
from fdi.structure.placement import cheapest_sensors, sensor_gains
from fdi.telemetry import Log

LIMIT = 2000
"""Choices of messages that are looked at before the smallest sets are given up."""
SECONDS = 60.0
"""For the proof that a set is a smallest one; the shipped models take less than one."""


@dataclass(frozen=True, slots=True)
class Gain:
    """What one more message, or one more sensor, would add.

    Attributes
    ----------
    name : str
        Of the message, or of the variable that the sensor measures.
    detectable : tuple of str
        Faults, of those there are, that would become detectable.
    isolable : tuple of (str, str)
        Pairs of which the first could be told from the second.
    setting : str
        By which setting of the autopilot the message is logged; "" where that is not known.
    """

    name: str
    detectable: tuple[str, ...]
    isolable: tuple[tuple[str, str], ...]
    setting: str = ""


@dataclass(frozen=True, slots=True)
class Placement:
    """Which further telemetry would show more.

    Attributes
    ----------
    kind : {"message", "sensor"}
    candidates : tuple of str
        Messages that the model can use, such a log may hold and this one lacks, in the order of the
        model, or variables.
    gains : tuple of Gain
        What each adds alone, the most useful first; those that add nothing are missing.
    sets : tuple of tuple of str, or None
        Minimal sets that together add all that all candidates add, smallest first; an empty set
        when nothing can be added. Of sensors, and of messages where there are too many sets, one of
        the smallest. None where it was not found in time.
    """

    kind: Literal["message", "sensor"]
    candidates: tuple[str, ...]
    gains: tuple[Gain, ...]
    sets: tuple[tuple[str, ...], ...] | None


def place(airframe: Airframe, log: Log | None) -> Placement:
    """Return which further messages, or without a log which sensors, would show more.

    Raises
    ------
    LogError
        The log has no channel that the model measures.
    """
    return _sensors(airframe) if log is None else _messages(airframe, log)


def _sensors(airframe: Airframe) -> Placement:
    model = airframe.observe().structure(trusting=False)
    gains = tuple(Gain(model.unknowns[u], *gain) for u, gain in sensor_gains(model).items())
    found = cheapest_sensors(model, seconds=SECONDS)
    sets = tuple(tuple(model.unknowns[u] for u in sensors) for sensors in found.sets[:1])
    return Placement("sensor", model.unknowns, _ordered(gains), sets if found.proven else None)


def _ordered(gains: Iterable[Gain]) -> tuple[Gain, ...]:
    return tuple(sorted(gains, key=lambda gain: -len(gain.detectable) - len(gain.isolable)))


def _messages(airframe: Airframe, log: Log) -> Placement:
    # what a method makes, nobody can record
    told = (m for m in airframe.measurements if not m.made_by)
    makes: dict[str, list[str]] = {}  # a recorded message, and what the model reads of it
    for source in dict.fromkeys(str(m.channel.source) for m in told):
        name = recorded_as(source, log)
        if name and is_lacking(source, log):
            makes.setdefault(name, []).append(source)
    candidates = tuple(makes)

    @cache
    def extended(counts: Counts) -> Model:
        return observed(name for name, n in zip(candidates, counts, strict=True) if n)

    def observed(names: Iterable[str]) -> Model:
        also = frozenset(source for name in names for source in makes[name])
        return airframe.observe(log, also=also).structure(trusting=False)

    before = reach(observed(()))
    each = (
        Gain(name, *gained(before, reach(observed([name]))), setting_of(makes[name][0], log))
        for name in candidates
    )
    gains = _ordered(gain for gain in each if gain.detectable or gain.isolable)
    most = (1,) * len(candidates)
    best = reach(extended(most))
    own = [best.names.index(name) for name in before.names]
    wanted = Reach(before.names, best.seen[own], best.told[np.ix_(own, own)])
    try:
        found = tuple(minimal_additions(extended, most, wanted, LIMIT))
    except UsageError:  # too many: one of the smallest
        one = cheapest_additions(extended, most, (1.0,) * len(most), wanted, seconds=SECONDS)
        if not one.proven:
            return Placement("message", candidates, gains, None)
        found = one.choices[:1]
    sets = (tuple(s for s, n in zip(candidates, counts, strict=True) if n) for counts in found)
    return Placement("message", candidates, gains, tuple(sets))
