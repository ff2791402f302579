"""How do the values that healthy flights of one vehicle tell of a parameter differ between them?

In: one value with its standard error per flight. Out: what a later flight may expect. The flights
are taken as drawn from a normal distribution (random effects): what their values scatter beyond
their errors is the spread between flights, load, weather and repairs. It is taken without weights,
by moments, because the errors of a flight's beginning are known less well than the differences
between flights are large.

A later flight lies off the mean by that spread and by the error of the mean. Few flights tell their
scatter badly, so this deviation is wider by Student's t until two of it hold 95 % of later flights;
it is never wider than between any two flights of any vehicles, which the model states. One flight
tells no scatter: the deviation is that.

A flight departs from what others taught where its own values, taken together, are farther off than
all but a twentieth of healthy flights: each distance over the deviations of both is turned into the
normal one that is as rare, and the sum of their squares has a chi-squared distribution. Values of
one flight are taken to err independently.

References
----------
Hedges and Olkin, Statistical Methods for Meta-Analysis, 1985, section 9.B (the spread between
studies by moments, unweighted). Higgins, Thompson and Spiegelhalter, J. R. Stat. Soc. A 172, 2009,
section 4.1 (prediction of a new study); Student's t with one degree of freedom less than flights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fdi.model.system import Estimate, ParameterValue

STRETCH_S: Final = 20.0
"""From so many seconds after settling in the air: what `fdi.decision` takes its constants from."""
TELLING: Final = 0.5
"""Share of the model's width: a flight that leaves more repeats the prior, and tells nothing."""
ROUNDED: Final = 1e-3
"""A policy file holds four digits."""
RARE: Final = 0.05
"""Share of healthy flights: chosen, what two deviations leave out for one parameter."""
TWO_SIGMA: Final = 0.975
"""Quantile to which the tails of few flights are taken."""


@dataclass(frozen=True, slots=True)
class Effects:
    """The mean over flights, its standard error, and the spread between flights.

    ``spread`` and ``error`` are NaN for one flight.
    """

    mean: float
    error: float
    spread: float


def random_effects(values: Sequence[float], errors: Sequence[float]) -> Effects:
    """Return how the values of flights differ beyond their errors.

    Parameters
    ----------
    values, errors : (k,) float
        Of k flights, at least one; standard errors.

    Examples
    --------
    >>> random_effects([1.0, 3.0], [1.0, 1.0])
    Effects(mean=2.0, error=1.0, spread=1.0)
    """
    given, within = np.asarray(values, float), np.square(np.asarray(errors, float))
    mean = float(given.mean())
    if len(given) < 2:
        return Effects(mean, np.nan, np.nan)
    total = float(given.var(ddof=1))
    # where the flights scatter less than their errors say, these tell how well the mean is known
    error = np.sqrt(max(total, float(within.mean())) / len(given))
    return Effects(mean, float(error), float(np.sqrt(max(total - within.mean(), 0.0))))


def expected(values: Sequence[float], errors: Sequence[float], width: float) -> Estimate:
    """Return what a later flight may expect of a parameter.

    Parameters
    ----------
    values, errors : (k,) float
        Of k flights, at least one; standard errors.
    width : float
        Standard deviation over all vehicles.
    """
    effects, count = random_effects(values, errors), len(values)
    most = widest(count, width)
    if count < 2:
        return Estimate(effects.mean, most, count)
    std = _wider(count) * float(np.hypot(effects.spread, effects.error))
    return Estimate(effects.mean, min(std, most), count)


def learned_parameters(flights: Sequence[Mapping[str, ParameterValue]]) -> dict[str, Estimate]:
    """Return what flights tell of every parameter that was identified on one of them, by name.

    Parameters
    ----------
    flights : sequence of mapping of str to ParameterValue
        The parameters of each, identified without anything learned before.
    """
    found = {}
    for name in dict.fromkeys(name for flight in flights for name in flight):
        own = [p for flight in flights if (p := flight.get(name)) is not None and tells(p)]
        if own:
            values, errors = [p.value for p in own], [p.std or 0.0 for p in own]
            found[name] = expected(values, errors, own[0].width)
    return found


def tells(parameter: ParameterValue) -> bool:
    """Return whether a flight tells more of a parameter than the model does."""
    if parameter.source != "identified" or parameter.std is None:
        return False
    return parameter.std < TELLING * parameter.width


@dataclass(frozen=True, slots=True)
class Departure:
    """How far a flight is from what others taught, and the share of healthy ones as far off.

    ``distances``: of its own value from the learned one by parameter, as a normal value's from its
    mean in standard deviations.
    """

    share: float
    distances: Mapping[str, float]

    @property
    def rare(self) -> bool:
        """Return whether so few healthy flights are as far off that this is told."""
        return self.share < RARE


def departure(parameters: Mapping[str, ParameterValue]) -> Departure | None:
    """Return how far a flight is from what others taught; None where nothing was learned."""
    distances = {}
    for name, own in parameters.items():
        if own.learned is not None and own.flight is not None:
            unsure = np.hypot(own.flight.std, own.learned.std)
            off = float((own.flight.value - own.learned.value) / unsure)
            distances[name] = as_normal(off, own.learned, own.width)
    return Departure(share_beyond(list(distances.values())), distances) if distances else None


def as_normal(distance: float, learned: Estimate, width: float) -> float:
    """Return the distance, in learned deviations, that is as rare for normal values.

    Where the deviation was learned, Student's t has longer tails than its two deviations tell;
    where it is the model's, the values are normal.
    """
    from scipy.special import ndtri, stdtr

    if learned.flights < 2 or learned.std > (1 - ROUNDED) * widest(learned.flights, width):
        return distance
    tail = float(stdtr(learned.flights - 1, -abs(distance) * _wider(learned.flights)))
    return float(np.copysign(ndtri(tail), distance))


def share_beyond(distances: Sequence[float]) -> float:
    """Return the share of healthy flights that are as far off, all distances together."""
    from scipy.special import chdtrc

    return float(chdtrc(len(distances), np.square(distances).sum()))


def widest(flights: int, width: float) -> float:
    """Return the most that a later flight may be off the mean of flights, if all differ alike.

    ``width``: the standard deviation over all vehicles.
    """
    return width * float(np.sqrt(1 + 1 / flights))


def _wider(flights: int) -> float:
    """Return by how much so few flights widen what two deviations hold."""
    from scipy.special import ndtri, stdtrit

    return float(stdtrit(flights - 1, TWO_SIGMA) / ndtri(TWO_SIGMA))
