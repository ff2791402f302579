"""By how much has the factor by which one quantity follows another changed, and when?

In: pairs of columns on a regular grid, the components of a vector that follows and of one that
leads. Out: for each sample the change of their common slope that is likeliest within the window
behind it, its standard error, and how long ago it was. Between them lies a vector that wanders: the
velocity over ground follows the velocity through the air by the scale of the airspeed, and the wind
comes in between. The slope is that of what lies along the leading vector, as it turns: what lies
across it (a slip) and what changes with its length (a launch, an angle of attack) says nothing of a
factor.

A Kalman filter holds the vector between (a random walk) and the slope. At every moment of the
window both may have jumped: what such a jump leaves in the innovations since is linear in its size,
so that the size is one least squares, with a jump of the vector free beside it. The moment is the
likeliest one. What a jump of the vector alone explains as well, at whatever moment (a gust, a
receiver that jumps), is no change of a slope: the error is what the gain in likelihood over the
best of those leaves. Nor is it one where the followers have turned against the leaders by more than
they have stretched (a gyroscope that drifts, a compass, a slip), which what lies across tells. How
much the vector wanders and the samples scatter is fitted to the data, block by block, each with a
slope of its own, so that what changes between two blocks is not taken for noise; where what is left
is more than that, the error is larger by as much. Blocks to come count, too: a log that ends
earlier may tell another error.

What does not determine the slope (a straight flight: an airspeed that reads too much is a wind
ahead) gives nothing: the change must be known to the tolerance by how the leaders moved alone.

References
----------
A. S. Willsky and H. L. Jones, IEEE Trans. Automatic Control 21, 1976, p. 108 (the jump's signature,
its generalised likelihood ratio).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats

Mask = NDArray[np.bool_]

THIN_S: Final = 2.0
"""What is nearer together is one sample, its mean."""
EVERY: Final = 2
"""Of these samples, at which a jump is looked for."""
BLOCK_S: Final = 20.0
"""Over which noise is fitted."""
NOISES: Final = 2.0 ** np.arange(-3, 4)
"""Of the median step, what the vector between wanders a sample, and what samples scatter by."""
WIDE: Final = 0.3
"""Of the slope, its standard deviation before anything is seen of it, and that of its jump."""
FEW: Final = 3
"""Samples since a jump; fewer tell nothing of it."""
MISFIT: Final = 2.0
"""Times the tolerance, the error with what no jump explains: beyond, it is no jump that is seen."""
_UNLIMITED: Final = 100.0
"""Median steps: a vector between, or its jump, of which nothing is known."""
_SIGMAS: Final = 1.4826  # a deviation over the median of sizes, of Gaussian noise


class Jump(NamedTuple):
    """The likeliest change of a slope, (n,) each; NaN where no jump is known well enough.

    Attributes
    ----------
    size, error : (n,) float
        In the unit of the followers per that of the leaders, and its standard deviation.
    ago : (n,) float
        s, since when.
    """

    size: Floats
    error: Floats
    ago: Floats


class _Rows(NamedTuple):
    """Thinned samples: what follows along the leaders (m,), their direction and length (m, p + 1).

    ``known`` (m,): where all of it is. ``aside`` (m,): what follows to the left of the leaders.
    """

    follows: Floats
    leads: Floats
    known: Mask
    aside: Floats


class _Scale(NamedTuple):
    """About what the slope is, and the median step of what it leaves: start values and units."""

    slope: float
    step: float

    def widths(self, pairs: int) -> Floats:
        """Return the standard deviations of vector and slope of which nothing is known yet."""
        return np.append(np.full(pairs, _UNLIMITED * self.step), WIDE * abs(self.slope))


class _Passed(NamedTuple):
    """What a filter met, row by row: (m, p + 1), (m,), (m,); NaN where rows are unknown.

    ``before`` (m,) and ``between`` (m, p): the standard deviation of the slope before each, and the
    vector.
    """

    gain: Floats
    variance: Floats
    innovation: Floats
    before: Floats
    between: Floats


def jump(
    followers: Sequence[Floats],
    leaders: Sequence[Floats],
    step: float,
    window_s: float,
    tolerance: float,
) -> Jump:
    """Return by how much the slope of the followers over the leaders has changed.

    Parameters
    ----------
    followers, leaders : sequence of (n,) float
        Two components each, of one unit; a sample of which any is NaN is left out.
    step : float
        s, of the grid.
    window_s : float
        s, how far back a jump is looked for.
    tolerance : float
        Standard deviation to which the leaders' motion must determine it.

    Examples
    --------
    >>> turning = np.linspace(0, 40, 801)
    >>> air = [20 * np.cos(turning), 20 * np.sin(turning)]
    >>> noise = np.random.default_rng(1).normal(0, 0.5, (2, 801))
    >>> scale = np.where(np.arange(801) < 400, 1.0, 1.2)
    >>> ground = [scale * air[0] + 5.0 + noise[0], scale * air[1] - 3.0 + noise[1]]
    >>> found = jump(ground, air, 0.25, 60.0, 0.03)
    >>> off, ago = found.size[600] - 0.2, found.ago[600] - 50.0
    >>> bool(abs(off) < 4 * found.error[600] < 0.06), bool(abs(ago) <= 4.0)
    (True, True)
    """
    size = len(followers[0])
    every = max(1, round(THIN_S / step))
    unknown = np.full(size, np.nan)
    rows = _rows(_thinned(followers, every), _thinned(leaders, every))
    scale = _scale(rows)
    rows = rows if scale is None else _turning(rows, scale.slope)
    noises = None if scale is None else _noises(rows, scale)
    if scale is None or noises is None:
        return Jump(unknown, unknown, unknown)
    passed = _filtered(rows, scale, noises)
    found = _likeliest(passed, rows, round(window_s / (every * step)), scale, tolerance)
    # a row is known once its last sample is
    last = np.arange(1, size + 1) // every - 1
    told = found[np.clip(last, 0, len(found) - 1)]
    told[last < 0] = np.nan
    return Jump(told[:, 0], told[:, 1], told[:, 2] * every * step)


def _thinned(columns: Sequence[Floats], every: int) -> Floats:
    """Return means of ``every`` samples, (m, p), NaN where one is unknown."""
    rows = len(columns[0]) // every
    cut = [column[: rows * every].reshape(rows, every).mean(axis=1) for column in columns]
    return np.stack(cut, axis=1)


def _rows(follows: Floats, leads: Floats) -> _Rows:
    length = np.linalg.norm(leads, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = leads / length[:, None]
    follow = (along * follows).sum(axis=1)
    aside = (_left(along) * follows).sum(axis=1)
    return _Rows(follow, np.column_stack([along, length]), np.asarray(np.isfinite(follow)), aside)


def _left(ahead: Floats) -> Floats:
    """Return the directions at right angles to others, (m, 2)."""
    return np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)


def _scale(rows: _Rows) -> _Scale | None:
    """Return the slope of all rows, the vector between a constant; None where nothing moves.

    About the ratio of the lengths where no turn tells more.
    """
    follows, leads = rows.follows[rows.known], rows.leads[rows.known]
    if len(follows) <= leads.shape[1]:
        return None
    ratio = float(np.median(np.abs(follows)) / np.median(leads[:, -1]))
    turned = _turning(rows, ratio)
    follows, leads = turned.follows[rows.known], turned.leads[rows.known]
    left = follows - ratio * leads[:, -1]
    prior = np.append(np.zeros(leads.shape[1] - 1), left.std() / (WIDE * ratio) if ratio else 1.0)
    more = np.linalg.lstsq(np.vstack([leads, prior]), np.append(left, 0.0), rcond=None)[0][-1]
    slope = ratio + float(more)
    left = np.diff(rows.follows - slope * rows.leads[:, -1])
    left = left[np.isfinite(left)]
    step = _SIGMAS * float(np.median(np.abs(left))) if left.size else 0.0
    return _Scale(slope, step) if step > 0 and slope != 0 else None


def _turning(rows: _Rows, slope: float) -> _Rows:
    """Return the rows as they were with leaders of one length, so that only turns tell a slope.

    What changes with the length itself (a launch, an angle of attack) is no change of a factor.
    """
    length = float(np.median(rows.leads[rows.known, -1]))
    leads = rows.leads.copy()
    leads[:, -1] = length
    return rows._replace(follows=rows.follows - slope * (rows.leads[:, -1] - length), leads=leads)


def _noises(rows: _Rows, scale: _Scale) -> tuple[float, float] | None:
    """Return what the vector wanders a row, and what rows scatter: likeliest in the median block.

    None where no block is known whole.
    """
    length, known = round(BLOCK_S / THIN_S), rows.known
    starts = [s for s in range(0, len(known) - length + 1, length) if known[s : s + length].all()]
    if not starts:
        return None
    block = np.add.outer(starts, np.arange(length))
    follows, leads = rows.follows[block], rows.leads[block]  # (b, length), (b, length, p + 1)
    both = np.meshgrid(NOISES * scale.step, NOISES * scale.step)
    wanders, scatters = (one.ravel() for one in both)
    count, tried, pairs = len(starts), wanders.size, leads.shape[2] - 1
    state = np.zeros((count, tried, pairs + 1))
    state[..., -1] = scale.slope
    covariance = np.broadcast_to(
        np.diag(scale.widths(pairs) ** 2), (*state.shape, pairs + 1)
    ).copy()
    cost, own = np.zeros((count, tried)), np.arange(pairs)
    for row in range(length):
        covariance[..., own, own] += wanders[:, None] ** 2
        taken = _taken(state, covariance, follows[:, row, None], leads[:, row, None], scatters**2)
        if row >= pairs:  # before, it is what is not known of the vector
            cost += np.log(taken[1]) + taken[2] ** 2 / taken[1]
        _correct(state, covariance, *taken)
    likeliest = int(np.argmin(np.quantile(cost, 0.5, axis=0, method="lower")))
    return float(wanders[likeliest]), float(scatters[likeliest])


def _taken(
    state: Floats, covariance: Floats, follow: Floats, lead: Floats, noise: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return gain (..., n), variance and innovation (...) of a row."""
    toward = (covariance * lead[..., None, :]).sum(axis=-1)
    variance = (toward * lead).sum(axis=-1) + noise
    return toward / variance[..., None], variance, follow - (state * lead).sum(axis=-1)


