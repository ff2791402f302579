"""What do noise and faults do to all residuals over a window of a flight?

In: residuals of a flight, a stretch of it, and a time profile for faults. Out: the covariance of
all residuals at all samples together, by the stated noise, and what every fault does to them.

The bank is not linear: limits have corners, roots and gates open and close. So slopes are secants
to both sides over what noise itself does (an accuracy, not an infinitely small step), and what is
left over is measured: noise is drawn `DRAWS` times, put through the bank itself, and what the
slopes do not foretell counts as noise, of which residuals share but a part (statistical
linearisation: Gelb, "Applied Optimal Estimation", 1974, section 6.2). Where noise makes a residual
unknown in some draws, it says nothing there, and a fault shows by so much less.

What stays the same over the window counts once, not once for every sample: the part of an accuracy
that does not change from sample to sample (beyond ``jitter``), and the tolerance of an equation, of
which two standard deviations are what the model states. Offsets that the decision takes off are
left out, and so are slopes over longer windows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.model.evaluate import Floats
from fdi.residuals.bank import Residuals
from fdi.residuals.evaluate import compute_node, context_of
from fdi.residuals.reads import needed_for
from fdi.residuals.respond import Fault, Stretch, respond, stretch, with_error
from fdi.shown import Shown

Profile = Literal["step", "drift"]
KINDS: Final = frozenset({"channel", "solve", "loop", "part", "derivative", "residual"})
"""Nodes whose value at a sample depends on samples nearby alone."""
SMALL: Final = 0.1
"""Size by which a fault of which neither noise nor a tolerance is stated is made linear."""
DRAWS: Final = 256
"""Draws of the noise: what is not linear is known to 1 / sqrt(2 * 256) = 4 % of itself."""

SHARED: Final = 0.5
"""Share that is believed of the covariance between residuals of what is not linear: 256 draws show
far more of it than there is. From 0 to 0.9 the sizes of two flights (c02, c03) change by 15 %
at most."""
PIECES: Final = 224
"""So many pieces with a fault of some size beside drawn noise are computed at once."""
DEPENDABLE: Final = 0.9
"""A row that is known in fewer draws finds nothing with the usual probability of 90 %."""


@dataclass(frozen=True, slots=True, eq=False)
class Window(Shown):
    """What noise and faults do to all residuals over a window.

    Attributes
    ----------
    names, units : tuple of str
        Of the f faults; a drift's unit is per second.
    residual, sample : (m,) int
        Of every row the place of its residual in the bank, and which sample of the window it is.
    covariance : (m, m) float
        Of the rows, by the noise; 0 where none is stated, or where noise makes a row unknown more
        often than not `DEPENDABLE`.
    response : (f, m) float
        Of the rows to every fault of size one.
    at : (f,) float
        The size, with its sign, that was put in for the response; 0 where it is a slope.
    free : tuple of (m, k) float
        What every fault can do to the rows with any time profile.
    start_s, length_s : float
    profile : {"step", "drift"}
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    residual: NDArray[np.int64]
    sample: NDArray[np.int64]
    covariance: Floats
    response: Floats
    at: Floats
    free: tuple[Floats, ...]
    start_s: float
    length_s: float
    profile: Profile

    def __repr__(self) -> str:
        rows = len(self.residual)
        return f"<Window: {len(self.names)} faults, {rows} values of residuals>"


class Source(NamedTuple):
    """A source of noise over a piece of n samples.

    One standard deviation of what changes from sample to sample, (n,), and of what does not.
    """

    equation: int
    fast: Floats
    steady: Floats


class Place(NamedTuple):
    """Where in a flight is looked: its grid's part with ``reach`` samples to both sides more."""

    residuals: Residuals
    rows: tuple[int, ...]
    first: int
    samples: int
    reach: int

    @property
    def size(self) -> int:
        """Return the samples of the piece, those to both sides included."""
        return self.samples + 2 * self.reach

    def pieces(self, times: int) -> Stretch:
        """Return the piece so many times over: it is computed with as many faults at once."""
        start = self.first - self.reach
        return stretch(self.residuals, np.tile(np.arange(start, start + self.size), times))

    def seen(self, columns: Floats) -> Floats:
        """Return of the residuals' columns over pieces, (r, p * n), what is looked at, (p, m)."""
        each = columns[list(self.rows)].reshape(len(self.rows), -1, self.size)
        inner = each[:, :, self.reach : self.reach + self.samples]
        return np.swapaxes(inner, 0, 1).reshape(inner.shape[1], -1)


