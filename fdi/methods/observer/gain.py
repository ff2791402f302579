"""Which gain makes the observer forget its error, and can it, with these outputs?

In: A (12, 12) and which states are measured. Out: the gain H (12, m), or which states cannot be
known. `placed` puts the poles of A - HC at twelve places between -4 and -5; with all states
measured A - HC is then exactly diagonal, and each residual is the error of its own equation through
one low pass. With fewer outputs placed poles are exact but ill-conditioned (the gain grows to
hundreds with four), and `steady_kalman` is the better choice.

References
----------
Tits and Yang 1996 (`scipy.signal.place_poles`); Kalman and Bucy 1961.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.methods.observer.states import STATES
from fdi.telemetry.message import Floats

POLES: Final = tuple(np.linspace(-4.05, -4.95, len(STATES)).tolist())
"""1/s; distinct, as multiple poles cannot be placed with few outputs."""
TOLERANCE: Final = 1e-9
"""Of a rank, relative to the largest entry."""
_PROCESS: Final = np.array([*3 * (0.01,), *3 * (1.0,), *3 * (10.0,), *3 * (0.01,)])
_MEASURED: Final = np.array([*3 * (0.02,), *3 * (0.02,), *3 * (0.01,), *3 * (0.002,)])


def rank(a: Floats, measured: NDArray[np.intp]) -> int:
    """Return the rank of the observability matrix of 12, its blocks scaled to entries of 1."""
    return int(np.linalg.matrix_rank(_observability(a, measured), tol=TOLERANCE))


def unknown_states(a: Floats, measured: NDArray[np.intp]) -> tuple[str, ...]:
    """Return the states that outputs do not determine."""
    blocks = _observability(a, measured)
    _, sizes, rows = np.linalg.svd(blocks)
    seen = rows[: int((sizes > TOLERANCE).sum())]
    # a state is known where its unit vector lies in the row space
    share = np.sum(seen**2, axis=0)
    return tuple(name for name, own in zip(STATES, share, strict=True) if own < 1 - 1e-6)


def _observability(a: Floats, measured: NDArray[np.intp]) -> Floats:
    block = np.eye(len(STATES))[measured]
    blocks = [block]
    for _ in range(5):  # A to the sixth is nothing but damping
        block = block @ a
        block = block / max(float(np.abs(block).max()), np.finfo(float).tiny)
        blocks.append(block)
    return np.concatenate(blocks)


def check_observable(a: Floats, outputs: Sequence[str]) -> NDArray[np.intp]:
    """Return the places of outputs among the states, once they are known to determine all.

    Raises
    ------
    UsageError
        An output is no state, is named twice, or they leave states unknown.
    """
    odd = [name for name in outputs if name not in STATES]
    if odd or len(set(outputs)) < len(outputs) or not outputs:
        what = f"there is no output {odd[0]!r}" if odd else "outputs are named once each"
        raise UsageError(what, hint=f"there are {', '.join(STATES)}")
    measured = np.array(sorted(STATES.index(name) for name in outputs), np.intp)
    found = rank(a, measured)
    if found < len(STATES):
        names = ", ".join(STATES[i] for i in measured)
        lost = ", ".join(unknown_states(a, measured))
        raise UsageError(
            f"the outputs {names} do not tell {lost} (rank {found} of {len(STATES)})",
            hint="x, y, z and psi are needed, and are enough",
        )
    return measured


def placed(a: Floats, measured: NDArray[np.intp]) -> Floats:
    """Return the gain, (12, m), that puts the poles at `POLES`."""
    if measured.size == len(STATES):
        return np.asarray(a - np.diag(POLES))
    import warnings

    from scipy.signal import place_poles

    c = np.eye(len(STATES))[measured]
    with warnings.catch_warnings():  # that it did not converge to the best conditioned one
        warnings.simplefilter("ignore", UserWarning)
        found = place_poles(a.T, c.T, POLES, rtol=1e-6, maxiter=100)
    return np.asarray(found.gain_matrix.T)


def steady_kalman(a: Floats, measured: NDArray[np.intp]) -> Floats:
    """Return the steady gain, (12, m), of a Kalman filter.

    Process noise: what tilt, thrust and torque are not modelled to, chosen as 1 m/s2 and 10 rad/s2
    per root hertz; measurement noise: the deviations of the usual estimators.
    """
    from scipy.linalg import solve_continuous_are

    c = np.eye(len(STATES))[measured]
    noise = np.diag(_MEASURED[measured] ** 2)
    spread = solve_continuous_are(a.T, c.T, np.diag(_PROCESS**2), noise)
    return np.asarray(spread @ c.T @ np.linalg.inv(noise))


GAINS: Final[Mapping[str, Callable[[Floats, NDArray[np.intp]], Floats]]] = {
    "poles": placed,
    "kalman": steady_kalman,
}
