"""How far does a linear system come in one step, inputs linear in between? Exactly.

In: F (n, n) and a step h. Out: Phi, Gamma0, Gamma1 (n, n) such that dx/dt = F x + g(t) with g
linear from g0 to g1 comes to x1 = Phi x0 + Gamma0 g0 + Gamma1 (g1 - g0) / h: a first-order hold,
for steps of any length. For a diagonal F these are e^(lh), (e^(lh) - 1)/l and (e^(lh) - 1 - lh)/l2;
for any other the blocks of one exponential of a matrix.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fdi.telemetry.message import Floats

_SMALL: Final = 1e-2
"""|lh| below which the closed forms lose digits; six terms of the series are then exact."""
_TERMS: Final = 8


def hold(f: Floats, step: float) -> tuple[Floats, Floats, Floats]:
    """Return Phi, Gamma0 and Gamma1 of a step, each (n, n).

    Parameters
    ----------
    f : (n, n) float
        1/s.
    step : float
        s, above 0.
    """
    poles = np.diag(f)
    if np.count_nonzero(f - np.diag(poles)) == 0:
        return tuple(np.diag(one) for one in _diagonal(poles, step))  # type: ignore[return-value]
    from scipy.linalg import expm

    size = len(f)
    whole = np.zeros((3 * size, 3 * size))
    whole[:size, :size] = f
    whole[:size, size : 2 * size] = whole[size : 2 * size, 2 * size :] = np.eye(size)
    blocks = expm(whole * step)[:size]
    return blocks[:, :size], blocks[:, size : 2 * size], blocks[:, 2 * size :]


def _diagonal(poles: Floats, step: float) -> tuple[Floats, Floats, Floats]:
    z = poles * step
    small = np.abs(z) < _SMALL
    safe = np.where(small, 1.0, z)
    first, second = np.ones_like(z), np.full_like(z, 0.5)
    term_1, term_2 = np.ones_like(z), np.full_like(z, 0.5)
    for k in range(2, _TERMS):
        term_1, term_2 = term_1 * z / k, term_2 * z / (k + 1)
        first, second = first + term_1, second + term_2
    gamma_0 = step * np.where(small, first, np.expm1(safe) / safe)
    gamma_1 = step**2 * np.where(small, second, (np.expm1(safe) - safe) / safe**2)
    return np.exp(z), gamma_0, gamma_1
