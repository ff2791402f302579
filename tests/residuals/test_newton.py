"""Loops solved at all samples at once, and equations with several roots."""

import importlib.util
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi.model.evaluate import evaluate
from fdi.model.expression import parse
from fdi.model.parts import Kind, Variable
from fdi.model.system import SystemEquation
from fdi.residuals.newton import choose, solve_loop, solve_moved
from fdi.residuals.solve import solve

ROOT = Path(__file__).parents[2]
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
    assert found.columns[:, away] == pytest.approx(velocity[:, away], abs=1e-5)


def test_an_unknown_input_makes_the_loop_unknown_at_that_sample_only():
    speed, course, _ = flight()
    speed[50] = np.nan
    x, y = solve_loop(SPEED, [X, Y], {"v": speed, "c": course}, flight()[2]).columns
    assert np.flatnonzero(np.isnan(x)).tolist() == np.flatnonzero(np.isnan(y)).tolist() == [50]


def test_what_has_no_solution_is_unknown():
    found = solve_loop([parse("x**2 + 1 + 0*v")], [X], {"v": np.ones(5)})
    assert np.isnan(found.columns).all()
    assert not found.ambiguous.any()


def test_a_root_outside_the_domain_is_dropped():
    found = solve_loop(
        [parse("x**2 - v")], [Variable("x", "1", low=0.0)], {"v": np.array([4.0, 9.0])}
    )
    assert found.columns[0] == pytest.approx([2.0, 3.0])


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.5, 3), st.floats(-3, 3))
@settings(deadline=None)
def test_linear_loops_are_solved_exactly(p, q, a, b):
    equations = [parse("a*x + b*y - p"), parse("x*b - a*y - q")]
    columns = {n: np.array([v]) for n, v in {"a": a, "b": b, "p": p, "q": q}.items()}
    found = solve_loop(equations, [X, Y], columns)
    expected = np.linalg.solve([[a, b], [b, -a]], [p, q])
    assert found.columns[:, 0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("total", "inside"), [(2.1, False), (1.9, True), (0.1, True), (-0.1, False)]
)
def test_the_one_solution_of_a_linear_loop_is_dropped_outside_its_domain(total, inside):
    """x + y is twice what x is, which may be 0 to 1."""
    x = Variable("x", "1", low=0.0, high=1.0)
    equations = [parse("x + y - s"), parse("x - y")]
    found = solve_loop(equations, [x, Y], {"s": np.array([total])})
    assert np.isfinite(found.columns).tolist() == [[inside]] * 2
    assert not found.ambiguous.any()


def test_choose_takes_the_root_nearest_to_what_is_shown_and_is_unknown_where_there_is_none():
    roots = np.array([[1.0, 1.0, np.nan, 1.0], [-1.0, -1.0, np.nan, np.nan]])[:, None, :]
    near = np.array([[0.4, -0.4, 5.0, -9.0]])
    found = choose(roots, near, (False,))
    assert found.columns[0] == pytest.approx([1.0, -1.0, np.nan, 1.0], nan_ok=True)
    assert not found.ambiguous.any()


def test_choose_does_not_guess_between_roots_that_nothing_tells_apart():
    roots = np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, np.nan]])[:, None, :]
    found = choose(roots, np.array([[np.nan, 0.0, np.nan]]), (False,))
    assert found.columns[0] == pytest.approx([np.nan, np.nan, 1.0], nan_ok=True)
    assert found.ambiguous.tolist() == [True, True, False]


def test_choose_measures_angles_around_the_circle():
    roots = np.array([[3.1], [0.5]])[:, None, :]
    assert choose(roots, np.array([[-3.1]]), (True,)).columns[0] == pytest.approx([3.1])


def test_a_column_of_the_pressure_of_air_does_not_hinder_a_loop():
    rng = np.random.default_rng(1)
    outside = 101_325 + rng.normal(0, 300, 300)
    flow = rng.uniform(0.5, 3, 300)
    inside = outside - (flow / 0.02) ** 2
    rise = inside - 1e3 * flow
    equations = [parse("q - 0.02*sqrt(p_0 - p)"), parse("p - 1000*q - d")]
    unknowns = [Variable("q", "kg/s", 0.0), Variable("p", "Pa", 0.0)]
    found = solve_loop(equations, unknowns, {"p_0": outside, "d": rise})
    assert found.columns == pytest.approx(np.array([flow, inside]), rel=1e-8)