def _correct(
    state: Floats, covariance: Floats, gain: Floats, variance: Floats, innovation: Floats
) -> None:
    """Take a row in: changes state and covariance."""
    state += gain * innovation[..., None]
    covariance -= (variance[..., None] * gain)[..., None] * gain[..., None, :]


def _filtered(rows: _Rows, scale: _Scale, noises: tuple[float, float]) -> _Passed:
    """Return what the filter met."""
    count, size = rows.leads.shape
    wander, scatter = noises
    state = np.append(np.zeros(size - 1), scale.slope)
    covariance = np.diag(scale.widths(size - 1) ** 2)
    variance, innovation, before = (np.full(count, np.nan) for _ in range(3))
    gain, between = np.full((count, size), np.nan), np.full((count, size - 1), np.nan)
    passed = _Passed(gain, variance, innovation, before, between)
    own, noise = np.arange(size - 1), np.array(scatter**2)
    for row in range(count):
        covariance[own, own] += wander**2
        passed.before[row] = np.sqrt(covariance[-1, -1])
        passed.between[row] = state[:-1]
        if not rows.known[row]:
            continue
        taken = _taken(state, covariance, rows.follows[row], rows.leads[row], noise)
        for kept, one in zip(passed[:3], taken, strict=True):
            kept[row] = one
        _correct(state, covariance, *taken)
    return passed


