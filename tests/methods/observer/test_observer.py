"""The step: exact, forgetful, honest about what it does not know; the published vectors."""

import json
from itertools import pairwise

import numpy as np
import pytest
from flights import SHARED
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim

from fdi.methods.observer.gain import POLES, placed
from fdi.methods.observer.hold import hold
from fdi.methods.observer.model import derivatives, linear_model
from fdi.methods.observer.observer import Record, begin, design, residuals_at, step
from fdi.methods.observer.states import PSI, STATES
from fdi.methods.observer.vehicle import GRAVITY, REFERENCE_QUADROTOR, mixing
from fdi.telemetry.motors import motors_of

VEHICLE = REFERENCE_QUADROTOR
VECTORS = SHARED.parent / "methods" / "observer_vectors.json"
QUAD_X = motors_of({"FRAME_CLASS": 1.0, "FRAME_TYPE": 1.0}, "ardupilot", "quad")


def run(observer, t, y, u):
    """Return residuals from the second record on, (13, n - 1), blank ones included, and states."""
    state, found, states = begin(observer), [], []
    for k, when in enumerate(t):
        state, _ = step(state, Record(when, y[:, k], u[:, k]))
        states.append(state.x)
        found.append(residuals_at(state).value)
    return np.array(found).T[:, 1:], np.array(states).T


@pytest.fixture(scope="module")
def vectors():
    if not VECTORS.is_file():
        pytest.skip("no ../shared")
    return json.loads(VECTORS.read_text())


def test_matrices_are_the_published_ones(vectors):
    a, b = linear_model(VEHICLE, vectors["psi"])
    assert np.allclose(a, vectors["A_ned"], rtol=0, atol=1e-12)
    assert np.allclose(b, vectors["B_ned"], rtol=0, atol=1e-12)
    assert np.allclose(POLES, vectors["poles"], rtol=0, atol=1e-12)
    gain = placed(a, np.arange(len(STATES)))
    assert np.allclose(gain, vectors["H_ned_psi_0_7"], rtol=0, atol=1e-12)


def test_in_a_world_with_z_up_they_are_the_published_ones(vectors):
    """The map of section 1: signs of states and inputs, and of the heading."""
    signs = np.diag([1, -1, -1, 1, -1, -1, 1, -1, -1, 1, -1, -1])
    a, b = linear_model(VEHICLE, -vectors["psi"])
    assert np.allclose(signs @ a @ signs, vectors["A_zup"], rtol=0, atol=1e-12)
    assert np.allclose(signs @ b @ np.diag([1, 1, -1, -1]), vectors["B_zup"], rtol=0, atol=1e-12)


def test_steps_are_the_published_ones(vectors):
    for length, expected in vectors["discretisation_by_step_s"].items():
        found = [np.diag(one) for one in hold(np.diag(POLES), float(length))]
        names = ("phi_diag", "gamma0_factor", "gamma1_factor")
        for own, name in zip(found, names, strict=True):
            assert np.allclose(own, expected[name], rtol=1e-12)


def test_mixing_is_the_published_one(vectors):
    quad = vectors["quad"]
    rows = mixing(VEHICLE, QUAD_X)
    assert np.allclose(rows, quad["mix_rows_uf_up_uq_ur"], rtol=0, atol=1e-12)
    for one in vectors["mixing"]:
        assert np.allclose(rows @ one["thrust_N"], one["u"], rtol=0, atol=1e-9)


def test_the_sequence_is_the_published_one(vectors):
    own, rows = vectors["sequence"], mixing(VEHICLE, QUAD_X)
    share = (np.array(own["pwm"]).T - 1000) / 1000
    thrust = vectors["quad"]["thrust_max_N"] * (0.35 * share + 0.65 * share**2)
    u = rows @ thrust
    u[0] -= VEHICLE.mass * GRAVITY
    found, _ = run(design(VEHICLE), own["time_s"], np.array(own["y"]).T, u)
    expected = np.array(own["expected_residual"]).T[:, 1:]
    assert np.abs(found - expected).max() < own["tolerance"]