def test_linear_equations_of_very_different_size_are_solved_exactly():
    rng = np.random.default_rng(2)
    size = 10.0 ** np.linspace(-4, 4, 6)
    matrix = rng.uniform(-1, 1, (6, 6)) + 2 * np.eye(6)
    roots = rng.uniform(-5, 5, (6, 100))
    unknowns = [Variable(f"x{i}", "1") for i in range(6)]
    equations = [
        parse(
            " + ".join(f"({float(size[i] * matrix[i, j])!r})*x{j}" for j in range(6)) + f" - b{i}"
        )
        for i in range(6)
    ]
    given = size[:, None] * (matrix @ roots)
    found = solve_loop(equations, unknowns, {f"b{i}": given[i] for i in range(6)})
    assert found.columns == pytest.approx(roots, rel=1e-10, abs=1e-10)


def test_a_linear_loop_without_one_solution_is_told():
    equations = [parse("x + y - v"), parse("2*x + 2*y - 2*v")]
    found = solve_loop(equations, [X, Y], {"v": np.array([1.0, np.nan])})
    assert np.isnan(found.columns).all()
    assert found.ambiguous.tolist() == [True, False]


def test_a_negative_first_of_four_unknowns_is_found():
    rng = np.random.default_rng(3)
    roots = rng.uniform(0.2, 3, (4, 50))
    roots[0] *= -1
    texts = ["a + b*c", "b + 0.2*b**3 + d", "c + 0.3*a", "d + 0.1*sin(a)"]
    here = dict(zip("abcd", roots, strict=True))
    columns = {f"y{i}": evaluate(parse(text), here) for i, text in enumerate(texts)}
    equations = [parse(f"{text} - y{i}") for i, text in enumerate(texts)]
    found = solve_loop(equations, [Variable(n, "1", -5.0, 5.0) for n in "abcd"], columns)
    known = ~found.ambiguous
    assert known.mean() > 0.9
    assert found.columns[:, known] == pytest.approx(roots[:, known], rel=1e-8)


def test_of_two_valid_roots_none_is_guessed_and_a_channel_decides():
    total, product = np.array([5.0, 2.0, 2.0]), np.array([6.0, -3.0, 1.0])
    equations = [parse("x + y - s"), parse("x*y - p")]
    columns = {"s": total, "p": product}
    found = solve_loop(equations, [X, Y], columns)
    assert np.isnan(found.columns).all()
    assert found.ambiguous.all()  # the third has one root twice, which cannot be proven
    near = np.array([[2.4, 2.0, np.nan], [np.nan, np.nan, np.nan]])
    found = solve_loop(equations, [X, Y], columns, near)
    assert found.columns[:, :2] == pytest.approx(np.array([[2.0, 3.0], [3.0, -1.0]]))
    assert found.ambiguous.tolist() == [False, False, True]


def test_a_root_is_followed_where_its_inputs_move():
    v = np.array([4.0, 9.0])
    moved = solve_moved([parse("x**2 - v")], [X], {"v": v + 0.1}, np.array([[2.0, -3.0]]))
    assert moved[0] == pytest.approx([np.sqrt(4.1), -np.sqrt(9.1)], rel=1e-12)


def test_random_loops_are_right_or_told_and_never_wrong():
    """Of 20 structures with 10 samples each, see benchmarks/loops.py for all 10,000."""
    spec = importlib.util.spec_from_file_location("loops", ROOT / "benchmarks" / "loops.py")
    benchmark = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    rng = np.random.default_rng(26)
    total = sum(
        (benchmark.judged(*benchmark.random_loop(rng, most=3)) for _ in range(20)), Counter()
    )
    assert total["wrong"] == 0
    assert total["unknown"] == 0
    assert total["right"] > 0.3 * total.total()


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
        found = [solve_loop([parse(f"{text} - q")], [variable], known).columns[0]]
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