def place_of(residuals: Residuals, start_s: float, length_s: float) -> Place:
    """Return where a window of a flight is.

    Raises
    ------
    UsageError
        It is not within the flight.
    """
    rows = _usable(residuals)
    rate = residuals.signals.rate_hz
    reach = round(max((residuals.delay_s[row] for row in rows), default=0.0) * rate)
    first = int(np.searchsorted(residuals.t, start_s - 0.5 / rate))
    count = max(round(length_s * rate), 1)
    if first < reach or first + count + reach > len(residuals.t):
        raise UsageError(f"{length_s:g} s from {start_s:g} s on are not within the flight")
    return Place(residuals, tuple(rows), first, count, reach)


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

    Notes
    -----
    Noise is drawn from a fixed seed: the same flight has the same answer.
    """
    system = residuals.bank.system
    of = {fault.name: fault.equation for fault in system.faults}
    names = tuple(of) if faults is None else tuple(faults)
    if strangers := [name for name in names if name not in of]:
        raise UsageError(f"{strangers[0]!r} is no fault of {system.name}")
    place = place_of(residuals, start_s, length_s)
    noise = tuple(sources(place))
    shape = _shape(place, profile)
    steady = {source.equation: source.steady for source in noise}
    pieces: dict[int, Stretch] = {}
    slopes = {
        equation: _slopes(place, equation, shape, steady.get(equation), pieces)
        for equation in dict.fromkeys([*(of[name] for name in names), *steady])
    }
    found, left, known_share = _noise(place, noise, slopes)
    response = np.array([slopes[of[name]].given for name in names])
    response = response.reshape(len(names), -1) * known_share
    free = tuple(slopes[of[name]].free * known_share[:, None] for name in names)
    healthy = place.seen(
        np.array([place.pieces(1).nodes[g.node].column for g in residuals.bank.generators])
    )
    known = np.isfinite(healthy[0]) & np.isfinite(found).all(axis=1) & (known_share > 0)
    known &= np.isfinite(response).all(axis=0)
    for own in free:
        known &= np.isfinite(own).all(axis=1)
    equations = [system.equations[of[name]] for name in names]
    kept = np.repeat(np.array(place.rows, dtype=np.int64), place.samples)[known]
    covariance = found[known] @ found[known].T
    same = kept[:, None] == kept
    covariance += np.where(same, 1.0, SHARED) * (left[known] @ left[known].T)
    covariance[known_share[known] < DEPENDABLE] = 0.0
    covariance[:, known_share[known] < DEPENDABLE] = 0.0
    return Window(
        names,
        tuple(f"{e.unit}/s" if profile == "drift" else e.unit for e in equations),
        kept,
        np.tile(np.arange(place.samples), len(place.rows))[known],
        covariance,
        response[:, known],
        np.zeros(len(names)),
        tuple(own[known][:, place.reach :] for own in free),
        start_s,
        length_s,
        profile,
    )


def moved_by(window: Window, residuals: Residuals, sizes: Floats) -> Iterator[Floats]:
    """Yield for every fault what it does to the rows at some sizes, (2, k, m), on average in noise.

    Two averages over draws of their own: the product of both does not grow by what they scatter.

    Parameters
    ----------
    window : Window
    residuals : Residuals
        That it is of.
    sizes : (f, k) float
        Of every fault, to either side.
    """
    place = place_of(residuals, window.start_s, window.length_s)
    number = np.full(len(residuals.bank.generators), -1)
    number[list(place.rows)] = np.arange(len(place.rows))
    rows = number[window.residual] * place.samples + window.sample
    shape = _shape(place, window.profile)
    count = sizes.shape[1]
    draws = max(PIECES // count, 2) // 2 * 2
    noise, _ = drawn(tuple(sources(place)), np.random.default_rng(0), draws)
    often = {number: np.tile(error, count) for number, error in noise.items()}
    piece = with_error(place.pieces(count * draws), often)
    of = {fault.name: fault.equation for fault in residuals.bank.system.faults}
    for name, own in zip(window.names, sizes, strict=True):
        if not own.any():
            yield np.zeros((2, count, len(rows)))
            continue
        added = (np.repeat(own, draws)[:, None] * shape).ravel()
        moved = np.nan_to_num(place.seen(respond(piece, {of[name]: added}))[:, rows])
        yield moved.reshape(count, 2, draws // 2, -1).mean(axis=2).swapaxes(0, 1)


def at_sizes(window: Window, residuals: Residuals, sizes: Mapping[str, float]) -> Window:
    """Return a window with what faults do to the rows when they are of some sizes.

    Parameters are those of :func:`moved_by`; a size is one of either sign, in the fault's unit.
    """
    asked = np.nan_to_num([sizes.get(name, 0.0) for name in window.names], posinf=0.0, neginf=0.0)
    response = [
        moved.mean(axis=0)[0] / size if size else slope
        for moved, size, slope in zip(
            moved_by(window, residuals, asked[:, None]), asked, window.response, strict=True
        )
    ]
    return replace(window, response=np.array(response).reshape(window.response.shape), at=asked)


def sources(place: Place) -> Iterator[Source]:
    """Yield what makes noise in the residuals that are looked at, by what the model states."""
    residuals, size = place.residuals, place.size
    bank = residuals.bank
    context = context_of(bank.system, bank.nodes, residuals.signals, residuals.recipe)
    nodes = {i for row in place.rows for i in needed_for(bank.nodes, bank.generators[row].node)}
    start = place.first - place.reach
    for number in sorted(nodes):
        node = bank.nodes[number]
        measurement = bank.system.equations[node.equation].measurement
        if node.kind != "channel" or measurement is None or measurement.accuracy is None:
            continue
        sigma = compute_node(node, {}, context).effects["noise", node.equation, 0]
        sigma = sigma[start : start + size]
        # unknown where the channel is: nothing is seen there, but a product with it would be lost
        sigma = np.where(np.isfinite(sigma), sigma, measurement.accuracy)
        share = min((measurement.jitter or measurement.accuracy) / measurement.accuracy, 1.0)
        yield Source(node.equation, share * sigma, np.sqrt(1 - share**2) * sigma)
    reached = {bank.nodes[i].equation for i in nodes}
    for number, equation in enumerate(bank.system.equations):
        if equation.tolerance and number in reached:
            yield Source(number, np.zeros(size), np.full(size, equation.tolerance / 2))


def drawn(
    noise: Sequence[Source], rng: np.random.Generator, times: int
) -> tuple[Fault, dict[int, tuple[Floats, Floats]]]:
    """Return draws of the noise, end to end, and the normal deviates that they are made of.

    By equation the latter are (times, n) for what changes, and (times, 1) for what does not.
    """
    normal = {
        own.equation: (
            rng.standard_normal((times, own.fast.size)),
            rng.standard_normal((times, 1)),
        )
        for own in noise
    }
    added = {
        own.equation: (
            own.fast * normal[own.equation][0] + own.steady * normal[own.equation][1]
        ).ravel()
        for own in noise
    }
    return added, normal


class _Slopes(NamedTuple):
    """What an equation's error does to the rows.

    The given profile of size one, (m,), one at each sample alone, (m, n), and the steady part of
    its noise, (m,).
    """

    given: Floats
    free: Floats
    steady: Floats


def _slopes(
    place: Place, equation: int, shape: Floats, steady: Floats | None, pieces: dict[int, Stretch]
) -> _Slopes:
    n, reach = place.size, _reach(place, equation)
    apart = min(2 * reach + 1, n)
    size = _probe(place.residuals, equation)
    added = np.zeros((apart + 2, n))
    for offset in range(apart):
        added[offset, offset::apart] = size
    added[-2] = size * shape
    added[-1] = 0.0 if steady is None else steady
    if apart not in pieces:
        pieces[apart] = place.pieces(apart + 2)
    up, down = (
        place.seen(respond(pieces[apart], {equation: sign * added.ravel()})) for sign in (1, -1)
    )
    both = np.where(np.isnan(up), -down, np.where(np.isnan(down), up, (up - down) / 2))
    free = np.zeros((both.shape[1], n))
    sample = np.tile(np.arange(place.samples), len(place.rows)) + place.reach
    for at in range(n):
        near = np.abs(sample - at) <= reach
        free[near, at] = both[at % apart, near] / size
    return _Slopes(both[-2] / size, free, both[-1])


def _noise(
    place: Place, noise: Sequence[Source], slopes: dict[int, _Slopes]
) -> tuple[Floats, Floats, Floats]:
    """Return what noise does to the rows, (m, k) by sources and (m, d) by what is not linear.

    Last how often each row is known, (m,).
    """
    columns = [np.zeros((len(place.rows) * place.samples, 1))]
    linear = np.zeros((len(columns[0]), DRAWS))
    added, normal = drawn(noise, np.random.default_rng(0), DRAWS)
    for source in noise:
        own, (fast, steady) = slopes[source.equation], normal[source.equation]
        if source.fast.any():
            columns.append(own.free * source.fast)
            linear += columns[-1] @ fast.T
        if source.steady.any():
            columns.append(own.steady[:, None])
            linear += columns[-1] * steady.T
    moved = place.seen(respond(place.pieces(DRAWS), added)).T
    known = np.isfinite(moved)
    left = np.where(known, moved, 0.0) - linear
    left -= left.mean(axis=1, keepdims=True)
    return np.hstack(columns), left / np.sqrt(DRAWS), known.mean(axis=1)


def _shape(place: Place, profile: Profile) -> Floats:
    """Return a fault of size one over the piece, (n,)."""
    later = np.arange(place.size) - place.reach
    if profile == "step":
        return (later >= 0).astype(float)
    return np.clip(later / place.residuals.signals.rate_hz, 0.0, None)


def _usable(residuals: Residuals) -> list[int]:
    """Return the residuals whose values depend on samples nearby alone."""
    bank = residuals.bank
    return [
        row
        for row, own in enumerate(bank.generators)
        if {bank.nodes[i].kind for i in needed_for(bank.nodes, own.node)} <= KINDS
    ]


def _reach(place: Place, equation: int) -> int:
    """Return how many samples apart an error and what it does to a residual can be."""
    residuals = place.residuals
    bank = residuals.bank
    reached = [
        residuals.delay_s[row]
        for row in place.rows
        if any(
            bank.nodes[i].equation == equation
            for i in needed_for(bank.nodes, bank.generators[row].node)
        )
    ]
    return round(max(reached, default=0.0) * residuals.signals.rate_hz)


def _probe(residuals: Residuals, equation: int) -> float:
    """Return a size of a fault by which it is made linear: one deviation of what health may do."""
    own = residuals.bank.system.equations[equation]
    accuracy = own.measurement.accuracy if own.measurement else None
    return accuracy or own.tolerance / 2 or SMALL
