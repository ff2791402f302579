"""How far were the measurements from what the estimator expected, and how far did it allow for?

In: a log and its cores. Out: `Innovation`s: what was measured less what was expected, in SI, with
the variance and the test ratio where the log has them, each against its own level in the flight.

The trap: ``estimator_innovation_test_ratios`` are squared, and their gate is the parameter's only
while the source itself is fused (on a made-up position it is 3). So ratios are read, none is
computed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fdi.methods.estimator.ratios import LEVEL_S, MEAN_S, trailing_mean
from fdi.methods.estimator.records import Core, table
from fdi.methods.estimator.spans import Span
from fdi.telemetry import Log, Message

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Innovation:
    """One innovation of one core.

    Attributes
    ----------
    core : int
    channel, unit : str
    t, value : (n,) float
        s; SI, NaN unknown.
    variance, ratio : (n,) float or None
        Of the innovation, SI squared; innovation^2/(gate^2 variance) as logged. None: not in this
        log.
    level : float or None
        Median of its size over the first 20 s in the air; None where unknown, or 0.
    peak : float or None
        Largest mean size over 4 s in the air against that level.
    peak_t : float or None
        s.
    """

    core: int
    channel: str
    unit: str
    t: Floats
    value: Floats
    variance: Floats | None
    ratio: Floats | None
    level: float | None
    peak: float | None
    peak_t: float | None


def innovations_of(log: Log, cores: Sequence[Core], air: Span) -> tuple[Innovation, ...]:
    """Return the innovations of every core that are not all unknown or all zero."""
    numbers = {core.number for core in cores}
    found = (
        one
        for row in table("innovations")["entries"]
        for message in log.messages.values()
        if fnmatchcase(message.name, row["message"]) and (message.instance or 0) in numbers
        for one in _of(log, message, row, air)
    )
    return tuple(found)


def _of(log: Log, message: Message, row: Mapping[str, Any], air: Span) -> Iterator[Innovation]:
    for field in message.fields:
        if re.fullmatch(row["field"], field) is None:
            continue
        value = message.si(field)
        if not np.any(value[np.isfinite(value)] != 0.0):
            continue
        level, peak, peak_t = _against_level(message.t, np.abs(value), air)
        yield Innovation(
            message.instance or 0,
            f"{message.key}.{field}",
            message.unit(field),
            message.t,
            value,
            _beside(log, message, field, row, "variance"),
            _beside(log, message, field, row, "ratio"),
            level,
            peak,
            peak_t,
        )


def _beside(
    log: Log, message: Message, field: str, row: Mapping[str, Any], what: str
) -> Floats | None:
    """Return what stands beside an innovation, at its records; None where it is not in the log."""
    if f"{what}_field" in row:
        part, other = row[f"{what}_field"]
        name = field.replace(part, other)
        return message.si(name) if name in message else None
    if what not in row:
        return None
    key = message.key.replace(message.name, row[what])
    source = log.messages.get(key)
    if source is None or field not in source or not len(source):
        return None
    if np.array_equal(source.t, message.t):
        return source.si(field)
    latest = np.searchsorted(source.t, message.t, side="right") - 1
    return np.where(latest >= 0, source.si(field)[np.maximum(latest, 0)], np.nan)


def _against_level(
    t: Floats, size: Floats, air: Span
) -> tuple[float | None, float | None, float | None]:
    first = size[(t >= air[0]) & (t <= min(air[0] + LEVEL_S, air[1]))]
    first = first[np.isfinite(first)]
    level = float(np.median(first)) if first.size >= 3 else 0.0
    if level <= 0.0:
        return None, None, None
    mean = trailing_mean(t, size)
    mean[(t < air[0] + MEAN_S) | (t > air[1])] = np.nan
    if not np.isfinite(mean).any():
        return level, None, None
    row = int(np.nanargmax(mean))
    return level, float(mean[row] / level), float(t[row])
