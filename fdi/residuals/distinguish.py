"""How far apart are two faults for a bank, in noise, and how large must one be to be told?

In: residuals of a flight, a stretch of it, and a time profile for faults. Out: for every fault and
every pair of faults the distinguishability of Eriksson, Frisk and Krysander, and from it the
smallest size that is detected, and told from another fault, at a false-alarm rate.

The bank is linear for small changes around what was flown. Over a window of samples all residuals
together are ``r = F_i s + F_j y + A e``: ``e`` is white noise of the channels at every sample, by
their accuracies, ``A`` what it does to the residuals (derivatives and relations included, so that
residuals of the same channels are correlated), ``F_i s`` what fault i of size s does, and ``F_j y``
what fault j does with any time profile. How far the data with fault i are from the nearest that
fault j could make, as the expected log-likelihood ratio (Kullback-Leibler), is half the square of
what is left of ``F_i s`` when the noise is made white and the span of ``F_j`` is projected out.

What stays the same over the window counts once, not once for every sample: the part of an accuracy
that does not change from sample to sample (beyond ``jitter``), and the tolerance of an equation, of
which two standard deviations are what the model states. Offsets that the decision takes off are
left out, and so are slopes over longer windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.model.evaluate import Floats
from fdi.residuals.bank import Residuals
from fdi.residuals.evaluate import compute_node, context_of
from fdi.residuals.reads import needed_for
from fdi.residuals.respond import Fault, Stretch, respond, stretch
from fdi.shown import Shown

Profile = Literal["step", "drift"]
KINDS: Final = frozenset({"channel", "solve", "loop", "part", "derivative", "residual"})
"""Nodes whose value at a sample depends on samples nearby alone."""
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
SMALL: Final = 0.1
"""Of an accuracy: the size of the faults by which the bank is made linear."""
SPAN: Final = 1e-7
"""Singular values of a fault's span, relative to the largest, below which they are rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Window(Shown):
    """What noise and faults do to all residuals over a window, to first order.

    Attributes
    ----------
    names, units : tuple of str
        Of the f faults; a drift's unit is per second.
    residual, sample : (m,) int
        Of every row the place of its residual in the bank, and which sample of the window it is.
    covariance : (m, m) float
        Of the rows, by the noise.
    response : (f, m) float
        Of the rows to every fault of size one.
    free : tuple of (m, k) float
        What every fault can do to the rows with any time profile.
    sigma : (f,) float
        The accuracy of the channel of every fault, NaN where it is none's.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    residual: NDArray[np.int64]
    sample: NDArray[np.int64]
    covariance: Floats
    response: Floats
    free: tuple[Floats, ...]
    sigma: Floats

    def __repr__(self) -> str:
        rows = len(self.residual)
        return f"<Window: {len(self.names)} faults, {rows} values of residuals>"


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


def window_of(
    residuals: Residuals,
    start_s: float,
    length_s: float = 5.0,
    profile: Profile = "step",
    faults: Sequence[str] | None = None,
) -> Window:
    """Return what noise and faults do to a bank's residuals over a window of a flight.

    Parameters
    ----------
    residuals : Residuals
    start_s, length_s : float
        s of the log's clock: when the fault begins, and how long after it is looked.
    profile : {"step", "drift"}
        One from the start on, or one per second.
    faults : sequence of str, optional
        By default all of the system.

    Raises
    ------
    UsageError
        A fault is none of the system's, or the window is not within the flight.
    """
    system = residuals.bank.system
    place = {fault.name: fault.equation for fault in system.faults}
    names = tuple(place) if faults is None else tuple(faults)
    if strangers := [name for name in names if name not in place]:
        raise UsageError(f"{strangers[0]!r} is no fault of {system.name}")
    rows = _usable(residuals)
    step = 1.0 / residuals.signals.rate_hz
    reach = round(max((residuals.delay_s[row] for row in rows), default=0.0) / step)
    first = int(np.searchsorted(residuals.t, start_s - step / 2))
    count = max(round(length_s / step), 1)
    span = slice(first - reach, first + count + reach)
    if span.start < 0 or span.stop > len(residuals.t):
        raise UsageError(f"{length_s:g} s from {start_s:g} s on are not within the flight")
    piece = stretch(residuals, span)
    size = len(piece.t)
    inner = slice(reach, size - reach)
    values = np.array([piece.nodes[residuals.bank.generators[r].node].column for r in rows])
    known = np.isfinite(values.reshape(len(rows), size))[:, inner].ravel()
    kept = np.repeat(np.array(rows, dtype=np.int64), count)
    sizes = {equation: _probe(residuals, equation) for equation in place.values()}

    def moved(fault: Fault) -> Floats:
        return respond(piece, fault)[rows][:, inner].ravel()

    t = np.clip((np.arange(size) - reach) * step, 0.0, None)
    shape = (np.arange(size) >= reach).astype(float) if profile == "step" else t
    given = np.array([moved({place[n]: sizes[place[n]] * shape}) / sizes[place[n]] for n in names])
    profiles = {}
    for name in names:
        own = _impulses(piece, place[name], sizes[place[name]], _reach(residuals, place[name]))
        profiles[place[name]] = own[rows][:, inner].reshape(-1, size)
    noise = _noise(residuals, piece, span, rows, profiles, inner)
    response = given.reshape(len(names), -1)
    free = tuple(profiles[place[name]][:, reach:] for name in names)
    known &= np.isfinite(noise).all(axis=1) & np.isfinite(response).all(axis=0)
    for own in free:
        known &= np.isfinite(own).all(axis=1)
    covariance = noise[known] @ noise[known].T
    equations = [system.equations[place[name]] for name in names]
    return Window(
        names,
        tuple(f"{e.unit}/s" if profile == "drift" else e.unit for e in equations),
        kept[known],
        np.tile(np.arange(count), len(rows))[known],
        covariance,
        response[:, known],
        tuple(own[known] for own in free),
        np.array([(e.measurement and e.measurement.accuracy) or np.nan for e in equations]),
    )


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


def _usable(residuals: Residuals) -> list[int]:
    """Return the residuals whose values depend on samples nearby alone."""
    bank = residuals.bank
    return [
        row
        for row, own in enumerate(bank.generators)
        if {bank.nodes[i].kind for i in needed_for(bank.nodes, own.node)} <= KINDS
    ]


def _reach(residuals: Residuals, equation: int) -> int:
    """Return how many samples apart a fault and what it does to a residual can be."""
    bank = residuals.bank
    reached = [
        residuals.delay_s[row]
        for row in _usable(residuals)
        if any(
            bank.nodes[i].equation == equation
            for i in needed_for(bank.nodes, bank.generators[row].node)
        )
    ]
    return round(max(reached, default=0.0) * residuals.signals.rate_hz)


def _probe(residuals: Residuals, equation: int) -> float:
    """Return a size of a fault that is small: what health may do, of its own unit one otherwise."""
    own = residuals.bank.system.equations[equation]
    accuracy = own.measurement.accuracy if own.measurement else None
    return SMALL * (accuracy or own.tolerance or 1.0)


def _impulses(piece: Stretch, equation: int, size: float, reach: int) -> Floats:
    """Return what a fault of one at one sample does, (r, n, n): residual, its sample, the fault's.

    Faults at samples that are further apart than a value looks are put in together.
    """
    n, apart = len(piece.t), 2 * reach + 1
    found = np.zeros((len(piece.bank.generators), n, n))
    for offset in range(min(apart, n)):
        added = np.zeros(n)
        added[offset::apart] = size
        change = respond(piece, {equation: added}) / size
        for at in range(offset, n, apart):
            near = slice(max(at - reach, 0), at + reach + 1)
            found[:, near, at] = change[:, near]
    return found


def _noise(
    residuals: Residuals,
    piece: Stretch,
    span: slice,
    rows: Sequence[int],
    profiles: dict[int, Floats],
    inner: slice,
) -> Floats:
    """Return what every independent source of noise, of variance one, does to the rows, (m, k)."""
    bank = residuals.bank
    context = context_of(bank.system, bank.nodes, residuals.signals, residuals.recipe)
    columns = []
    nodes = {i for row in rows for i in needed_for(bank.nodes, bank.generators[row].node)}
    for number in sorted(nodes):
        node = bank.nodes[number]
        measurement = bank.system.equations[node.equation].measurement
        if node.kind != "channel" or measurement is None or measurement.accuracy is None:
            continue
        sigma = compute_node(node, {}, context).effects["noise", node.equation, 0][span]
        own = profiles.get(node.equation)
        if own is None:
            size = SMALL * measurement.accuracy
            found = _impulses(piece, node.equation, size, _reach(residuals, node.equation))
            own = found[rows][:, inner].reshape(-1, len(piece.t))
        # what does not change from sample to sample is one number for the whole window
        share = min((measurement.jitter or measurement.accuracy) / measurement.accuracy, 1.0)
        columns.append(own * (share * sigma))
        if share < 1:
            columns.append((own @ sigma * np.sqrt(1 - share**2))[:, None])
    for number, equation in enumerate(bank.system.equations):
        if equation.tolerance and any(bank.nodes[i].equation == number for i in nodes):
            added = np.full(len(piece.t), equation.tolerance / 2)
            columns.append(respond(piece, {number: added})[rows][:, inner].reshape(-1, 1))
    return np.hstack(columns) if columns else np.zeros((len(rows) * (inner.stop - inner.start), 1))


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