@pytest.mark.parametrize("heading", [0.0, 0.7, 1.571, -2.3])
def test_linear_equations_are_the_derivative_of_the_nonlinear_ones(heading):
    a, b = linear_model(VEHICLE, heading)
    x, u, h = np.zeros(12), np.zeros(4), 1e-6
    x[PSI] = heading
    for i, e in enumerate(np.eye(12)):
        slope = (derivatives(VEHICLE, x + h * e, u) - derivatives(VEHICLE, x - h * e, u)) / (2 * h)
        assert np.allclose(slope, a[:, i], atol=1e-8)
    for i, e in enumerate(np.eye(4)):
        slope = (derivatives(VEHICLE, x, u + h * e) - derivatives(VEHICLE, x, u - h * e)) / (2 * h)
        assert np.allclose(slope, b[:, i], atol=1e-7)


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 999), st.sampled_from([STATES, ("x", "y", "z", "phi", "theta", "psi")]))
def test_even_steps_equal_a_simulation_of_the_whole_log(seed, outputs):
    rng = np.random.default_rng(seed)
    t = np.arange(200) * 0.02
    y, u = rng.normal(size=(12, t.size)), rng.normal(size=(4, t.size))
    y[PSI] = 0.7
    observer = design(VEHICLE, outputs)
    error, b, gain = observer.matrices_at(0.7)
    whole = np.concatenate([b, gain], axis=1)
    inputs = np.concatenate([u, y[observer.measured]])
    _, _, expected = lsim((error, whole, np.eye(12), 0 * whole), inputs.T, t, X0=y[:, 0])
    _, states = run(observer, t, y, u)
    assert np.allclose(states.T, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(("seed", "gain"), [(0, "poles"), (1, "poles"), (2, "kalman")])
def test_it_converges_on_the_system_that_it_is_of(seed, gain):
    """Uneven steps, a system simulated exactly, an estimate that begins wrong in what is unseen."""
    rng = np.random.default_rng(seed)
    a, _ = linear_model(VEHICLE, 0.4)
    observer = design(VEHICLE, ("x", "y", "z", "phi", "theta", "psi"), gain)
    x = rng.normal(0, 0.1, 12)
    x[PSI] = 0.4
    x[[6, 7, 8]] = 0.0
    t = np.cumsum(rng.uniform(0.005, 0.025, 400))
    u = np.zeros((4, t.size))
    seen = [x]
    for before, after in pairwise(t):
        seen.append(hold(a, after - before)[0] @ seen[-1])
    y = np.array(seen).T
    # the heading of this system does not change, so A is the same at every step
    told = y.copy()
    told[3:9] = np.nan
    found, states = run(observer, t, told, u)
    assert np.abs(states[:, 0] - y[:, 0]).max() > 0.02
    # a system seen as straight lines between records is not quite the system
    assert np.abs(states[:, -1] - y[:, -1]).max() < 1e-3
    assert np.nanmax(np.abs(found[:12, -1])) < 1e-3


def test_yaw_may_pass_through_south():
    t = np.arange(200) * 0.05
    y, u = np.zeros((12, t.size)), np.zeros((4, t.size))
    y[8] = 0.5
    y[PSI] = (2.5 + 0.5 * t + np.pi) % (2 * np.pi) - np.pi
    found, _ = run(design(VEHICLE), t, y, u)
    assert np.abs(found[PSI]).max() < 1e-9


def test_a_gap_begins_anew_and_blanks():
    observer = design(VEHICLE)
    t = np.concatenate([np.arange(0, 5, 0.1), np.arange(9, 14, 0.1)])
    state, known = begin(observer), []
    for when in t:
        state, found = step(state, Record(when, np.zeros(12), np.zeros(4)))
        known.append(bool(np.isfinite(found.value).all()))
    known = np.array(known)
    for start in (0.0, 9.0):
        blank = (t >= start) & (t < start + observer.blank_s - 1e-9)
        assert not known[blank].any()
    assert known[(t > 2) & (t < 5)].all()
    assert known[t > 11].all()


@pytest.mark.parametrize("place", [0, 7, PSI])
def test_an_unknown_output_leaves_its_record_out(place):
    observer = design(VEHICLE)
    state, _ = step(begin(observer), Record(0.0, np.zeros(12), np.zeros(4)))
    y = np.zeros(12)
    y[place] = np.nan
    after, found = step(state, Record(0.1, y, np.zeros(4)))
    assert after is state
    assert np.isnan(found.value).all()


def test_a_record_that_is_not_later_is_left_out():
    state, _ = step(begin(design(VEHICLE)), Record(1.0, np.zeros(12), np.zeros(4)))
    assert step(state, Record(1.0, np.ones(12), np.zeros(4)))[0] is state
    assert step(state, Record(0.5, np.ones(12), np.zeros(4)))[0] is state


def test_a_missing_thrust_leaves_the_residuals_that_physics_says():
    """Motor 1 commanded 4.27 N gives 2.99 N: section 8 of the reference predicts 6.12 and 0.236."""
    u = -mixing(VEHICLE, QUAD_X)[:, 0] * -1.28
    t = np.arange(0, 6, 0.02)
    found, _ = run(design(VEHICLE), t, np.zeros((12, t.size)), np.tile(u[:, None], t.size))
    at = dict(zip(STATES, found[:12, -1], strict=True))
    assert at["p"] == pytest.approx(6.12, abs=0.02)
    assert at["vz"] == pytest.approx(0.236, abs=0.002)
    assert at["q"] < -5.9
    assert at["r"] < -0.7