def _likeliest(
    passed: _Passed, rows: _Rows, window: int, scale: _Scale, tolerance: float
) -> Floats:
    """Return size, error and age (rows) of the likeliest jump, (m, 3)."""
    found = np.full((len(rows.known), 3), np.nan)
    prior = np.diag(scale.widths(rows.leads.shape[1] - 1) ** -2.0)
    sure = rows.known & (passed.before <= tolerance)
    for row, starts, information, toward, left, count in _signatures(passed, rows.leads, window):
        # a change needs a before: what a take-off shows is no slope yet
        ready = (starts >= 0) & (count >= FEW) & (passed.before[starts] <= tolerance)
        if not ready.any():
            continue
        covariance, sizes, explained = _fitted(information[ready] + prior, toward[ready])
        free = np.maximum(count[ready] - len(prior), 1)
        wider = np.sqrt(np.maximum((left[ready] - explained) / free, 1.0))
        error = np.sqrt(covariance[:, -1, -1])
        fits = (error <= tolerance) & (error * wider <= MISFIT * tolerance)
        if not fits.any():
            continue
        best = int(np.argmax(np.where(fits, explained, -1.0)))
        alone = _fitted((information[ready] + prior)[:, :-1, :-1], toward[ready][:, :-1])[2].max()
        gain = np.sqrt(max(float(explained[best] - alone), 0.0)) / wider[best]
        size, start = float(sizes[best, -1]), int(starts[ready][best])
        least = max(error[best] * wider[best], abs(size) / gain if gain else np.inf)
        if least > MISFIT * tolerance:
            continue
        turned = _turned(passed, rows, sure, (start, row), sizes[best, :-1])
        # a turn by x shows as cos x - 1 along and sin x across: from a right angle on backwards
        if turned <= abs(size) and (scale.slope + size) * scale.slope > 0:
            found[row] = size, least, row - start
    return found


