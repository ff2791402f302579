"""What would the residuals of this flight be with other noise of the same kind?

In: residuals off their centre over their predicted spread, where they are calm. Out: a
``NoiseModel``, and as many flights' worth of noise from it as wanted. The method is a smooth sieve
bootstrap (Buhlmann 1997; Efron and Tibshirani 1993 for the smoothing): each residual is
an autoregression of its own; what is left, the innovations, is drawn from the flight's own, those
of all residuals at one moment together, so that residuals that share a channel stay as correlated
as they are. Two moments are mixed for each draw, so that innovations occur that were not seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.model.evaluate import Floats

MEMORY_S: Final = 2.0
"""An autoregression looks so far back; derivatives are taken over 1 to 2 s."""
MOST_ORDER: Final = 20
LEAST_PER_COEFFICIENT: Final = 4
"""Fewer known samples tell no autoregression, and the residual is taken to stay at its mean."""
RIDGE: Final = 1e-6
"""Share of the variance added for the solution, below what rounding of a log brings."""
ROUNDING: Final = 1e-9
"""Share of the deviation; innovations that vary less are none."""
MIXED: Final = 0.3
"""Angle by which a second moment is mixed in, rad: 9 % of the variance."""


@dataclass(frozen=True, slots=True, eq=False)
class NoiseModel:
    """How r residuals of a flight of n samples vary while nothing is wrong.

    Attributes
    ----------
    mean, deviation : (r,) float
    whitening : (r, p + 1) float
        The filters that turn residuals into innovations.
    innovations : (r, m) float
        Of the m moments that may be drawn.
    samples : int
        The n of a flight.
    """

    mean: Floats
    deviation: Floats
    whitening: Floats
    innovations: Floats
    samples: int

    def of(self, rows: NDArray[np.intp]) -> NoiseModel:
        """Return the model of some of the residuals."""
        return NoiseModel(
            self.mean[rows],
            self.deviation[rows],
            self.whitening[rows],
            self.innovations[rows],
            self.samples,
        )

    def draw(self, flights: int, rng: np.random.Generator) -> Floats:
        """Return noise, (r, flights, n)."""
        size = _fast_size(flights * self.samples)
        first, second = rng.integers(0, self.innovations.shape[1], (2, size))
        drawn = np.cos(MIXED) * self.innovations[:, first]
        drawn += np.sin(MIXED) * self.innovations[:, second]
        # the recursion, on a ring: one division in the frequency domain
        spectrum = np.fft.rfft(drawn, axis=1)
        spectrum /= np.fft.rfft(self.whitening, size, axis=1)
        noise: Floats = np.fft.irfft(spectrum, size, axis=1)
        own = noise.std(axis=1)
        # innovations that are rounding errors would be blown up without bounds
        varies = own > ROUNDING * self.deviation
        scale = np.divide(self.deviation, own, out=np.zeros_like(own), where=varies)
        noise *= scale[:, None]
        noise += self.mean[:, None]
        shape = len(noise), flights, self.samples
        return noise[:, : flights * self.samples].reshape(shape)


def fit_noise(values: Floats, calm: NDArray[np.bool_], rate_hz: float) -> NoiseModel:
    """Return the noise model of residuals.

    Parameters
    ----------
    values : (r, n) float
        Each in a unit in which its noise is the same all along.
    calm : (r, n) bool
        Where they are known, and noise alone.
    rate_hz : float

    Notes
    -----
    The autocovariance is that of the residual with zeros where it is not calm, over the number of
    calm samples: it is positive definite, so the autoregression is stable.
    """
    rows, samples = values.shape
    order = int(np.clip(round(MEMORY_S * rate_hz), 1, max(1, min(MOST_ORDER, samples - 1))))
    number = calm.sum(axis=1)
    enough = number >= LEAST_PER_COEFFICIENT * order
    mean = np.where(enough, np.where(calm, values, 0.0).sum(axis=1) / np.maximum(number, 1), 0.0)
    centred = np.where(calm & enough[:, None], values - mean[:, None], 0.0)
    power = np.abs(np.fft.rfft(centred, _fast_size(2 * samples), axis=1)) ** 2
    covariance = np.fft.irfft(power, axis=1)[:, : order + 1] / np.maximum(number, 1)[:, None]
    varies = covariance[:, 0] > 0
    covariance[~varies] = np.eye(order + 1)[0]
    lags = np.abs(np.subtract.outer(np.arange(order), np.arange(order)))
    normal = covariance[:, lags] + RIDGE * covariance[:, :1, None] * np.eye(order)
    whitening = np.ones((rows, order + 1))
    whitening[:, 1:] = -np.linalg.solve(normal, covariance[:, 1:, None])[..., 0]
    white = np.zeros((rows, samples))
    usable = calm.copy()
    for lag in range(order + 1):
        white[:, lag:] += whitening[:, lag, None] * centred[:, : samples - lag]
        usable[:, lag:] &= calm[:, : samples - lag]
    usable[:, :order] = False
    moments = np.flatnonzero(usable[varies].any(axis=0))
    return NoiseModel(
        mean,
        np.where(varies, np.sqrt(covariance[:, 0]), 0.0),
        whitening,
        _filled(white, usable)[:, moments] if len(moments) else np.zeros((rows, 1)),
        samples,
    )


def _filled(white: Floats, usable: NDArray[np.bool_]) -> Floats:
    """Return innovations with those that are unknown taken from other moments, evenly spread."""
    result = np.zeros_like(white)
    for row, own in enumerate(usable):
        known = np.flatnonzero(own)
        if len(known):
            missing = np.flatnonzero(~own)
            result[row] = white[row]
            result[row, missing] = white[row, known[(missing * 7919) % len(known)]]
            result[row] -= result[row, own].mean()
    return result


def _fast_size(least: int) -> int:
    """Return a size of at least so many samples whose Fourier transform is fast."""
    power = 1 << max(0, int(np.ceil(np.log2(max(least, 1)))) - 3)
    return next(power * k for k in (5, 6, 8, 9, 10, 12, 15, 16) if power * k >= least)
