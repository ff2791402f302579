"""How probably does a system of several units still work after a time, and for how long?

In: reliabilities or failure rates of the units. Out: reliability R(t) and mean time to failure
(MTTF) of one unit, series, parallel, and k of n units, equal or different, with a voter in series
where there is one.

What all of it assumes stands in `ASSUMPTIONS` and belongs beside every figure made of it.

The thesis prints the sum of 2 of 3 with R to the first power; as printed it gives 1.16 at
R = 0.905. It calls the sample mean of times to failure MTTF; that is an estimate of the integral of
R.

References
----------
Thesis on the triple redundant autopilot, section 2.2.2 and equations 2.1 to 2.5; M. Rausand, A.
Hoyland, "System Reliability Theory", 2nd ed. (2004), sections 2.6 and 4.6.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import comb, inf, isfinite
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.errors import UsageError

Floats = NDArray[np.float64]

ASSUMPTIONS: Final = (
    "units fail independently of each other (no common cause: weather, software, a shared sensor)",
    "the failure rate of a unit is constant (no wear, no early failures)",
    "nothing is repaired in flight",
    "a failure is always detected and the change of units takes no time",
)
"""What the closed forms rest on."""


def constant(rate: float, t: ArrayLike) -> Floats:
    """Return R(t) = exp(-rate t) of one unit.

    Parameters
    ----------
    rate : float
        Failures per unit of time, 0 or more.
    t : array_like
        In the same unit of time.

    Examples
    --------
    >>> round(float(constant(0.1, 1.0)), 6)
    0.904837
    """
    if not (isfinite(rate) and rate >= 0):
        raise UsageError(f"a failure rate of {rate:g} is not possible", hint="0 or more")
    found: Floats = np.exp(-rate * np.asarray(t, np.float64))
    return found


def from_rate(rate: Callable[[float], float], t: float) -> float:
    """Return R(t) = exp(-integral of the rate from 0 to t), by numerical integration.

    Parameters
    ----------
    rate : callable
        Failures per unit of time at a time.
    t : float
        0 or more.

    Examples
    --------
    >>> round(from_rate(lambda t: 0.2 * t, 1.0), 6)  # a unit that wears: exp(-0.1)
    0.904837
    """
    from scipy.integrate import quad

    return float(np.exp(-quad(rate, 0.0, t)[0]))


def series(units: Sequence[ArrayLike]) -> Floats:
    """Return the reliability of units all of which are needed.

    Parameters
    ----------
    units : sequence of array_like
        Reliability of each, 0 to 1.

    Examples
    --------
    >>> float(series([0.5, 0.5]))
    0.25
    """
    product: Floats = np.prod(_shares(units), axis=0)
    return product


def parallel(units: Sequence[ArrayLike]) -> Floats:
    """Return the reliability of units of which one suffices.

    Examples
    --------
    >>> float(parallel([0.5, 0.5]))
    0.75
    """
    all_fail: Floats = np.prod(1.0 - _shares(units), axis=0)
    return 1.0 - all_fail


def k_of_n(k: int, units: Sequence[ArrayLike], voter: ArrayLike = 1.0) -> Floats:
    """Return the reliability of units, equal or different, of which k are needed.

    Parameters
    ----------
    k : int
        1 (parallel) to n (series).
    units : sequence of (...) array_like
        Reliability of each of the n units, 0 to 1.
    voter : array_like
        Reliability of what votes, in series with all.

    Notes
    -----
    The probability that exactly i work is built up unit by unit (a Poisson binomial distribution),
    n^2 / 2 products, no subtraction.

    Examples
    --------
    >>> a, b, c = 0.9, 0.8, 0.7
    >>> round(float(k_of_n(2, [a, b, c])), 9), round(a * b + a * c + b * c - 2 * a * b * c, 9)
    (0.902, 0.902)
    """
    values = _shares(units)
    n = len(values)
    _check_k(k, n)
    working = np.zeros((n + 1, *values.shape[1:]))
    working[0] = 1.0
    for unit in values:
        works = working * unit
        working *= 1.0 - unit
        working[1:] += works[:-1]
    found: Floats = working[k:].sum(axis=0) * _shares([voter])[0]
    return found


def mttf_series(rates: Sequence[float]) -> float:
    """Return the mean time to failure of units in series: 1 / sum of their rates.

    Examples
    --------
    >>> mttf_series([0.5, 0.5, 1.0])
    0.5
    """
    total = sum(rates)
    return 1.0 / total if total > 0 else inf


def mttf_k_of_n(k: int, n: int, rate: float) -> float:
    """Return the mean time to failure of n equal units of which k are needed.

    (1/rate) (1/k + ... + 1/n); k = 1 is parallel, k = n series.

    Examples
    --------
    >>> round(mttf_k_of_n(2, 3, 1.0), 4), round(mttf_k_of_n(1, 3, 1.0), 4)
    (0.8333, 1.8333)
    """
    _check_k(k, n)
    return sum(1.0 / i for i in range(k, n + 1)) / rate if rate > 0 else inf


def mttf(reliability: Callable[[float], float]) -> float:
    """Return the mean time to failure, the integral of R from 0 on, by numerical integration.

    Parameters
    ----------
    reliability : callable
        R at a time; its unit of time should be of the order of the answer.

    Examples
    --------
    >>> round(mttf(lambda t: float(k_of_n(2, [constant(1.0, t)] * 3))), 6)
    0.833333
    """
    from scipy.integrate import quad

    return float(quad(reliability, 0.0, np.inf)[0])


def break_even(k: int, n: int) -> float:
    """Return the reliability of a unit below which k of n units are worse than one.

    0 where they never are (k = 1), 1 where they always are (k = n).

    Examples
    --------
    >>> round(break_even(2, 3), 6)
    0.5
    """
    _check_k(k, n)
    if k == 1 or k == n:
        return 0.0 if k == 1 else 1.0
    # k of n crosses the diagonal once between 0 and 1, from below
    low, high = 1e-9, 1.0 - 1e-9
    for _ in range(60):
        middle = (low + high) / 2
        at = sum(comb(n, i) * middle**i * (1 - middle) ** (n - i) for i in range(k, n + 1))
        low, high = (low, middle) if at > middle else (middle, high)
    return (low + high) / 2


def _check_k(k: int, n: int) -> None:
    if not 1 <= k <= n:
        raise UsageError(f"{k} of {n} units are no system", hint="1 to n units are needed")


def _shares(units: Sequence[ArrayLike]) -> Floats:
    values = np.stack(np.broadcast_arrays(*(np.asarray(unit, np.float64) for unit in units)))
    if not np.all((values >= 0) & (values <= 1)):
        raise UsageError("a reliability is not between 0 and 1")
    return values
