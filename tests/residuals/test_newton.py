"""Loops solved at all samples at once, and equations with several roots."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.model.evaluate import evaluate
from fdi.model.expression import parse
from fdi.model.parts import Kind, Variable
from fdi.model.system import SystemEquation
from fdi.residuals.newton import choose, follow, solve_loop
from fdi.residuals.solve import solve

SPEED = [parse("sqrt(x**2 + y**2) - v"), parse("tan(c) - y/x")]
X, Y = Variable("x", "m/s"), Variable("y", "m/s")


def flight(n=200):
    course = np.linspace(0.3, 12.0, n)
    speed = np.linspace(5.0, 20.0, n)
    return speed, course, np.array([speed * np.cos(course), speed * np.sin(course)])


def test_loop_of_speed_and_course_gives_the_velocity_that_a_channel_shows():
    speed, course, velocity = flight()
    near = np.array([velocity[0] + 1.0, np.full(speed.size, np.nan)])
    found = solve_loop(SPEED, [X, Y], {"v": speed, "c": course}, near)
    away = np.abs(velocity[0]) > 1.5  # beside it the channel cannot tell the two apart
    assert np.array(found)[:, away] == pytest.approx(velocity[:, away], abs=1e-5)


def test_an_unknown_input_makes_the_loop_unknown_at_that_sample_only():
    speed, course, _ = flight()
    speed[50] = np.nan
    x, y = solve_loop(SPEED, [X, Y], {"v": speed, "c": course})
    assert np.flatnonzero(np.isnan(x)).tolist() == np.flatnonzero(np.isnan(y)).tolist() == [50]


def test_what_has_no_solution_is_unknown():
    found = solve_loop([parse("x**2 + 1 + 0*v")], [X], {"v": np.ones(5)})
    assert np.isnan(found[0]).all()


def test_a_root_outside_the_domain_is_dropped():
    found = solve_loop(
        [parse("x**2 - v")], [Variable("x", "1", low=0.0)], {"v": np.array([4.0, 9.0])}
    )
    assert found[0] == pytest.approx([2.0, 3.0])


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.5, 3), st.floats(-3, 3))
def test_linear_loops_are_solved_exactly(p, q, a, b):
    equations = [parse("a*x + b*y - p"), parse("x*b - a*y - q")]
    columns = {n: np.array([v]) for n, v in {"a": a, "b": b, "p": p, "q": q}.items()}
    found = solve_loop(equations, [X, Y], columns)
    expected = np.linalg.solve([[a, b], [b, -a]], [p, q])
    assert np.array(found)[:, 0] == pytest.approx(expected, abs=1e-6)


def test_follow_stays_on_the_root_that_is_continuous():
    t = np.linspace(0, 6, 300)
    one, two = np.sin(t), 3 + np.cos(t)
    swapped = (
        np.where(np.arange(300) % 2 == 0, one, two),
        np.where(np.arange(300) % 2 == 0, two, one),
    )
    found = follow(np.array(swapped)[:, None, :])[0]
    assert np.allclose(found, one) or np.allclose(found, two)


def test_follow_survives_a_gap():
    roots = np.array([np.full(20, 1.0), np.full(20, -1.0)])[:, None, :]
    roots[:, :, 5:9] = np.nan
    found = follow(roots)[0]
    assert np.isnan(found[5:9]).all()
    assert set(found[np.isfinite(found)]) in ({1.0}, {-1.0})


def test_choose_takes_the_root_nearest_to_what_is_shown_and_is_unknown_where_there_is_none():
    roots = np.array([[1.0, 1.0, np.nan, 1.0], [-1.0, -1.0, np.nan, np.nan]])[:, None, :]
    near = np.array([[0.4, -0.4, 5.0, -9.0]])
    assert choose(roots, near)[0] == pytest.approx([1.0, -1.0, np.nan, 1.0], nan_ok=True)


TEXTS = [
    "a*v**2 + b*v",
    "v/(1 + v**2)*a",
    "sqrt(v) + a*v",
    "a*sin(v) + b*cos(v)",
    "v**3 + a*v",
    "v*exp(v)",
    "a*v + b*abs(v)",
    "0.5*a*v**2 + b",
]


@pytest.mark.parametrize("text", TEXTS)
def test_one_of_the_roots_found_by_formula_or_iteration_is_the_value_that_was_put_in(text):
    rng = np.random.default_rng(3)
    names = {
        "a": rng.uniform(2, 3, 40),
        "b": rng.uniform(0.5, 1.5, 40),
        "v": rng.uniform(0.2, 0.8, 40),
    }
    right = parse(text)
    given_value = evaluate(right, names)
    variable = Variable("v", "1", 0.0, 1.0)
    equation = SystemEquation("m", Kind.RELATION, parse("q"), right, {})
    known = {"a": names["a"], "b": names["b"], "q": given_value}
    roots = solve(equation, "v", variable)
    if roots is None:
        found = [solve_loop([parse(f"{text} - q")], [variable], known)[0]]
    else:
        found = [np.broadcast_to(evaluate(root, known), 40) for root in roots]
    gap = np.nanmin([np.abs(root - names["v"]) for root in found], axis=0)
    assert gap.max() < 1e-6


@given(
    st.sampled_from(["v*tan(v)", "min(v, 2*v)", "sign(v)*v**2", "v**1.5 + v", "atan2(v, v + 1)"])
)
@settings(max_examples=5)
def test_what_computer_algebra_gets_wrong_is_left_to_iteration(text):
    equation = SystemEquation("m", Kind.RELATION, parse("q"), parse(text), {})
    assert solve(equation, "v", Variable("v", "1")) is None
