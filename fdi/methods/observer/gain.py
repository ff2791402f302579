"""Which gain makes the observer forget its error, and can it, with these outputs?

In: A (12, 12) and which states are measured. Out: the gain H (12, m), or which states cannot be
known.

`placed` puts the poles of A - HC at twelve places between -4 and -5. What a measured state does to
the others is taken from its measurement (its column of A cancels), so that A - HC falls into small
parts, each with poles of its own: with all states measured it is exactly diagonal, and each
residual is the error of its own equation through one low pass. With few outputs parts are large and
placed poles ill-conditioned (gains in the hundreds with four outputs); `steady_kalman` is then the
better choice.

References
----------
Tits and Yang 1996 (`scipy.signal.place_poles`); Kalman and Bucy 1961.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fdi.errors import UsageError
from fdi.methods.observer.states import STATES
from fdi.telemetry.message import Floats

POLES: Final = np.linspace(-4.05, -4.95, len(STATES))
"""1/s, by state; distinct, as a pole cannot be placed more often than there are outputs."""
TOLERANCE: Final = 1e-9
"""Of a rank, relative to the largest entry."""
_BLOCKS: Final = 6
"""C, CA, ... CA^5: without damping A to the fourth is zero."""
_DEVIATION: Final = np.repeat([0.02, 0.02, 0.01, 0.002], 3)
"""Of measurements, as stated for the reference simulation: m, m/s, rad/s, rad."""


def rank(a: Floats, measured: NDArray[np.intp]) -> int:
    """Return the rank of the observability matrix, its blocks scaled to entries of 1."""
    return int(np.linalg.matrix_rank(_observability(a, measured), tol=TOLERANCE))


def unknown_states(a: Floats, measured: NDArray[np.intp]) -> tuple[str, ...]:
    """Return the states that outputs do not determine."""
    _, sizes, rows = np.linalg.svd(_observability(a, measured))
    # a state is known where its unit vector lies in the row space
    share = np.sum(rows[: int((sizes > TOLERANCE).sum())] ** 2, axis=0)
    return tuple(name for name, own in zip(STATES, share, strict=True) if own < 1 - 1e-6)


def _observability(a: Floats, measured: NDArray[np.intp]) -> Floats:
    blocks = [np.eye(len(STATES))[measured]]
    for _ in range(_BLOCKS - 1):
        block = blocks[-1] @ a
        blocks.append(block / max(float(np.abs(block).max()), np.finfo(float).tiny))
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
        return np.asarray(a - np.diag(POLES))  # what follows says so, too, a hundred times slower
    from scipy.signal import place_poles
    from scipy.sparse.csgraph import connected_components

    gain = a[:, measured].copy()
    left = a.copy()
    left[:, measured] = 0.0
    _, part_of = connected_components(left != 0, directed=False)
    for part in range(part_of.max() + 1):
        own = np.flatnonzero(part_of == part)
        columns = np.flatnonzero(part_of[measured] == part)
        seen = measured[columns]
        if seen.size == own.size:
            gain[seen, columns] -= POLES[seen]
            continue
        inner, c = left[np.ix_(own, own)], np.eye(len(STATES))[np.ix_(seen, own)]
        with warnings.catch_warnings():  # that it did not converge to the best conditioned one
            warnings.simplefilter("ignore", UserWarning)
            found = place_poles(inner.T, c.T, POLES[own], rtol=1e-6, maxiter=100)
        gain[np.ix_(own, columns)] += found.gain_matrix.T
    return np.asarray(gain)


def steady_kalman(a: Floats, measured: NDArray[np.intp]) -> Floats:
    """Return the steady gain, (12, m), of a Kalman filter.

    Process noise is such that a state whose measurement is all that is known of it is forgotten as
    fast as with placed poles.
    """
    from scipy.linalg import solve_continuous_are

    c = np.eye(len(STATES))[measured]
    noise, process = np.diag(_DEVIATION[measured] ** 2), np.diag((POLES * _DEVIATION) ** 2)
    spread = solve_continuous_are(a.T, c.T, process, noise)
    return np.asarray(spread @ c.T @ np.linalg.inv(noise))


GAINS: Final[Mapping[str, Callable[[Floats, NDArray[np.intp]], Floats]]] = {
    "poles": placed,
    "kalman": steady_kalman,
}
