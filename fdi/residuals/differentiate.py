"""How fast does a sampled quantity change, and how noisy is that answer?

In: a column on a regular grid. Out: its derivative and the factor by which white noise of the input
is multiplied. Two methods: the slope of a local straight line over a centred window (least squares,
which has the smallest noise gain of all linear unbiased slopes), and the published recipe's
difference quotient that starts from zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from fdi.model.evaluate import Floats, wrap
from fdi.shown import Shown

RESOLVED: Final = np.pi / 2
"""rad: an angle that changes by more from one sample to the next may have turned the other way, or
by a whole turn more. Half a turn is Nyquist's limit; half of it is for what turns ever faster."""


@dataclass(frozen=True, slots=True)
class Differentiation(Shown):
    """How a policy differentiates.

    Attributes
    ----------
    method : str
        ``local_line``: slope over a centred window; ``backward_from_zero``: (x[k] - x[k-1]) / dt
        with x[-1] = 0, so that the first sample is x[0] / dt itself (for reproduction only).
    window_s : float
        Length of the window, s; at least three samples are taken.
    imaginary : str
        What a root of a negative number is: ``unknown``, or its ``real_part``.
    """

    method: Literal["local_line", "backward_from_zero"] = "local_line"
    window_s: float = 1.0
    imaginary: Literal["unknown", "real_part"] = "unknown"

    def half_width(self, step: float) -> int:
        """Return how many samples the window reaches to each side."""
        if self.method == "backward_from_zero":
            return 1
        return max(1, round(self.window_s / (2 * step)))


def differentiate(
    values: Floats, step: float, recipe: Differentiation, *, circular: bool = False
) -> tuple[Floats, float]:
    """Return the derivative of a column and its noise gain.

    Parameters
    ----------
    values : (n,) float
        On a grid of ``step`` seconds; NaN is unknown.
    circular : bool
        Whether the values are angles, rad, that wrap.

    Returns
    -------
    derivative : (n,) float
        Unknown wherever the window holds an unknown sample, a turn that the samples do not resolve
        (`RESOLVED`), or leaves the grid.
    gain : float, 1/s
        Standard deviation of the derivative for white noise of standard deviation one.

    Notes
    -----
    Savitzky, Golay, Analytical Chemistry 36 (1964), first derivative of a first-order polynomial:
    the weights of 2m+1 points are i / (step * sum i^2), the gain is 1 / (step * sqrt(sum i^2)).
    """
    if recipe.method == "backward_from_zero":
        before = np.concatenate([[0.0], values[:-1]])
        return (values - before) / step, float(np.sqrt(2.0) / step)
    known = np.isfinite(values)
    if circular:
        # Turned on step by step: over a whole window a fast rotation would pass half a turn.
        turned = np.nan_to_num(wrap(np.diff(values, prepend=values[:1])))
        known &= np.abs(turned) <= RESOLVED
        values = np.cumsum(turned)
    values = np.where(known, values, np.nan)
    half = recipe.half_width(step)
    total = half * (half + 1) * (2 * half + 1) / 3  # sum of i^2 from -half to half
    slope = np.zeros(len(values))
    for offset in range(1, half + 1):
        difference = np.full(len(values), np.nan)
        if 2 * offset < len(values):
            difference[offset:-offset] = values[2 * offset :] - values[: -2 * offset]
        slope += offset * difference
    slope[~known] = np.nan
    return slope / (step * total), float(1.0 / (step * np.sqrt(total)))
