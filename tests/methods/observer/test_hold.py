"""An exact step for inputs that run linearly, whatever its length."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from fdi.methods.observer.gain import POLES
from fdi.methods.observer.hold import hold
from fdi.methods.observer.observer import design
from fdi.methods.observer.vehicle import REFERENCE_QUADROTOR

STEPS = st.floats(1e-5, 1.0)


def blocks(f, step):
    """The three blocks out of one exponential, for any F."""
    n = len(f)
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n], whole[:n, n : 2 * n], whole[n : 2 * n, 2 * n :] = f, np.eye(n), np.eye(n)
    found = expm(whole * step)[:n]
    return found[:, :n], found[:, n : 2 * n], found[:, 2 * n :]


@settings(max_examples=15, deadline=None)
@given(STEPS)
def test_closed_forms_of_a_diagonal_are_those_of_the_exponential(step):
    for found, expected in zip(
        hold(np.diag(POLES), step), blocks(np.diag(POLES), step), strict=True
    ):
        assert np.allclose(found, expected, rtol=1e-12, atol=1e-16)


@settings(max_examples=15, deadline=None)
@given(st.floats(1e-9, 1e-2))
def test_short_steps_lose_no_digits(step):
    """(e^z - 1 - z)/z2 of a small z by its formula would."""
    phi, gamma_0, gamma_1 = hold(np.diag(POLES), step)
    z = POLES * step
    assert np.allclose(np.diag(phi), np.exp(z), rtol=1e-15)
    assert np.allclose(np.diag(gamma_0) / step, 1 + z / 2 + z**2 / 6 + z**3 / 24, rtol=1e-7)
    assert np.allclose(np.diag(gamma_1) / step**2, 0.5 + z / 6 + z**2 / 24, rtol=1e-5)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.floats(0.003, 0.15), min_size=5, max_size=15), st.integers(0, 99))
def test_uneven_steps_equal_a_solver_of_differential_equations(steps, seed):
    rng = np.random.default_rng(seed)
    f = design(REFERENCE_QUADROTOR, ("x", "y", "z", "phi", "theta", "psi")).matrices_at(0.7)[0]
    t = np.concatenate([[0.0], np.cumsum(steps)])
    g = rng.normal(size=(12, t.size))
    x = x_0 = rng.normal(size=12)
    for k, step in enumerate(steps):
        phi, gamma_0, gamma_1 = hold(f, step)
        x = phi @ x + gamma_0 @ g[:, k] + gamma_1 @ (g[:, k + 1] - g[:, k]) / step
    expected = x_0
    for k in range(len(steps)):  # piece by piece: the solver knows no corners
        slope = (g[:, k + 1] - g[:, k]) / steps[k]
        expected = solve_ivp(
            lambda s, y, k=k, slope=slope: f @ y + g[:, k] + slope * s,
            (0.0, steps[k]),
            expected,
            rtol=1e-12,
            atol=1e-13,
            method="DOP853",
        ).y[:, -1]
    assert np.allclose(x, expected, rtol=0, atol=1e-9 * max(1.0, np.abs(expected).max()))
