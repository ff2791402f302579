"""How far apart are two faults for a bank, in noise, and how large must one be to be told?

In: residuals of a flight, a stretch of it, and a time profile for faults. Out: for every fault and
every pair of faults the distinguishability of Eriksson, Frisk and Krysander, and from it the
smallest size that is detected, and told from another fault, at a false-alarm rate.

Over a window of samples all residuals together are ``r = F_i s + F_j y + A e`` (``window.py``):
``A e`` is what noise does to them, ``F_i s`` what fault i of size s does, and ``F_j y`` what fault
j does with any time profile. How far the data with fault i are from the nearest that fault j could
make, as the expected log-likelihood ratio (Kullback-Leibler), is half the square of what is left of
``F_i s`` when the noise is made white and the span of ``F_j`` is projected out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats
from fdi.residuals.bank import Residuals
from fdi.residuals.window import Window, at_sizes, moved_by
from fdi.shown import Shown

FLOOR: Final = 1e-2
"""Variance of a residual, relative to its own by the noise, that it has for itself alone: residuals
of the same channels are functions of one another, but not to better than 10 % of their noise, since
they are linear only around a point that is measured itself. From 1e-3 to 1e-1 sizes change by 4 %
on a model with loops; at 1e-6 they are half as large, and drawn noise raises alarms in every third
window."""
SETTLED: Final = 0.5
"""Share of a distance that ten times the floor may change (0.1 % is usual, 90 % where the floor is
all the noise there is): beyond, no noise is stated of what shows the fault."""
FREE: Final = 1e-5
"""Share of a response below which what is left of it is rounding."""
TIMES: Final = 2.0 ** np.arange(-2, 5)
"""Of the size by the slopes: where the size is looked for from which a fault is seen."""
SPAN: Final = 1e-7
"""Singular values of a fault's span, relative to the largest, below which they are rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Distinguishability(Shown):
    """Of faults of size one: how far from health and from each other.

    Attributes
    ----------
    names, units : tuple of str
    detected : (f,) float
        Kullback-Leibler distance from health, without a unit; NaN where it shows only in residuals
        without stated noise.
    told : (f, f) float
        ``[i, j]``: of fault i from the nearest that fault j could be; the diagonal is 0.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    detected: Floats
    told: Floats


def distinguishability(window: Window, bank: Sequence[int] | None = None) -> Distinguishability:
    """Return how far faults of size one are from health and from each other.

    Parameters
    ----------
    window : Window
    bank : sequence of int, optional
        The residuals that are there, by their places; by default all.

    Notes
    -----
    Of a fault of size s it is ``s**2`` times as far. Residuals without any stated noise are left
    out; no distance is known of a fault that shows in these alone, or in combinations of residuals
    in which no stated noise is left.

    References
    ----------
    Eriksson, Frisk, Krysander, "A method for quantitative fault diagnosability analysis of
    stochastic linear descriptor models", Automatica 49(6), 2013, definition 2 and theorem 2.
    """
    rows = _rows(window, bank)
    found, other = (_distances(window, rows, floor) for floor in (FLOOR, 10 * FLOOR))
    with np.errstate(divide="ignore", invalid="ignore"):
        detected, told = (
            np.where(np.abs(own - more) <= SETTLED * own, own, np.nan)
            for own, more in zip(found, other, strict=True)
        )
    # what cannot be seen cannot be told: nothing is open there
    told[detected == 0] = 0.0
    return Distinguishability(window.names, window.units, detected, told)


def _distances(window: Window, rows: NDArray[np.int64], floor: float) -> tuple[Floats, Floats]:
    """Return the distances from health, (f,), and between faults, (f, f), of size one."""
    whiten, silent = _whitening(window.covariance[np.ix_(rows, rows)], floor)
    response = window.response[:, rows]
    white = response @ whiten.T
    told = np.zeros((len(white), len(white)))
    for j, own in enumerate(window.free):
        told[:, j] = 0.5 * (_without(white, whiten @ own[rows]) ** 2).sum(axis=1)
    detected = 0.5 * (white**2).sum(axis=1)
    unstated = ~white.any(axis=1) & response[:, silent].any(axis=1)
    detected[unstated] = np.nan
    told[unstated] = np.nan
    np.fill_diagonal(told, 0.0)
    return detected, told


def best_test(window: Window, fault: str, other: str | None = None) -> Floats:
    """Return the weights of the residuals' values with which a fault is found best, (m,).

    Parameters
    ----------
    window : Window
    fault, other : str
        The fault of the profile, and the one with any profile to which the test shall not react.

    Returns
    -------
    (m,) float
        For the rows of the window: their weighted sum has unit variance in health, and the fault of
        size s moves it by ``s * sqrt(2 D)``. All 0 where nothing tells the faults apart.
    """
    whiten, _ = _whitening(window.covariance)
    white = window.response[window.names.index(fault)] @ whiten.T
    if other is not None:
        white = _without(white[None], whiten @ window.free[window.names.index(other)])[0]
    size = float(np.linalg.norm(white))
    weights: Floats = white @ whiten / size if size else np.zeros(len(window.residual))
    return weights


def smallest_size(distance: Floats, alpha: float, power: float = 0.9) -> Floats:
    """Return the size of a fault that is found at a false-alarm rate.

    Parameters
    ----------
    distance : float array
        Distinguishability of the fault of size one.
    alpha : float
        Probability of an alarm in one window without a fault, to either side.
    power : float
        Probability of an alarm with the fault.

    Returns
    -------
    float array
        In units of the fault; infinite where it shows nothing, NaN where no distance is known.

    Notes
    -----
    The most powerful test of a known profile is the projection of the white data on it, which has
    unit variance and is off by ``sqrt(2 D) s`` with the fault (Neyman and Pearson 1933).
    """
    from scipy.special import ndtri

    needed = float(ndtri(1 - alpha / 2) + ndtri(power))
    with np.errstate(divide="ignore"):
        return np.asarray(needed / np.sqrt(2 * np.asarray(distance)), dtype=np.float64)


def at_smallest(window: Window, residuals: Residuals, alpha: float, power: float = 0.9) -> Window:
    """Return a window with what faults do to the rows when they are just large enough to be seen.

    Parameters
    ----------
    window : Window
    residuals : Residuals
        That it is of.
    alpha, power : float
        As of :func:`smallest_size`.

    Returns
    -------
    Window
        A length, an angle or a corner answers otherwise at ten times the noise than within it. An
        error of a channel may be to either side: that counts where it shows less. What is off in
        an equation has the side where it shows more. A fault that is not seen up to 16 times
        the size by the slopes shows nothing.
    """
    whiten, _ = _whitening(window.covariance)
    sizes = smallest_size(0.5 * ((window.response @ whiten.T) ** 2).sum(axis=1), alpha, power)
    sizes = np.where(np.isfinite(sizes), sizes, 0.0)
    needed = float(smallest_size(np.array(0.5), alpha, power))
    tried = sizes[:, None] * np.concatenate([TIMES, -TIMES])
    of = {fault.name: fault.equation for fault in residuals.bank.system.faults}
    equations = residuals.bank.system.equations
    found: dict[str, float] = {}
    rows = moved_by(window, residuals, tried)
    for name, own, moved in zip(window.names, tried[:, : len(TIMES)], rows, strict=True):
        one, other = moved @ whiten.T
        lengths = np.sqrt(np.clip((one * other).sum(axis=1), 0.0, None)).reshape(2, -1)
        up, down = (_crossing(own, one, needed) for one in lengths)
        either = equations[of[name]].measurement is not None
        found[name] = -down if (down > up) == either else up
    there = at_sizes(window, residuals, found)
    unseen = (sizes > 0) & ~np.isfinite([found[name] for name in window.names])
    return replace(there, response=np.where(unseen[:, None], 0.0, there.response))


def _crossing(sizes: Floats, lengths: Floats, needed: float) -> float:
    """Return from which size on what is seen is long enough, inf where at none."""
    enough = np.flatnonzero(lengths < needed)
    last = enough[-1] + 1 if enough.size else 0
    if last == len(sizes):
        return np.inf
    if not last:
        return float(sizes[0])
    low, high = lengths[last - 1 : last + 1]
    share = (needed - low) / (high - low)
    return float(sizes[last - 1] + share * (sizes[last] - sizes[last - 1]))


def _rows(window: Window, bank: Sequence[int] | None) -> NDArray[np.int64]:
    if bank is None:
        return np.arange(len(window.residual))
    return np.flatnonzero(np.isin(window.residual, bank))


def _whitening(covariance: Floats, floor: float = FLOOR) -> tuple[Floats, NDArray[np.bool_]]:
    """Return what makes rows white, (k, m), and the rows without noise, (m,) bool, left out of it.

    Done for the rows that hang together by their noise, one after the other: the factors of a
    matrix cost the cube of its size.
    """
    from scipy.linalg import cholesky, solve_triangular
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    scale = np.sqrt(np.diag(covariance))
    _, label = connected_components(csr_array(covariance != 0), directed=False)
    size = len(scale)
    white = [np.zeros((0, size))]
    for number in range(label.max(initial=-1) + 1):
        part = np.flatnonzero(label == number)
        own = scale[part]
        if not own.all():
            continue
        correlation = covariance[np.ix_(part, part)] / np.outer(own, own)
        lower = cholesky(correlation + floor * np.eye(part.size), lower=True)
        made = np.zeros((part.size, size))
        made[:, part] = solve_triangular(lower, np.diag(1 / own), lower=True)
        white.append(made)
    return np.vstack(white), scale == 0


def _without(white: Floats, spanned: Floats) -> Floats:
    """Return what of white vectors, (f, k), is not in a span, (k, n); rounding is nothing."""
    if not np.abs(spanned).any():
        return white
    basis, sizes, _ = np.linalg.svd(spanned, full_matrices=False)
    basis = basis[:, sizes > SPAN * sizes[0]]
    left = white - (white @ basis) @ basis.T
    lengths = np.linalg.norm(white, axis=1, keepdims=True)
    return np.where(np.linalg.norm(left, axis=1, keepdims=True) > FREE * lengths, left, 0.0)
