"""The gain: poles where they are placed, and which outputs tell which states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.errors import UsageError
from fdi.methods.observer.gain import POLES, check_observable, rank, steady_kalman
from fdi.methods.observer.model import linear_model
from fdi.methods.observer.observer import design
from fdi.methods.observer.states import STATES
from fdi.methods.observer.vehicle import REFERENCE_QUADROTOR

HEADINGS = st.floats(-4.0, 4.0)
# rank of the observability matrix, recomputed for the corrected model
RANKS = {
    STATES: 12,
    ("x", "y", "z", "psi"): 12,
    ("x", "y", "z", "vx", "vy", "vz", "psi"): 12,
    ("x", "y", "z", "phi", "theta", "psi"): 12,
    ("x", "y", "z", "vx", "vy", "vz", "r"): 11,
    ("vx", "vy", "z", "phi", "theta", "psi"): 10,
    ("x", "y", "z"): 10,
    ("vx", "vy", "vz", "psi"): 9,
    ("phi", "theta", "psi", "p", "q", "r"): 6,
    ("p", "q", "r"): 3,
}
ENOUGH = [outputs for outputs, found in RANKS.items() if found == len(STATES)]


def a_at(heading):
    return linear_model(REFERENCE_QUADROTOR, heading)[0]


def error_of(outputs, gain, heading):
    return design(REFERENCE_QUADROTOR, outputs, gain).matrices_at(heading)[0]


@pytest.mark.parametrize(("outputs", "expected"), RANKS.items())
@pytest.mark.parametrize("heading", [0.0, 0.7, -2.3])
def test_rank_of_outputs(outputs, expected, heading):
    measured = np.array(sorted(STATES.index(name) for name in outputs))
    assert rank(a_at(heading), measured) == expected


@pytest.mark.parametrize(
    ("outputs", "lost"),
    [
        (("x", "y", "z", "vx", "vy", "vz", "r"), "do not tell psi (rank 11 of 12)"),
        (("vx", "vy", "z", "phi", "theta", "psi"), "do not tell x, y (rank 10 of 12)"),
        (("x", "y", "z"), "do not tell r, psi (rank 10 of 12)"),
        (("vx", "vy", "vz", "psi"), "do not tell x, y, z (rank 9 of 12)"),
    ],
)
def test_outputs_that_do_not_do_say_what_they_leave_unknown(outputs, lost):
    with pytest.raises(UsageError) as told:
        check_observable(a_at(0.3), outputs)
    assert lost in str(told.value)


@pytest.mark.parametrize("outputs", [("x", "altitude"), ("x", "x"), ()])
def test_outputs_are_states_named_once(outputs):
    with pytest.raises(UsageError):
        check_observable(a_at(0.0), outputs)


@settings(max_examples=10, deadline=None)
@given(HEADINGS)
def test_with_all_outputs_each_error_forgets_by_itself(heading):
    assert np.array_equal(error_of(STATES, "poles", heading), np.diag(POLES))


@pytest.mark.parametrize("outputs", [o for o in ENOUGH if o != STATES])
@settings(max_examples=5, deadline=None)
@given(heading=HEADINGS)
def test_poles_are_where_they_are_placed(outputs, heading):
    found = np.linalg.eigvals(error_of(outputs, "poles", heading))
    # 1e-6: four outputs are ill-conditioned
    assert np.allclose(np.sort(found.real), np.sort(POLES), atol=1e-6)
    assert np.abs(found.imag).max() < 1e-3


@pytest.mark.parametrize("outputs", ENOUGH)
@settings(max_examples=5, deadline=None)
@given(heading=HEADINGS)
def test_the_steady_filter_is_stable_and_solves_its_equation(outputs, heading):
    error = error_of(outputs, "kalman", heading)
    assert np.linalg.eigvals(error).real.max() < -0.1
    measured = np.array(sorted(STATES.index(name) for name in outputs))
    assert np.isfinite(steady_kalman(a_at(heading), measured)).all()
