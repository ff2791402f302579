"""How far may be off what a check measured, and which verdict does that allow?

In: a measured share, angle or ratio. Out: an `Interval` of `SURE` standard errors. By which law
depends on what was measured: a share of the time is binomial, an explained share a squared
correlation, and of all else the spread over the flight's parts tells (`by_parts`), which holds
whatever the noise is and counts a fault that stands in one part as what it is.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.methods.setup.values import Verdict

SURE: Final = 3.0
"""Standard errors: beyond, one in 370 by chance."""
PARTS: Final = 10
"""Of a flight, for the spread over them: fewer tell no spread, more are no longer independent."""

Mask = NDArray[np.bool_]


class Interval(NamedTuple):
    """A value, and between what it lies."""

    value: float
    least: float
    most: float


def verdict_of(found: Interval, *, fine: float, bad: float) -> Verdict:
    """Return in order where all of it lies below ``fine``, wrong where all lies above ``bad``."""
    if found.most < fine:
        return "in order"
    return "wrong" if found.least > bad else "not known"


def by_parts(estimate: Callable[[Mask], float], count: int, lowest: float = -np.inf) -> Interval:
    """Return an estimate from all of so many samples, and its interval by leaving parts out.

    ``lowest`` is what it cannot fall below.

    The jackknife over `PARTS` stretches of consecutive samples: what samples near one another have
    in common does not make it surer (Shao and Tu, The Jackknife and Bootstrap, 9.2).
    """
    every = np.ones(count, np.bool_)
    value = estimate(every)
    others = []
    for part in np.array_split(np.arange(count), min(PARTS, count)):
        kept = every.copy()
        kept[part] = False
        others.append(estimate(kept) if kept.any() else value)
    size = len(others)
    error = float(np.sqrt((size - 1) * np.var(others)))
    return Interval(value, max(value - SURE * error, lowest), value + SURE * error)


def of_time(happens: Mask) -> Interval:
    """Return in what share of the samples something happens, 0 to 1.

    Wilson's interval of a binomial share, samples counted as often as they are independent by
    their own autocorrelation: what happens once for a while is one event.
    """
    share, count = float(happens.mean()), float(happens.size)
    rest = happens - share
    size = float(rest @ rest)
    follows = float(np.clip(rest[1:] @ rest[:-1] / size, 0.0, 1 - 1 / count)) if size else 0.0
    count *= (1 - follows) / (1 + follows)
    middle = (share + SURE**2 / (2 * count)) / (1 + SURE**2 / count)
    half = SURE * np.sqrt(share * (1 - share) / count + (SURE / (2 * count)) ** 2)
    half = float(half) / (1 + SURE**2 / count)
    return Interval(share, min(max(middle - half, 0.0), share), max(min(middle + half, 1.0), share))


def of_explained(share: float, independent: float) -> Interval:
    """Return an explained share of a variance, 0 to 1: a squared correlation, by Fisher's z."""
    share = float(np.clip(share, 0.0, 1.0))
    z = np.arctanh(np.sqrt(min(share, 1 - 1e-9)))
    error = SURE / np.sqrt(max(independent - 3.0, 1.0))
    least, most = (float(np.tanh(max(x, 0.0)) ** 2) for x in (z - error, z + error))
    return Interval(share, min(least, share), max(most, share))


def in_percent(share: Interval) -> str:
    """Return a share with its interval in parentheses where that shows.

    >>> in_percent(Interval(0.689, 0.6, 0.77))
    '69 % (60 to 77 %)'
    """
    return in_words(Interval(*(100 * x for x in share)), " %")


def in_degrees(angle: Interval) -> str:
    """Return an angle in radians in degrees, with its interval in parentheses where that shows.

    Examples
    --------
    >>> in_degrees(Interval(*np.radians([1, 1, 2]))), in_degrees(Interval(*np.radians([2, 2, 2])))
    ('1 degree (1 to 2 degrees)', '2 degrees')
    """
    told = in_words(Interval(*np.degrees(angle)), " degrees")
    return re.sub(r"^1 degrees", "1 degree", told)


def in_words(found: Interval, unit: str, digits: int = 0) -> str:
    """Return a value, unit and all, with its interval in parentheses where that shows."""
    value, least, most = (f"{x + 0.0:.{digits}f}" for x in found)
    told = f"{value}{unit}"
    return told if least == value == most else f"{told} ({least} to {most}{unit})"


def numbers_of(name: str, found: Interval, scale: float = 1.0) -> dict[str, float]:
    """Return a value and its interval under a name and ``_least``, ``_most`` after it."""
    value, least, most = (scale * x for x in found)
    return {name: value, f"{name}_least": least, f"{name}_most": most}