def _fitted(information: Floats, toward: Floats) -> tuple[Floats, Floats, Floats]:
    """Return covariance (j, n, n), sizes (j, n) and what they explain (j,), of least squares."""
    covariance = np.linalg.inv(information)
    sizes = (covariance @ toward[..., None])[..., 0]
    explained: Floats = (sizes * toward).sum(axis=1)
    return np.asarray(covariance), sizes, explained


def _turned(
    passed: _Passed, rows: _Rows, sure: Mask, since: tuple[int, int], change: Floats
) -> float:
    """Return by how much the followers have turned against the leaders since a row, as a slope.

    What lies across for each unit of the leaders, before and since, without the vector between,
    which changed by ``change`` then; NaN where the one or the other is not known.
    """
    start, last = since
    length = float(rows.leads[rows.known, -1][0])
    before = np.flatnonzero(sure[:start])
    after = start + np.flatnonzero(rows.known[start : last + 1])
    if not before.size or not after.size:
        return np.nan
    vectors = passed.between[before], passed.between[start] + change
    was, now = (
        rows.aside[part] - (_left(rows.leads[part, :-1]) * vector).sum(axis=1)
        for part, vector in zip((before, after), vectors, strict=True)
    )
    # not the mean: who drifts on turns round and round
    return float(np.median(np.abs(now - np.median(was)))) / length


def _signatures(
    passed: _Passed, leads: Floats, window: int
) -> Iterator[tuple[int, NDArray[np.intp], Floats, Floats, Floats, Floats]]:
    """Yield, row by row, what jumps at rows of the window have left in the innovations since.

    The rows (j,), information (j, n, n) and what it says of the sizes (j, n), the sum of squared
    innovations over their variances (j,), and of how many (j,). A jump x that the filter does not
    know shows in an innovation as g x, g = h (1 - F): h the row's leaders, F how much of it the
    filter has taken in since.
    """
    count, size = leads.shape
    places = max(1, window // EVERY)
    starts = np.full(places, -1)
    taken, information = np.zeros((places, size, size)), np.zeros((places, size, size))
    toward, left, known = np.zeros((places, size)), np.zeros(places), np.zeros(places)
    for row in range(count):
        if row % EVERY == 0:
            place = row // EVERY % places
            starts[place] = row
            for each in (taken, information, toward, left, known):
                each[place] = 0.0
        variance, innovation = passed.variance[row], passed.innovation[row]
        if np.isnan(variance):
            continue
        shows = leads[row] - leads[row] @ taken
        taken += passed.gain[row][:, None] * shows[:, None, :]
        information += shows[:, :, None] * (shows / variance)[:, None, :]
        toward += shows * (innovation / variance)
        left += innovation**2 / variance
        known += 1.0
        yield row, starts, information, toward, left, known
